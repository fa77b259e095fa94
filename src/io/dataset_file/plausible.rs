//! Places that cannot be meant: too far from the others, in another unit, or all the same.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::FileError;
use crate::bounds::Bounds;
use crate::plain::length;
use crate::statistics::median;
use crate::units;

/// Wider than any part that is pressed by hand (mm): a place in another unit, or a slip.
const WIDEST: f64 = 20_000.0;
/// Touches and sites lie on one part; spreads as different as this are worth a word.
const UNLIKE: f64 = 100.0;
/// A spread that is wide may be in another unit, and is where it is so much wider than the other (mm).
const WIDE: f64 = 2_000.0;
/// Places nearer than this are one (mm).
const ONE: f64 = 1e-6;

/// Where places stand in a file, so that a message can name one.
pub struct FileOrigin {
    path: PathBuf,
    /// Touches or sites.
    what: &'static str,
    kind: ValueKind,
}

enum ValueKind {
    /// Rows of an array, in metres.
    Array(&'static str),
    /// Lines of a table, in millimetres.
    Lines(Vec<u64>),
    /// Nodes of exported results.
    Nodes(Vec<u64>),
}

impl FileOrigin {
    pub fn array(path: &Path, what: &'static str, name: &'static str) -> Self {
        Self::of(path, what, ValueKind::Array(name))
    }

    pub fn lines(path: &Path, what: &'static str, lines: Vec<u64>) -> Self {
        Self::of(path, what, ValueKind::Lines(lines))
    }

    pub fn nodes(path: &Path, what: &'static str, nodes: Vec<u64>) -> Self {
        Self::of(path, what, ValueKind::Nodes(nodes))
    }

    fn of(path: &Path, what: &'static str, kind: ValueKind) -> Self {
        Self {
            path: path.to_owned(),
            what,
            kind,
        }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    fn name(&self, number: usize) -> String {
        match &self.kind {
            ValueKind::Array(name) => format!("{name}[{number}]"),
            ValueKind::Lines(lines) => format!("line {}", lines[number]),
            ValueKind::Nodes(nodes) => format!("node {}", nodes[number]),
        }
    }

    /// What to do about a unit.
    fn unit(&self) -> String {
        match self.kind {
            ValueKind::Array(name) => {
                format!("{name} is in metres: divide it by 1000 if it is in millimetres")
            }
            ValueKind::Lines(_) => "x_mm, y_mm and z_mm are in millimetres".to_owned(),
            ValueKind::Nodes(_) => "check the unit in the first line of the exports".to_owned(),
        }
    }

    fn wrong(&self, what: impl Display) -> FileError {
        FileError::broken(&self.path, what)
    }
}

/// Places, and where they stand.
pub struct FilePlaces<'a> {
    origin: &'a FileOrigin,
    /// mm.
    points: Vec<DVec3>,
}

impl<'a> FilePlaces<'a> {
    /// Of finite points (mm).
    pub fn new(origin: &'a FileOrigin, points: impl Iterator<Item = DVec3>) -> Self {
        Self {
            origin,
            points: points.collect(),
        }
    }

    /// mm.
    fn longest_side(&self) -> f64 {
        longest_side(&self.points)
    }

    /// The median of each coordinate (mm): one place far away does not move it.
    fn middle(&self) -> DVec3 {
        let of = |axis: usize| median(self.points.iter().map(|p| p[axis])).unwrap_or(0.0);
        DVec3::new(of(0), of(1), of(2))
    }

    /// Refuses what is wider than any part: one place by its name, or all for their unit.
    fn within_reach(&self) -> Result<(), FileError> {
        let longest_side = self.longest_side();
        if longest_side <= WIDEST {
            return Ok(());
        }
        let origin = self.origin;
        let middle = self.middle();
        let distances: Vec<f64> = self
            .points
            .iter()
            .map(|&p| (p - middle).abs().max_element())
            .collect();
        let near = median(distances.iter().copied()).unwrap_or(0.0);
        let farthest = (distances.into_iter().zip(0..)).max_by(|a, b| a.0.total_cmp(&b.0));
        Err(match farthest {
            Some((distance, number)) if 2.0 * near < WIDE => origin.wrong(format!(
                "{}: this one of the {} lies {} from their middle, and half of them lie within {} of it. Check the number, or take it out",
                origin.name(number),
                origin.what,
                length(units::from_mm(distance)),
                length(units::from_mm(near))
            )),
            _ => origin.wrong(format!(
                "the {} are spread over {}, wider than any part. {}",
                origin.what,
                length(units::from_mm(longest_side)),
                origin.unit()
            )),
        })
    }

    /// Refuses touches that are all at one place: nothing can be learned from them.
    pub(super) fn check_apart(&self) -> Result<(), FileError> {
        if self.longest_side() > ONE {
            return Ok(());
        }
        Err(self.origin.wrong(match self.points.len() {
            1 => {
                "there is one touch only: to tell places apart takes touches at several".to_owned()
            }
            n => format!("all {n} touches lie at one place: there is nothing to tell apart"),
        }))
    }
}

/// What a reader of a dataset must know about its places.
///
/// # Errors
/// [`FileError`] naming the file and, where one is to blame, the place.
pub fn check(touches: &FilePlaces, sites: &FilePlaces) -> Result<Vec<String>, FileError> {
    touches.within_reach()?;
    sites.within_reach()?;
    let (pressed, read) = (touches.longest_side(), sites.longest_side());
    let (narrow, wide) = (pressed.min(read), pressed.max(read));
    // Touches at one place say nothing of how large the part is.
    if sites.points.len() < 2 || pressed <= ONE || wide <= UNLIKE * narrow {
        let doubt = || in_doubt(wide, touches, sites);
        return Ok((wide > WIDE).then(doubt).into_iter().collect());
    }
    let unlike = format!(
        "the sites are spread over {} and the touches over {}, though both lie on one part",
        length(units::from_mm(read)),
        length(units::from_mm(pressed))
    );
    let odd = if read > pressed { sites } else { touches };
    if wide > WIDE {
        return Err(odd.origin.wrong(format!("{unlike}. {}", odd.origin.unit())));
    }
    Ok(vec![format!("Check the units: {unlike}.")])
}

/// What is said where touches and sites agree on a part (mm) that is larger than what a hand presses.
fn in_doubt(size: f64, touches: &FilePlaces, sites: &FilePlaces) -> String {
    let mut units = vec![touches.origin.unit()];
    if !sites.points.is_empty() {
        units.push(sites.origin.unit());
    }
    units.dedup();
    format!(
        "Check the unit: these places are of a part of {}. {}.",
        length(units::from_mm(size)),
        units.join("; ")
    )
}

/// The longest side of the box around some points, in their unit; zero of none. No square is taken: it may leave
/// the range of numbers.
pub fn longest_side(points: &[DVec3]) -> f64 {
    if points.is_empty() {
        return 0.0;
    }
    Bounds::around(points.iter().copied()).size().max_element()
}
