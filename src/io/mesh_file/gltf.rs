//! glTF and GLB: all meshes of the scene, in its frame; named nodes become groups of vertices.

use std::path::Path;

use glam::{DMat4, Mat4, Vec3};

use super::Soup;

pub fn read(bytes: &[u8], folder: Option<&Path>) -> Result<Soup, String> {
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
    let mut soup = Soup::default();
    for node in scene.nodes() {
        visit(&node, DMat4::IDENTITY, &buffers, &mut soup, 0)?;
    }
    Ok(soup)
}

/// An accessor that announces more entries than its buffers have bytes is not believed.
fn check_size(accessor: &gltf::Accessor, buffers: &[gltf::buffer::Data]) -> Result<(), String> {
    let bytes: usize = buffers.iter().map(|b| b.0.len()).sum();
    if accessor.count() > bytes {
        return Err("an array of the glTF file is longer than its data".into());
    }
    Ok(())
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
    /// Far more than a part needs; a file may name the same node again and again.
    const MOST: usize = 20_000_000;
    if depth > DEEPEST || soup.visits > 1_000_000 || soup.triangles.len() > MOST {
        return Err(
            "the glTF file nests its nodes in a circle, or repeats them without an end".into(),
        );
    }
    soup.visits += 1;
    let world = parent * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
    if let Some(mesh) = node.mesh() {
        let first = soup.triangles.len();
        for primitive in mesh.primitives() {
            read_primitive(&primitive, world, buffers, soup)?;
        }
        soup.group(node.name().or(mesh.name()).unwrap_or_default(), first);
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
    check_size(&accessor, buffers)?;
    if let Some(indices) = primitive.indices() {
        check_size(&indices, buffers)?;
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
    let base = soup.positions.len() as u32;
    soup.positions.extend(
        positions
            .iter()
            .map(|&p| world.transform_point3(Vec3::from_array(p).as_dvec3())),
    );
    // A mirroring node turns the surface inside out.
    let turned = world.determinant() < 0.0;
    soup.triangles.extend(indices.chunks_exact(3).map(|t| {
        let [a, b, c] = [base + t[0], base + t[1], base + t[2]];
        if turned { [a, c, b] } else { [a, b, c] }
    }));
    Ok(())
}
