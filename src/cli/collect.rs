//! `hapdef collect`: a machine presses the limb at many places, and what the gauges read is written down.

mod args;

use std::io::BufRead as _;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};

use anyhow::ensure;
use serde_json::json;

pub use self::args::CollectArgs;
use super::common::make_folder;
use super::listen::sensing_for;
use super::out;
use super::progress::Bar;
use super::spared::Spared;
use crate::bench::{Collector, Ended, News};
use crate::link::{Address, BenchOrder, Pace};
use crate::plain;
use crate::test_bed::{Ready, Run, press_on_simulated, pressed};

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &CollectArgs) -> anyhow::Result<()> {
    let loaded = args.common.load()?;
    loaded.inputs.project.check()?;
    Spared::of(&loaded).check("--out", Some(&args.out))?;
    let run = Run::new(args.asked(), &loaded.inputs, &args.out)?;
    let ports = ports(args)?;
    make_folder(&args.out)?;
    let sensing = Arc::new(sensing_for(&args.common, &loaded)?);
    let ready = Ready::new(run, loaded.inputs, sensing)?;
    for line in ready.in_words() {
        out::say(&line);
    }
    if args.plan_only {
        let reach = &ready.reach;
        let said = json!({ "presses": reach.presses.len(), "left_out": reach.left_out.len() });
        return out::line(&said.to_string());
    }
    out::say(&ready.checked_in_words());
    let mut collector = ready.collector();
    let (ended, failed) = if collector.left() == 0 {
        (Ended::Finished, 0)
    } else {
        press(args, &ready, ports, &mut collector)?
    };
    finish(&ready, &collector, &ended, failed)
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

/// Presses what is left; how it ended, and how many failed.
fn press(
    args: &CollectArgs,
    ready: &Ready,
    ports: Option<(Address, Address)>,
    collector: &mut Collector,
) -> anyhow::Result<(Ended, usize)> {
    let all = ready.reach.presses.len();
    let (mut done, mut failed) = (ready.done.len(), 0);
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
            out::say(&format!("press {number} failed: {why}"));
        }
        News::Answer(_) => {
            if let Err(error) = ready.keep(&news) {
                out::say(&format!("hapdef: {error:#}"));
            }
        }
        News::Discarded(none) => done = done.saturating_sub(none.len()),
        News::Note(_) | News::Keep | News::Begun(_) => {}
    };
    let ended = if let Some((printer, board)) = ports {
        let (orders, inbox) = channel();
        obey_signals(orders.clone());
        obey_stdin(orders);
        let mut next = || inbox.try_recv().ok();
        ready.press_at(collector, (&printer, &board), &mut next, tell)?
    } else {
        let bar = Bar::default();
        let pressing = || {
            let watch = |p| bar.show(p);
            let mut begun = false;
            let mut orders = || {
                // What was computed for it is there.
                if !std::mem::replace(&mut begun, true) {
                    bar.finish();
                }
                None
            };
            press_on_simulated(ready, collector, &watch, &mut orders, tell)
        };
        args.common.in_pool(pressing)?
    };
    Ok((ended, failed))
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
    ready: &Ready,
    collector: &Collector,
    ended: &Ended,
    failed: usize,
) -> anyhow::Result<()> {
    let (presses, done) = (ready.reach.presses.len(), pressed(&ready.folder)?.len());
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
