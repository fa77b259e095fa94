//! `hapdef collect`: a machine presses the limb at many places, and what the gauges read is written down.

mod args;
mod places;
mod reference;
mod simulated;

use std::collections::BTreeSet;
use std::io::BufRead as _;
use std::path::Path;
use std::sync::mpsc::{Sender, channel};

use anyhow::{Context as _, ensure};
use serde_json::json;

pub use self::args::CollectArgs;
use self::places::{places, reached};
use super::common::make_folder;
use super::listen::sensing_for;
use super::out;
use super::spared::Spared;
use crate::bench::{Collector, Ended, Limits, News, Planned, Reach, Reference};
use crate::design::Sensing;
use crate::io::bench_folder::{self, About, limb_key};
use crate::io::machine_file::{self, MachineFile};
use crate::io::project_file::LoadedProject;
use crate::io::source;
use crate::link::{Address, BenchOrder, Pace, Recorder, bench_presses, press_at_ports};
use crate::plain;

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &CollectArgs) -> anyhow::Result<()> {
    let loaded = args.common.load()?;
    loaded.inputs.project.check()?;
    Spared::of(&loaded).check("--out", Some(&args.out))?;
    let (about, file) = about(args, &loaded)?;
    let ports = ports(args)?;
    make_folder(&args.out)?;
    let begun = About::read(&args.out)?;
    if let Some(before) = &begun {
        same(before, &about, &args.out)?;
    }
    let sensing = sensing_for(&args.common, &loaded)?;
    let places = places(args, &loaded, &sensing, begun.is_some())?;
    let reach = reached(&places, &loaded, &sensing, &file, &mut |text| {
        out::say(text);
    })?;
    if begun.is_none() {
        about.write(&args.out)?;
        let all: Vec<_> = reach.presses.iter().map(|p| (p.at, p.normal)).collect();
        bench_folder::write_plan(&args.out, &all)?;
    }
    say_plan(&reach, &about);
    if args.plan_only {
        let said = json!({ "presses": reach.presses.len(), "left_out": reach.left_out.len() });
        return out::line(&said.to_string());
    }
    let done = pressed(&args.out)?;
    let presses = reach.presses.len();
    // Numbers are the lines of plan.csv, which holds what was in reach when it was written.
    let number = |k: usize| if begun.is_some() { reach.asked[k] } else { k };
    let left: Vec<(usize, Planned)> = (reach.presses.iter().copied().enumerate())
        .map(|(k, press)| (number(k), press))
        .filter(|(number, _)| !done.contains(number))
        .collect();
    if !done.is_empty() {
        let there = plain::either(done.len(), "press", "presses");
        out::say(&format!(
            "{there} of {presses} are there already; places are those that it was begun with, and --places and --points are not looked at"
        ));
    }
    let limits = Limits {
        step: about.step_mm * 1e-3,
        depth: about.depth_mm * 1e-3,
        enough: about.force_n,
        most_force: about.most_force_n,
        ..Limits::default()
    };
    let machine = file.machine.clone();
    let mut collector = Collector::new(machine, limits, left.iter().copied(), reach.retreat);
    match reference::reference(args, &loaded, &sensing, &file)? {
        Some(reference) => {
            out::say(&on_reference(&reference));
            collector = collector.checked_at(reference);
        }
        None => out::say(
            "steps that a motor loses are not looked for: no place is pressed again and again",
        ),
    }
    let (ended, failed) = if left.is_empty() {
        (Ended::Finished, 0)
    } else {
        let bench = (&loaded, &sensing, &file);
        press(args, bench, ports, &mut collector, &reach, done.len())?
    };
    finish(args, &collector, &ended, presses, failed)
}

