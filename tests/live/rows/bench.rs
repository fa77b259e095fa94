//! What the rows are tried with: a folder with projects, a script, what a board sent, and what is heard of it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::cli;
use hapdef::design;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use super::limb::Limb;
use crate::promise::{hapdef, text, with};

/// How finely the listener computes the limb, unless a row says it itself.
fn quality() -> String {
    std::env::var("HAPDEF_QUALITY").unwrap_or_else(|_| "draft".into())
}

/// Holds what the bundled limb and its gauges hold; of others it is said where they do not.
pub fn hold(holds: bool, what: &str) {
    let is_other = !Limb::tried().is_the_bundled() || quality() != "draft";
    if is_other && !holds {
        println!("does not hold {what}");
    }
    assert!(holds || is_other, "{what}");
}

/// A touch that has ended is forgotten within so much (s).
pub const LET_GO_S: f64 = 0.3;

/// A press as a script says it.
#[derive(Clone, Copy)]
pub struct Press {
    pub start_s: f64,
    pub duration_s: f64,
    pub place: DVec3,
    pub force: f64,
    pub ramp_ms: f64,
    pub tilt_deg: f64,
    pub towards_deg: f64,
    pub radius_mm: f64,
}

impl Press {
    pub fn new(start_s: f64, duration_s: f64, place: DVec3, force: f64) -> Self {
        Self {
            start_s,
            duration_s,
            place,
            force,
            ramp_ms: 80.0,
            tilt_deg: 0.0,
            towards_deg: 0.0,
            radius_mm: 5.0,
        }
    }

    /// When it is there in full and a moment has passed, a shorter one of a tap.
    pub fn full_s(&self) -> std::ops::Range<f64> {
        let ramp = 1e-3 * self.ramp_ms;
        let moment = 0.12_f64.min(0.2 * self.duration_s);
        self.start_s + ramp + moment..self.start_s + self.duration_s - ramp
    }

    pub fn goes_on_at(&self, time_s: f64) -> bool {
        (self.start_s..self.start_s + self.duration_s + LET_GO_S).contains(&time_s)
    }
}

/// What `listen` says of one sample.
pub struct Heard {
    pub time_s: f64,
    pub kind: Option<String>,
    /// The place (mm) by the estimator that was asked for.
    pub place: Option<DVec3>,
    /// By matching: places (mm), forces (N) and radii of the regions (mm), the hardest first.
    pub touches: Vec<(DVec3, f64, f64)>,
    pub channels_ok: u64,
}

impl Heard {
    pub fn of(line: &str) -> Self {
        let said: Value = serde_json::from_str(line).unwrap();
        let number = |of: &Value, key: &str| of[key].as_f64().unwrap();
        let touch = |t: &Value| {
            let [x, y, z] = ["x_mm", "y_mm", "z_mm"].map(|key| number(t, key));
            let at = DVec3::new(x, y, z);
            (at, number(t, "force_n"), number(t, "uncertainty_mm"))
        };
        let [x, y, z] = ["x_mm", "y_mm", "z_mm"].map(|key| said[key].as_f64());
        Self {
            time_s: 1e-6 * number(&said, "t_us"),
            place: x.zip(y).zip(z).map(|((x, y), z)| DVec3::new(x, y, z)),
            kind: said["kind"].as_str().map(str::to_owned),
            touches: said["touches"]
                .as_array()
                .unwrap()
                .iter()
                .map(touch)
                .collect(),
            channels_ok: said["channels_ok"].as_u64().unwrap(),
        }
    }
}

/// A bench: a folder with projects, a script, and what a board sent.
pub struct Bench {
    told: String,
    /// That its project may name.
    arrays: Option<PathBuf>,
    folder: tempfile::TempDir,
    pub presses: Vec<Press>,
    /// Of the workshop that glued its gauges, and of whoever presses.
    seed: u64,
}

impl Bench {
    pub fn of(presses: Vec<Press>) -> Self {
        Self::on(&Limb::tried(), presses)
    }

    /// On other gauges of the bundled limb, by their name.
    pub fn with_ten(ten: &str, presses: Vec<Press>) -> Self {
        Self::on(&Limb::WithTen(ten.into()), presses)
    }

    /// On another limb of `assets`, by its name.
    pub fn on_bundled(name: &'static str, presses: Vec<Press>) -> Self {
        Self::on(&Limb::Bundled(name), presses)
    }

    fn on(limb: &Limb, presses: Vec<Press>) -> Self {
        let bench = Self {
            told: limb.told(),
            arrays: limb.arrays(),
            folder: limb.folder(),
            presses,
            seed: 4,
        };
        std::fs::write(bench.at("script.csv"), bench.script(0.0)).unwrap();
        bench.save("board.hapdef.toml", &bench.told);
        bench
    }

