//! `hapdef board`: ports, and a simulated board.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use anyhow::Context;
use clap::Args;
use serde_json::json;

use super::common::Common;
use super::ranges::{between, whole};
use super::simulate::in_file;
use super::spared::Spared;
use super::{out, progress::Bar};
use crate::board::{
    ChannelFault, Disturbances, Drawn, Fault, Faults, GivenPress, Options, PRESSES, Press, Script,
    SimulatedBoard, Truth, aside, script_seed,
};
use crate::budget::Watch;
use crate::design::simulated_board::{options, places, simulated};
use crate::design::{self, Inputs, Sensing, Workshop};
use crate::elasticity::Touch;
use crate::given;
use crate::inference::Chain;
use crate::io::points;
use crate::link::{Doorway, Entrance, Recorder, check_length, host, ports, record};
use crate::mesh::TriMesh;
use crate::plain;
use crate::wire::MOST_CHANNELS;

#[derive(Args, Debug, Clone)]
pub struct BoardArgs {
    #[command(flatten)]
    pub common: Common,
    /// Simulate one; without it, the ports of this machine are listed, the likeliest board first.
    #[arg(long)]
    pub simulate: bool,
    /// Listen at a socket instead of a pseudo-terminal: HOST:PORT, port 0 for any that is free.
    #[arg(long, num_args = 0..=1, default_missing_value = "127.0.0.1:0")]
    pub tcp: Option<String>,
    /// Write what it sends into a recording (.hapdrec) instead, with the truth, without waiting for the time to pass.
    #[arg(long, requires = "simulate", conflicts_with = "tcp")]
    pub record: Option<PathBuf>,
    /// Samples a second, until the studio asks for others.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    pub rate: u16,
    /// Channels; as many as gauges when left out.
    #[arg(long, value_parser = whole(1, MOST_CHANNELS as u64))]
    pub channels: Option<usize>,
    /// Bits of the converter.
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u8).range(1..=24))]
    pub bits: u8,
    /// Standard deviation of a reading (microstrain); the project's when left out.
    #[arg(long, value_parser = between(0.0, MOST_MICROSTRAIN))]
    pub noise: Option<f64>,
    /// What readings drift by in a second (microstrain).
    #[arg(long, default_value_t = 0.1, value_parser = between(0.0, MOST_MICROSTRAIN))]
    pub drift: f64,
    /// What the gauges are off by: exact, gains, or all (gains, places, directions); as far as gauge.tolerance says.
    #[arg(long, default_value = "all", value_parser = workshop)]
    pub workshop: Workshop,
    /// Smallest and largest force of random touches (N).
    #[arg(long, num_args = 2, default_values_t = [2.0, 15.0], value_parser = between(*PRESSES.start(), *PRESSES.end()))]
    pub force: Vec<f64>,
    /// Shortest and longest time in which random touches rise and fall (ms).
    #[arg(long, num_args = 2, default_values_t = [80.0, 80.0], value_parser = between(0.1, 1e4))]
    pub ramp: Vec<f64>,
    /// How far random touches may push aside (degrees off the upright, in any direction).
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 80.0))]
    pub tilt: f64,
    #[command(flatten)]
    pub disturbed: DisturbanceArgs,
    /// Touches instead of random ones (.csv): `start_s,duration_s,x_mm,y_mm,z_mm,force_n`, and if wanted
    /// `ramp_ms,tilt_deg,towards_deg,radius_mm`; they may overlap.
    #[arg(long)]
    pub script: Option<PathBuf>,
    /// Where the truth is written (.csv): `t_us,x_mm,y_mm,z_mm,force_n`, empty where nothing touches. Where touches
    /// overlap or push aside, these are of the hardest, and `fx_n,fy_n,fz_n,touches` of all follow.
    #[arg(long)]
    pub truth: Option<PathBuf>,
    /// A channel (from 0) that fails, or an unplug: `dead:7@5`, `stuck:2@3+4`, `saturated:1`, `noisy:0`, `unplug@10+1`.
    #[arg(long)]
    pub fault: Vec<Fault>,
    /// Probability of a byte to have a bit turned over.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1.0))]
    pub flip: f64,
    /// Probability of a byte to be left out.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1.0))]
    pub drop: f64,
    /// Probability of a frame to come twice.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1.0))]
    pub duplicate: f64,
    /// Probability of a frame to be lost.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1.0))]
    pub lose: f64,
    /// Seconds after which it ends by itself; a recording ends a second after the last touch of a script.
    #[arg(long, value_parser = between(0.0, 1e9))]
    pub seconds: Option<f64>,
}

