//! Given touches, sites and presses, and answers, as CSV with the units in the column names.

use std::ops::RangeInclusive;
use std::path::Path;

use glam::DVec3;

use super::npz::NpzFile;
use super::table::{NamedTable, TableRow, Writing};
use super::{FileError, atomic};
use crate::board::{GivenPress, PRESSES, RAMP_S};
use crate::elasticity::Touch;
use crate::given::{self, GivenAnswer, GivenSite};
use crate::project::TouchKeys;

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
const SCRIPT: [&str; 6] = ["start_s", "duration_s", "x_mm", "y_mm", "z_mm", "force_n"];

/// Forces (N) that a robot may meet; beyond them the numbers of the model leave their range.
const FORCES: RangeInclusive<f64> = 1e-9..=1e9;
/// When a press may begin, and how long it may last (s).
const STARTS: RangeInclusive<f64> = 0.0..=1e9;
const DURATIONS: RangeInclusive<f64> = 1e-3..=1e9;

/// Reads touches: `x_mm,y_mm,z_mm,nx,ny,nz,force_n,tip_radius_mm`, n being the outward normal. Further
/// columns are ignored.
///
/// # Errors
/// [`FileError`] naming the file, the line and the column.
pub fn read_touches(path: &Path) -> Result<Vec<Touch>, FileError> {
    read(path, &TOUCHES, |row, [x, y, z, nx, ny, nz, force, tip]| {
        Ok(Touch {
            position: DVec3::new(x, y, z) * 1e-3,
            normal: direction(DVec3::new(nx, ny, nz)).ok_or_else(|| {
                row.wrong("nx, ny, nz is no direction: give the outward unit normal")
            })?,
            force: ranged(
                row,
                "force_n",
                force,
                &FORCES,
                "above zero, as it presses along -n",
            )?,
            tip_radius: 1e-3
                * ranged(
                    row,
                    "tip_radius_mm",
                    tip,
                    &TouchKeys::tip_radius_mm().numbers(),
                    "above zero",
                )?,
        })
    })
}

/// Reads gauges: `x_mm,y_mm,z_mm,dx,dy,dz`, d being the direction the gauge measures along. Further
/// columns are ignored.
///
/// # Errors
/// [`FileError`] naming the file, the line and the column.
pub fn read_sites(path: &Path) -> Result<Vec<GivenSite>, FileError> {
    read(path, &SITES, |row, [x, y, z, dx, dy, dz]| {
        Ok(GivenSite {
            position: DVec3::new(x, y, z) * 1e-3,
            direction: direction(DVec3::new(dx, dy, dz)).ok_or_else(|| {
                row.wrong("dx, dy, dz is no direction: give the one the gauge measures along")
            })?,
        })
    })
}

/// What a press may be like besides, where a column says so.
const BESIDE: [(&str, RangeInclusive<f64>); 4] = [
    ("ramp_ms", 0.1..=1e6),
    ("tilt_deg", 0.0..=80.0),
    ("towards_deg", -360.0..=360.0),
    ("radius_mm", 0.01..=1e4),
];

/// Reads who presses a simulated board and when: `start_s,duration_s,x_mm,y_mm,z_mm,force_n`, and where they are known
/// `ramp_ms`, `tilt_deg`, `towards_deg` and `radius_mm`, which may be left empty. Presses may overlap. Further columns
/// are ignored. Without a row nobody presses.
///
/// # Errors
/// [`FileError`] naming the file, the line and the column.
pub fn read_presses(path: &Path) -> Result<Vec<GivenPress>, FileError> {
    let table = NamedTable::read(path)?;
    let mut beside = [None; 4];
    for (column, (name, _)) in beside.iter_mut().zip(&BESIDE) {
        *column = table.column(name)?;
    }
    taken(&table, &SCRIPT, |row, [start, duration, x, y, z, force]| {
        let [ramp, tilt, towards, radius] = besides(row, &beside)?;
        Ok(GivenPress {
            start_s: ranged(row, "start_s", start, &STARTS, "zero or more")?,
            duration_s: ranged(row, "duration_s", duration, &DURATIONS, "above zero")?,
            position: DVec3::new(x, y, z) * 1e-3,
            force: ranged(row, "force_n", force, &PRESSES, "above zero")?,
            ramp_s: ramp.map_or(RAMP_S, |ms| ms * 1e-3),
            tilt_deg: tilt.unwrap_or(0.0),
            towards_deg: towards.unwrap_or(0.0),
            radius: radius.map(|mm| mm * 1e-3),
        })
    })
}

