//! PLY, text and binary: vertices (x, y, z) and faces (a list of vertex numbers, of any size).
//!
//! Read here value by value: what the header announces is compared with what there is before anything is laid
//! out, nothing beyond it is passed over, and what is wrong is named by its line or its element.

mod header;
mod values;

use glam::DVec3;

use self::header::{PlyElement, PlyHeader};
use self::values::Values;
use super::soup::Soup;
use super::words::no_surface;
use crate::plain::quote;

/// Reads vertices and faces of a file.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let header = PlyHeader::read(bytes)?;
    let body = &bytes[header.length..];
    header.check_room(body)?;
    let mut soup = Soup::default();
    let mut values = Values::of(body, &header)?;
    let vertices = header.element("vertex").map_or(0, |e| e.count);
    let mut small = 0;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read_vertices(element, &mut values, &mut soup)?,
            "face" => {
                let mut faces = |list: &[f64], into: &mut Vec<[u32; 3]>| {
                    let corners = corners(list, vertices)?;
                    small += usize::from(corners.len() < 3);
                    fan(&corners, into);
                    Ok(())
                };
                read_faces(element, &mut values, &mut soup, &mut faces)?;
            }
            "tristrips" => {
                let mut strips = |list: &[f64], into: &mut Vec<[u32; 3]>| {
                    // A strip ends where a vertex is -1.
                    for strip in list.split(|&v| v == -1.0) {
                        strip_of(&corners(strip, vertices)?, into);
                    }
                    Ok(())
                };
                read_faces(element, &mut values, &mut soup, &mut strips)?;
            }
            _ => {
                pass_over(element, &mut values)?;
                let what = format!("elements {}", quote(&element.name));
                soup.notes.extend(no_surface(element.count, &what));
            }
        }
    }
    values.end()?;
    let what = "faces of fewer than three corners";
    soup.notes.extend(no_surface(small, what));
    Ok(soup)
}

fn read_vertices(element: &PlyElement, values: &mut Values, soup: &mut Soup) -> Result<(), String> {
    let column = |axis: &str| {
        let found = element.properties.iter().position(|p| p.name == axis);
        found.filter(|&k| element.properties[k].count.is_none())
    };
    let (Some(x), Some(y), Some(z)) = (column("x"), column("y"), column("z")) else {
        return Err("the vertices of the PLY file have no x, y and z".into());
    };
    let mut row = vec![0.0; element.properties.len()];
    for index in 0..element.count {
        values.begin(&element.name, index)?;
        for (value, property) in row.iter_mut().zip(&element.properties) {
            match property.count {
                None => *value = values.next(property.scalar)?,
                Some(count) => drop(values.list(count, property.scalar)?),
            }
        }
        let place = DVec3::new(row[x], row[y], row[z]);
        if !place.is_finite() {
            return Err(values.wrong("is not a finite point"));
        }
        soup.positions.push(place);
        values.finish()?;
    }
    Ok(())
}

/// What makes triangles of a list of vertices.
type PlySurface<'a> = &'a mut dyn FnMut(&[f64], &mut Vec<[u32; 3]>) -> Result<(), String>;

/// The triangles of the lists of vertices that each of the elements has.
fn read_faces(
    element: &PlyElement,
    values: &mut Values,
    soup: &mut Soup,
    triangles_of: PlySurface<'_>,
) -> Result<(), String> {
    let corners_of = |name: &str| name == "vertex_indices" || name == "vertex_index";
    let lists = |k: &usize| element.properties[*k].count.is_some();
    let column = (0..element.properties.len())
        .find(|k| corners_of(&element.properties[*k].name) && lists(k))
        .ok_or("the faces of the PLY file have no list of vertex_indices")?;
    for index in 0..element.count {
        values.begin(&element.name, index)?;
        for (k, property) in element.properties.iter().enumerate() {
            let Some(count) = property.count else {
                values.next(property.scalar)?;
                continue;
            };
            let list = values.list(count, property.scalar)?;
            if k == column {
                triangles_of(&list, &mut soup.triangles).map_err(|said| values.wrong(&said))?;
            }
        }
        values.finish()?;
    }
    Ok(())
}

/// Triangles round the first corner.
fn fan(corners: &[u32], into: &mut Vec<[u32; 3]>) {
    if let [first, rest @ ..] = corners {
        into.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
    }
}

/// A triangle for each corner from the third on, every other one turned over. Strips go on through triangles without area.
fn strip_of(corners: &[u32], into: &mut Vec<[u32; 3]>) {
    for (k, corners) in corners.windows(3).enumerate() {
        let [a, b, c] = [corners[0], corners[1], corners[2]];
        if a != b && b != c && c != a {
            into.push(if k % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
    }
}

fn corners(list: &[f64], vertices: usize) -> Result<Vec<u32>, String> {
    list.iter().map(|&v| corner(v, vertices)).collect()
}

fn corner(value: f64, vertices: usize) -> Result<u32, String> {
    if value.fract() == 0.0 && value >= 0.0 && value < (vertices as f64) {
        return Ok(value as u32);
    }
    // Beyond these digits a number of three hundred would fill lines.
    let value = if value.abs() < 1e15 {
        value.to_string()
    } else {
        format!("{value:e}")
    };
    Err(format!(
        "names vertex {value}, and there are {vertices}, from 0"
    ))
}

fn pass_over(element: &PlyElement, values: &mut Values) -> Result<(), String> {
    for index in 0..element.count {
        values.begin(&element.name, index)?;
        for property in &element.properties {
            match property.count {
                None => {
                    values.next(property.scalar)?;
                }
                Some(count) => drop(values.list(count, property.scalar)?),
            }
        }
        values.finish()?;
    }
    Ok(())
}