/// What there is in the readings beside touches.
#[derive(Args, Debug, Clone)]
pub struct DisturbanceArgs {
    /// Mains hum in every channel: amplitude (microstrain) and frequency (Hz; 50 when left out), as 20 or 20@60.
    #[arg(long, value_parser = hum)]
    pub hum: Option<(f64, f64)>,
    /// What all channels drift by together (microstrain a second), as a part that is warmed.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = between(-MOST_MICROSTRAIN, MOST_MICROSTRAIN))]
    pub warming: f64,
    /// What each channel drifts by alone (microstrain a second, standard deviation over the channels).
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, MOST_MICROSTRAIN))]
    pub warming_apart: f64,
    /// Creep of the plastic: share of a strain that follows later (%) and the time in which it does (s; 6 when left
    /// out), as 3 or 3@20.
    #[arg(long, value_parser = creep)]
    pub creep: Option<(f64, f64)>,
    /// Share of a reading that is of the channel before it (%).
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 100.0))]
    pub crosstalk: f64,
}

impl DisturbanceArgs {
    /// In SI units.
    fn disturbances(&self) -> Disturbances {
        Disturbances {
            hum: self.hum.map(|(amplitude, hertz)| (amplitude * 1e-6, hertz)),
            warming: self.warming * 1e-6,
            warming_apart: self.warming_apart * 1e-6,
            creep: self.creep.map(|(percent, time)| (percent / 100.0, time)),
            crosstalk: self.crosstalk / 100.0,
        }
    }
}

fn hum(text: &str) -> Result<(f64, f64), String> {
    let wanted = "write MICROSTRAIN or MICROSTRAIN@HERTZ, as 20@50, up to 100000 and 5000";
    pair(text, 50.0, MOST_MICROSTRAIN, 0.01..=5000.0).ok_or_else(|| wanted.into())
}

fn creep(text: &str) -> Result<(f64, f64), String> {
    let wanted = "write PERCENT or PERCENT@SECONDS, as 3@6, up to 100 and 1000000";
    pair(text, 6.0, 100.0, 1e-3..=1e6).ok_or_else(|| wanted.into())
}

/// An amount up to `most` and what stands behind the @, or what is usual.
fn pair(
    text: &str,
    usual: f64,
    most: f64,
    range: std::ops::RangeInclusive<f64>,
) -> Option<(f64, f64)> {
    let (amount, rest) = match text.split_once('@') {
        Some((amount, rest)) => (amount, rest.parse().ok()?),
        None => (text, usual),
    };
    let amount = amount.parse().ok().filter(|a| (0.0..=most).contains(a))?;
    range.contains(&rest).then_some((amount, rest))
}

/// More than any gauge bears.
const MOST_MICROSTRAIN: f64 = 1e5;

/// What the gauges are off by, as it is written.
fn workshop(text: &str) -> Result<Workshop, String> {
    match text {
        "exact" => Ok(Workshop::Exact),
        "gains" => Ok(Workshop::Gains),
        "all" => Ok(Workshop::All),
        _ => Err("choose exact, gains or all".into()),
    }
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &BoardArgs) -> anyhow::Result<()> {
    if !args.simulate {
        return list(args.common.json);
    }
    let loaded = args.common.load()?;
    // All that may be wrong is found before the model is computed.
    Spared::of(&loaded)
        .and("the script", args.script.as_deref())
        .check("--truth", args.truth.as_deref())?;
    let plan = Plan::new(args, &loaded.inputs)?;
    let (failed, failures) = channel();
    let mut truth = match &args.truth {
        Some(path) => Some(TruthFile::create(path, plan.says_more(args), failed)?),
        None => None,
    };
    let outlet = Outlet::open(args, &plan)?;
    let bar = Bar::default();
    let board = args.common.in_pool(|| {
        let watch = |p| bar.show(p);
        build(args, plan, &loaded.inputs, &watch)
    });
    bar.finish();
    let board = board?;
    let tell = move |t: Truth| {
        if let Some(file) = &mut truth {
            file.write(&t);
        }
    };
    match outlet {
        Outlet::Door(entrance) => serve(args, board, entrance, tell, &failures)?,
        Outlet::Recording { recorder, seconds } => {
            let path = recorder.path.clone();
            let samples = record(board, recorder, seconds, tell).map_err(anyhow::Error::msg)?;
            let said = json!({ "recording": path, "seconds": seconds, "samples": samples });
            out::line(&said.to_string())?;
        }
    }
    // What was written last may have failed too.
    check_truth(args, &failures)
}

