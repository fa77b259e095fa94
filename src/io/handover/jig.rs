//! The jig's files: `jig/*.stl` to print, and `jig/jig.csv`, a row a piece in the order of assembly.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DMat3, DVec3};

use crate::io::table::Writing;
use crate::jig::{Jig, PrintedPart, Stack, parts};
use crate::mesh::Facets;

/// The folder of a jig in that of a design.
pub const FOLDER: &str = "jig";
/// What every piece's name begins with.
const KINDS: [&str; 5] = ["rod-", "seat-", "ring-", "pad-", "sleeve-"];

/// Whether a file of a jig's folder is one that was written with some jig.
#[must_use]
pub fn is_of_a_jig(name: &str) -> bool {
    let is_stl = Path::new(name).extension().is_some_and(|e| e == "stl");
    let piece = KINDS.iter().any(|kind| name.starts_with(kind)) && is_stl;
    piece || name == "jig.csv"
}

/// All files with their names; none where no gauge is reached.
#[must_use]
pub fn files(jig: &Jig) -> Vec<(String, Vec<u8>)> {
    if jig.stacks.is_empty() {
        return Vec::new();
    }
    let made: Vec<(&Stack, Vec<PrintedPart>)> =
        jig.stacks.iter().map(|s| (s, parts(jig, s))).collect();
    let pieces = made.iter().flat_map(|(_, parts)| parts);
    let mut files: Vec<(String, Vec<u8>)> = pieces
        .map(|part| {
            let name = format!("{FOLDER}/{}.stl", part.name);
            (
                name,
                stl(&part.name, &on_the_bed(&part.solid, &part.print_turn)),
            )
        })
        .collect();
    files.push((format!("{FOLDER}/jig.csv"), table(jig, &made).into_bytes()));
    files
}

/// A row a piece, in the order in which they are put onto their rod.
fn table(jig: &Jig, made: &[(&Stack, Vec<PrintedPart>)]) -> String {
    let mut table = Writing::new([
        "step",
        "file",
        "stack",
        "entry",
        "gauge",
        "height_mm",
        "angle_deg",
        "travel_mm",
    ]);
    let mut step = 0;
    for (stack, parts) in made {
        for part in parts {
            step += 1;
            let number = part
                .name
                .strip_prefix("ring-")
                .or_else(|| part.name.strip_prefix("pad-"));
            let arm = stack
                .arms
                .iter()
                .find(|arm| number == Some(&format!("{:02}", arm.number)));
            let mut row = vec![
                step.to_string(),
                format!("{}.stl", part.name),
                stack.letter.clone(),
                stack.entry.name().to_owned(),
            ];
            match arm {
                Some(arm) => row.extend([
                    arm.number.to_string(),
                    format!("{:.2}", arm.pad.height),
                    format!("{:.2}", arm.angle.to_degrees()),
                    format!("{:.2}", arm.travel),
                ]),
                None => row.extend(std::iter::repeat_n(String::new(), 4)),
            }
            table.row(row);
        }
    }
    for left in &jig.left_out {
        step += 1;
        let mut row = vec![step.to_string(), format!("by hand: {}", left.why.words())];
        row.extend([String::new(), String::new(), left.number.to_string()]);
        row.extend(std::iter::repeat_n(String::new(), 3));
        table.row(row);
    }
    table.text().clone()
}

/// As it lies on the printer's bed, its middle over the origin.
fn on_the_bed(solid: &Facets, turn: &DMat3) -> Facets {
    let turned: Vec<DVec3> = solid.positions.iter().map(|&p| *turn * p).collect();
    let low = turned.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = turned.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let off = ((low + high) / 2.0).with_z(low.z);
    Facets {
        positions: turned.into_iter().map(|p| p - off).collect(),
        triangles: solid.triangles.clone(),
    }
}

/// A binary STL.
fn stl(name: &str, solid: &Facets) -> Vec<u8> {
    const HEADER: usize = 80;
    let mut head = String::from("HapDef, mm: ");
    let _ = write!(head, "{name}");
    let mut bytes = head.into_bytes();
    bytes.resize(HEADER, b' ');
    bytes.extend((solid.triangles.len() as u32).to_le_bytes());
    for triangle in &solid.triangles {
        let [a, b, c] = triangle.map(|v| solid.positions[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for v in [normal, a, b, c] {
            bytes.extend(
                v.to_array()
                    .into_iter()
                    .flat_map(|x| (x as f32).to_le_bytes()),
            );
        }
        bytes.extend([0; 2]);
    }
    bytes
}
