//! `hapdef collect --by-hand`: asks for one press after another.

use std::io::{BufRead as _, IsTerminal as _};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

use anyhow::{Context as _, ensure};
use serde_json::json;

use super::CollectArgs;
use crate::cli::out;
use crate::design::{Inputs, Sensing};
use crate::link::{Address, Pace};
use crate::plain;
use crate::test_bed::{HandOrder, HandRun, HandSays, PressingRun, pressed};

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
    out::say(&match says {
        HandSays::Press(which, all, at) => {
            let p = *at * 1e3;
            format!(
                "press {which} of {all}: at ({:.1}, {:.1}, {:.1}) mm with about {meant_n} N; hold it for a second",
                p.x, p.y, p.z
            )
        }
        HandSays::LetGo => "read: let go".to_owned(),
        HandSays::HowHard => format!("how hard was it, in N? (Enter: {meant_n})"),
        HandSays::Unsteady => {
            "it was not taken: leave the limb alone for a moment, then press again and hold it for a second".to_owned()
        }
        HandSays::NothingWaits => "no press waits for a force".to_owned(),
        HandSays::Taken(Some(force)) => format!("taken, with {force} N"),
        HandSays::Taken(None) => "taken".to_owned(),
        HandSays::Board(text) => format!("hapdef: {text}"),
    });
}

/// What is typed, a line each.
fn typed(run: &HandRun) -> Receiver<HandOrder> {
    out::say(if run.has_sensor {
        "write skip or stop and press Enter"
    } else {
        "write how hard each press was (N), skip or stop, and press Enter"
    });
    let (orders, inbox) = channel();
    // Without a thread there are no orders, and every press is as hard as is meant.
    let _ = std::thread::Builder::new()
        .name("orders".into())
        .spawn(move || read_lines(&orders));
    inbox
}

fn read_lines(orders: &Sender<HandOrder>) {
    /// Nobody presses harder (N).
    const HARDEST: f64 = 1e4;
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        let order = match line.trim() {
            "" => HandOrder::AsMeant,
            "skip" => HandOrder::Skip,
            "stop" => HandOrder::Stop,
            other => match other.trim_end_matches(['N', ' ']).parse::<f64>() {
                Ok(force) if force > 0.0 && force <= HARDEST => HandOrder::Force(force),
                _ => {
                    out::say(&format!("{} is no force and no order", plain::quote(other)));
                    continue;
                }
            },
        };
        if orders.send(order).is_err() {
            return;
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
