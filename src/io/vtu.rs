//! Fields for `ParaView`: an unstructured grid of triangles in VTK's XML format.

use std::fmt::Write as _;
use std::path::Path;

use super::{FileError, atomic};
use crate::elasticity::observe::Face;
use crate::elasticity::{Model, Touch};
use crate::mesh::TriMesh;

/// One named field, by rows.
pub struct NamedField {
    pub name: String,
    /// Numbers a row.
    pub width: usize,
    pub values: Vec<f64>,
}

/// The most touches whose fields are written.
pub const TOUCHES: usize = 32;

/// What a model says of touches at its vertices: displacement, and strain on the inside face as the two
/// principal values.
#[must_use]
pub fn fields(model: &dyn Model, touches: &[Touch]) -> Vec<NamedField> {
    let vertices = model.mesh().vertex_points();
    let observer = model.observer(&vertices, Face::Inside);
    let mut fields = vec![NamedField {
        name: "held".into(),
        width: 1,
        values: model
            .held()
            .into_iter()
            .map(|h| f64::from(u8::from(h)))
            .collect(),
    }];
    let loads: Vec<_> = touches.iter().map(|t| model.load(t)).collect();
    let solutions = model.system().solve_loads(&loads);
    let strains = observer.strains_of(model, &solutions);
    let moved = model.moved(touches);
    for (k, (moved, strain)) in moved.into_iter().zip(strains).enumerate() {
        fields.push(NamedField {
            name: format!("displacement_mm_touch_{k}"),
            width: 3,
            values: (moved.into_iter())
                .flat_map(|u| (u * 1000.0).to_array())
                .collect(),
        });
        fields.push(NamedField {
            name: format!("inside_principal_strain_touch_{k}"),
            width: 2,
            values: strain
                .into_iter()
                .flat_map(|[xx, yy, xy]| {
                    let (mean, radius) = (f64::midpoint(xx, yy), ((xx - yy) / 2.0).hypot(xy / 2.0));
                    [mean + radius, mean - radius]
                })
                .collect(),
        });
    }
    fields
}

/// Writes a mesh (in mm) with fields at its vertices.
///
/// # Errors
/// [`FileError`] naming the file.
pub fn write(path: &Path, mesh: &TriMesh, fields: &[NamedField]) -> Result<(), FileError> {
    atomic::write(path, to_text(mesh, fields).as_bytes())
}

fn to_text(mesh: &TriMesh, fields: &[NamedField]) -> String {
    let (points, cells) = (mesh.positions().len(), mesh.triangles().len());
    let mut t = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n",
    );
    let _ = writeln!(
        t,
        "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">"
    );
    t.push_str("<PointData>\n");
    for field in fields {
        array(
            &mut t,
            &field.name,
            "Float64",
            field.width,
            field.values.chunks(field.width),
        );
    }
    t.push_str("</PointData>\n<Points>\n");
    let positions: Vec<[f64; 3]> = mesh
        .positions()
        .iter()
        .map(|p| (*p * 1000.0).to_array())
        .collect();
    array(&mut t, "Points", "Float64", 3, positions.iter());
    t.push_str("</Points>\n<Cells>\n");
    array(&mut t, "connectivity", "Int32", 1, mesh.triangles().iter());
    array(&mut t, "offsets", "Int32", 1, (1..=cells).map(|k| [3 * k]));
    array(&mut t, "types", "UInt8", 1, (0..cells).map(|_| [5]));
    t.push_str("</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
    t
}

fn array<N: std::fmt::Display, R: AsRef<[N]>>(
    t: &mut String,
    name: &str,
    kind: &str,
    width: usize,
    rows: impl Iterator<Item = R>,
) {
    let _ = writeln!(
        t,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{width}\" format=\"ascii\">"
    );
    for row in rows {
        for value in row.as_ref() {
            let _ = write!(t, "{value} ");
        }
        t.push('\n');
    }
    t.push_str("</DataArray>\n");
}