/// What is asked for, and its machine.
fn about(args: &CollectArgs, loaded: &LoadedProject) -> anyhow::Result<(About, MachineFile)> {
    let project = &loaded.inputs.project;
    let gauges = project.selection.sites.len();
    ensure!(
        gauges > 0,
        "the project has no gauges yet: choose them first (hapdef design)"
    );
    ensure!(
        args.force < args.most_force,
        "--force {} must be less than --most-force {}",
        args.force,
        args.most_force
    );
    let text = match &args.machine {
        Some(path) => source::read_text(path)?,
        None => machine_file::PAPER.to_owned(),
    };
    let file = match &args.machine {
        Some(path) => machine_file::read(path)?,
        None => machine_file::parse(&text).map_err(anyhow::Error::msg)?,
    };
    let mut file = file;
    if args.simulate
        && let Some(sensor) = &mut file.machine.sensor
    {
        // The simulated board has its force sensor behind the gauges.
        sensor.channel = gauges;
    }
    let settings = project.live.settings(gauges);
    let about = About {
        format: About::format(),
        limb: limb_key(&loaded.inputs),
        machine: text,
        seed: project.budget.seed,
        step_mm: args.step,
        depth_mm: args.depth,
        force_n: args.force,
        most_force_n: args.most_force,
        channels: settings.channels,
        gauge_factor: settings.chain.gauge_factor,
        active_arms: settings.chain.active_arms,
        simulated: args.simulate,
    };
    Ok((about, file))
}

/// Printer and board, where they are real.
fn ports(args: &CollectArgs) -> anyhow::Result<Option<(Address, Address)>> {
    if args.simulate || args.plan_only {
        return Ok(None);
    }
    let (Some(printer), Some(board)) = (&args.printer, &args.board) else {
        anyhow::bail!(
            "name the ports of both with --printer and --board, or press on a simulated bench with --simulate"
        );
    };
    let address = |text: &str, baud| Address::parse(text, baud, Pace::Real);
    let ports = (
        address(printer, args.printer_baud),
        address(board, args.board_baud),
    );
    for port in [&ports.0, &ports.1] {
        ensure!(
            !port.is_recording(),
            "{port}: a recording cannot be pressed"
        );
        port.check().map_err(anyhow::Error::msg)?;
    }
    Ok(Some(ports))
}

/// A run is gone on with only as it was begun.
fn same(before: &About, now: &About, folder: &Path) -> anyhow::Result<()> {
    let what = if before.limb != now.limb {
        "another limb or other gauges"
    } else if before.machine != now.machine {
        "another machine file"
    } else if before != now {
        "other settings (seed, step, depth, forces, channels, or simulated and not)"
    } else {
        return Ok(());
    };
    anyhow::bail!(
        "{}: a run was begun there with {what}. Name another folder, or go on as it was begun",
        folder.display()
    )
}

fn say_plan(reach: &Reach, about: &About) {
    /// Of a step with its settling and reading, and of a press beside its steps (s).
    const STEP_S: f64 = 0.45;
    const PRESS_S: f64 = 9.0;
    let presses = reach.presses.len();
    let steps = (about.depth_mm / about.step_mm).ceil() + 14.0;
    let hours = presses as f64 * (PRESS_S + STEP_S * steps) / 3600.0;
    out::say(&format!(
        "{} of up to {:.2} mm or {} N, at most {hours:.1} hours of the machine's time",
        plain::either(presses, "press", "presses"),
        about.depth_mm,
        about.force_n
    ));
    if let Some((_, why)) = reach.left_out.first() {
        out::say(&format!(
            "{} left out, the first because {why}",
            plain::either(reach.left_out.len(), "place is", "places are"),
        ));
    }
}

fn on_reference(reference: &Reference) -> String {
    let at = reference.at.at * 1e3;
    format!(
        "({:.1}, {:.1}, {:.1}) mm is pressed at first, after every {} and at the end, to see whether the machine lost steps",
        at.x,
        at.y,
        at.z,
        plain::either(reference.every, "press", "presses")
    )
}

