//! Given touches and sites, and the answers to them, as CSV with the units in the column names.

use std::collections::HashMap;
use std::io::Write as _;
use std::path::Path;

use glam::DVec3;

use super::npz::NpzFile;
use super::{FileError, atomic};
use crate::elasticity::Touch;
use crate::given::{Answer, GivenSite};

const TOUCHES: [&str; 8] = [
    "x_mm",
    "y_mm",
    "z_mm",
    "nx",
    "ny",
    "nz",
    "force_n",
    "tip_radius_mm",
];
const SITES: [&str; 6] = ["x_mm", "y_mm", "z_mm", "dx", "dy", "dz"];

/// Reads touches: `x_mm,y_mm,z_mm,nx,ny,nz,force_n,tip_radius_mm`, n being the outward normal.
///
/// # Errors
/// [`FileError`] naming the file, the line and the column.
pub fn read_touches(path: &Path) -> Result<Vec<Touch>, FileError> {
    let table = read(path, &TOUCHES)?;
    table
        .into_iter()
        .map(|(line, v)| {
            let normal = DVec3::new(v[3], v[4], v[5]);
            let wrong = |what: &str| Err(FileError::broken(path, format!("line {line}: {what}")));
            if normal.length() < 1e-9 {
                return wrong("nx, ny, nz is no direction: give the outward unit normal");
            }
            if v[6] <= 0.0 {
                return wrong("force_n must be above zero: it presses along -n");
            }
            if v[7] <= 0.0 {
                return wrong("tip_radius_mm must be above zero");
            }
            Ok(Touch {
                position: DVec3::new(v[0], v[1], v[2]) * 1e-3,
                normal: normal.normalize(),
                force: v[6],
                tip_radius: v[7] * 1e-3,
            })
        })
        .collect()
}

/// Reads gauges: `x_mm,y_mm,z_mm,dx,dy,dz`, d being the direction the gauge measures along. Further
/// columns are ignored.
///
/// # Errors
/// [`FileError`] naming the file, the line and the column.
pub fn read_sites(path: &Path) -> Result<Vec<GivenSite>, FileError> {
    let table = read(path, &SITES)?;
    table
        .into_iter()
        .map(|(line, v)| {
            let direction = DVec3::new(v[3], v[4], v[5]);
            if direction.length() < 1e-9 {
                return Err(FileError::broken(
                    path,
                    format!("line {line}: dx, dy, dz is no direction"),
                ));
            }
            Ok(GivenSite {
                position: DVec3::new(v[0], v[1], v[2]) * 1e-3,
                direction: direction.normalize(),
            })
        })
        .collect()
}

/// The columns asked for of every row, with the row's line; columns may come in any order.
fn read<const N: usize>(path: &Path, names: &[&str; N]) -> Result<Vec<(u64, [f64; N])>, FileError> {
    let bytes = std::fs::read(path).map_err(|e| FileError::of(path, &e))?;
    let broken = |message: String| FileError::broken(path, message);
    // Programs that write tables like to begin them with a byte-order mark.
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text);
    let header = reader
        .headers()
        .map_err(|e| broken(format!("this is not a readable table ({e})")))?
        .clone();
    let known: HashMap<&str, usize> = header.iter().enumerate().map(|(k, h)| (h, k)).collect();
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        *column = *known.get(name).ok_or_else(|| {
            broken(format!(
                "the column {name} is missing: the first line must name {}",
                names.join(",")
            ))
        })?;
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| broken(format!("this is not a readable table ({e})")))?;
        let line = record.position().map_or(0, csv::Position::line);
        let mut values = [0.0; N];
        for ((value, &column), name) in values.iter_mut().zip(&columns).zip(names) {
            let text = record.get(column).unwrap_or_default();
            let number = text.parse::<f64>().ok().filter(|x| x.is_finite());
            *value = number.ok_or_else(|| {
                broken(format!(
                    "line {line}: {name} is \"{text}\", which is no number"
                ))
            })?;
        }
        rows.push((line, values));
    }
    if rows.is_empty() {
        return Err(broken("there is no row below the first line".into()));
    }
    Ok(rows)
}

