//! Binary glTF: the bundled limb is written with this.

use std::borrow::Cow;
use std::collections::BTreeMap;

use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Target, View};
use gltf::json::extras::Void;
use gltf::json::validation::{Checked::Valid, USize64};
use gltf::json::{self, Index, Root};

use crate::mesh::TriMesh;

/// A GLB file with one mesh; positions in metres as glTF asks, kept to f32 as it stores them.
///
/// # Errors
/// Only what serialization itself reports.
pub fn write_glb(mesh: &TriMesh) -> Result<Vec<u8>, gltf::Error> {
    let positions: Vec<[f32; 3]> = mesh
        .positions()
        .iter()
        .map(|p| p.as_vec3().to_array())
        .collect();
    let indices: Vec<u32> = mesh.triangles().iter().flatten().copied().collect();
    let mut builder = Builder::new(positions.len() * 12 + indices.len() * 4);
    let fold = |pick: fn(f32, f32) -> f32, start: f32| -> Vec<f32> {
        (0..3)
            .map(|k| positions.iter().fold(start, |m, p| pick(m, p[k])))
            .collect()
    };
    let bounds = Some((
        fold(f32::min, f32::INFINITY),
        fold(f32::max, f32::NEG_INFINITY),
    ));
    let position_bytes = positions.iter().flatten().flat_map(|x| x.to_le_bytes());
    let at = builder.accessor(
        position_bytes,
        positions.len(),
        (ComponentType::F32, Type::Vec3, Target::ArrayBuffer),
        bounds,
    );
    let index_bytes = indices.iter().flat_map(|i| i.to_le_bytes());
    let by = builder.accessor(
        index_bytes,
        indices.len(),
        (ComponentType::U32, Type::Scalar, Target::ElementArrayBuffer),
        None,
    );
    builder.finish(at, by)
}

struct Builder {
    root: Root,
    buffer: Index<json::Buffer>,
    bytes: Vec<u8>,
}

impl Builder {
    fn new(total: usize) -> Self {
        let mut root = Root::default();
        root.asset.generator = Some("hapdef limb".into());
        let buffer = root.push(json::Buffer {
            byte_length: USize64::from(total),
            name: None,
            uri: None,
            extensions: None,
            extras: Void::default(),
        });
        Self {
            root,
            buffer,
            bytes: Vec::with_capacity(total),
        }
    }

    fn accessor(
        &mut self,
        bytes: impl Iterator<Item = u8>,
        count: usize,
        (component, kind, target): (ComponentType, Type, Target),
        bounds: Option<(Vec<f32>, Vec<f32>)>,
    ) -> Index<json::Accessor> {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let view = self.root.push(View {
            buffer: self.buffer,
            byte_length: USize64::from(self.bytes.len() - start),
            byte_offset: Some(USize64::from(start)),
            byte_stride: None,
            name: None,
            target: Some(Valid(target)),
            extensions: None,
            extras: Void::default(),
        });
        let (min, max) = bounds.unzip();
        self.root.push(json::Accessor {
            buffer_view: Some(view),
            byte_offset: Some(USize64(0)),
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(component)),
            type_: Valid(kind),
            min: min.map(json::Value::from),
            max: max.map(json::Value::from),
            name: None,
            normalized: false,
            sparse: None,
            extensions: None,
            extras: Void::default(),
        })
    }

    fn finish(
        mut self,
        positions: Index<json::Accessor>,
        indices: Index<json::Accessor>,
    ) -> Result<Vec<u8>, gltf::Error> {
        let attributes = BTreeMap::from([(Valid(json::mesh::Semantic::Positions), positions)]);
        let mesh = self.root.push(json::Mesh {
            name: None,
            weights: None,
            extensions: None,
            extras: Void::default(),
            primitives: vec![json::mesh::Primitive {
                attributes,
                indices: Some(indices),
                material: None,
                mode: Valid(json::mesh::Mode::Triangles),
                targets: None,
                extensions: None,
                extras: Void::default(),
            }],
        });
        let node = self.root.push(json::Node {
            mesh: Some(mesh),
            ..Default::default()
        });
        let scene = self.root.push(json::Scene {
            name: None,
            nodes: vec![node],
            extensions: None,
            extras: Void::default(),
        });
        self.root.scene = Some(scene);
        let glb = gltf::Glb {
            header: gltf::binary::Header {
                magic: *b"glTF",
                version: 2,
                length: 0,
            },
            json: Cow::Owned(
                json::serialize::to_vec(&self.root).map_err(gltf::Error::Deserialize)?,
            ),
            bin: Some(Cow::Owned(self.bytes)),
        };
        glb.to_vec()
    }
}
