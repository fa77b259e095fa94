//! Datasets from elsewhere: NPZ, CSV, and folders of nodal results as Ansys Mechanical exports them.

mod exports;
mod found;
mod plausible;

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;

use self::found::ABSURD;
use self::found::{FoundDataset, FoundTouches, PLACE};
use self::plausible::FileOrigin;
use super::FileError;
use super::npz::{self, Arrays};
use super::table::NamedTable;
use crate::plain::quote;

pub use self::found::GivenData;

/// Reads a dataset by its ending: `.npz` with `X` (sites × touches), `p_m` (touches × 3) and, where
/// there are some, `site_m` (sites × 3) and `cost` (sites); `.csv` with a row a site; or a folder of
/// exports, one a touch. CSV and folders need `touches`, a CSV with `x_mm,y_mm,z_mm` (and `file` for a
/// folder).
///
/// # Errors
/// [`FileError`] naming the file, the place in it and what to do.
pub fn read(path: &Path, touches: Option<&Path>) -> Result<GivenData, FileError> {
    let found = found(path, touches)?;
    let given = found.check_apart();
    let read = found.checked(path)?;
    given.map(|()| read)
}

/// As [`read`], to be answered and not learned from: the touches may all be at one place.
///
/// # Errors
/// As [`read`].
pub fn read_to_answer(path: &Path, touches: Option<&Path>) -> Result<GivenData, FileError> {
    found(path, touches)?.checked(path)
}

fn found(path: &Path, touches: Option<&Path>) -> Result<FoundDataset, FileError> {
    if path.is_dir() {
        exports::read(path, FoundTouches::read(needed(path, touches)?)?)
    } else if ends_with(path, "npz") {
        if let Some(touches) = touches {
            return Err(FileError::broken(
                touches,
                "not read: an .npz holds where its touches were (p_m), so leave --touches out",
            ));
        }
        read_npz(path)
    } else if ends_with(path, "csv") {
        read_csv(path, FoundTouches::read(needed(path, touches)?)?)
    } else {
        Err(FileError::broken(
            path,
            "a dataset is an .npz, a .csv, or a folder of exported results",
        ))
    }
}

fn needed<'a>(path: &Path, touches: Option<&'a Path>) -> Result<&'a Path, FileError> {
    touches.ok_or_else(|| {
        FileError::broken(
            path,
            "where the touches were is not in it: give --touches T.csv with the columns x_mm,y_mm,z_mm",
        )
    })
}

fn metres(mm: &[[f64; 3]]) -> Vec<DVec3> {
    mm.iter().map(|&p| DVec3::from_array(p) * 1e-3).collect()
}

fn read_npz(path: &Path) -> Result<FoundDataset, FileError> {
    let broken = |message: String| Err(FileError::broken(path, message));
    let mut arrays = Arrays::open(path)?;
    let x = arrays.numbers("X")?;
    let [sites, touches] = x.shape[..] else {
        return broken(format!(
            "X has {} dimensions: it must be sites × touches",
            x.shape.len()
        ));
    };
    if sites == 0 || touches == 0 {
        return broken("there is no signal in it: X needs sites × touches".into());
    }
    let pressed = positions(path, &mut arrays, "p_m")?;
    if pressed.len() != touches {
        return broken(format!(
            "X has {touches} touches (columns), but there are {} touch positions (rows of p_m): X must be sites × touches",
            pressed.len()
        ));
    }
    let known = if arrays.holds("site_m") {
        positions(path, &mut arrays, "site_m")?
    } else {
        Vec::new()
    };
    if !known.is_empty() && known.len() != sites {
        return broken(format!(
            "X has {sites} sites (rows), but site_m has {}",
            known.len()
        ));
    }
    let costs = numbers_or_none(&mut arrays, "cost")?;
    if !costs.is_empty() && costs.len() != sites {
        return broken(format!("X has {sites} sites, but cost has {}", costs.len()));
    }
    let forces = numbers_or_none(&mut arrays, "force_n")?;
    if !forces.is_empty() && forces.len() != touches {
        return broken(format!(
            "X has {touches} touches, but force_n has {}",
            forces.len()
        ));
    }
    Ok(FoundDataset {
        values: x.values,
        targets: pressed.iter().map(|&p| (p * 1e3).to_array()).collect(),
        positions: known,
        costs,
        forces,
        touches: FileOrigin::array(path, "touches", "p_m"),
        sites: FileOrigin::array(path, "sites", "site_m"),
        notes: Vec::new(),
    })
}

/// The numbers of an array that may be left out.
fn numbers_or_none(arrays: &mut Arrays, name: &str) -> Result<Vec<f64>, FileError> {
    if arrays.holds(name) {
        Ok(arrays.numbers(name)?.values)
    } else {
        Ok(Vec::new())
    }
}

/// Places in an array (m).
fn positions(path: &Path, arrays: &mut Arrays, name: &str) -> Result<Vec<DVec3>, FileError> {
    let array = arrays.numbers(name)?;
    let [_, 3] = array.shape[..] else {
        return Err(FileError::broken(
            path,
            format!("{name} must have three columns: x, y, z in metres"),
        ));
    };
    let wrong = |v: &f64| !v.is_finite() || v.abs() > ABSURD;
    if let Some(at) = array.values.iter().position(wrong) {
        let (row, column) = (at / 3, at % 3);
        let value = array.values[at];
        return Err(FileError::broken(
            path,
            format!("{name}[{row}, {column}] is {value:e}: a place is three numbers in metres"),
        ));
    }
    Ok(array
        .values
        .chunks_exact(3)
        .map(DVec3::from_slice)
        .collect())
}