/// Where the bytes of the board go.
enum Outlet {
    Door(Entrance),
    Recording { recorder: Recorder, seconds: f64 },
}

impl Outlet {
    fn open(args: &BoardArgs, plan: &Plan) -> anyhow::Result<Self> {
        let Some(path) = &args.record else {
            let entrance = doorway(args)?.open().map_err(anyhow::Error::msg)?;
            return Ok(Self::Door(entrance));
        };
        let last = plan.presses.as_deref().and_then(end_of);
        let seconds = args.seconds.or(last).context(
            "--record: nobody knows how long it goes on. Say so with --seconds, or give the touches with --script",
        )?;
        check_length(seconds, args.rate, plan.channels, args.bits)
            .map_err(|why| anyhow::anyhow!("--record: {why}"))?;
        Ok(Self::Recording {
            recorder: Recorder::create(path).map_err(anyhow::Error::msg)?,
            seconds,
        })
    }
}

/// A second after the last of some presses; nothing where there are none.
fn end_of(presses: &[GivenPress]) -> Option<f64> {
    let ends = presses.iter().map(|p| p.start_s + p.duration_s);
    Some(ends.max_by(f64::total_cmp)? + 1.0)
}

/// Keeps the board at its port until its time is over.
fn serve(
    args: &BoardArgs,
    board: SimulatedBoard,
    entrance: Entrance,
    tell: impl FnMut(Truth) + Send + 'static,
    failures: &Receiver<std::io::Error>,
) -> anyhow::Result<()> {
    let hosted = host(board, entrance, tell).map_err(anyhow::Error::msg)?;
    out::line(&json!({ "port": hosted.port }).to_string())?;
    while args.seconds.is_none_or(|s| hosted.seconds() < s) {
        check_truth(args, failures)?;
        std::thread::sleep(Duration::from_millis(20));
    }
    Ok(())
}

/// Ends where the truth can be written no more: a table that is cut would be believed.
fn check_truth(args: &BoardArgs, failures: &Receiver<std::io::Error>) -> anyhow::Result<()> {
    let Ok(failure) = failures.try_recv() else {
        return Ok(());
    };
    let path = args.truth.as_deref().unwrap_or(Path::new("--truth"));
    let what = format!(
        "{}: the truth ends here, because it can be written no more",
        path.display()
    );
    Err(anyhow::Error::new(failure).context(what))
}

fn list(as_json: bool) -> anyhow::Result<()> {
    let all = ports();
    for port in &all {
        // What a device calls itself comes from outside.
        let product = plain::message(&port.product);
        if as_json {
            let port = json!({ "port": port.path, "product": product, "likely": port.likely });
            out::line(&port.to_string())?;
        } else {
            let mark = if port.likely { " *" } else { "" };
            out::line(&format!("{}{mark}  {product}", port.path))?;
        }
    }
    if all.is_empty() {
        out::say("There is no serial port. `hapdef board --simulate` starts a simulated board.");
    }
    Ok(())
}

#[cfg(unix)]
#[allow(clippy::unnecessary_wraps, reason = "elsewhere it may fail")]
fn doorway(args: &BoardArgs) -> anyhow::Result<Doorway> {
    Ok(args.tcp.clone().map_or(Doorway::Terminal, Doorway::Socket))
}

#[cfg(not(unix))]
fn doorway(args: &BoardArgs) -> anyhow::Result<Doorway> {
    let address = args
        .tcp
        .clone()
        .context("there are no pseudo-terminals on this system: use --tcp")?;
    Ok(Doorway::Socket(address))
}

/// What was asked for, as far as it can be known to make sense without the model.
struct Plan {
    channels: usize,
    faults: Faults,
    /// Instead of random touches.
    presses: Option<Vec<GivenPress>>,
}

