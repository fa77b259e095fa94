//! STL, text and binary.

use std::io::Cursor;

use glam::Vec3;

use super::Soup;

pub fn read(bytes: &[u8]) -> Result<Soup, String> {
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
    Ok(Soup {
        positions,
        triangles,
        ..Soup::default()
    })
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
    Soup {
        positions,
        triangles,
        ..Soup::default()
    }
}
