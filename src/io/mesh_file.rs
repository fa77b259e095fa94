//! Meshes from files: glTF and GLB, OBJ, STL (both kinds).
//!
//! The libraries that parse them may panic on hostile bytes, so they run behind a boundary; what they
//! return is checked by [`TriMesh::new`] like anything from outside.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use glam::{DMat4, DVec3, Mat4, Vec3};

use super::FileError;
use crate::mesh::{RepairReport, TriMesh};
use crate::project::Unit;

/// A mesh from a file with what was changed on the way in.
pub struct LoadedMesh {
    pub mesh: TriMesh,
    pub repairs: RepairReport,
}

type Soup = (Vec<DVec3>, Vec<[u32; 3]>);

/// Whether a mesh of this name does not say its unit.
#[must_use]
pub fn needs_unit(path: &Path) -> bool {
    !ending(path).starts_with("gl")
}

fn ending(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}

/// File endings that can be read.
pub const ENDINGS: [&str; 4] = ["glb", "gltf", "obj", "stl"];

/// Reads one body of a mesh file. `unit` is that of the file's numbers; glTF needs none.
///
/// # Errors
/// [`FileError`] naming the file, what is wrong and what to do.
pub fn read_mesh(path: &Path, unit: Option<Unit>, body: usize) -> Result<LoadedMesh, FileError> {
    let ending = ending(path);
    if !ENDINGS.contains(&ending.as_str()) {
        return Err(FileError::broken(
            path,
            format!("meshes are read from {} files", ENDINGS.join(", ")),
        ));
    }
    let bytes = std::fs::read(path).map_err(|e| FileError::of(path, &e))?;
    if bytes.is_empty() {
        return Err(FileError::broken(
            path,
            "the file is empty. Export the mesh again",
        ));
    }
    let scale = scale(path, unit)?;
    let parse = || match ending.as_str() {
        "obj" => read_obj(&bytes),
        "stl" => read_stl(&bytes),
        _ => read_gltf(&bytes, path.parent()),
    };
    let (mut positions, triangles) = catch_unwind(AssertUnwindSafe(parse))
        .unwrap_or_else(|_| Err("the file is damaged".into()))
        .map_err(|m| FileError::broken(path, format!("{m}. Export the mesh again")))?;
    for p in &mut positions {
        *p *= scale;
    }
    let (mesh, repairs) =
        TriMesh::new(&positions, &triangles, body).map_err(|e| FileError::broken(path, e))?;
    Ok(LoadedMesh { mesh, repairs })
}

/// Reads a GLB from memory: body 0, in metres.
///
/// # Errors
/// A message in the user's terms.
pub fn parse_glb(bytes: &[u8]) -> Result<LoadedMesh, String> {
    let (positions, triangles) = read_gltf(bytes, None)?;
    let (mesh, repairs) = TriMesh::new(&positions, &triangles, 0).map_err(|e| e.to_string())?;
    Ok(LoadedMesh { mesh, repairs })
}

fn scale(path: &Path, unit: Option<Unit>) -> Result<f64, FileError> {
    match unit {
        Some(unit) => Ok(unit.metres()),
        None if !needs_unit(path) => Ok(1.0),
        None => Err(FileError::broken(
            path,
            "this format does not say its unit. Give it: --unit mm, cm, m or in (part.unit in a project)",
        )),
    }
}

fn read_stl(bytes: &[u8]) -> Result<Soup, String> {
    // Headers lie: a binary file is known by its length, whatever its first word.
    let binary = bytes.len() >= 84 && {
        let count = u32::from_le_bytes([bytes[80], bytes[81], bytes[82], bytes[83]]) as usize;
        bytes.len() == 84 + 50 * count
    };
    if binary {
        return Ok(binary_stl(bytes));
    }
    if !bytes.trim_ascii_start().starts_with(b"solid") {
        return Err(
            "the STL file is truncated: its length does not match the triangles it announces"
                .into(),
        );
    }
    // The reader wants a name after the first word.
    let text = [b"solid stl".as_slice(), after_first_line(bytes)].join(&b'\n');
    let mesh = stl_io::read_stl(&mut Cursor::new(text))
        .map_err(|e| format!("not a readable STL file ({e})"))?;
    if !bytes
        .windows(8)
        .any(|w| w.eq_ignore_ascii_case(b"endsolid"))
    {
        return Err("the STL file is truncated: it has no endsolid".into());
    }
    let positions = mesh
        .vertices
        .iter()
        .map(|v| Vec3::from_array(v.0).as_dvec3())
        .collect();
    let triangles = mesh
        .faces
        .iter()
        .map(|f| f.vertices.map(|v| v as u32))
        .collect();
    Ok((positions, triangles))
}

