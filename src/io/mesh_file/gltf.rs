//! glTF and GLB: all meshes of the scene, in its frame; named nodes become groups of vertices.

mod data;

use std::path::Path;

use glam::{DMat4, Mat4, Vec3};
use gltf::mesh::Mode;

use self::data::Buffers;
use super::boundary::quietly;
use super::soup::Soup;
use super::words::no_surface;
use crate::{memory, plain};

/// What copies a mesh without a node for each copy.
const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// Reads all meshes of the scene; `folder` is where buffers that it names are looked for.
pub fn read(bytes: &[u8], folder: Option<&Path>) -> Result<Soup, String> {
    if bytes.starts_with(b"glTF") {
        check_glb_length(bytes)?;
    }
    let gltf::Gltf { document, blob } = parsed(bytes)?;
    let buffers = Buffers::load(&document, folder, blob)?;
    let scene = document
        .default_scene()
        .or_else(|| document.scenes().next())
        .ok_or("the glTF file has no scene")?;
    let mut walk = NodeWalk {
        buffers: &buffers,
        soup: Soup::default(),
        visits: 0,
        without_area: 0,
        morphed: 0,
        skinned: 0,
    };
    for node in scene.nodes() {
        walk.visit(&node, DMat4::IDENTITY, 0)?;
    }
    let others = document.scenes().len() - 1;
    if document.extensions_used().any(|name| name == INSTANCING) {
        let note =
            format!("the copies that {INSTANCING} makes of a mesh are not read: it is taken once");
        walk.soup.notes.push(note);
    }
    Ok(walk.finish(others))
}

fn parsed(bytes: &[u8]) -> Result<gltf::Gltf, String> {
    match quietly(|| gltf::Gltf::from_slice(bytes)) {
        Some(Ok(gltf)) => Ok(gltf),
        Some(Err(e)) => Err(format!("not a readable glTF file ({e})")),
        None => Err(missing_accessor(bytes)
            .unwrap_or_else(|| "the glTF file refers to what is not in it".into())),
    }
}

/// The primitive whose positions are not there, which the library stumbles over while it checks the file.
fn missing_accessor(bytes: &[u8]) -> Option<String> {
    let gltf = quietly(|| gltf::Gltf::from_slice_without_validation(bytes).ok())??;
    let root = gltf.document.as_json();
    let count = root.accessors.len();
    root.meshes.iter().enumerate().find_map(|(m, mesh)| {
        mesh.primitives.iter().enumerate().find_map(|(p, primitive)| {
            let missing = (primitive.attributes.values()).find(|a| a.value() >= count)?;
            Some(format!(
                "meshes[{m}].primitives[{p}] of the glTF file names accessor {} (from 0), and the file has {}",
                missing.value(),
                plain::count(count, "accessor")
            ))
        })
    })
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

/// The way through the nodes of a scene.
struct NodeWalk<'d> {
    buffers: &'d Buffers,
    soup: Soup,
    /// Nodes walked through.
    visits: usize,
    /// Primitives of points and lines, and those with shapes to morph into.
    without_area: usize,
    morphed: usize,
    /// Nodes whose mesh is posed by joints.
    skinned: usize,
}

