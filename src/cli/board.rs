//! `hapdef board`: ports, and a simulated board.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use clap::Args;
use glam::DVec3;
use serde::Deserialize;
use serde_json::json;

use super::{Common, progress::Bar};
use crate::board::{
    Fault, Faults, Options, Press, Script, SimulatedBoard, Truth, fitting_gain, script_seed,
};
use crate::budget::Watch;
use crate::design::{self, Inputs, Sensing, Workshop};
use crate::elasticity::Touch;
use crate::inference::Chain;
use crate::link::{Doorway, host, ports};

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
    /// Samples a second, until the studio asks for others.
    #[arg(long, default_value_t = 1000)]
    pub rate: u16,
    /// Channels; as many as gauges when left out.
    #[arg(long)]
    pub channels: Option<usize>,
    /// Bits of the converter.
    #[arg(long, default_value_t = 12)]
    pub bits: u8,
    /// Standard deviation of a reading (microstrain); the project's when left out.
    #[arg(long)]
    pub noise: Option<f64>,
    /// What readings drift by in a second (microstrain).
    #[arg(long, default_value_t = 0.1)]
    pub drift: f64,
    /// What the gauges are off by: exact, gains (3 %), or all (gains, 1 mm, 3°).
    #[arg(long, default_value = "all")]
    pub workshop: String,
    /// Smallest and largest force of random touches (N).
    #[arg(long, num_args = 2, default_values_t = [2.0, 15.0])]
    pub force: Vec<f64>,
    /// Touches instead of random ones (.csv): `start_s,duration_s,x_mm,y_mm,z_mm,force_n`.
    #[arg(long)]
    pub script: Option<PathBuf>,
    /// Where the truth is written (.csv): `t_us,x_mm,y_mm,z_mm,force_n`, empty where nothing touches.
    #[arg(long)]
    pub truth: Option<PathBuf>,
    /// A channel (from 0) that fails, or an unplug: `dead:7@5`, `stuck:2@3+4`, `saturated:1`, `noisy:0`, `unplug@10+1`.
    #[arg(long)]
    pub fault: Vec<String>,
    /// Probability of a byte to have a bit turned over.
    #[arg(long, default_value_t = 0.0)]
    pub flip: f64,
    /// Probability of a byte to be left out.
    #[arg(long, default_value_t = 0.0)]
    pub drop: f64,
    /// Probability of a frame to come twice.
    #[arg(long, default_value_t = 0.0)]
    pub duplicate: f64,
    /// Probability of a frame to be lost.
    #[arg(long, default_value_t = 0.0)]
    pub lose: f64,
    /// Seconds after which it ends by itself.
    #[arg(long)]
    pub seconds: Option<f64>,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &BoardArgs) -> anyhow::Result<()> {
    if !args.simulate {
        list(args.common.json);
        return Ok(());
    }
    let loaded = args.common.load()?;
    let bar = Bar::default();
    let board = args.common.in_pool(|| {
        let watch = |p| bar.show(p);
        build(args, &loaded.inputs, &watch)
    });
    bar.finish();
    let board = board?;
    let mut truth = match &args.truth {
        Some(path) => Some(TruthFile::create(path)?),
        None => None,
    };
    let hosted = host(board, &doorway(args)?, move |t| {
        if let Some(file) = &mut truth {
            file.write(&t);
        }
    })
    .map_err(anyhow::Error::msg)?;
    println!("{}", json!({ "port": hosted.port }));
    std::io::stdout()
        .flush()
        .context("the port's name cannot be printed")?;
    while args.seconds.is_none_or(|s| hosted.seconds() < s) {
        std::thread::sleep(Duration::from_millis(20));
    }
    Ok(())
}

