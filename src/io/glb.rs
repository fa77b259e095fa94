//! Binary glTF: the bundled limb is written with this, and scenes for colleagues.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3};
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Target, View};
use gltf::json::extras::Void;
use gltf::json::mesh::Semantic;
use gltf::json::validation::{Checked::Valid, USize64};
use gltf::json::{self, Index, Root};

use crate::mesh::TriMesh;
use crate::mesh::stance::Stance;

/// A GLB file with one mesh; positions in metres as glTF asks, kept to f32 as it stores them.
///
/// # Errors
/// Only what serialization itself reports.
pub fn write_glb(mesh: &TriMesh) -> Result<Vec<u8>, gltf::Error> {
    let mut builder = Builder::new();
    let primitive = builder.primitive(mesh.positions(), mesh.triangles(), None);
    let node = builder.node(None, primitive);
    builder.finish(vec![node])
}

/// A piece of a scene.
#[derive(Clone, Debug)]
pub struct ScenePiece {
    pub name: String,
    /// m.
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Red, green, blue of each vertex, as a screen shows them.
    pub colours: Vec<[u8; 3]>,
}

/// A GLB file with named pieces, coloured by vertex and seen from both sides; a node above them turns the part's axis up and
/// its front to the viewer.
///
/// # Errors
/// Only what serialization itself reports.
pub fn write_scene(
    pieces: &[ScenePiece],
    stance: Stance,
    by: String,
) -> Result<Vec<u8>, gltf::Error> {
    let mut builder = Builder::new();
    builder.root.asset.generator = Some(by);
    let material = builder.matt();
    let nodes: Vec<Index<json::Node>> = (pieces.iter())
        .map(|piece| {
            let colours = Some((&piece.colours[..], material));
            let primitive = builder.primitive(&piece.positions, &piece.triangles, colours);
            builder.node(Some(piece.name.clone()), primitive)
        })
        .collect();
    // glTF's up is y, and its front is z.
    let axes = DMat3::from_cols(stance.right(), stance.up(), stance.front()).transpose();
    let turn = DQuat::from_mat3(&axes).as_quat();
    let root = builder.root.push(json::Node {
        children: Some(nodes),
        rotation: Some(json::scene::UnitQuaternion(turn.to_array())),
        name: Some("limb and gauges".into()),
        ..Default::default()
    });
    builder.finish(vec![root])
}

struct Builder {
    root: Root,
    buffer: Index<json::Buffer>,
    bytes: Vec<u8>,
}

impl Builder {
    fn new() -> Self {
        let mut root = Root::default();
        root.asset.generator = Some("hapdef limb".into());
        let buffer = root.push(json::Buffer {
            byte_length: USize64(0),
            name: None,
            uri: None,
            extensions: None,
            extras: Void::default(),
        });
        Self {
            root,
            buffer,
            bytes: Vec::new(),
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

    /// Positions, colours and triangles as they are stored.
    fn primitive(
        &mut self,
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        colours: Option<(&[[u8; 3]], Index<json::Material>)>,
    ) -> json::mesh::Primitive {
        let stored: Vec<[f32; 3]> = positions.iter().map(|p| p.as_vec3().to_array()).collect();
        let fold = |pick: fn(f32, f32) -> f32, start: f32| -> Vec<f32> {
            (0..3)
                .map(|k| stored.iter().fold(start, |m, p| pick(m, p[k])))
                .collect()
        };
        let bounds = (
            fold(f32::min, f32::INFINITY),
            fold(f32::max, f32::NEG_INFINITY),
        );
        let at = self.accessor(
            stored.iter().flatten().flat_map(|x| x.to_le_bytes()),
            stored.len(),
            (ComponentType::F32, Type::Vec3, Target::ArrayBuffer),
            Some(bounds),
        );
        let mut attributes = BTreeMap::from([(Valid(Semantic::Positions), at)]);
        if let Some((colours, _)) = colours {
            // Stored as light, which viewers make a screen's values of again.
            let light = colours
                .iter()
                .flat_map(|c| c.map(linear))
                .flat_map(f32::to_le_bytes);
            let kind = (ComponentType::F32, Type::Vec3, Target::ArrayBuffer);
            let colour = self.accessor(light, colours.len(), kind, None);
            attributes.insert(Valid(Semantic::Colors(0)), colour);
        }
        let indices: Vec<u32> = triangles.iter().flatten().copied().collect();
        let by = self.accessor(
            indices.iter().flat_map(|i| i.to_le_bytes()),
            indices.len(),
            (ComponentType::U32, Type::Scalar, Target::ElementArrayBuffer),
            None,
        );
        json::mesh::Primitive {
            attributes,
            indices: Some(by),
            material: colours.map(|(_, material)| material),
            mode: Valid(json::mesh::Mode::Triangles),
            targets: None,
            extensions: None,
            extras: Void::default(),
        }
    }

    /// A material without shine.
    fn matt(&mut self) -> Index<json::Material> {
        let surface = json::material::PbrMetallicRoughness {
            metallic_factor: json::material::StrengthFactor(0.0),
            roughness_factor: json::material::StrengthFactor(0.8),
            ..Default::default()
        };
        self.root.push(json::Material {
            pbr_metallic_roughness: surface,
            double_sided: true,
            ..Default::default()
        })
    }

    fn node(
        &mut self,
        name: Option<String>,
        primitive: json::mesh::Primitive,
    ) -> Index<json::Node> {
        let mesh = self.root.push(json::Mesh {
            name: name.clone(),
            weights: None,
            extensions: None,
            extras: Void::default(),
            primitives: vec![primitive],
        });
        self.root.push(json::Node {
            mesh: Some(mesh),
            name,
            ..Default::default()
        })
    }

    fn finish(mut self, nodes: Vec<Index<json::Node>>) -> Result<Vec<u8>, gltf::Error> {
        let scene = self.root.push(json::Scene {
            name: None,
            nodes,
            extensions: None,
            extras: Void::default(),
        });
        self.root.scene = Some(scene);
        self.root.buffers[self.buffer.value()].byte_length = USize64::from(self.bytes.len());
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

/// What light a screen makes of a value (IEC 61966-2-1).
fn linear(value: u8) -> f32 {
    let v = f32::from(value) / 255.0;
    if v <= 0.040_45 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}
