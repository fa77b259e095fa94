//! Datasets from elsewhere: NPZ, CSV, and folders of nodal results as Ansys Mechanical exports them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::FileError;
use super::npz;
use crate::dataset::SignalMatrix;
use crate::study::Data;

/// A dataset, and what was left out or assumed, for people.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenData {
    pub data: Data,
    pub notes: Vec<String>,
}

/// Reads a dataset by its ending: `.npz` with `X` (sites × touches), `p_m` (touches × 3) and, where
/// there are some, `site_m` (sites × 3) and `cost` (sites); `.csv` with a row a site; or a folder of
/// exports, one a touch. CSV and folders need `touches`, a CSV with `x_mm,y_mm,z_mm` (and `file` for a
/// folder).
///
/// # Errors
/// [`FileError`] naming the file, the place in it and what to do.
pub fn read(path: &Path, touches: Option<&Path>) -> Result<GivenData, FileError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    let given = if path.is_dir() {
        read_folder(path, needed(path, touches)?)
    } else if ending.eq_ignore_ascii_case("npz") {
        read_npz(path)
    } else if ending.eq_ignore_ascii_case("csv") {
        read_csv(path, needed(path, touches)?)
    } else {
        Err(FileError::broken(
            path,
            "a dataset is an .npz, a .csv, or a folder of exported results",
        ))
    }?;
    check(path, &given.data)?;
    Ok(given)
}

fn needed<'a>(path: &Path, touches: Option<&'a Path>) -> Result<&'a Path, FileError> {
    touches.ok_or_else(|| {
        FileError::broken(
            path,
            "where the touches were is not in it: give --touches T.csv with the columns x_mm,y_mm,z_mm",
        )
    })
}

fn check(path: &Path, data: &Data) -> Result<(), FileError> {
    let broken = |message: String| Err(FileError::broken(path, message));
    let (sites, touches) = (data.x.rows(), data.x.columns());
    if sites == 0 || touches == 0 {
        return broken("there is no signal in it: X needs sites × touches".into());
    }
    if data.targets.len() != touches {
        return broken(format!(
            "X has {touches} touches (columns), but there are {} touch positions: X must be sites × touches",
            data.targets.len()
        ));
    }
    if !data.positions.is_empty() && data.positions.len() != sites {
        return broken(format!(
            "X has {sites} sites (rows), but site_m has {}",
            data.positions.len()
        ));
    }
    if !data.costs.is_empty() && data.costs.len() != sites {
        return broken(format!(
            "X has {sites} sites, but cost has {}",
            data.costs.len()
        ));
    }
    if let Some(at) = data.x.values().iter().position(|v| !v.is_finite()) {
        return broken(format!(
            "the signal of site {} under touch {} is no finite number: take one of them out",
            at / touches,
            at % touches
        ));
    }
    let wild = |p: &[f64; 3]| p.iter().any(|v| !v.is_finite());
    if let Some(at) = data.targets.iter().position(wild) {
        return broken(format!("the position of touch {at} is no finite number"));
    }
    if let Some(at) = data.positions.iter().position(|p| !p.is_finite()) {
        return broken(format!("the position of site {at} is no finite number"));
    }
    Ok(())
}

fn read_npz(path: &Path) -> Result<GivenData, FileError> {
    let (shape, values) = npz::read_numbers(path, "X")?;
    let [_, touches] = shape[..] else {
        return Err(FileError::broken(
            path,
            format!(
                "X has {} dimensions: it must be sites × touches",
                shape.len()
            ),
        ));
    };
    let triples = |name: &str| -> Result<Vec<[f64; 3]>, FileError> {
        let (shape, values) = npz::read_numbers(path, name)?;
        if shape.len() != 2 || shape[1] != 3 {
            return Err(FileError::broken(
                path,
                format!("{name} must have three columns: x, y, z in metres"),
            ));
        }
        Ok(values.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
    };
    let optional = |name: &str| npz::holds(path, name);
    let data = Data {
        x: SignalMatrix::new(touches, values),
        targets: triples("p_m")?
            .into_iter()
            .map(|p| p.map(|v| v * 1e3))
            .collect(),
        positions: if optional("site_m")? {
            triples("site_m")?
                .into_iter()
                .map(DVec3::from_array)
                .collect()
        } else {
            Vec::new()
        },
        costs: if optional("cost")? {
            npz::read_numbers(path, "cost")?.1
        } else {
            Vec::new()
        },
    };
    Ok(GivenData {
        data,
        notes: Vec::new(),
    })
}

/// A table with a header.
struct Table {
    columns: HashMap<String, usize>,
    header: Vec<String>,
    /// With the line each row stands in.
    rows: Vec<(usize, Vec<String>)>,
}

impl Table {
    fn csv(path: &Path) -> Result<Self, FileError> {
        let broken = |e: csv::Error| FileError::broken(path, format!("{e}"));
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_path(path)
            .map_err(broken)?;
        let header: Vec<String> = reader
            .headers()
            .map_err(broken)?
            .iter()
            .map(|h| h.trim_start_matches('\u{feff}').to_owned())
            .collect();
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(broken)?;
            let line = record.position().map_or(0, |p| p.line() as usize);
            rows.push((line, record.iter().map(str::to_owned).collect()));
        }
        Ok(Self {
            columns: header.iter().cloned().zip(0..).collect(),
            header,
            rows,
        })
    }

    fn numbers(&self, path: &Path, column: usize) -> Result<Vec<f64>, FileError> {
        self.rows
            .iter()
            .map(|(line, row)| {
                row.get(column).and_then(|v| v.parse().ok()).ok_or_else(|| {
                    FileError::broken(
                        path,
                        format!(
                            "line {line}: {} is no number",
                            self.header.get(column).map_or("a column", String::as_str)
                        ),
                    )
                })
            })
            .collect()
    }

    fn positions_mm(&self, path: &Path) -> Result<Vec<[f64; 3]>, FileError> {
        let column = |name: &str| {
            let place = self
                .columns
                .get(name)
                .ok_or_else(|| FileError::broken(path, format!("the column {name} is missing")))?;
            self.numbers(path, *place)
        };
        let (x, y, z) = (column("x_mm")?, column("y_mm")?, column("z_mm")?);
        Ok((0..x.len()).map(|i| [x[i], y[i], z[i]]).collect())
    }
}