fn after_first_line(bytes: &[u8]) -> &[u8] {
    let end = bytes
        .iter()
        .position(|&b| b == b'\n')
        .unwrap_or(bytes.len());
    bytes.get(end + 1..).unwrap_or_default()
}

fn binary_stl(bytes: &[u8]) -> Soup {
    let float =
        |at: usize| f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let count = (bytes.len() - 84) / 50;
    let positions = (0..3 * count)
        .map(|i| {
            let at = 84 + 50 * (i / 3) + 12 + 12 * (i % 3);
            Vec3::new(float(at), float(at + 4), float(at + 8)).as_dvec3()
        })
        .collect();
    let triangles = (0..count as u32)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    (positions, triangles)
}

fn read_obj(bytes: &[u8]) -> Result<Soup, String> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &Path| Err(tobj::LoadError::GenericFailure);
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, no_materials)
        .map_err(|e| format!("not a readable OBJ file ({e})"))?;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for model in models {
        let base = positions.len() as u32;
        positions.extend(
            model
                .mesh
                .positions
                .chunks_exact(3)
                .map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into())),
        );
        triangles.extend(
            model
                .mesh
                .indices
                .chunks_exact(3)
                .map(|t| [base + t[0], base + t[1], base + t[2]]),
        );
    }
    Ok((positions, triangles))
}

fn read_gltf(bytes: &[u8], folder: Option<&Path>) -> Result<Soup, String> {
    if bytes.starts_with(b"glTF") {
        check_glb_length(bytes)?;
    }
    let gltf::Gltf { document, blob } =
        gltf::Gltf::from_slice(bytes).map_err(|e| format!("not a readable glTF file ({e})"))?;
    let buffers = gltf::import_buffers(&document, folder, blob)
        .map_err(|e| format!("the data of the glTF file cannot be read ({e})"))?;
    let scene = document
        .default_scene()
        .or_else(|| document.scenes().next())
        .ok_or("the glTF file has no scene")?;
    let mut soup = (Vec::new(), Vec::new());
    for node in scene.nodes() {
        visit(&node, DMat4::IDENTITY, &buffers, &mut soup, 0)?;
    }
    Ok(soup)
}

fn check_glb_length(bytes: &[u8]) -> Result<(), String> {
    let announced = bytes
        .get(8..12)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    if announced == Some(bytes.len()) {
        Ok(())
    } else {
        Err("the GLB file is truncated: its length does not match what it announces".into())
    }
}

fn visit(
    node: &gltf::Node,
    parent: DMat4,
    buffers: &[gltf::buffer::Data],
    soup: &mut Soup,
    depth: usize,
) -> Result<(), String> {
    const DEEPEST: usize = 64;
    if depth > DEEPEST {
        return Err("the glTF file nests its nodes in a circle".into());
    }
    let world = parent * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
    if let Some(mesh) = node.mesh() {
        for primitive in mesh.primitives() {
            read_primitive(&primitive, world, buffers, soup)?;
        }
    }
    for child in node.children() {
        visit(&child, world, buffers, soup, depth + 1)?;
    }
    Ok(())
}

