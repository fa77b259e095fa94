//! Meshes from files: glTF and GLB, OBJ, STL (both kinds), PLY; tetrahedra and mid-surfaces from Gmsh, Abaqus,
//! `CalculiX` and Ansys.
//!
//! What parses them may panic on hostile bytes, so it runs behind a boundary; what it returns is checked by
//! [`TriMesh::taken_in`] like anything from outside. What a reader does not know, or leaves out, it notes.

mod ansys;
mod boundary;
mod found;
mod gltf;
mod held;
mod inp;
mod msh;
mod obj;
mod place;
mod ply;
mod sets;
mod soup;
mod stl;
mod tetrahedra;
mod unread;
pub mod urdf;
mod words;

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use self::boundary::quietly;
use self::soup::Soup;
use super::{FileError, source};
use crate::bounds::Bounds;
use crate::mesh::halve::longest_wanted;
use crate::mesh::repair::Repair;
use crate::mesh::volume::VolumeMesh;
use crate::mesh::{MeshError, RepairReport, TriMesh};
use crate::plain;
use crate::project::{Masks, Unit};

pub use self::found::FoundDeck;

/// A mesh from a file with what was changed on the way in.
pub struct LoadedMesh {
    pub mesh: TriMesh,
    pub repairs: RepairReport,
    /// Vertices of each named group of the file that lie on the body.
    pub groups: Masks,
    /// What the file says beside its mesh.
    pub found: FoundDeck,
}

/// Whether a mesh of this name does not say its unit.
#[must_use]
pub fn needs_unit(path: &Path) -> bool {
    !ending(path).starts_with("gl") && !may_say_unit(path) && urdf::named(path).is_none()
}

/// Whether a mesh of this name may say its unit, or leave it out.
#[must_use]
pub fn may_say_unit(path: &Path) -> bool {
    DECKS.contains(&ending(path).as_str())
}

fn ending(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}

/// File endings that can be read.
pub const ENDINGS: [&str; 9] = [
    "cdb", "dat", "glb", "gltf", "inp", "msh", "obj", "ply", "stl",
];
/// Of Ansys.
const DECKS: [&str; 2] = ["cdb", "dat"];
/// The longest part of a file that says its own unit (m): what is larger was not meant so.
const LONGEST: f64 = 10.0;

/// Reads one body of a mesh file. `unit` is that of the file's numbers; glTF needs none.
///
/// # Errors
/// [`FileError`] naming the file, what is wrong and what to do.
pub fn read_mesh(
    path: &Path,
    unit: Option<Unit>,
    body: usize,
    repair: Repair,
) -> Result<LoadedMesh, FileError> {
    if let Some((file, link)) = urdf::named(path) {
        return read_link(&file, link.as_deref(), body, &repair);
    }
    let ending = ending(path);
    if !ENDINGS.contains(&ending.as_str()) {
        return Err(FileError::broken(
            path,
            format!("meshes are read from {} files", ENDINGS.join(", ")),
        ));
    }
    let bytes = source::read(path)?;
    if bytes.is_empty() {
        return Err(FileError::broken(
            path,
            "the file is empty. Export the mesh again",
        ));
    }
    if unit.is_none() && needs_unit(path) {
        return Err(FileError::broken(path, NO_UNIT));
    }
    let read = || {
        let mut soup = parsed(&bytes, &ending, path.parent())?;
        let scale = scale(&mut soup, unit, may_say_unit(path))?;
        taken_in(soup, scale, body, &repair)
    };
    read().map_err(|m| FileError::broken(path, m))
}

/// Reads one body of the mesh of a robot's link, in the link's frame: in metres, as descriptions are.
fn read_link(
    urdf: &Path,
    link: Option<&str>,
    body: usize,
    repair: &Repair,
) -> Result<LoadedMesh, FileError> {
    let link = urdf::find(urdf, link)?;
    let mesh = &link.mesh;
    let ending = ending(mesh);
    if !ENDINGS.contains(&ending.as_str()) {
        return Err(FileError::broken(
            mesh,
            "a mesh of a robot's link that is not read: convert it to STL, OBJ or GLB, and name that in the description",
        ));
    }
    let bytes = source::read(mesh)?;
    let read = || {
        let mut soup = parsed(&bytes, &ending, mesh.parent())?;
        if soup.volume.is_some() {
            return Err("tetrahedra are no mesh of a link: name a surface".into());
        }
        link.place(&mut soup);
        taken_in(soup, 1.0, body, repair)
    };
    read().map_err(|m| FileError::broken(mesh, m))
}

