//! PLY, text and binary: vertices (x, y, z) and faces (a list of vertex numbers, of any size).

use std::io::Cursor;

use glam::DVec3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

use super::Soup;

/// Any element: what a mesh needs of it.
#[derive(Default)]
struct Element {
    position: [Option<f64>; 3],
    corners: Vec<u32>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = ["x", "y", "z"].iter().position(|&a| a == name);
        match (axis, name) {
            (Some(axis), _) => self.position[axis] = number(&property),
            (None, "vertex_indices" | "vertex_index") => match property.to_u32_list() {
                Some(corners) => self.corners = corners,
                None => return PropertyAccessResult::UnsupportedType,
            },
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn number(property: &Property) -> Option<f64> {
    match *property {
        Property::Double(v) => Some(v),
        Property::Float(v) => Some(v.into()),
        Property::Char(v) => Some(v.into()),
        Property::UChar(v) => Some(v.into()),
        Property::Short(v) => Some(v.into()),
        Property::UShort(v) => Some(v.into()),
        Property::Int(v) => Some(v.into()),
        Property::UInt(v) => Some(v.into()),
        _ => None,
    }
}

/// Every element takes at least a byte; a header that announces more is not believed.
fn check_counts(bytes: &[u8]) -> Result<(), String> {
    let header = Parser::<Element>::new()
        .read_ply_header(&mut Cursor::new(bytes))
        .map_err(|e| format!("not a readable PLY file ({e})"))?;
    let too_many = |count: usize| count > bytes.len();
    match header.elements.values().find(|e| too_many(e.count)) {
        Some(element) => Err(format!(
            "the PLY file is truncated: it announces {} of \"{}\"",
            element.count, element.name
        )),
        None => Ok(()),
    }
}

pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    check_counts(bytes)?;
    let ply = Parser::<Element>::new()
        .read_ply(&mut Cursor::new(bytes))
        .map_err(|e| format!("not a readable PLY file ({e})"))?;
    let element = |name: &str| ply.payload.get(name).map_or(&[][..], Vec::as_slice);
    let mut soup = Soup::default();
    for vertex in element("vertex") {
        let [Some(x), Some(y), Some(z)] = vertex.position else {
            return Err("the vertices of the PLY file have no x, y and z".into());
        };
        soup.positions.push(DVec3::new(x, y, z));
    }
    for face in element("face") {
        // A polygon as a fan round its first corner.
        for pair in face.corners.get(1..).unwrap_or_default().windows(2) {
            soup.triangles.push([face.corners[0], pair[0], pair[1]]);
        }
    }
    Ok(soup)
}
