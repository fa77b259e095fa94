//! Machines of the test-bed as files (`.toml`): axes, tip, commands, and points that the tip has touched.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;

use super::{FileError, source};
use crate::bench::{Machine, MachineAxis, TableMount, TipSensor, TouchedPoint};
use crate::mesh::TriMesh;
use crate::mesh::stance::Stance;

/// The paper's bench.
pub const PAPER: &str = include_str!("../../assets/bench/paper.toml");
/// What touched points may be off where nothing else is said (mm).
const FIT_MM: f64 = 1.5;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: u32,
    name: String,
    axes: Axes,
    tip: TipTable,
    #[serde(default)]
    commands: Commands,
    #[serde(default)]
    touched: Vec<TouchedEntry>,
    #[serde(default)]
    fit_mm: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Axes {
    radial: AxisEntry,
    along: AxisEntry,
    rotary: AxisEntry,
    lateral: Option<AxisEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisEntry {
    letter: char,
    zero: f64,
    sign: f64,
    range: [f64; 2],
    speed: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TipTable {
    radius_mm: f64,
    clearance_mm: f64,
    most_tilt_deg: f64,
    channel: Option<usize>,
    newton_per_count: Option<f64>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Commands {
    begin: Vec<String>,
    home: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TouchedEntry {
    limb_mm: [f64; 3],
    at: BTreeMap<char, f64>,
}

/// A machine that was read, with what its tip has touched.
pub struct MachineFile {
    /// The machine.
    pub machine: Machine,
    touched: Vec<TouchedEntry>,
    fit: f64,
}

/// Reads a machine.
///
/// # Errors
/// [`FileError`] naming the file, what is wrong in it and what to do.
pub fn read(path: &Path) -> Result<MachineFile, FileError> {
    let text = source::read_text(path)?;
    parse(&text).map_err(|what| FileError::broken(path, what))
}

/// Reads a machine's text.
///
/// # Errors
/// What is wrong in it.
pub fn parse(text: &str) -> Result<MachineFile, String> {
    let file: File = toml::from_str(text).map_err(|e| e.to_string())?;
    if file.format != 1 {
        return Err(format!(
            "format = {}: this program reads format 1 of machines",
            file.format
        ));
    }
    let tip = &file.tip;
    let ranged = |name: &str, value: f64, range: std::ops::RangeInclusive<f64>| {
        let (low, high) = (range.start(), range.end());
        let said = format!("{name} = {value}: it must lie between {low} and {high}");
        range.contains(&value).then_some(value).ok_or(said)
    };
    let sensor = match (tip.channel, tip.newton_per_count) {
        (Some(channel), Some(newton_per_count)) => {
            ranged("tip.newton_per_count", newton_per_count.abs(), 1e-9..=1e6)?;
            Some(TipSensor {
                channel,
                newton_per_count,
            })
        }
        (None, None) => None,
        _ => return Err("tip.channel and tip.newton_per_count go together".into()),
    };
    let lateral = file.axes.lateral.as_ref().map(|a| axis("lateral", a));
    let machine = Machine {
        name: file.name,
        radial: axis("radial", &file.axes.radial)?,
        along: axis("along", &file.axes.along)?,
        rotary: axis("rotary", &file.axes.rotary)?,
        lateral: lateral.transpose()?,
        tip_radius: ranged("tip.radius_mm", tip.radius_mm, 0.1..=100.0)? * 1e-3,
        clearance: ranged("tip.clearance_mm", tip.clearance_mm, 0.1..=1000.0)? * 1e-3,
        most_tilt: ranged("tip.most_tilt_deg", tip.most_tilt_deg, 0.0..=80.0)?.to_radians(),
        sensor,
        begin: commands(file.commands.begin)?,
        home: commands(file.commands.home)?,
    };
    letters(&machine)?;
    Ok(MachineFile {
        machine,
        touched: file.touched,
        fit: ranged("fit_mm", file.fit_mm.unwrap_or(FIT_MM), 1e-3..=100.0)? * 1e-3,
    })
}

fn axis(name: &str, entry: &AxisEntry) -> Result<MachineAxis, String> {
    let wrong = |what: &str| Err(format!("axes.{name}: {what}"));
    let finite = [entry.zero, entry.range[0], entry.range[1], entry.speed];
    if !finite.iter().all(|v| v.abs() < 1e6) {
        return wrong("its numbers are none that a machine has");
    }
    if !"XYZEABCUVWIJK".contains(entry.letter) {
        return wrong("its letter must be one of X Y Z E A B C U V W I J K");
    }
    if entry.sign.abs() != 1.0 {
        return wrong("its sign must be 1 or -1");
    }
    if entry.range[0] >= entry.range[1] {
        return wrong("its range must be the smallest and the largest number");
    }
    if entry.speed <= 0.0 {
        return wrong("its speed must be above zero");
    }
    Ok(MachineAxis {
        letter: entry.letter,
        zero: entry.zero,
        sign: entry.sign,
        range: entry.range,
        speed: entry.speed,
    })
}

/// Each axis its own letter.
fn letters(machine: &Machine) -> Result<(), String> {
    let Machine {
        radial,
        along,
        rotary,
        lateral,
        ..
    } = machine;
    let mut all: Vec<char> = [radial, along, rotary].map(|a| a.letter).to_vec();
    all.extend(lateral.as_ref().map(|a| a.letter));
    let mut once = all.clone();
    once.sort_unstable();
    once.dedup();
    if once.len() < all.len() {
        return Err("two axes have the same letter".into());
    }
    Ok(())
}

/// One line each, and none that the line's own number and sum would be lost in.
fn commands(all: Vec<String>) -> Result<Vec<String>, String> {
    let wrong = |c: &&String| {
        c.is_empty() || c.len() > 80 || !c.is_ascii() || c.contains(['\n', '\r', '*', ';'])
    };
    match all.iter().find(wrong) {
        Some(command) => Err(format!(
            "commands: {} is no line of G-code",
            crate::plain::quote(command)
        )),
        None => Ok(all),
    }
}

impl MachineFile {
    /// How the limb stands: as the touched points say, or upright where there are none; with how far the points are off (m).
    ///
    /// # Errors
    /// A message where the points say too little, or do not fit this limb.
    pub fn mount(&self, limb: &TriMesh, stance: &Stance) -> Result<(TableMount, Vec<f64>), String> {
        if self.touched.is_empty() {
            let (low, high) = limb.bounds();
            let middle = (low + high) / 2.0;
            return Ok((
                TableMount::upright(stance.up(), stance.front(), middle),
                Vec::new(),
            ));
        }
        let touched: Vec<TouchedPoint> = (self.touched.iter())
            .map(|entry| self.touched(entry, limb))
            .collect::<Result<_, _>>()?;
        let (mount, off) = TableMount::fit(&touched, self.machine.tip_radius)?;
        let worst = off.iter().copied().fold(0.0, f64::max);
        if worst > self.fit {
            let each: Vec<String> = off.iter().map(|o| format!("{:.2}", o * 1e3)).collect();
            return Err(format!(
                "the touched points do not fit this limb: they are {} mm off, and {:.2} is allowed (fit_mm). The limb may be mounted the other way round, or a point be of another place",
                each.join(", "),
                self.fit * 1e3
            ));
        }
        Ok((mount, off))
    }

    fn touched(&self, entry: &TouchedEntry, limb: &TriMesh) -> Result<TouchedPoint, String> {
        /// How far from the limb its points may be given (m).
        const FAR: f64 = 3e-3;
        let asked = DVec3::from_array(entry.limb_mm) * 1e-3;
        let (at, far) = limb.index().nearest(asked);
        if far > FAR {
            return Err(format!(
                "touched: {:?} mm lies {:.1} mm from the limb",
                entry.limb_mm,
                far * 1e3
            ));
        }
        let machine = &self.machine;
        let axes = [
            Some(&machine.radial),
            Some(&machine.along),
            Some(&machine.rotary),
            machine.lateral.as_ref(),
        ];
        for axis in axes.into_iter().flatten() {
            if !entry.at.contains_key(&axis.letter) {
                return Err(format!("touched: the number of {} is missing", axis.letter));
            }
        }
        let pose = machine.pose_of(|axis| entry.at.get(&axis.letter).copied().unwrap_or(axis.zero));
        Ok(TouchedPoint {
            limb: limb.point(at),
            normal: limb.normal(at),
            tip: pose.on_table(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limb::LimbSpec;

    #[test]
    fn the_papers_bench_is_read() {
        let file = parse(PAPER).unwrap();
        let machine = &file.machine;
        assert_eq!((machine.radial.letter, machine.rotary.letter), ('X', 'E'));
        assert_eq!(machine.sensor.unwrap().channel, 10);
        assert_eq!((machine.begin.len(), machine.home.len()), (7, 0));
    }

    #[test]
    fn what_no_machine_can_be_is_refused_by_name() {
        for (from, to, part) in [
            ("format = 1", "format = 2", "format = 2"),
            ("letter = \"Z\"", "letter = \"X\"", "same letter"),
            ("letter = \"Z\"", "letter = \"Q\"", "axes.along"),
            (
                "range = [0.0, 119.0]",
                "range = [119.0, 0.0]",
                "axes.radial",
            ),
            ("speed = 90.0", "speed = 0.0", "axes.rotary"),
            ("radius_mm = 5.0", "radius_mm = nan", "tip.radius_mm"),
            ("channel = 10", "", "go together"),
            ("\"G21\"", "\"G21\\nM112\"", "no line of G-code"),
            ("[tip]", "[tip]\nwrong = 1", "wrong"),
        ] {
            let text = PAPER.replacen(from, to, 1);
            assert_ne!(text, PAPER);
            let said = parse(&text).err().unwrap();
            assert!(said.contains(part), "{part}: {said}");
        }
    }

    #[test]
    fn a_limb_that_was_mounted_the_other_way_round_is_found_out() {
        let (limb, _) = LimbSpec::default().build().unwrap();
        let file = parse(PAPER).unwrap();
        let stance = Stance::of(&limb);
        let (upright, _) = file.mount(&limb, &stance).unwrap();
        let touched = |turned: f64| {
            let mut text = PAPER.to_owned();
            for k in [3, 400, 900, 1500, 2200] {
                let at = limb.vertex_points()[k % limb.positions().len()];
                let (p, n) = (limb.point(at), limb.normal(at));
                let tip = upright.place(p + n * file.machine.tip_radius);
                let angle = -tip.y.atan2(tip.x);
                let p = p * 1e3;
                let entry = format!(
                    "[[touched]]\nlimb_mm = [{}, {}, {}]\nat = {{ X = {}, Z = {}, E = {} }}\n",
                    p.x,
                    p.y,
                    p.z,
                    120.0 - tip.truncate().length() * 1e3,
                    if turned > 0.0 {
                        120.0 - tip.z * 1e3
                    } else {
                        tip.z * 1e3
                    },
                    angle.to_degrees() + turned
                );
                text.push_str(&entry);
            }
            parse(&text).unwrap().mount(&limb, &stance)
        };
        let (found, off) = touched(0.0).unwrap();
        assert!(off.iter().all(|o| *o < 1e-9), "{off:?}");
        assert!((found.shift - upright.shift).length() < 1e-9);
        let said = touched(90.0).unwrap_err();
        assert!(said.contains("other way round"), "{said}");
    }
}