/// Reads one body of a mesh from the bytes of a file with this ending; `folder` is where other files
/// that it names are looked for, `scale` its unit in metres.
///
/// # Errors
/// A message in the user's terms.
pub fn parse_mesh(
    bytes: &[u8],
    ending: &str,
    folder: Option<&Path>,
    scale: f64,
    body: usize,
    repair: &Repair,
) -> Result<LoadedMesh, String> {
    taken_in(parsed(bytes, ending, folder)?, scale, body, repair)
}

fn parsed(bytes: &[u8], ending: &str, folder: Option<&Path>) -> Result<Soup, String> {
    let parse = || match ending {
        "stl" if stl::is_binary(bytes) => stl::read(bytes),
        _ => unmarked(bytes).and_then(|bytes| by_ending(bytes, ending, folder)),
    };
    quietly(parse)
        .unwrap_or_else(|| Err("the file is damaged".into()))
        .map_err(|m| format!("{m}. Export the mesh again"))
}

/// What stands behind the mark of UTF-8 that some editors write in front of a text.
fn unmarked(bytes: &[u8]) -> Result<&[u8], String> {
    match bytes {
        [0xef, 0xbb, 0xbf, text @ ..] => Ok(text),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => {
            Err("the file is text in UTF-16: save it as UTF-8".into())
        }
        _ => Ok(bytes),
    }
}

fn by_ending(bytes: &[u8], ending: &str, folder: Option<&Path>) -> Result<Soup, String> {
    match ending {
        "obj" => obj::read(bytes),
        "ply" => ply::read(bytes),
        "stl" => stl::read(bytes),
        "msh" => msh::read(bytes),
        "inp" => inp::read(bytes),
        "cdb" | "dat" => ansys::read(bytes),
        _ => gltf::read(bytes, folder),
    }
}

/// One body of what a file holds, in a unit of so many metres.
fn taken_in(
    mut soup: Soup,
    scale: f64,
    body: usize,
    repair: &Repair,
) -> Result<LoadedMesh, String> {
    for p in &mut soup.positions {
        *p *= scale;
    }
    let mut loaded = match soup.volume.take() {
        Some(volume) => tetrahedral(&mut soup, volume, scale, body, repair.straighten)?,
        None => surface(&mut soup, body, repair)?,
    };
    loaded.found = soup.said.found(
        scale,
        &loaded.groups,
        loaded.mesh.volume().is_some(),
        &mut soup.notes,
    );
    loaded.repairs.notes = soup.notes;
    Ok(loaded)
}

/// A body of a mesh of triangles.
fn surface(soup: &mut Soup, body: usize, repair: &Repair) -> Result<LoadedMesh, String> {
    let taken = TriMesh::taken_in(&soup.positions, &soup.triangles, body, repair);
    let taken = taken.map_err(|e: MeshError| e.to_string())?;
    let groups = soup.masks(&taken.vertices, taken.mesh.positions().len());
    let (given, mut repairs) = (taken.mesh.triangles().len(), taken.repairs);
    let mesh = halved(taken.mesh, repair);
    if mesh.triangles().len() > given {
        repairs.halved_into = mesh.triangles().len();
    }
    let spread = |(name, mask): (String, Arc<Vec<bool>>)| {
        let mask = mesh.mask_of(mask.to_vec()).map_or(mask, Arc::new);
        (name, mask)
    };
    Ok(LoadedMesh {
        groups: groups.into_iter().map(spread).collect(),
        mesh,
        repairs,
        found: FoundDeck::default(),
    })
}

/// The surface with its long edges halved, where that is asked for or needed.
fn halved(mesh: TriMesh, repair: &Repair) -> TriMesh {
    let longest = if repair.halve == 0.0 {
        longest_wanted(&mesh)
    } else {
        Some(repair.halve)
    };
    match longest {
        Some(longest) => mesh.with_long_edges_halved(longest),
        None => mesh,
    }
}