/// A row a site: `x_mm,y_mm,z_mm`, `dx,dy,dz` and `cost` where there are some, and then a column a touch.
fn read_csv(path: &Path, touches: &Path) -> Result<GivenData, FileError> {
    const KNOWN: [&str; 7] = ["x_mm", "y_mm", "z_mm", "dx", "dy", "dz", "cost"];
    let table = Table::csv(path)?;
    let positions = table.positions_mm(path)?;
    let signals: Vec<usize> = (0..table.header.len())
        .filter(|&c| !KNOWN.contains(&table.header[c].as_str()))
        .collect();
    let mut values = vec![0.0; positions.len() * signals.len()];
    for (k, &column) in signals.iter().enumerate() {
        for (site, v) in table.numbers(path, column)?.into_iter().enumerate() {
            values[site * signals.len() + k] = v;
        }
    }
    let costs = match table.columns.get("cost") {
        Some(&column) => table.numbers(path, column)?,
        None => Vec::new(),
    };
    let data = Data {
        x: SignalMatrix::new(signals.len(), values),
        targets: Table::csv(touches)?.positions_mm(touches)?,
        positions: metres(&positions),
        costs,
    };
    Ok(GivenData {
        data,
        notes: Vec::new(),
    })
}

fn metres(positions: &[[f64; 3]]) -> Vec<DVec3> {
    positions
        .iter()
        .map(|&p| DVec3::from_array(p) * 1e-3)
        .collect()
}

/// A folder of exports of nodal results, one file a touch: in the order of the column `file` of the
/// touches, or of the names of the files (numbers in them count as numbers). Nodes that are not in every
/// file are left out.
fn read_folder(folder: &Path, touches: &Path) -> Result<GivenData, FileError> {
    let table = Table::csv(touches)?;
    let targets = table.positions_mm(touches)?;
    let files: Vec<PathBuf> = match table.columns.get("file") {
        Some(&column) => table
            .rows
            .iter()
            .map(|(_, row)| folder.join(row.get(column).map_or("", String::as_str)))
            .collect(),
        None => exports_in(folder)?,
    };
    if files.len() != targets.len() {
        return Err(FileError::broken(
            folder,
            format!(
                "there are {} exports (.txt, .xls, .csv, .dat) for {} touches: one is needed for each, or a column `file` in the touches",
                files.len(),
                targets.len()
            ),
        ));
    }
    let exports: Result<Vec<Export>, FileError> = files.iter().map(|f| read_export(f)).collect();
    join(folder, &exports?, targets)
}

fn exports_in(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let entries = std::fs::read_dir(folder).map_err(|e| FileError::of(folder, &e))?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| {
            let ending = p.extension().unwrap_or_default().to_string_lossy();
            ["txt", "xls", "csv", "dat"].contains(&ending.to_lowercase().as_str())
        })
        .collect();
    files.sort_by_cached_key(|p| natural(&p.file_name().unwrap_or_default().to_string_lossy()));
    Ok(files)
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

/// One exported result: node numbers, their places (m) and values.
struct Export {
    nodes: Vec<u64>,
    positions: Vec<DVec3>,
    values: Vec<f64>,
}