/// What a row says in the columns that need not be there.
fn besides(row: &TableRow, columns: &[Option<usize>; 4]) -> Result<[Option<f64>; 4], FileError> {
    let mut found = [None; 4];
    for ((value, column), (name, range)) in found.iter_mut().zip(columns).zip(&BESIDE) {
        let given = column.filter(|&column| !row.text(column).is_empty());
        if let Some(column) = given {
            let number = row.number(column)?;
            *value = Some(ranged(
                row,
                name,
                number,
                range,
                "a number that can be meant",
            )?);
        }
    }
    Ok(found)
}

/// Where somebody is asked to press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AskedPoint {
    /// m.
    pub position: DVec3,
    /// N, where it is known.
    pub force: Option<f64>,
    /// From when to when (s), in a recording whose presses were made at known times.
    pub during_s: Option<[f64; 2]>,
}

impl AskedPoint {
    /// A place (m), of which nothing else is known.
    #[must_use]
    pub fn at(position: DVec3) -> Self {
        Self {
            position,
            force: None,
            during_s: None,
        }
    }
}

/// Reads where to press: `x_mm,y_mm,z_mm`, and where they are known `force_n`, `start_s` and `duration_s`. Further columns
/// are ignored.
///
/// # Errors
/// [`FileError`] naming the file, the line and the column.
pub fn read_points(path: &Path) -> Result<Vec<AskedPoint>, FileError> {
    let table = NamedTable::read(path)?;
    let more = [
        table.column("force_n")?,
        table.column("start_s")?,
        table.column("duration_s")?,
    ];
    let take = |row: &TableRow, [x, y, z]: [f64; 3]| {
        let number = |column: Option<usize>| column.map(|c| row.number(c)).transpose();
        let [force, start, duration] = [number(more[0])?, number(more[1])?, number(more[2])?];
        let force = force.map(|f| ranged(row, "force_n", f, &PRESSES, "above zero"));
        let during = start.zip(duration).map(|(start, duration)| {
            let start = ranged(row, "start_s", start, &STARTS, "zero or more")?;
            let lasts = ranged(row, "duration_s", duration, &DURATIONS, "above zero")?;
            Ok::<_, FileError>([start, start + lasts])
        });
        Ok(AskedPoint {
            position: DVec3::new(x, y, z) * 1e-3,
            force: force.transpose()?,
            during_s: during.transpose()?,
        })
    };
    let points = taken(&table, &["x_mm", "y_mm", "z_mm"], take)?;
    if points.is_empty() {
        return Err(table.wrong("there is no row below the first line"));
    }
    Ok(points)
}

/// The line of such a table that a touch, gauge or press stands in, counted as they were read, from 0.
#[must_use]
pub fn line(path: &Path, number: usize) -> Option<u64> {
    lines(path).get(number).copied()
}

/// A table, and the line in it that such a row stands in, for a message.
#[must_use]
pub fn place(path: &Path, number: usize) -> String {
    let line = line(path, number).map_or_else(String::new, |line| format!(", line {line}"));
    format!("{}{line}", path.display())
}

/// The lines of all rows of such a table; none of what cannot be read.
#[must_use]
pub fn lines(path: &Path) -> Vec<u64> {
    let Ok(table) = NamedTable::read(path) else {
        return Vec::new();
    };
    (table.rows())
        .map_while(|row| Some(row.ok()?.line()))
        .collect()
}

/// The unit vector along `v`, if it has a direction. Its size is taken out first: the squares of what is very
/// large or very small are no numbers.
fn direction(v: DVec3) -> Option<DVec3> {
    let size = v.abs().max_element();
    (size > 0.0).then(|| (v / size).normalize())
}