fn list(as_json: bool) {
    let all = ports();
    for port in &all {
        if as_json {
            println!(
                "{}",
                json!({ "port": port.path, "product": port.product, "likely": port.likely })
            );
        } else {
            println!(
                "{}{}  {}",
                port.path,
                if port.likely { " *" } else { "" },
                port.product
            );
        }
    }
    if all.is_empty() {
        eprintln!("There is no serial port. `hapdef board --simulate` starts a simulated board.");
    }
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

fn build(args: &BoardArgs, inputs: &Inputs, watch: Watch) -> anyhow::Result<SimulatedBoard> {
    let workshop = match args.workshop.as_str() {
        "exact" => Workshop::Exact,
        "gains" => Workshop::Gains,
        "all" => Workshop::All,
        other => anyhow::bail!("--workshop {other}: choose exact, gains or all"),
    };
    anyhow::ensure!(
        (1..=24).contains(&args.bits),
        "--bits {}: a converter has between 1 and 24",
        args.bits
    );
    anyhow::ensure!(args.rate > 0, "--rate 0: at least one sample a second");
    anyhow::ensure!(
        args.force[0] > 0.0 && args.force[0] <= args.force[1] && args.force[1].is_finite(),
        "--force: the smaller one first, both above zero"
    );
    let mut faults = Faults {
        flip: probability("--flip", args.flip)?,
        drop: probability("--drop", args.drop)?,
        duplicate: probability("--duplicate", args.duplicate)?,
        lose: probability("--lose", args.lose)?,
        ..Faults::default()
    };
    for text in &args.fault {
        faults.add(text.parse::<Fault>().map_err(anyhow::Error::msg)?);
    }
    let seed = inputs.project.budget.seed;
    let sensing = design::sense(inputs, &inputs.project.budget.budget(), watch)?;
    let script = match &args.script {
        Some(path) => given(path, inputs, &sensing)?,
        None => Script::random(
            places(inputs, &sensing, seed)?,
            [args.force[0], args.force[1]],
            script_seed(seed),
        ),
    };
    let most = strongest(&script).unwrap_or(args.force[1]);
    let options = Options {
        rate_hz: args.rate,
        channels: args.channels.unwrap_or(sensing.gauges.len()),
        noise: args.noise.unwrap_or(inputs.project.gauge.noise_microstrain) * 1e-6,
        drift: args.drift * 1e-6,
        chain: Chain {
            bits: args.bits,
            ..Chain::default()
        },
        ..options(inputs, sensing.gauges.len())
    };
    anyhow::ensure!(
        options.channels >= sensing.gauges.len() && options.channels <= crate::wire::MOST_CHANNELS,
        "--channels {}: the project has {} gauges, and a board at most {} channels",
        options.channels,
        sensing.gauges.len(),
        crate::wire::MOST_CHANNELS
    );
    Ok(simulated(
        inputs, &sensing, workshop, script, most, options, faults, watch,
    )?)
}

fn probability(name: &str, value: f64) -> anyhow::Result<f64> {
    anyhow::ensure!(
        (0.0..=1.0).contains(&value),
        "{name} {value}: a probability lies between 0 and 1"
    );
    Ok(value)
}

/// What a simulated board of a project is like where nothing else is asked for.
#[must_use]
pub fn options(inputs: &Inputs, channels: usize) -> Options {
    Options {
        seed: inputs.project.budget.seed,
        rate_hz: 1000,
        chain: Chain::default(),
        channels,
        noise: inputs.project.gauge.noise_microstrain * 1e-6,
        drift: 0.1e-6,
        offset: 100e-6,
        name: "Simulated board".into(),
    }
}

/// Places that random touches come to: off the nodes, with a seed that no training uses.
///
/// # Errors
/// As [`Sensing::touches`].
pub fn places(
    inputs: &Inputs,
    sensing: &Sensing,
    seed: u64,
) -> Result<Vec<Touch>, design::DesignError> {
    const PLACES: usize = 2000;
    const SEED: u64 = 0x70c4;
    sensing.touches(inputs, PLACES, seed.wrapping_add(SEED), false)
}

/// A board whose gain suits touches up to a force (N).
///
/// # Errors
/// As [`Sensing::truth`].
#[allow(clippy::too_many_arguments)]
pub fn simulated(
    inputs: &Inputs,
    sensing: &Sensing,
    workshop: Workshop,
    script: Script,
    most_force: f64,
    mut options: Options,
    faults: Faults,
    watch: Watch,
) -> Result<SimulatedBoard, design::DesignError> {
    let seed = inputs.project.budget.seed;
    let (truth, gains) = sensing.truth(workshop, seed, watch)?;
    let typical: Vec<Touch> = places(inputs, sensing, seed)?
        .into_iter()
        .take(300)
        .collect();
    options.chain.gain = fitting_gain(&truth, &gains, &typical, most_force, &options.chain);
    Ok(SimulatedBoard::new(truth, gains, script, options, faults))
}

fn strongest(script: &Script) -> Option<f64> {
    match script {
        Script::Given(presses) => presses.iter().map(|p| p.touch.force).max_by(f64::total_cmp),
        Script::Random(_) => None,
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    start_s: f64,
    duration_s: f64,
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    force_n: f64,
}

/// Touches from a file, put onto the part's surface.
fn given(path: &Path, inputs: &Inputs, sensing: &Sensing) -> anyhow::Result<Script> {
    let shown = path.display();
    let mut reader = csv::Reader::from_path(path)
        .with_context(|| format!("{shown}: the script cannot be read"))?;
    let mut presses = Vec::new();
    for (number, row) in reader.deserialize().enumerate() {
        let row: Row = row.with_context(|| {
            format!(
                "{shown}, touch {}: the columns are start_s,duration_s,x_mm,y_mm,z_mm,force_n",
                number + 1
            )
        })?;
        let sound = [
            row.start_s,
            row.duration_s,
            row.x_mm,
            row.y_mm,
            row.z_mm,
            row.force_n,
        ];
        anyhow::ensure!(
            sound.iter().all(|v| v.is_finite()) && row.duration_s > 0.0 && row.force_n > 0.0,
            "{shown}, touch {}: duration and force must be above zero",
            number + 1
        );
        let place = DVec3::new(row.x_mm, row.y_mm, row.z_mm) * 1e-3;
        let map = &sensing.drawn.map;
        let (at, _) = map.index.nearest(place);
        presses.push(Press {
            start_s: row.start_s,
            duration_s: row.duration_s,
            touch: Touch {
                position: map.mesh.point(at),
                normal: map.mesh.normal(at),
                force: row.force_n,
                tip_radius: inputs.project.tip().1,
            },
        });
    }
    Ok(Script::Given(presses))
}

struct TruthFile(BufWriter<File>);

impl TruthFile {
    fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path)
            .with_context(|| format!("{}: the truth cannot be written there", path.display()))?;
        let mut file = BufWriter::new(file);
        writeln!(file, "t_us,x_mm,y_mm,z_mm,force_n")?;
        file.flush()?;
        Ok(Self(file))
    }

    fn write(&mut self, truth: &Truth) {
        let line = match truth.touch {
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
        // A full disk must not stop the board.
        let _ = writeln!(self.0, "{line}");
        if truth.time_us % 100_000 < 1000 {
            let _ = self.0.flush();
        }
    }
}
