//! Maps of readings over one surface as arrays of an NPZ: in what is kept beside a project, and in trained estimators.
//!
//! | array | shape | is |
//! |---|---|---|
//! | `map_positions`, `map_triangles` | × 3 | the surface (m) |
//! | `asked` | 2 | whether readings by the tip's size are there, and along the axes |
//! | `readings` | maps × nodes × channels | the caller's own, then by the tip's size (1) and along the axes (3) |

use std::sync::Arc;

use glam::DVec3;

use super::npz::{Arrays, NpzFile};
use crate::inference::ResponseMap;
use crate::mesh::TriMesh;

/// Maps over one surface.
pub struct Maps {
    /// The caller's.
    pub own: Vec<ResponseMap>,
    /// By the tip's size.
    pub tip: Option<Arc<ResponseMap>>,
    /// By forces along x, y and z.
    pub axes: Option<Arc<[ResponseMap; 3]>>,
}

/// Adds maps over one surface, at least one `own`.
///
/// # Errors
/// Where the archive cannot be written.
pub fn add(
    file: &mut NpzFile,
    own: &[&ResponseMap],
    tip: Option<&ResponseMap>,
    axes: Option<&[ResponseMap; 3]>,
) -> std::io::Result<()> {
    let first = own[0];
    add_mesh(file, "map", &first.mesh)?;
    file.add(
        "asked",
        &[2],
        &[tip.is_some(), axes.is_some()].map(u8::from),
    )?;
    let maps: Vec<&ResponseMap> = (own.iter().copied())
        .chain(tip)
        .chain(axes.into_iter().flatten())
        .collect();
    let readings: Vec<f64> = maps
        .iter()
        .flat_map(|m| m.values().iter().copied())
        .collect();
    let nodes = first.values().len() / first.channels().max(1);
    file.add(
        "readings",
        &[maps.len(), nodes, first.channels()],
        &readings,
    )
}

/// Takes them out again: so many `own` maps of so many channels. Nothing where they are not what was added.
pub fn read(from: &mut Arrays, own: usize, channels: usize) -> Option<Maps> {
    if channels == 0 {
        return None;
    }
    let mesh = mesh(from, "map")?;
    let asked = numbers(from, "asked", &[2])?;
    let (with_tip, with_axes) = (asked[0] > 0.0, asked[1] > 0.0);
    let maps = own + usize::from(with_tip) + 3 * usize::from(with_axes);
    let nodes = mesh.positions().len() + mesh.edges().len();
    let readings = numbers(from, "readings", &[maps, nodes, channels])?;
    let mut maps = readings
        .chunks_exact(nodes * channels)
        .map(|values| ResponseMap::of(Arc::clone(&mesh), channels, values.to_vec()));
    let own: Vec<ResponseMap> = maps.by_ref().take(own).collect();
    let tip = if with_tip {
        Some(Arc::new(maps.next()?))
    } else {
        None
    };
    let axes = if with_axes {
        Some(Arc::new([maps.next()?, maps.next()?, maps.next()?]))
    } else {
        None
    };
    Some(Maps { own, tip, axes })
}

/// Adds a surface.
///
/// # Errors
/// Where the archive cannot be written.
pub fn add_mesh(file: &mut NpzFile, of: &str, mesh: &TriMesh) -> std::io::Result<()> {
    let positions = flat(mesh.positions());
    let name = format!("{of}_positions");
    file.add(&name, &[positions.len() / 3, 3], &positions)?;
    let corners = mesh.triangles().as_flattened();
    file.add(&format!("{of}_triangles"), &[corners.len() / 3, 3], corners)
}

/// Takes a surface out again, where it is one.
pub fn mesh(from: &mut Arrays, of: &str) -> Option<Arc<TriMesh>> {
    let positions = from.numbers(&format!("{of}_positions")).ok()?;
    let triangles = from.numbers(&format!("{of}_triangles")).ok()?;
    let of_threes = |shape: &[usize]| matches!(shape, [n, 3] if *n > 0);
    if !of_threes(&positions.shape) || !of_threes(&triangles.shape) {
        return None;
    }
    let vertices = positions.shape[0];
    let is_vertex = |v: &f64| v.fract() == 0.0 && (0.0..vertices as f64).contains(v);
    let sound =
        triangles.values.iter().all(is_vertex) && positions.values.iter().all(|v| v.is_finite());
    let corners = |t: &[f64]| [t[0] as u32, t[1] as u32, t[2] as u32];
    let mut taken = vec![false; vertices];
    if sound {
        for &v in &triangles.values {
            taken[v as usize] = true;
        }
    }
    // A vertex without a triangle lies nowhere on the surface.
    taken.iter().all(|t| *t).then(|| {
        let triangles = triangles.values.chunks_exact(3).map(corners).collect();
        Arc::new(TriMesh::from_checked(vectors(&positions.values), triangles))
    })
}

/// Finite numbers of a shape, where they are there.
pub fn numbers(from: &mut Arrays, name: &str, shape: &[usize]) -> Option<Vec<f64>> {
    let array = from.numbers(name).ok()?;
    let sound = array.shape == shape && array.values.iter().all(|v| v.is_finite());
    sound.then_some(array.values)
}

/// Coordinate by coordinate.
pub fn flat(vectors: &[DVec3]) -> Vec<f64> {
    vectors.iter().flat_map(DVec3::to_array).collect()
}

/// And back.
pub fn vectors(numbers: &[f64]) -> Vec<DVec3> {
    numbers.chunks_exact(3).map(DVec3::from_slice).collect()
}