/// Whether a dataset is an NPZ with an array of this name.
///
/// # Errors
/// [`FileError`] when it is no readable archive.
pub fn holds(path: &Path, array: &str) -> Result<bool, FileError> {
    Ok(ends_with(path, "npz") && npz::holds(path, array)?)
}

/// The group of each touch, numbered from zero as they first appear: from the column `group` of a CSV, or from an
/// array of the dataset. Nothing where the dataset is no NPZ, and the name none of a CSV.
///
/// # Errors
/// [`FileError`] where there are none, not one for each touch, or no whole numbers.
pub fn groups(path: &Path, name: &str, touches: usize) -> Result<Option<Vec<usize>>, FileError> {
    let file = Path::new(name);
    let (source, values) = if ends_with(file, "csv") {
        (file, group_column(file)?)
    } else if ends_with(path, "npz") {
        (path, Arrays::open(path)?.numbers(name)?.values)
    } else {
        return Ok(None);
    };
    let broken = |what: String| Err(FileError::broken(source, what));
    if values.len() != touches {
        return broken(format!(
            "there are {touches} touches, but {} has {} groups: one is needed a touch",
            quote(name),
            values.len()
        ));
    }
    let wrong = |v: &f64| !(v.is_finite() && v.fract() == 0.0);
    if let Some(at) = values.iter().position(wrong) {
        return broken(format!(
            "the group of touch {at} in {} is {}: groups are whole numbers",
            quote(name),
            values[at]
        ));
    }
    let mut known = HashMap::new();
    let number = |value: &f64| {
        let next = known.len();
        // Zero has two signs.
        *known.entry((value + 0.0).to_bits()).or_insert(next)
    };
    Ok(Some(values.iter().map(number).collect()))
}

fn group_column(path: &Path) -> Result<Vec<f64>, FileError> {
    let table = NamedTable::read(path)?;
    let [group] = table.columns(&["group"])?;
    table.rows().map(|row| row?.number(group)).collect()
}

fn ends_with(path: &Path, ending: &str) -> bool {
    let found = path.extension().unwrap_or_default().to_string_lossy();
    found.eq_ignore_ascii_case(ending) && !path.is_dir()
}

/// A row a site: `x_mm,y_mm,z_mm`, `dx,dy,dz` and `cost` where there are some, and then a column a touch.
fn read_csv(path: &Path, touches: FoundTouches) -> Result<FoundDataset, FileError> {
    const KNOWN: [&str; 7] = ["x_mm", "y_mm", "z_mm", "dx", "dy", "dz", "cost"];
    let table = NamedTable::read(path)?;
    let place = table.columns(&PLACE)?;
    let cost = table.column("cost")?;
    let signals: Vec<usize> = (0..)
        .zip(table.names())
        .filter(|(_, name)| !KNOWN.contains(name))
        .map(|(column, _)| column)
        .collect();
    let count = touches.mm.len();
    if signals.len() != count {
        let first = signals.first().map(|&column| quote(table.name(column)));
        let from = first.map_or_else(String::new, |name| format!(" (from {name})"));
        return Err(table.wrong(format!(
            "beside {} it has {} columns{from}, but {} has {count} touches: it needs one column a touch and no other",
            KNOWN.join(","),
            signals.len(),
            touches.origin.path().display()
        )));
    }
    let (mut mm, mut lines, mut costs, mut values) = (vec![], vec![], vec![], vec![]);
    for row in table.rows() {
        let row = row?;
        mm.push(row.numbers(&place)?);
        lines.push(row.line());
        if let Some(column) = cost {
            costs.push(row.number(column)?);
        }
        for &column in &signals {
            values.push(row.number(column)?);
        }
    }
    if mm.is_empty() {
        return Err(table.wrong("there is no row below the first line: one is needed a site"));
    }
    Ok(FoundDataset {
        values,
        targets: touches.mm,
        positions: metres(&mm),
        costs,
        forces: touches.forces,
        touches: touches.origin,
        sites: FileOrigin::lines(path, "sites", lines),
        notes: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_csv_has_a_row_a_site_and_a_column_a_touch() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let signals = file(
            "d.csv",
            "x_mm,y_mm,z_mm,cost,t0,t1\n1,0,0,2,0.5,0.25\n0,1,0,3,1,2\n",
        );
        let touches = file("t.csv", "x_mm,y_mm,z_mm\n0,0,0\n1,1,1\n");
        let GivenData { data, .. } = read(&signals, Some(&touches)).unwrap();
        assert_eq!(data.x.values(), [0.5, 0.25, 1.0, 2.0]);
        assert_eq!(data.costs, [2.0, 3.0]);
        let alone = read(&signals, None).unwrap_err();
        assert!(alone.to_string().contains("--touches"));
    }

    #[test]
    fn one_place_can_be_answered_and_not_learned_from() {
        let folder = tempfile::tempdir().unwrap();
        let [signals, touches] = ["x.csv", "t.csv"].map(|name| folder.path().join(name));
        std::fs::write(&signals, "x_mm,y_mm,z_mm,a\n0,0,0,0.5\n9,0,0,1\n").unwrap();
        std::fs::write(&touches, "x_mm,y_mm,z_mm\n1,2,3\n").unwrap();
        let said = read(&signals, Some(&touches)).unwrap_err().to_string();
        assert!(said.contains("one touch only"), "{said}");
        let answered = read_to_answer(&signals, Some(&touches)).unwrap();
        assert_eq!(answered.data.targets, [[1.0, 2.0, 3.0]]);
        assert!(answered.notes.is_empty(), "{:?}", answered.notes);
    }

    #[test]
    fn touches_beside_those_of_an_archive_are_not_passed_over() {
        let said = read(Path::new("x.npz"), Some(Path::new("t.csv"))).unwrap_err();
        assert!(said.to_string().contains("leave --touches out"), "{said}");
    }
}
