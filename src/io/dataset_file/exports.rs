//! Folders of nodal results, one file a touch, as Ansys Mechanical writes them by “Export Text File”.

use std::collections::{HashMap, HashSet};
use std::path::{Component, Path, PathBuf};

use glam::DVec3;

use super::found::{FoundDataset, FoundTouches};
use super::plausible::{FileOrigin, longest_side};
use crate::io::{FileError, source};
use crate::memory;
use crate::plain::{self, length, quote};

/// Text may become so many times as large in memory while it is taken apart.
const GROWTH: f64 = 16.0;
/// Nodes of one number that lie farther apart than this share of the part are of different meshes.
const MOVED: f64 = 1e-3;
/// Node numbers are whole, and exact as floats up to here.
const MOST_NODES: f64 = 9.007e15;

/// Reads a folder of exports: in the order of the column `file` of the touches, or of the names of the files
/// (numbers in them count as numbers). Nodes that are not in every file are left out.
///
/// # Errors
/// [`FileError`] naming the file, the line and what to do.
pub(super) fn read(folder: &Path, touches: FoundTouches) -> Result<FoundDataset, FileError> {
    let files = match &touches.files {
        Some(names) => named(folder, &touches, names)?,
        None => in_folder(folder)?,
    };
    if files.len() != touches.mm.len() {
        return Err(FileError::broken(
            folder,
            format!(
                "there are {} exports (.txt, .xls, .csv, .dat) for {} touches: one is needed for each, or a column `file` in the touches",
                files.len(),
                touches.mm.len()
            ),
        ));
    }
    check_room(folder, &files)?;
    let exports: Result<Vec<Export>, FileError> = files.iter().map(|f| Export::read(f)).collect();
    join(folder, &exports?, touches)
}

/// The files that the touches name, each in the folder itself and each once.
fn named(
    folder: &Path,
    touches: &FoundTouches,
    names: &[String],
) -> Result<Vec<PathBuf>, FileError> {
    let mut seen = HashSet::new();
    for (number, name) in names.iter().enumerate() {
        let mut parts = Path::new(name).components();
        let inside = matches!(parts.next(), Some(Component::Normal(_))) && parts.next().is_none();
        let wrong = match (inside, seen.insert(name)) {
            (true, true) => continue,
            (true, false) => "stands twice: each touch has a file of its own",
            (false, _) => "is no name of a file in the folder",
        };
        let what = format!("the file of touch {number}, {}, {wrong}", quote(name));
        return Err(FileError::broken(touches.origin.path(), what));
    }
    Ok(names.iter().map(|name| folder.join(name)).collect())
}

fn in_folder(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let failed = |e: std::io::Error| FileError::of(folder, &e);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        if ["txt", "xls", "csv", "dat"].contains(&ending.to_lowercase().as_str()) {
            files.push(path);
        }
    }
    files.sort_by_cached_key(|p| natural(&p.file_name().unwrap_or_default().to_string_lossy()));
    Ok(files)
}

/// Each file may be small enough and all together too large.
fn check_room(folder: &Path, files: &[PathBuf]) -> Result<(), FileError> {
    let mut bytes = 0.0;
    for file in files {
        bytes += source::ordinary(file)?.len() as f64;
    }
    if bytes * GROWTH <= memory::allowed() {
        return Ok(());
    }
    Err(FileError::broken(
        folder,
        format!(
            "the exports have {} together, and at most {} are read with {} of memory. Give fewer, or allow more with --memory-gb",
            plain::needed(bytes),
            plain::allowed(memory::allowed() / GROWTH),
            plain::allowed(memory::allowed())
        ),
    ))
}