/// A piece of a mesh of tetrahedra, its surface as the mesh; nodes on bent edges move by `straighten` (m) at most.
fn tetrahedral(
    soup: &mut Soup,
    mut volume: VolumeMesh,
    scale: f64,
    body: usize,
    straighten: f64,
) -> Result<LoadedMesh, String> {
    for p in &mut volume.nodes {
        *p *= scale;
    }
    let finite = |p: &DVec3| p.is_finite() && p.abs().max_element() < 1e9;
    if let Some(node) = volume.nodes.iter().position(|p| !finite(p)) {
        return Err(format!("node {node} is not a finite point"));
    }
    let whole = volume.checked();
    let mut whole = whole.map_err(|e| tetrahedra::at_origin(&e, &soup.origins))?;
    let mended = whole.straighten(straighten);
    let mended = mended.map_err(|e| tetrahedra::at_origin(&e, &soup.origins))?;
    soup.notes.extend(mended.in_words());
    let (piece, mesh, bodies) = whole.body(body).map_err(|e| e.to_string())?;
    note_held_within(soup, &whole, &piece, &mesh);
    let groups = (soup.node_sets.iter())
        .map(|(name, nodes)| {
            let members: HashSet<[u64; 3]> = (whole.with_middles(nodes).iter())
                .map(|&n| bits(whole.nodes[n as usize]))
                .collect();
            let mask: Vec<bool> = (mesh.positions().iter())
                .map(|&p| members.contains(&bits(p)))
                .collect();
            (name.clone(), Arc::new(mask))
        })
        .filter(|(_, mask)| mask.iter().any(|&m| m));
    Ok(LoadedMesh {
        groups: groups.collect(),
        repairs: RepairReport {
            bodies,
            ..RepairReport::default()
        },
        mesh: mesh.around(piece),
        found: FoundDeck::default(),
    })
}