fn ranged(
    row: &TableRow,
    name: &str,
    value: f64,
    range: &RangeInclusive<f64>,
    rule: &str,
) -> Result<f64, FileError> {
    if range.contains(&value) {
        return Ok(value);
    }
    Err(row.wrong(format!(
        "{name} must be {rule}, and from {:e} to {:e}",
        range.start(),
        range.end()
    )))
}

/// What `take` makes of the columns asked for of every row; columns may come in any order.
fn read<const N: usize, T>(
    path: &Path,
    names: &[&str; N],
    take: impl Fn(&TableRow, [f64; N]) -> Result<T, FileError>,
) -> Result<Vec<T>, FileError> {
    let table = NamedTable::read(path)?;
    let rows = taken(&table, names, take)?;
    if rows.is_empty() {
        return Err(table.wrong("there is no row below the first line"));
    }
    Ok(rows)
}

/// As [`read`], of a table that may have no rows.
fn taken<const N: usize, T>(
    table: &NamedTable,
    names: &[&str; N],
    take: impl Fn(&TableRow, [f64; N]) -> Result<T, FileError>,
) -> Result<Vec<T>, FileError> {
    let columns = table.columns(names)?;
    table
        .rows()
        .map(|row| {
            let row = row?;
            take(&row, row.numbers(&columns)?)
        })
        .collect()
}

/// Writes the answers: as CSV, one row a pair, touch by touch, and below them in lines that begin with # which rows
/// were left out; or as NPZ, one array a column, with what was left out as no numbers, and arrays that say so.
///
/// # Errors
/// [`FileError`] naming the file.
pub fn write_answers(path: &Path, answer: &GivenAnswer) -> Result<(), FileError> {
    if path.extension().is_some_and(|e| e == "npz") {
        return write_npz(path, answer).map_err(|e| FileError::of(path, &e))?;
    }
    atomic::write(path, csv(answer).as_bytes())
}

fn csv(answer: &GivenAnswer) -> String {
    let rows = &answer.rows;
    let mut table = Writing::new([
        "touch",
        "site",
        "ux_mm",
        "uy_mm",
        "uz_mm",
        "strain",
        "touch_distance_mm",
        "site_distance_mm",
    ]);
    for pair in answer.pairs() {
        let u = pair.displacement * 1000.0;
        let figures = [
            u.x,
            u.y,
            u.z,
            pair.strain,
            rows.touch_distances[pair.touch] * 1000.0,
            rows.site_distances[pair.site] * 1000.0,
        ];
        let numbers = [pair.touch, pair.site].map(|n| n.to_string());
        let figures = figures.map(|f| format!("{f:e}"));
        table.row(numbers.iter().chain(&figures));
    }
    let left_out = rows
        .left_out
        .iter()
        .map(|l| format!("# left out: {}\n", l.why));
    table.text() + &left_out.collect::<String>()
}