impl NodeWalk<'_> {
    fn visit(&mut self, node: &gltf::Node, parent: DMat4, depth: usize) -> Result<(), String> {
        const DEEPEST: usize = 64;
        /// Far more than a part needs; a file may name the same node again and again.
        const MOST: usize = 1_000_000;
        if depth > DEEPEST || self.visits > MOST {
            return Err(
                "the glTF file nests its nodes in a circle, or repeats them without an end".into(),
            );
        }
        self.visits += 1;
        let world = parent * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
        if let Some(mesh) = node.mesh() {
            self.skinned += usize::from(node.skin().is_some());
            let first = self.soup.triangles.len();
            for primitive in mesh.primitives() {
                let place = format!("meshes[{}].primitives[{}]", mesh.index(), primitive.index());
                self.primitive(&primitive, world)
                    .map_err(|said| format!("{place} of the glTF file {said}"))?;
            }
            self.soup
                .group(node.name().or(mesh.name()).unwrap_or_default(), first);
        }
        for child in node.children() {
            self.visit(&child, world, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &gltf::Primitive, world: DMat4) -> Result<(), String> {
        let mode = primitive.mode();
        if !matches!(
            mode,
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            self.without_area += 1;
            return Ok(());
        }
        self.morphed += usize::from(primitive.morph_targets().next().is_some());
        let (positions, indices) = self.arrays(primitive)?;
        let base = self.soup.positions.len() as u32;
        let place = |&p: &[f32; 3]| world.transform_point3(Vec3::from_array(p).as_dvec3());
        self.soup.positions.extend(positions.iter().map(place));
        // A mirroring node turns the surface inside out.
        let turned = world.determinant() < 0.0;
        let oriented = |t: [u32; 3]| {
            let [a, b, c] = t.map(|v| base + v);
            if turned { [a, c, b] } else { [a, b, c] }
        };
        let triangles = triangles(mode, &indices)?;
        self.soup
            .triangles
            .extend(triangles.into_iter().map(oriented));
        Ok(())
    }

    /// Positions of a primitive, and its corners by their numbers among these.
    fn arrays(&self, primitive: &gltf::Primitive) -> Result<(Vec<[f32; 3]>, Vec<u32>), String> {
        let buffers = self.buffers;
        let accessor = primitive
            .get(&gltf::Semantic::Positions)
            .ok_or("has no positions")?;
        let by = primitive.indices();
        let corners = by.as_ref().map_or(accessor.count(), gltf::Accessor::count);
        self.check_room(accessor.count(), corners)?;
        buffers.check_positions(&accessor)?;
        if let Some(by) = &by {
            buffers.check_indices(by)?;
        }
        let reader = primitive.reader(move |b| buffers.bytes(&b));
        let unreadable = "has positions or indices that cannot be read";
        let positions: Vec<[f32; 3]> = reader.read_positions().ok_or(unreadable)?.collect();
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None if by.is_none() => (0..positions.len() as u32).collect(),
            None => return Err(unreadable.into()),
        };
        match indices.iter().find(|&&i| i as usize >= positions.len()) {
            None => Ok((positions, indices)),
            Some(index) => Err(format!(
                "refers to vertex {index}, and there are {}, from 0",
                positions.len()
            )),
        }
    }

    /// Whether so many more vertices and corners find their place: a small file may repeat a mesh without an end.
    fn check_room(&self, vertices: usize, corners: usize) -> Result<(), String> {
        /// Bytes that a vertex, and a corner of a triangle, take until the surface is there.
        const VERTEX: f64 = 200.0;
        const CORNER: f64 = 100.0;
        let vertices = (self.soup.positions.len() as f64) + vertices as f64;
        let corners = 3.0 * (self.soup.triangles.len() as f64) + corners as f64;
        let needed = VERTEX * vertices + CORNER * corners;
        if needed <= memory::allowed() && vertices < f64::from(u32::MAX) {
            return Ok(());
        }
        Err(format!(
            "would take {} with all that comes before it, and {} may be taken: decimate the mesh, or allow more with --memory-gb",
            plain::needed(needed),
            plain::allowed(memory::allowed())
        ))
    }

    /// What was found, with what was left out.
    fn finish(mut self, other_scenes: usize) -> Soup {
        let left_out = [
            no_surface(self.without_area, "primitives of points or lines"),
            (self.morphed > 0).then(|| {
                format!(
                    "read as at rest: {} of the file with shapes to morph into",
                    plain::either(self.morphed, "mesh", "meshes")
                )
            }),
            (self.skinned > 0).then(|| {
                format!(
                    "read as at rest: {} of the file with joints",
                    plain::either(self.skinned, "mesh", "meshes")
                )
            }),
            (other_scenes > 0).then(|| {
                format!(
                    "left out: {} of the file",
                    plain::either(other_scenes, "other scene", "other scenes")
                )
            }),
        ];
        self.soup.notes.extend(left_out.into_iter().flatten());
        self.soup
    }
}

/// The triangles that the vertices of a primitive span, one way round.
fn triangles(mode: Mode, vertices: &[u32]) -> Result<Vec<[u32; 3]>, String> {
    let whole = mode != Mode::Triangles || vertices.len().is_multiple_of(3);
    if vertices.len() < 3 || !whole {
        return Err(format!(
            "has {} corners, which is no number of whole triangles",
            vertices.len()
        ));
    }
    let strip = |(k, t): (usize, &[u32])| match k % 2 {
        0 => [t[0], t[1], t[2]],
        _ => [t[0], t[2], t[1]],
    };
    // Strips go on over triangles without area to where they begin anew.
    let spans = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    Ok(match mode {
        Mode::TriangleStrip => (vertices.windows(3).enumerate())
            .map(strip)
            .filter(spans)
            .collect(),
        Mode::TriangleFan => (vertices[1..].windows(2))
            .map(|pair| [pair[0], pair[1], vertices[0]])
            .collect(),
        _ => (vertices.chunks_exact(3))
            .map(|t| [t[0], t[1], t[2]])
            .collect(),
    })
}