/// A name cut into text and numbers, so that `touch 10` comes after `touch 9`.
fn natural(name: &str) -> Vec<(String, u64)> {
    let mut parts = Vec::new();
    let (mut text, mut digits) = (String::new(), String::new());
    for c in name.chars() {
        if c.is_ascii_digit() {
            digits.push(c);
        } else {
            if !digits.is_empty() {
                parts.push((
                    std::mem::take(&mut text),
                    digits.parse().unwrap_or(u64::MAX),
                ));
                digits.clear();
            }
            text.push(c);
        }
    }
    parts.push((text, digits.parse().unwrap_or(0)));
    parts
}

/// One exported result.
struct Export {
    path: PathBuf,
    nodes: Vec<u64>,
    /// m.
    positions: Vec<DVec3>,
    values: Vec<f64>,
    /// Of the values, as the file says it.
    unit: String,
}

impl Export {
    /// Reads one file: tab-separated, one header line with the unit in parentheses (“X Location (mm)”), decimal
    /// points or commas, in UTF-8, UTF-16 or an older encoding.
    fn read(path: &Path) -> Result<Self, FileError> {
        let text = decode(&source::read(path)?);
        let mut rows = text
            .lines()
            .zip(1..)
            .map(|(line, number)| (number, line.trim_end_matches(['\t', ' '])))
            .filter(|(_, line)| !line.is_empty());
        let broken = |what: String| FileError::broken(path, what);
        let (_, header) = rows
            .next()
            .ok_or_else(|| broken("the file is empty".into()))?;
        let mut columns = ExportColumns::of(header).map_err(broken)?;
        let has = |mark: char| rows.clone().any(|(_, row)| row.contains(mark));
        columns.comma = has(',');
        if columns.comma && has('.') {
            return Err(broken(
                "numbers have decimal points and commas: export again with one of them".into(),
            ));
        }
        let mut export = Self {
            path: path.to_owned(),
            nodes: Vec::new(),
            positions: Vec::new(),
            values: Vec::new(),
            unit: columns.unit.clone(),
        };
        for (line, row) in rows {
            let taken = columns.take(row, &mut export);
            taken.map_err(|what| broken(format!("line {line}: {what}")))?;
        }
        Ok(export)
    }
}

/// Which column of an export is what; node numbers come first, the value last.
struct ExportColumns {
    axes: [usize; 3],
    value: usize,
    /// Metres to the unit of the places.
    metres: f64,
    /// Of the values, as the file says it.
    unit: String,
    /// Whether decimals stand behind a comma.
    comma: bool,
}

impl ExportColumns {
    fn of(header: &str) -> Result<Self, String> {
        let labels: Vec<&str> = header.split('\t').map(str::trim).collect();
        let place = |axis: &str| {
            labels.iter().position(|l| {
                let l = l.to_lowercase();
                l.starts_with(&format!("{axis} location"))
                    || l.starts_with(&format!("{axis}-position"))
                    || l.starts_with(&format!("{axis} position"))
            })
        };
        let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(place) else {
            return Err(format!(
                "the first line has no columns “X Location (mm)”, … but {}: export with “Include Node Location” switched on",
                quote(header)
            ));
        };
        let value = z + 1;
        if labels.len() != value + 1 {
            return Err(format!(
                "{} columns of results: export one scalar result (a total, or one direction)",
                labels.len().saturating_sub(value)
            ));
        }
        let metres = length_unit(labels[x])
            .ok_or_else(|| format!("the unit of {} is not known", quote(labels[x])))?;
        Ok(Self {
            axes: [x, y, z],
            value,
            metres,
            unit: unit_of(labels[value]).unwrap_or_default().to_owned(),
            comma: false,
        })
    }