fn read_primitive(
    primitive: &gltf::Primitive,
    world: DMat4,
    buffers: &[gltf::buffer::Data],
    soup: &mut Soup,
) -> Result<(), String> {
    if primitive.mode() != gltf::mesh::Mode::Triangles {
        return Ok(());
    }
    let damaged = "a mesh of the glTF file has no readable positions or indices";
    let accessor = primitive.get(&gltf::Semantic::Positions).ok_or(damaged)?;
    if accessor.count() == 0 || accessor.data_type() != gltf::accessor::DataType::F32 {
        return Err(damaged.into());
    }
    let reader = primitive.reader(|b| buffers.get(b.index()).map(|d| d.0.as_slice()));
    let positions: Vec<[f32; 3]> = reader.read_positions().ok_or(damaged)?.collect();
    let indices: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None if primitive.indices().is_none() => (0..positions.len() as u32).collect(),
        None => return Err(damaged.into()),
    };
    if indices.iter().any(|&i| i as usize >= positions.len()) {
        return Err("a triangle of the glTF file refers to a vertex that is not there".into());
    }
    let base = soup.0.len() as u32;
    soup.0.extend(
        positions
            .iter()
            .map(|&p| world.transform_point3(Vec3::from_array(p).as_dvec3())),
    );
    // A mirroring node turns the surface inside out.
    let turned = world.determinant() < 0.0;
    soup.1.extend(indices.chunks_exact(3).map(|t| {
        let [a, b, c] = [base + t[0], base + t[1], base + t[2]];
        if turned { [a, c, b] } else { [a, b, c] }
    }));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limb::LimbSpec;

    fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    #[test]
    fn a_limb_survives_its_file() {
        let (limb, _) = LimbSpec::default().build().unwrap();
        let bytes = super::super::glb::write_glb(&limb).unwrap();
        let (_keep, path) = file("limb.glb", &bytes);
        let back = read_mesh(&path, None, 0).unwrap();
        assert_eq!(back.mesh.triangles(), limb.triangles());
        assert_eq!(back.repairs.welded_vertices, 0);
        let worst = limb
            .positions()
            .iter()
            .zip(back.mesh.positions())
            .map(|(a, b)| a.distance(*b))
            .fold(0.0, f64::max);
        assert!(worst < 1e-8);
    }

    #[test]
    fn any_cut_of_a_file_is_refused_without_a_panic() {
        let (limb, _) = LimbSpec {
            element: 12.0,
            ..LimbSpec::default()
        }
        .build()
        .unwrap();
        let bytes = super::super::glb::write_glb(&limb).unwrap();
        for cut in (0..bytes.len()).step_by(97) {
            let (_keep, path) = file("cut.glb", &bytes[..cut]);
            let error = read_mesh(&path, None, 0)
                .err()
                .expect("a cut file is refused");
            assert!(error.to_string().contains("cut.glb"), "{error}");
        }
    }

    #[test]
    fn stl_of_both_kinds_and_obj_agree() {
        let ascii = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 10 0 0\nvertex 0 10 0\nendloop\nendfacet\nendsolid\n";
        let mut binary = vec![b's'; 80];
        binary[..5].copy_from_slice(b"solid");
        binary.extend(1u32.to_le_bytes());
        for x in [0.0f32, 0., 1., 0., 0., 0., 10., 0., 0., 0., 10., 0.] {
            binary.extend(x.to_le_bytes());
        }
        binary.extend([0, 0]);
        let obj = "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 3\n";
        for (name, bytes) in [
            ("a.stl", ascii.as_bytes()),
            ("b.stl", &binary),
            ("c.obj", obj.as_bytes()),
        ] {
            let (_keep, path) = file(name, bytes);
            let mesh = read_mesh(&path, Some(Unit::Millimetre), 0).unwrap().mesh;
            assert!((mesh.area() - 50e-6).abs() < 1e-12, "{name}");
            let error = read_mesh(&path, None, 0).err().unwrap();
            assert!(error.to_string().contains("--unit"));
        }
    }

    #[test]
    fn what_is_not_finite_is_named() {
        let (_keep, path) = file("n.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
        let error = read_mesh(&path, Some(Unit::Metre), 0)
            .err()
            .unwrap()
            .to_string();
        assert!(
            error.contains("n.obj") && (error.contains("finite") || error.contains("OBJ")),
            "{error}"
        );
    }
}