fn write_npz(path: &Path, answer: &GivenAnswer) -> std::io::Result<Result<(), FileError>> {
    let rows = &answer.rows;
    let shape = [rows.touch_distances.len(), rows.site_distances.len()];
    let mut columns: [Vec<f64>; 4] = std::array::from_fn(|_| vec![f64::NAN; shape[0] * shape[1]]);
    for pair in answer.pairs() {
        let u = pair.displacement * 1000.0;
        let place = pair.touch * shape[1] + pair.site;
        for (column, value) in columns.iter_mut().zip([u.x, u.y, u.z, pair.strain]) {
            column[place] = value;
        }
    }
    let mut file = NpzFile::default();
    for (name, column) in ["ux_mm", "uy_mm", "uz_mm", "strain"].iter().zip(&columns) {
        file.add(name, &shape, column)?;
    }
    let mm = |d: &[f64]| d.iter().map(|d| d * 1000.0).collect::<Vec<_>>();
    let (touches, sites) = (&shape[..1], &shape[1..]);
    file.add("touch_distance_mm", touches, &mm(&rows.touch_distances))?;
    file.add("site_distance_mm", sites, &mm(&rows.site_distances))?;
    file.add("site_angle_deg", sites, &rows.site_angles)?;
    let missing = |table: given::GivenTable, count: usize| {
        let mut missing = vec![0_u8; count];
        for left_out in rows.left_out.iter().filter(|l| l.table == table) {
            missing[left_out.row] = 1;
        }
        missing
    };
    let left_out = missing(given::GivenTable::Touches, shape[0]);
    file.add("touch_left_out", touches, &left_out)?;
    let left_out = missing(given::GivenTable::Sites, shape[1]);
    file.add("site_left_out", sites, &left_out)?;
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
            (
                "1,2,3,0,0,1,10,5\n1,2,x,0,0,1,10,5\n",
                "line 3: “z_mm” is “x”",
            ),
            ("1,2,3,0,0,0,10,5\n", "nx, ny, nz"),
            ("1,2,3,0,0,1,-10,5\n", "force_n"),
            ("1,2,3,0,0,1,10,0\n", "tip_radius_mm"),
            ("1,2,nan,0,0,1,10,5\n", "no number"),
            ("1,2,3\n", "line 2: there are 3 values for the 8 columns"),
            ("1,,3,0,0,1,10,5\n", "“y_mm” is empty"),
            ("1,2,1e999,0,0,1,10,5\n", "finite"),
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

    #[test]
    fn presses_that_nobody_can_mean_are_refused_with_their_line() {
        let head = "start_s,duration_s,x_mm,y_mm,z_mm,force_n\n";
        let read = |rows: &str| {
            let (_keep, path) = file(&format!("{head}{rows}"));
            read_presses(&path).map_err(|e| e.to_string())
        };
        let presses = read("1,2,22.5,0,60,8\n# a remark\n4,1,0,0,0,1\n").unwrap();
        let first = GivenPress {
            start_s: 1.0,
            duration_s: 2.0,
            position: DVec3::new(22.5, 0.0, 60.0) * 1e-3,
            force: 8.0,
            ramp_s: RAMP_S,
            tilt_deg: 0.0,
            towards_deg: 0.0,
            radius: None,
        };
        assert_eq!((presses.len(), presses[0]), (2, first));
        assert!(read("").unwrap().is_empty());
        for (rows, part) in [
            ("1,1,1,2,3,8\n1,1,nan,0,0,8\n", "line 3: “x_mm” is “nan”"),
            ("1,1,0,1e309,0,8\n", "finite"),
            ("-1,1,1,2,3,8\n", "start_s"),
            ("1,nan,1,2,3,8\n", "duration_s"),
            ("1,0,1,2,3,8\n", "duration_s"),
            ("1,1,1,2,3,1e300\n", "force_n"),
            ("1,1,1\n", "line 2: there are 3 values for the 6 columns"),
        ] {
            let said = read(rows).unwrap_err();
            assert!(said.contains(part) && said.contains("t.csv"), "{said}");
        }
        let wide = "start_s,duration_s,x_mm,y_mm,z_mm,force_n,tilt_deg,radius_mm,ramp_ms\n";
        let (_keep, path) = file(&format!(
            "{wide}1,2,22.5,0,60,8,20,,5\n1,2,22.5,0,60,8,,15,\n"
        ));
        let presses = read_presses(&path).unwrap();
        let like = |p: &GivenPress| (p.tilt_deg, p.radius, p.ramp_s);
        assert_eq!(like(&presses[0]), (20.0, None, 0.005));
        assert_eq!(like(&presses[1]), (0.0, Some(0.015), RAMP_S));
        let (_keep, path) = file(&format!("{wide}1,2,22.5,0,60,8,90,,5\n"));
        let said = read_presses(&path).unwrap_err().to_string();
        assert!(
            said.contains("line 2") && said.contains("tilt_deg"),
            "{said}"
        );
        let (_keep, path) = file(&format!("\u{1b}[31m{}\n1\n", "x".repeat(200_000)));
        let said = read_presses(&path).unwrap_err().to_string();
        assert!(said.len() < 500 && !said.contains('\u{1b}'), "{said}");
    }
}