/// Writes the answers: as CSV, one row a pair, touch by touch; or as NPZ, one array a column.
///
/// # Errors
/// [`FileError`] naming the file.
pub fn write_answers(path: &Path, answer: &Answer) -> Result<(), FileError> {
    if path.extension().is_some_and(|e| e == "npz") {
        return write_npz(path, answer).map_err(|e| FileError::of(path, &e))?;
    }
    let mut text = Vec::new();
    let written = (|| -> std::io::Result<()> {
        writeln!(
            text,
            "touch,site,ux_mm,uy_mm,uz_mm,strain,touch_distance_mm,site_distance_mm"
        )?;
        for pair in answer.pairs() {
            let u = pair.displacement * 1000.0;
            writeln!(
                text,
                "{},{},{:e},{:e},{:e},{:e},{:e},{:e}",
                pair.touch,
                pair.site,
                u.x,
                u.y,
                u.z,
                pair.strain,
                answer.touch_distances[pair.touch] * 1000.0,
                answer.site_distances[pair.site] * 1000.0
            )?;
        }
        Ok(())
    })();
    written.map_err(|e| FileError::of(path, &e))?;
    atomic::write(path, &text)
}

fn write_npz(path: &Path, answer: &Answer) -> std::io::Result<Result<(), FileError>> {
    let shape = [answer.touch_distances.len(), answer.site_distances.len()];
    let mut columns = [const { Vec::new() }; 4];
    for pair in answer.pairs() {
        let u = pair.displacement * 1000.0;
        for (column, value) in columns.iter_mut().zip([u.x, u.y, u.z, pair.strain]) {
            column.push(value);
        }
    }
    let mut file = NpzFile::default();
    for (name, column) in ["ux_mm", "uy_mm", "uz_mm", "strain"].iter().zip(&columns) {
        file.add(name, &shape, column)?;
    }
    let mm = |d: &[f64]| d.iter().map(|d| d * 1000.0).collect::<Vec<_>>();
    file.add(
        "touch_distance_mm",
        &shape[..1],
        &mm(&answer.touch_distances),
    )?;
    file.add("site_distance_mm", &shape[1..], &mm(&answer.site_distances))?;
    Ok(file.save(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        std::fs::write(&path, text).unwrap();
        (folder, path)
    }

    #[test]
    fn columns_may_come_in_any_order_and_more_of_them() {
        let text = "\u{feff}note, dx,dy,dz, z_mm,y_mm,x_mm\n# gauges\nleft, 0,0,2, 3,2,1\n";
        let (_keep, path) = file(text);
        let sites = read_sites(&path).unwrap();
        assert_eq!(sites.len(), 1);
        assert!(sites[0].position.distance(DVec3::new(1e-3, 2e-3, 3e-3)) < 1e-15);
        assert_eq!(sites[0].direction, DVec3::Z);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let head = "x_mm,y_mm,z_mm,nx,ny,nz,force_n,tip_radius_mm\n";
        for (rows, part) in [
            ("1,2,3,0,0,1,10,5\n1,2,x,0,0,1,10,5\n", "line 3: z_mm"),
            ("1,2,3,0,0,0,10,5\n", "nx, ny, nz"),
            ("1,2,3,0,0,1,-10,5\n", "force_n"),
            ("1,2,3,0,0,1,10,0\n", "tip_radius_mm"),
            ("1,2,nan,0,0,1,10,5\n", "no number"),
            ("1,2,3\n", "readable"),
            ("", "no row"),
        ] {
            let (_keep, path) = file(&format!("{head}{rows}"));
            let error = read_touches(&path).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("t.csv"), "{error}");
        }
        let (_keep, path) = file("x_mm,y_mm\n1,2\n");
        let error = read_sites(&path).unwrap_err().to_string();
        assert!(error.contains("z_mm is missing"), "{error}");
    }
}