/// Reads what Ansys Mechanical writes by “Export Text File”: tab-separated, one header line with the unit
/// in parentheses (“X Location (mm)”), decimal points or commas, in UTF-8, UTF-16 or an older encoding.
fn read_export(path: &Path) -> Result<Export, FileError> {
    let bytes = std::fs::read(path).map_err(|e| FileError::of(path, &e))?;
    let text = decode(&bytes);
    let mut lines = text
        .lines()
        .zip(1..)
        .map(|(line, number)| (number, line.trim_end_matches(['\t', ' ', '\r'])))
        .filter(|(_, line)| !line.is_empty());
    let broken = |message: String| FileError::broken(path, message);
    let (_, header) = lines
        .next()
        .ok_or_else(|| broken("the file is empty".into()))?;
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
        return Err(broken(format!(
            "the first line has no columns “X Location (mm)”, … but “{header}”: export with “Include Node Location” switched on"
        )));
    };
    let value = z + 1;
    if labels.len() != value + 1 {
        return Err(broken(format!(
            "{} columns of results: export one scalar result (a total, or one direction)",
            labels.len().saturating_sub(value)
        )));
    }
    let unit = length_unit(labels[x])
        .ok_or_else(|| broken(format!("the unit of “{}” is not known", labels[x])))?;
    let rows: Vec<(usize, Vec<&str>)> = lines.map(|(n, l)| (n, l.split('\t').collect())).collect();
    let has = |c: char| rows.iter().any(|(_, r)| r.iter().any(|v| v.contains(c)));
    let comma = match (has(','), has('.')) {
        (true, true) => {
            return Err(broken(
                "numbers have decimal points and commas: export again with one of them".into(),
            ));
        }
        (comma, _) => comma,
    };
    let mut export = Export {
        nodes: Vec::new(),
        positions: Vec::new(),
        values: Vec::new(),
    };
    for (line, row) in rows {
        let number = |column: usize| -> Result<f64, FileError> {
            let cell = row.get(column).map_or("", |c| c.trim());
            let cell = if comma {
                cell.replace(',', ".")
            } else {
                cell.to_owned()
            };
            cell.parse()
                .map_err(|_| broken(format!("line {line}: “{cell}” is no number")))
        };
        export.nodes.push(number(0)? as u64);
        export
            .positions
            .push(DVec3::new(number(x)?, number(y)?, number(z)?) * unit);
        export.values.push(number(value)?);
    }
    Ok(export)
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

/// Metres in the unit that stands in the last parentheses of a label.
fn length_unit(label: &str) -> Option<f64> {
    let unit = label.rsplit_once('(')?.1.trim_end_matches([')', ' ']);
    Some(match unit {
        "m" => 1.0,
        "cm" => 1e-2,
        "mm" => 1e-3,
        "µm" | "μm" | "um" => 1e-6,
        "in" => 0.0254,
        "ft" => 0.3048,
        _ => return None,
    })
}

fn join(folder: &Path, exports: &[Export], targets: Vec<[f64; 3]>) -> Result<GivenData, FileError> {
    let Some(first) = exports.first() else {
        return Err(FileError::broken(folder, "there are no exports in it"));
    };
    let mut seen: HashMap<u64, usize> = HashMap::new();
    for export in exports {
        let mut own: Vec<u64> = export.nodes.clone();
        own.sort_unstable();
        own.dedup();
        if own.len() < export.nodes.len() {
            return Err(FileError::broken(
                folder,
                "a node stands more than once in an export (shells list top and bottom): export one face",
            ));
        }
        for node in own {
            *seen.entry(node).or_default() += 1;
        }
    }
    let kept: Vec<usize> = (0..first.nodes.len())
        .filter(|&i| seen[&first.nodes[i]] == exports.len())
        .collect();
    let touches = exports.len();
    let mut values = vec![0.0; kept.len() * touches];
    for (t, export) in exports.iter().enumerate() {
        let of: HashMap<u64, f64> = (export.nodes.iter().copied())
            .zip(export.values.iter().copied())
            .collect();
        for (s, &i) in kept.iter().enumerate() {
            values[s * touches + t] = of[&first.nodes[i]];
        }
    }
    let dropped = seen.len() - kept.len();
    let data = Data {
        x: SignalMatrix::new(touches, values),
        targets,
        positions: kept.iter().map(|&i| first.positions[i]).collect(),
        costs: Vec::new(),
    };
    Ok(GivenData {
        data,
        notes: (dropped > 0)
            .then(|| format!("{dropped} nodes are not in every export and were left out."))
            .into_iter()
            .collect(),
    })
}

#[cfg(test)]
mod tests {
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
    fn a_csv_has_a_row_a_site_and_a_column_a_touch() {
        let folder = folder(&[
            (
                "d.csv",
                b"x_mm,y_mm,z_mm,cost,t0,t1\n1,0,0,2,0.5,0.25\n0,1,0,3,1,2\n",
            ),
            ("t.csv", b"x_mm,y_mm,z_mm\n0,0,0\n1,1,1\n"),
        ]);
        let GivenData { data, .. } = read(
            &folder.path().join("d.csv"),
            Some(&folder.path().join("t.csv")),
        )
        .unwrap();
        assert_eq!(data.x.values(), [0.5, 0.25, 1.0, 2.0]);
        assert_eq!(data.costs, [2.0, 3.0]);
        let alone = read(&folder.path().join("d.csv"), None).unwrap_err();
        assert!(alone.to_string().contains("--touches"));
    }

    #[test]
    fn names_sort_by_their_numbers() {
        let mut names = ["b2", "a10", "a9", "a", "b"];
        names.sort_by_cached_key(|n| natural(n));
        assert_eq!(names, ["a", "a9", "a10", "b", "b2"]);
    }
}