/// Presses that are in the folder's recordings.
fn pressed(folder: &Path) -> anyhow::Result<BTreeSet<usize>> {
    let mut done = BTreeSet::new();
    for part in bench_folder::parts(folder)? {
        let bytes = std::fs::read(&part).with_context(|| plain::path(&part))?;
        done.extend(bench_presses(&bytes).iter().map(|p| p.number));
    }
    Ok(done)
}

/// Presses what is left; how it ended, and how many failed.
fn press(
    args: &CollectArgs,
    (loaded, sensing, file): (&LoadedProject, &Sensing, &MachineFile),
    ports: Option<(Address, Address)>,
    collector: &mut Collector,
    reach: &Reach,
    before: usize,
) -> anyhow::Result<(Ended, usize)> {
    let recorder = Recorder::create(&bench_folder::next_part(&args.out)?);
    let recorder = recorder.map_err(anyhow::Error::msg)?;
    let all = reach.presses.len();
    let (mut done, mut failed) = (before, 0);
    let mut failures = Vec::new();
    let tell = |news: News| match news {
        News::Say(text) => out::say(&format!("hapdef: {text}")),
        News::Press { failed: None, .. } => {
            done += 1;
            if done.is_multiple_of(10) || done == all {
                out::say(&format!("{done} of {all} presses"));
            }
        }
        News::Press {
            number,
            failed: Some(why),
        } => {
            failed += 1;
            failures.push(number);
            out::say(&format!("press {number} failed: {why}"));
        }
        News::Answer(answer) => {
            if let Err(error) = bench_folder::write_answer(&args.out, &answer) {
                out::say(&format!("hapdef: {error}"));
            }
        }
        News::Discarded(presses) => done = done.saturating_sub(presses),
        News::Note(_) | News::Keep => {}
    };
    let ended = match ports {
        Some((printer, board)) => {
            let (orders, inbox) = channel();
            obey_signals(orders.clone());
            obey_stdin(orders);
            press_at_ports(collector, (&printer, &board), recorder, &inbox, tell)
        }
        None => simulated::press(
            args,
            (loaded, sensing, file),
            reach,
            collector,
            recorder,
            tell,
        )?,
    };
    Ok((ended.map_err(anyhow::Error::msg)?, failed))
}

/// Ctrl-C and a request to end take the tip back before the program ends.
fn obey_signals(orders: Sender<BenchOrder>) {
    let stop = move || {
        let _ = orders.send(BenchOrder::Stop);
    };
    if ctrlc::set_handler(stop).is_err() {
        out::say("Ctrl-C does not take the tip back here: write stop");
    }
}

/// Lines on standard input: pause, resume, stop, kill.
fn obey_stdin(orders: Sender<BenchOrder>) {
    out::say(
        "write pause, resume, stop (takes the tip back) or kill (halts the machine) and press Enter",
    );
    let listen = move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            let order = match line.trim() {
                "pause" => BenchOrder::Pause,
                "resume" => BenchOrder::Resume,
                "stop" => BenchOrder::Stop,
                "kill" => BenchOrder::Kill,
                "" => continue,
                other => {
                    out::say(&format!("{} is no order", plain::quote(other)));
                    continue;
                }
            };
            if orders.send(order).is_err() {
                return;
            }
        }
    };
    // Without a thread there are no orders, and all else works.
    let _ = std::thread::Builder::new()
        .name("orders".into())
        .spawn(listen);
}

fn finish(
    args: &CollectArgs,
    collector: &Collector,
    ended: &Ended,
    presses: usize,
    failed: usize,
) -> anyhow::Result<()> {
    let done = pressed(&args.out)?.len();
    let said = json!({
        "presses": presses,
        "pressed": done,
        "failed": failed,
        "moves": collector.moves,
        "lines_sent_again": collector.resent(),
        "hardest_n": collector.hardest,
    });
    out::line(&said.to_string())?;
    match ended {
        Ended::Finished => Ok(()),
        Ended::Stopped(why) => anyhow::bail!(
            "{why}. {done} of {presses} presses are kept; the same command goes on with the rest"
        ),
    }
}