    /// Takes one row into an export.
    fn take(&self, row: &str, export: &mut Export) -> Result<(), String> {
        let cells: Vec<&str> = row.split('\t').map(str::trim).collect();
        let wanted = self.value + 1;
        if cells.len() != wanted {
            return Err(format!(
                "there are {} values for the {wanted} columns of the first line",
                cells.len()
            ));
        }
        let number = |column: usize| -> Result<f64, String> {
            let cell = cells[column];
            let parsed = if self.comma {
                cell.replace(',', ".").parse::<f64>()
            } else {
                cell.parse()
            };
            let finite = parsed.ok().filter(|x| x.is_finite());
            finite.ok_or_else(|| format!("{} is no number", quote(cell)))
        };
        let node = number(0)?;
        if node.fract() != 0.0 || !(0.0..=MOST_NODES).contains(&node) {
            return Err(format!("{} is no number of a node", quote(cells[0])));
        }
        let [x, y, z] = self.axes;
        export.nodes.push(node as u64);
        export
            .positions
            .push(DVec3::new(number(x)?, number(y)?, number(z)?) * self.metres);
        export.values.push(number(self.value)?);
        Ok(())
    }
}

fn decode(bytes: &[u8]) -> String {
    let wide = |rest: &[u8], little: bool| {
        let units: Vec<u16> = rest
            .chunks_exact(2)
            .map(|c| {
                if little {
                    u16::from_le_bytes([c[0], c[1]])
                } else {
                    u16::from_be_bytes([c[0], c[1]])
                }
            })
            .collect();
        String::from_utf16_lossy(&units)
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => wide(rest, true),
        [0xfe, 0xff, rest @ ..] => wide(rest, false),
        [0xef, 0xbb, 0xbf, rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        _ => match std::str::from_utf8(bytes) {
            Ok(text) => text.to_owned(),
            // Older encodings share their first 256 characters with Unicode, near enough for labels.
            Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
        },
    }
}

/// The unit in the last parentheses of a label.
fn unit_of(label: &str) -> Option<&str> {
    Some(label.rsplit_once('(')?.1.trim_end_matches([')', ' ']))
}

/// Metres in the unit of a label.
fn length_unit(label: &str) -> Option<f64> {
    Some(match unit_of(label)? {
        "m" => 1.0,
        "cm" => 1e-2,
        "mm" => 1e-3,
        "µm" | "μm" | "um" => 1e-6,
        "in" => 0.0254,
        "ft" => 0.3048,
        _ => return None,
    })
}

/// One row a node that stands in every export, one column an export.
fn join(
    folder: &Path,
    exports: &[Export],
    touches: FoundTouches,
) -> Result<FoundDataset, FileError> {
    let Some(first) = exports.first() else {
        return Err(FileError::broken(folder, "there are no exports in it"));
    };
    let rows: Result<Vec<HashMap<u64, usize>>, FileError> =
        exports.iter().map(|e| e.rows(first)).collect();
    let rows = rows?;
    let kept: Vec<usize> = (0..first.nodes.len())
        .filter(|&k| rows.iter().all(|r| r.contains_key(&first.nodes[k])))
        .collect();
    if kept.is_empty() {
        return Err(FileError::broken(
            folder,
            "no node stands in every export: they are of different meshes, or empty",
        ));
    }
    let all: HashSet<u64> = exports
        .iter()
        .flat_map(|e| e.nodes.iter().copied())
        .collect();
    let dropped = all.len() - kept.len();
    let nodes: Vec<u64> = kept.iter().map(|&k| first.nodes[k]).collect();
    let values = nodes
        .iter()
        .flat_map(|node| (exports.iter().zip(&rows)).map(move |(e, of)| e.values[of[node]]))
        .collect();
    Ok(FoundDataset {
        values,
        targets: touches.mm,
        positions: kept.iter().map(|&k| first.positions[k]).collect(),
        costs: Vec::new(),
        forces: touches.forces,
        touches: touches.origin,
        sites: FileOrigin::nodes(folder, "sites", nodes),
        notes: (dropped > 0)
            .then(|| format!("{dropped} nodes are not in every export and were left out."))
            .into_iter()
            .collect(),
    })
}

impl Export {
    /// The row of each node, where this export is one of the same mesh and unit as the first.
    fn rows(&self, first: &Self) -> Result<HashMap<u64, usize>, FileError> {
        let broken = |what: String| Err(FileError::broken(&self.path, what));
        if self.unit != first.unit {
            return broken(format!(
                "its values are in {}, and those of the first export in {}: export all in one unit",
                quote(&self.unit),
                quote(&first.unit)
            ));
        }
        let mut rows = HashMap::with_capacity(self.nodes.len());
        for (row, &node) in self.nodes.iter().enumerate() {
            if rows.insert(node, row).is_some() {
                return broken(format!(
                    "node {node} stands more than once in it (shells list top and bottom): export one face"
                ));
            }
        }
        let moved = MOVED * longest_side(&first.positions);
        for (node, place) in first.nodes.iter().zip(&first.positions) {
            let Some(&row) = rows.get(node) else { continue };
            let apart = (self.positions[row] - *place).abs().max_element();
            if apart > moved {
                return broken(format!(
                    "node {node} lies {} from where it lies in the first export: they are of different meshes",
                    length(apart)
                ));
            }
        }
        Ok(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{GivenData, read};
    use super::*;

    fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in files {
            std::fs::write(folder.path().join(name), bytes).unwrap();
        }
        folder
    }

    const HEADER: &str =
        "Node Number\tX Location (mm)\tY Location (mm)\tZ Location (mm)\tTotal Deformation (m)\r\n";

    #[test]
    fn exports_are_joined_by_their_nodes() {
        let one = format!("{HEADER}7\t1.\t2.5\t-3.e+000\t5.e-003\r\n9\t0.\t0.\t1.\t2.\r\n");
        // Decimal commas, other order, a node more, UTF-16.
        let two: Vec<u8> = [0xff, 0xfe]
            .into_iter()
            .chain(
                format!("{HEADER}9\t0,\t0,\t1,\t4,5\t\r\n11\t1,\t1,\t1,\t1,\r\n7\t1,\t2,5\t-3,\t6,e-003\r\n")
                    .encode_utf16()
                    .flat_map(u16::to_le_bytes),
            )
            .collect();
        let folder = folder(&[("t 2.txt", &one.clone().into_bytes()), ("t 10.txt", &two)]);
        let touches = folder.path().join("where").with_extension("touches");
        std::fs::write(&touches, "x_mm,y_mm,z_mm\n1,2,3\n4,5,6\n").unwrap();
        let GivenData { data, notes } = read(folder.path(), Some(&touches)).unwrap();
        assert_eq!(data.x.values(), [5e-3, 6e-3, 2.0, 4.5]);
        assert_eq!(data.targets, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert!((data.positions[0] - DVec3::new(1e-3, 2.5e-3, -3e-3)).length() < 1e-15);
        assert!(notes[0].contains("1 nodes"));
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let cases: [(&str, &str); 5] = [
            (
                "Node Number\tTotal Deformation (m)\n1\t2\n",
                "Include Node Location",
            ),
            (&format!("{HEADER}1\t2\t3\t4\tx\n"), "line 2"),
            (&format!("{HEADER}1\t2,5\t3.5\t4\t1\n"), "points and commas"),
            (&HEADER.replace("(mm)", "(furlong)"), "unit"),
            (
                &format!("{HEADER}1\t2\t3\t4\t1\n1\t2\t3\t4\t1\n"),
                "more than once",
            ),
        ];
        for (text, expected) in cases {
            let folder = folder(&[("a.txt", text.as_bytes())]);
            let touches = folder.path().join("where").with_extension("touches");
            std::fs::write(&touches, "x_mm,y_mm,z_mm\n1,2,3\n").unwrap();
            let said = read(folder.path(), Some(&touches)).unwrap_err().to_string();
            assert!(said.contains(expected), "{said}");
        }
    }

    #[test]
    fn names_sort_by_their_numbers() {
        let mut names = ["b2", "a10", "a9", "a", "b"];
        names.sort_by_cached_key(|n| natural(n));
        assert_eq!(names, ["a", "a9", "a10", "b", "b2"]);
    }
}
