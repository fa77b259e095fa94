//! `hapdef board`: ports, and a simulated board.

mod args;
mod disturbed;
mod plan;
mod truth;

use std::path::Path;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use anyhow::Context;
use serde_json::json;

pub use self::args::{BoardArgs, workshop};
use self::plan::{BoardPlan, on_surface};
use self::truth::TruthFile;
use super::spared::Spared;
use super::{out, progress::Bar};
use crate::board::{
    BoardOptions, GivenPress, HardestUse, PressScript, RandomPresses, SimulatedBoard, Truth,
    script_seed,
};
use crate::budget::Watch;
use crate::design::simulated_board::{BoardRequest, LASTS_S, options, places, simulated};
use crate::design::{self, Inputs};
use crate::inference::Chain;
use crate::link::{Doorway, Entrance, Recorder, check_length, host, ports, record};
use crate::plain;

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
    let plan = BoardPlan::new(args, &loaded.inputs)?;
    let (failed, failures) = channel();
    let mut truth = match &args.truth {
        Some(path) => Some(TruthFile::create(
            path,
            plan.says_more(args, &loaded.inputs.project.making()),
            failed,
        )?),
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
            let chain = *board.chain();
            let samples = record(board, recorder, seconds, tell).map_err(anyhow::Error::msg)?;
            let said = json!({ "recording": path, "seconds": seconds, "samples": samples,
                "gain": chain.gain, "microstrain_per_count": per_count(&chain) });
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
    fn open(args: &BoardArgs, plan: &BoardPlan) -> anyhow::Result<Self> {
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
    let chain = *board.chain();
    let hosted = host(board, entrance, tell).map_err(anyhow::Error::msg)?;
    let said = json!({ "port": hosted.port, "gain": chain.gain, "microstrain_per_count": per_count(&chain) });
    out::line(&said.to_string())?;
    while args.seconds.is_none_or(|s| hosted.seconds() < s) {
        check_truth(args, failures)?;
        std::thread::sleep(Duration::from_millis(20));
    }
    Ok(())
}

/// What a count stands for (microstrain), to three digits.
fn per_count(chain: &Chain) -> f64 {
    let microstrain = 1e6 / chain.counts_per_strain();
    let digits = 10_f64.powi(2 - microstrain.log10().floor() as i32);
    (microstrain * digits).round() / digits
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

fn build(
    args: &BoardArgs,
    plan: BoardPlan,
    inputs: &Inputs,
    watch: Watch,
) -> anyhow::Result<SimulatedBoard> {
    let seed = inputs.project.budget.seed;
    let sensing = design::sensing(inputs, &inputs.project.budget.budget(), watch)?;
    let script = match &plan.presses {
        Some(presses) => on_surface(presses, inputs, &sensing),
        None => PressScript::random(
            places(inputs, &sensing, seed)?,
            RandomPresses {
                forces: [args.force[0], args.force[1]],
                ramps: [args.ramp[0] * 1e-3, args.ramp[1] * 1e-3],
                tilt_deg: args.tilt,
                making: args.making(&inputs.project.making()),
            },
            script_seed(seed),
        ),
    };
    let scripted = plan.presses.as_deref().and_then(end_of);
    let lasts_s = args.seconds.or(scripted);
    let hardest = HardestUse {
        force: strongest(&script).unwrap_or(args.force[1]),
        seconds: lasts_s.unwrap_or(LASTS_S),
    };
    let usual = options(inputs, plan.channels);
    let options = BoardOptions {
        rate_hz: args.rate,
        noise: args.noise.unwrap_or(inputs.project.gauge.noise_microstrain) * 1e-6,
        drift: args.drift * 1e-6,
        disturbances: args.disturbed.disturbances(&usual.disturbances),
        chain: Chain {
            bits: args.bits,
            gain: args.gain.unwrap_or(Chain::default().gain),
            ..Chain::default()
        },
        ..usual
    };
    let asked = BoardRequest {
        workshop: args.workshop,
        script,
        hardest: args.gain.is_none().then_some(hardest),
        options,
        faults: plan.faults,
    };
    Ok(simulated(inputs, &sensing, asked, watch)?)
}

fn strongest(script: &PressScript) -> Option<f64> {
    match script {
        PressScript::Given(presses) => presses.iter().map(|p| p.touch.force).max_by(f64::total_cmp),
        PressScript::Random(_) | PressScript::Held(..) => None,
    }
}