impl Plan {
    fn new(args: &BoardArgs, inputs: &Inputs) -> anyhow::Result<Self> {
        inputs.project.check()?;
        let gauges = inputs.project.selection.sites.len();
        let channels = args.channels.unwrap_or(gauges);
        anyhow::ensure!(
            (gauges..=MOST_CHANNELS).contains(&channels),
            "--channels {channels}: the project has {gauges} gauges, and a board at most {MOST_CHANNELS} channels"
        );
        anyhow::ensure!(
            args.force[0] <= args.force[1],
            "--force {} {}: the smaller one first",
            args.force[0],
            args.force[1]
        );
        anyhow::ensure!(
            args.ramp[0] <= args.ramp[1],
            "--ramp {} {}: the shorter one first",
            args.ramp[0],
            args.ramp[1]
        );
        let script = args.script.as_deref();
        Ok(Self {
            channels,
            faults: faults(args, channels)?,
            presses: script
                .map(|path| read_script(path, &inputs.part))
                .transpose()?,
        })
    }
}

impl Plan {
    /// Whether touches overlap or push aside.
    fn says_more(&self, args: &BoardArgs) -> bool {
        let presses = self.presses.as_deref().unwrap_or_default();
        let mut spans: Vec<[f64; 2]> = (presses.iter())
            .map(|p| [p.start_s, p.start_s + p.duration_s])
            .collect();
        spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let overlap = spans.windows(2).any(|pair| pair[1][0] < pair[0][1]);
        overlap || args.tilt > 0.0 || presses.iter().any(|p| p.tilt_deg > 0.0)
    }
}

fn faults(args: &BoardArgs, channels: usize) -> anyhow::Result<Faults> {
    let mut faults = Faults {
        flip: args.flip,
        drop: args.drop,
        duplicate: args.duplicate,
        lose: args.lose,
        ..Faults::default()
    };
    for &fault in &args.fault {
        if let Fault::Channel(ChannelFault { channel, .. }) = fault {
            anyhow::ensure!(
                channel < channels,
                "--fault on channel {channel}: the board has {channels} channels, from 0"
            );
        }
        faults.add(fault);
    }
    Ok(faults)
}

fn build(
    args: &BoardArgs,
    plan: Plan,
    inputs: &Inputs,
    watch: Watch,
) -> anyhow::Result<SimulatedBoard> {
    let seed = inputs.project.budget.seed;
    let sensing = design::sensing(inputs, &inputs.project.budget.budget(), watch)?;
    let script = match &plan.presses {
        Some(presses) => on_surface(presses, inputs, &sensing),
        None => Script::random(
            places(inputs, &sensing, seed)?,
            Drawn {
                forces: [args.force[0], args.force[1]],
                ramps: [args.ramp[0] * 1e-3, args.ramp[1] * 1e-3],
                tilt_deg: args.tilt,
            },
            script_seed(seed),
        ),
    };
    let most = strongest(&script).unwrap_or(args.force[1]);
    let options = Options {
        rate_hz: args.rate,
        noise: args.noise.unwrap_or(inputs.project.gauge.noise_microstrain) * 1e-6,
        drift: args.drift * 1e-6,
        disturbances: args.disturbed.disturbances(),
        chain: Chain {
            bits: args.bits,
            ..Chain::default()
        },
        ..options(inputs, plan.channels)
    };
    Ok(simulated(
        inputs,
        &sensing,
        args.workshop,
        script,
        most,
        options,
        plan.faults,
        watch,
    )?)
}

fn strongest(script: &Script) -> Option<f64> {
    match script {
        Script::Given(presses) => presses.iter().map(|p| p.touch.force).max_by(f64::total_cmp),
        Script::Random(_) => None,
    }
}

/// Presses from a file, all of them near the part.
fn read_script(path: &Path, part: &TriMesh) -> anyhow::Result<Vec<GivenPress>> {
    let presses = points::read_presses(path)?;
    given::check_reach(part, "touch", presses.iter().map(|p| p.position))
        .map_err(|error| in_file(error, path, path))?;
    Ok(presses)
}

