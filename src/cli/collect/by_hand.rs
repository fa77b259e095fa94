//! `hapdef collect --by-hand`: asks for one press after another.

use std::io::{BufRead as _, IsTerminal as _};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

use anyhow::{Context as _, ensure};
use glam::DVec3;
use serde_json::json;

use super::CollectArgs;
use crate::cli::out;
use crate::design::{Inputs, Sensing};
use crate::link::{Address, Pace};
use crate::plain;
use crate::test_bed::{HandOrder, HandRun, HandSays, PressingRun, pressed};

/// Nobody presses harder (N).
const HARDEST_N: f64 = 1e4;

/// Presses what is left of a run.
pub fn run(
    args: &CollectArgs,
    run: PressingRun,
    inputs: Inputs,
    sensing: Arc<Sensing>,
) -> anyhow::Result<()> {
    let board = board(args)?;
    let run = HandRun::new(run, inputs, sensing)?;
    let all = run.places.len();
    if !run.left.is_empty() {
        let inbox = typed(&run);
        out::say("hapdef: waiting for the board; leave the limb alone until its rest is taken");
        // Somebody at a terminal says it of the press that was; a script says all of them beforehand.
        let ahead = !std::io::stdin().is_terminal();
        run.press_at(board, (&mut || next(&inbox), ahead), |says| {
            say(&says, args.force_n());
        })?;
    }
    let done = pressed(&run.folder)?.len();
    out::line(&json!({ "presses": all, "pressed": done }).to_string())?;
    ensure!(
        done == all,
        "{done} of {all} presses are kept; the same command goes on with the rest"
    );
    Ok(())
}

fn board(args: &CollectArgs) -> anyhow::Result<Address> {
    let text = args
        .board
        .as_ref()
        .context("name the port of the board with --board")?;
    let address = Address::parse(text, args.board_baud, Pace::Real);
    ensure!(
        !address.is_recording(),
        "{address}: a recording cannot be pressed"
    );
    address.check().map_err(anyhow::Error::msg)?;
    Ok(address)
}

fn say(says: &HandSays, meant_n: f64) {
    let words = says.in_words(meant_n);
    out::say(&match says {
        HandSays::Board(_) => format!("hapdef: {words}"),
        _ => words,
    });
}

/// What is typed, a line each.
fn typed(run: &HandRun) -> Receiver<HandOrder> {
    out::say(if run.has_sensor {
        "write skip, stop, or at X Y Z (mm) where you press elsewhere, and press Enter"
    } else {
        "write how hard each press was (N), skip, stop, or at X Y Z (mm) where you pressed elsewhere, and press Enter"
    });
    let (orders, inbox) = channel();
    // Without a thread there are no orders, and every press is as hard as is meant.
    let _ = std::thread::Builder::new()
        .name("orders".into())
        .spawn(move || read_lines(&orders));
    inbox
}

fn read_lines(orders: &Sender<HandOrder>) {
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        let Some(order) = order_of(line.trim()) else {
            let line = plain::quote(line.trim());
            out::say(&format!("{line} is no force, no place and no order"));
            continue;
        };
        if orders.send(order).is_err() {
            return;
        }
    }
}

fn order_of(line: &str) -> Option<HandOrder> {
    if line == "at" {
        return Some(HandOrder::Elsewhere(None));
    }
    if let Some(place) = line.strip_prefix("at ") {
        let numbers: Vec<f64> = place
            .split([' ', ','])
            .filter(|word| !word.is_empty())
            .map(|word| word.parse().ok().filter(|mm: &f64| mm.is_finite()))
            .collect::<Option<_>>()?;
        let &[x, y, z] = &numbers[..] else {
            return None;
        };
        return Some(HandOrder::Elsewhere(Some(DVec3::new(x, y, z) * 1e-3)));
    }
    match line {
        "" => Some(HandOrder::AsMeant),
        "skip" => Some(HandOrder::Skip),
        "stop" => Some(HandOrder::Stop),
        force => {
            let force: f64 = force.trim_end_matches(['N', ' ']).parse().ok()?;
            (force > 0.0 && force <= HARDEST_N).then_some(HandOrder::Force(force))
        }
    }
}

/// The next line. Where nobody can type, every press is as hard as is meant.
fn next(inbox: &Receiver<HandOrder>) -> Option<HandOrder> {
    match inbox.try_recv() {
        Ok(order) => Some(order),
        Err(TryRecvError::Empty) => None,
        Err(TryRecvError::Disconnected) => Some(HandOrder::AsMeant),
    }
}