/// A point as what tells it from all others; -0 is 0.
fn bits(point: DVec3) -> [u64; 3] {
    (point + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// Notes the nodes of supports that lie inside a piece of the file's tetrahedra: a part is held on its surface.
fn note_held_within(soup: &mut Soup, whole: &VolumeMesh, piece: &VolumeMesh, surface: &TriMesh) {
    let supports: HashSet<&str> = (soup.said.supports.iter())
        .filter_map(|s| s.vertices.as_deref())
        .collect();
    if supports.is_empty() {
        return;
    }
    let places = |points: &[DVec3]| points.iter().map(|&p| bits(p)).collect::<HashSet<_>>();
    let (of_piece, on_surface) = (places(&piece.nodes), places(surface.positions()));
    let held = (soup.node_sets.iter()).filter(|(name, _)| supports.contains(&**name));
    for (name, nodes) in held {
        let places = nodes.iter().map(|&n| bits(whole.nodes[n as usize]));
        let places: Vec<_> = places.filter(|p| of_piece.contains(p)).collect();
        let inside = (places.iter()).filter(|p| !on_surface.contains(*p)).count();
        if inside > 0 {
            soup.notes.push(format!(
                "{}: {inside} of its {} lie inside the part, where nothing is held: only its surface is",
                plain::quote(name),
                plain::count(places.len(), "node")
            ));
        }
    }
}

/// Reads a GLB from memory: body 0, in metres.
///
/// # Errors
/// A message in the user's terms.
pub fn parse_glb(bytes: &[u8]) -> Result<LoadedMesh, String> {
    parse_mesh(bytes, "glb", None, 1.0, 0, &Repair::default())
}

const NO_UNIT: &str =
    "this format does not say its unit. Give it: --unit mm, cm, m or in (part.unit in a project)";

/// The unit (m) of what a file holds: what the user says comes before what the file says. Only decks may say it.
fn scale(soup: &mut Soup, given: Option<Unit>, deck: bool) -> Result<f64, String> {
    let own = soup.said.system;
    match (given, own) {
        (Some(given), own) => {
            if let Some(own) = own
                && own.length != given
            {
                soup.notes.push(format!(
                    "the file has its lengths in {} (line {}), and they are taken in {}, as was asked for",
                    own.length.name(),
                    own.line,
                    given.name()
                ));
            }
            Ok(given.metres())
        }
        (None, Some(own)) => {
            let metres = own.length.metres();
            let long = extent(&soup.positions) * metres;
            if long > LONGEST {
                return Err(format!(
                    "the part is {} long in the unit that line {} names ({}): its coordinates are in another one. Say which: --unit mm, cm, m or in (part.unit in a project)",
                    plain::length(long),
                    own.line,
                    own.length.name()
                ));
            }
            Ok(metres)
        }
        (None, None) if deck => Err(NO_UNIT.replace("this format", "this file")),
        (None, None) => Ok(1.0),
    }
}

/// The longest side of the box around points, in their unit.
fn extent(points: &[DVec3]) -> f64 {
    Bounds::around(points.iter().copied()).size().max_element()
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
        let back = read_mesh(&path, None, 0, Repair::default()).unwrap();
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
            let error = read_mesh(&path, None, 0, Repair::default())
                .err()
                .expect("a cut file is refused");
            assert!(error.to_string().contains("cut.glb"), "{error}");
        }
    }

    #[test]
    fn all_formats_agree() {
        let ascii = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 10 0 0\nvertex 0 10 0\nendloop\nendfacet\nendsolid\n";
        let mut binary = vec![b's'; 80];
        binary[..5].copy_from_slice(b"solid");
        binary.extend(1u32.to_le_bytes());
        for x in [0.0f32, 0., 1., 0., 0., 0., 10., 0., 0., 0., 10., 0.] {
            binary.extend(x.to_le_bytes());
        }
        binary.extend([0, 0]);
        let obj = "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 3\n";
        let head = "element vertex 4\nproperty double x\nproperty double y\nproperty double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        // A quadrangle of the same area.
        let ply = format!("ply\nformat ascii 1.0\n{head}0 0 0\n10 0 0\n10 5 0\n0 5 0\n4 0 1 2 3\n");
        let mut binary_ply = format!("ply\nformat binary_little_endian 1.0\n{head}").into_bytes();
        for x in [0.0f64, 0., 0., 10., 0., 0., 10., 5., 0., 0., 5., 0.] {
            binary_ply.extend(x.to_le_bytes());
        }
        binary_ply.push(4);
        for v in 0i32..4 {
            binary_ply.extend(v.to_le_bytes());
        }
        for (name, bytes) in [
            ("a.stl", ascii.as_bytes()),
            ("b.stl", &binary),
            ("c.obj", obj.as_bytes()),
            ("d.ply", ply.as_bytes()),
            ("e.ply", &binary_ply),
        ] {
            let (_keep, path) = file(name, bytes);
            let mesh = read_mesh(&path, Some(Unit::Millimetre), 0, Repair::default())
                .unwrap()
                .mesh;
            assert!((mesh.area() - 50e-6).abs() < 1e-12, "{name}");
            let error = read_mesh(&path, None, 0, Repair::default()).err().unwrap();
            assert!(error.to_string().contains("--unit"));
        }
    }

    #[test]
    fn what_is_not_finite_is_named() {
        let (_keep, path) = file("n.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
        let error = read_mesh(&path, Some(Unit::Metre), 0, Repair::default())
            .err()
            .unwrap()
            .to_string();
        assert!(
            error.contains("n.obj") && (error.contains("finite") || error.contains("OBJ")),
            "{error}"
        );
    }

    #[test]
    fn groups_of_a_file_are_known_by_name() {
        let obj =
            b"o shell\nv 0 0 0\nv 10 0 0\nv 0 10 0\nv 10 10 0\ng left\nf 1 2 3\ng right\nf 2 4 3\n";
        let (_keep, path) = file("g.obj", obj);
        let loaded = read_mesh(&path, Some(Unit::Millimetre), 0, Repair::default()).unwrap();
        let left: Vec<bool> = loaded.groups["left"].to_vec();
        assert_eq!(left.iter().filter(|&&m| m).count(), 3);
        let only_right = loaded
            .mesh
            .positions()
            .iter()
            .zip(&left)
            .find(|(_, m)| !**m);
        assert!((only_right.unwrap().0.x - 0.01).abs() < 1e-12);
    }
}