/// Presses put onto the part's surface.
fn on_surface(presses: &[GivenPress], inputs: &Inputs, sensing: &Sensing) -> Script {
    let map = &sensing.drawn.map;
    let up = inputs.project.part.axis.stance(&inputs.part).up();
    let press = |asked: &GivenPress| {
        let (at, _) = map.mesh.index().nearest(asked.position);
        let normal = map.mesh.normal(at);
        Press {
            start_s: asked.start_s,
            duration_s: asked.duration_s,
            touch: Touch {
                position: map.mesh.point(at),
                normal,
                force: asked.force,
                tip_radius: asked.radius.unwrap_or(inputs.project.tip().1),
            },
            ramp_s: asked.ramp_s,
            aside: aside(normal, up, asked.tilt_deg, asked.towards_deg),
        }
    };
    Script::Given(presses.iter().map(press).collect())
}

/// Columns of a truth of several touches, or of some that push aside.
const MORE: &str = ",fx_n,fy_n,fz_n,touches";

/// What really happens, as a table. What goes wrong with it is told to `failed`, once.
struct TruthFile {
    file: BufWriter<File>,
    /// Whether there is more to say than one touch that presses straight in.
    says_more: bool,
    failed: Option<Sender<std::io::Error>>,
}

impl TruthFile {
    fn create(
        path: &Path,
        says_more: bool,
        failed: Sender<std::io::Error>,
    ) -> anyhow::Result<Self> {
        let more = if says_more { MORE } else { "" };
        let begin = || {
            let mut file = BufWriter::new(File::create(path)?);
            writeln!(file, "t_us,x_mm,y_mm,z_mm,force_n{more}")?;
            file.flush()?;
            Ok::<_, std::io::Error>(file)
        };
        let file = begin()
            .with_context(|| format!("{}: the truth cannot be written there", path.display()))?;
        Ok(Self {
            file,
            says_more,
            failed: Some(failed),
        })
    }

    fn write(&mut self, truth: &Truth) {
        let mut line = match truth.touch {
            Some(Touch {
                position, force, ..
            }) => {
                let p = position * 1e3;
                format!(
                    "{},{:.4},{:.4},{:.4},{force:.5}",
                    truth.time_us, p.x, p.y, p.z
                )
            }
            None => format!("{},,,,", truth.time_us),
        };
        if self.says_more {
            let all = truth.force;
            let more = match truth.touches {
                0 => ",,,,0".to_owned(),
                touches => format!(",{:.5},{:.5},{:.5},{touches}", all.x, all.y, all.z),
            };
            line.push_str(&more);
        }
        let written = writeln!(self.file, "{line}");
        self.note(written);
        if truth.time_us % 100_000 < 1000 {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let flushed = self.file.flush();
        self.note(flushed);
    }

    fn note(&mut self, outcome: std::io::Result<()>) {
        if let Err(error) = outcome
            && let Some(failed) = self.failed.take()
        {
            // Who no longer listens is about to end anyway.
            let _ = failed.send(error);
        }
    }
}

impl Drop for TruthFile {
    fn drop(&mut self) {
        self.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_disturbs_is_an_amount_and_if_wanted_more() {
        assert_eq!(hum("20"), Ok((20.0, 50.0)));
        assert_eq!(hum("5@60.02"), Ok((5.0, 60.02)));
        assert_eq!(creep("3@20"), Ok((3.0, 20.0)));
        for wrong in [
            "", "@50", "nan", "20@", "20@0", "20@nan", "1e9", "-1", "20@50@60",
        ] {
            assert!(hum(wrong).is_err() && creep(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn presses_far_from_the_part_are_refused_with_their_line() {
        let part = super::super::bundled().unwrap().inputs.part;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("touches.csv");
        let head = "start_s,duration_s,x_mm,y_mm,z_mm,force_n\n1,1,22.5,22.5,60,8\n";
        std::fs::write(&path, format!("{head}2,1,0,0,0,1\n")).unwrap();
        assert_eq!(read_script(&path, &part).unwrap().len(), 2);
        std::fs::write(&path, format!("{head}1,1,1e160,0,0,8\n")).unwrap();
        let said = format!("{:#}", read_script(&path, &part).unwrap_err());
        assert!(
            said.contains("touches.csv, line 3") && said.contains("from the part"),
            "{said}"
        );
        assert!(said.len() < 500, "{said}");
    }
}