    /// Of another workshop.
    pub fn of_workshop(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The presses as a table; as somebody tells of them who is off by so much (mm), forces by 3 %.
    pub fn script(&self, off_mm: f64) -> String {
        let mut rng = ChaCha8Rng::seed_from_u64(3 + self.seed);
        let mut off = |most: f64| most * rng.random_range(-1.0..1.0);
        let mut text = String::from(
            "start_s,duration_s,x_mm,y_mm,z_mm,force_n,ramp_ms,tilt_deg,towards_deg,radius_mm\n",
        );
        for p in &self.presses {
            let place = p.place + DVec3::new(off(off_mm), off(off_mm), off(off_mm));
            let force = p.force * (1.0 + if off_mm > 0.0 { off(0.05) } else { 0.0 });
            let _ = writeln!(
                text,
                "{:.4},{:.4},{:.4},{:.4},{:.4},{force:.4},{},{},{},{}",
                p.start_s,
                p.duration_s,
                place.x,
                place.y,
                place.z,
                p.ramp_ms,
                p.tilt_deg,
                p.towards_deg,
                p.radius_mm
            );
        }
        text
    }

    /// The bundled project with other values of some keys.
    pub fn project(&self, keys: &[(&str, &str)]) -> PathBuf {
        let told = self.told.clone();
        let changed = keys.iter().fold(told, |p, (key, to)| with(&p, key, to));
        self.save("told.hapdef.toml", &changed)
    }

    /// A project, with the arrays that it may name.
    fn save(&self, name: &str, project: &str) -> PathBuf {
        let path = self.at(name);
        std::fs::write(&path, project).unwrap();
        if let Some(arrays) = &self.arrays {
            std::fs::copy(arrays, path.with_extension("npz")).unwrap();
        }
        path
    }

    /// The project of somebody who knows that no gauge is off, and how far touches drag along the surface.
    pub fn exact(&self, friction_percent: &str) -> PathBuf {
        self.project(&[
            ("place_mm", "0.0"),
            ("angle_deg", "0.0"),
            ("gain_percent", "0.0"),
            ("friction_percent", friction_percent),
        ])
    }

    /// What a board sends while it is pressed.
    pub fn record(&self, options: &[&str]) -> PathBuf {
        self.record_at("draft", options)
    }

    /// The same, of a board whose limb is computed as finely as that.
    pub fn record_at(&self, quality: &str, options: &[&str]) -> PathBuf {
        let recording = self.at("board.hapdrec");
        let (script, project) = (self.at("script.csv"), self.at("board.hapdef.toml"));
        let mut arguments = vec!["board", text(&project), "--simulate", "--quality", quality];
        let seed = self.seed.to_string();
        arguments.extend(["--seed", &seed, "--script", text(&script)]);
        arguments.extend(["--record", text(&recording)]);
        arguments.extend(options);
        hapdef(&arguments);
        recording
    }

    /// Samples of full presses, each with the press.
    pub fn full<'a>(&'a self, heard: &'a [Heard]) -> impl Iterator<Item = (&'a Press, &'a Heard)> {
        self.presses.iter().flat_map(move |press| {
            let full = press.full_s();
            let during = move |h: &&Heard| full.contains(&h.time_s);
            heard.iter().filter(during).map(move |h| (press, h))
        })
    }

    /// Share of the samples of full presses in which anything is felt.
    pub fn felt(&self, heard: &[Heard]) -> f64 {
        let (felt, all) = (self.full(heard)).fold((0, 0), |(felt, all), (_, h)| {
            (felt + u32::from(!h.touches.is_empty()), all + 1_u32)
        });
        f64::from(felt) / f64::from(all)
    }

    /// Presses, by their number, of which a sample is not felt.
    pub fn unfelt(&self, heard: &[Heard]) -> Vec<usize> {
        let is_unfelt = |press: &Press| {
            let full = press.full_s();
            let mut during = heard.iter().filter(|h| full.contains(&h.time_s));
            during.any(|h| h.touches.is_empty())
        };
        (0..self.presses.len())
            .filter(|&k| is_unfelt(&self.presses[k]))
            .collect()
    }

    /// Mean distance (mm) of the hardest touch that is heard from the press, and the share whose region holds it.
    pub fn off(&self, heard: &[Heard]) -> (f64, f64) {
        let found: Vec<(f64, f64)> = (self.full(heard))
            .filter_map(|(press, h)| {
                let &(at, _, radius) = h.touches.first()?;
                Some((at.distance(press.place), radius))
            })
            .collect();
        let count = found.len() as f64;
        let mean = found.iter().map(|f| f.0).sum::<f64>() / count;
        let held = found.iter().filter(|(off, radius)| off <= radius).count();
        (mean, held as f64 / count)
    }

    /// Samples from some time on in which something is felt that is not there, be it unclear what.
    pub fn ghosts(&self, heard: &[Heard], from_s: f64) -> usize {
        let is_pressed = |time_s: f64| self.presses.iter().any(|p| p.goes_on_at(time_s));
        let felt = (heard.iter()).filter(|h| h.time_s >= from_s && h.kind.is_some());
        felt.filter(|h| !is_pressed(h.time_s)).count()
    }
}

/// What is heard of a recording with a project, and what is said beside.
pub fn listen(recording: &Path, project: &Path) -> (Vec<Heard>, String) {
    listen_with(recording, project, &["--quality", &quality()])
}

pub fn listen_with(recording: &Path, project: &Path, more: &[&str]) -> (Vec<Heard>, String) {
    let done = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(["listen", text(recording), "--fast"])
        .args(["--project", text(project)])
        .args(more)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{said}");
    let lines = String::from_utf8(done.stdout).unwrap();
    (lines.lines().map(Heard::of).collect(), said)
}

/// So many places on the limb's outside (mm), off the held ends.
pub fn places(count: usize) -> Vec<DVec3> {
    static ALL: OnceLock<Vec<DVec3>> = OnceLock::new();
    let all = ALL.get_or_init(|| match Limb::tried() {
        Limb::Other(project) => felt_places(&project),
        _ => places_around(),
    });
    spread(all, count)
}

/// So many places (mm) on another limb of `assets` that its gauges feel.
pub fn places_on(name: &'static str, count: usize) -> Vec<DVec3> {
    spread(&felt_places(&Limb::Bundled(name).project()), count)
}

fn spread(all: &[DVec3], count: usize) -> Vec<DVec3> {
    (0..count).map(|k| all[k * all.len() / count]).collect()
}

/// Places that are tried.
const TRIED: usize = 300;

/// Where the gauges of a project feel a newton ten times above a noise of a microstrain: what they are blind to is the
/// design's, and not what is tried here.
fn felt_places(project: &Path) -> Vec<DVec3> {
    const SEED: u64 = 0x7e57;
    const FELT: f64 = 10e-6;
    let inputs = cli::open(project, None).unwrap().inputs;
    let sensing = design::sensing(&inputs, &Quality::Draft.budget(), &unwatched).unwrap();
    let touches = sensing.touches(&inputs, TRIED, SEED, true).unwrap();
    let map = &sensing.drawn.map;
    let is_felt = |place: &DVec3| {
        let reading = map.at(map.mesh.index().nearest(*place).0);
        reading.iter().map(|x| x * x).sum::<f64>().sqrt() >= FELT
    };
    let felt: Vec<DVec3> = touches.iter().map(|t| t.position).filter(is_felt).collect();
    println!("{} of {} places are felt", felt.len(), touches.len());
    felt.iter().map(|p| *p * 1e3).collect()
}

/// On the bundled limb, one above another around it.
fn places_around() -> Vec<DVec3> {
    let part = cli::open(&Limb::Bundled("limb").project(), None)
        .unwrap()
        .inputs
        .part;
    let mesh = part.as_given();
    let on_the_limb = |k: usize| {
        let angle = std::f64::consts::TAU * 0.381_966 * k as f64;
        let z = 18.0 + 84.0 * (k as f64 + 0.5) / TRIED as f64;
        let around = DVec3::new(31.85 * angle.cos(), 31.85 * angle.sin(), z) * 1e-3;
        let place = mesh.point(mesh.index().nearest(around).0);
        (place.distance(around) < 0.5e-3).then_some(place * 1e3)
    };
    (0..TRIED).filter_map(on_the_limb).collect()
}

/// Presses one after another, each everywhere alike.
pub fn in_turn(
    first_s: f64,
    every_s: f64,
    lasts_s: f64,
    places: &[DVec3],
    force: f64,
) -> Vec<Press> {
    let press = |(k, place): (usize, &DVec3)| {
        Press::new(first_s + every_s * k as f64, lasts_s, *place, force)
    };
    places.iter().enumerate().map(press).collect()
}

pub const BOARD: [&str; 6] = ["--rate", "200", "--bits", "16", "--workshop", "exact"];

pub fn with_more<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&BOARD[..], more].concat()
}
