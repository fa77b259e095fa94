//! `hapdef collect --by-hand`: asks for one press after another.

use std::io::{BufRead as _, IsTerminal as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

use anyhow::{Context as _, ensure};
use glam::DVec3;
use serde_json::json;

use super::CollectArgs;
use crate::cli::out;
use crate::design::{Inputs, Sensing};
use crate::link::{Address, Pace};
use crate::plain;
use crate::test_bed::{HARDEST_N, HandOrder, HandRun, HandSays, PressOrder, PressingRun, pressed};

/// Presses what is left of a run.
pub fn run(
    args: &CollectArgs,
    run: PressingRun,
    inputs: Inputs,
    sensing: Arc<Sensing>,
) -> anyhow::Result<()> {
    let board = board(args)?;
    let run = HandRun::new(run, inputs, sensing)?;
    let all = run.plan.places.len();
    if !run.plan.left.is_empty() {
        // Somebody at a terminal says it of the press that was; a script says all of them beforehand.
        let ahead = !std::io::stdin().is_terminal();
        let shown = Arc::new(AtomicUsize::new(NOTHING));
        let inbox = typed(&run, (!ahead).then(|| Arc::clone(&shown)));
        out::say("hapdef: waiting for the board; leave the limb alone until its rest is taken");
        run.press_at(board, (&mut || next(&inbox), ahead), |says| {
            match &says {
                HandSays::Press { number, .. } => shown.store(*number, Ordering::Relaxed),
                HandSays::Wait => shown.store(NOTHING, Ordering::Relaxed),
                _ => {}
            }
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

/// In place of a press's number, before there is one.
const NOTHING: usize = usize::MAX;

/// What is typed, a line each: of the press that is asked for as it is typed, where somebody sees that.
fn typed(run: &HandRun, shown: Option<Arc<AtomicUsize>>) -> Receiver<PressOrder> {
    out::say(if run.plan.has_sensor {
        "write skip, stop, or at X Y Z (mm) where you press elsewhere, and press Enter"
    } else {
        "write how hard each press was (N), skip, stop, or at X Y Z (mm) where you pressed elsewhere, and press Enter"
    });
    let (orders, inbox) = channel();
    // Without a thread there are no orders, and every press is as hard as is meant.
    let _ = std::thread::Builder::new()
        .name("orders".into())
        .spawn(move || read_lines(&orders, shown.as_deref()));
    inbox
}

fn read_lines(orders: &Sender<PressOrder>, shown: Option<&AtomicUsize>) {
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        let Some(order) = order_of(line.trim()) else {
            let line = plain::quote(line.trim());
            out::say(&format!("{line} is no force, no place and no order"));
            continue;
        };
        let number = shown.map(|shown| shown.load(Ordering::Relaxed));
        let number = number.filter(|&number| number != NOTHING);
        if orders.send(PressOrder { number, order }).is_err() {
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
            let force = force.trim_end_matches(['N', ' ']).replace(',', ".");
            let force: f64 = force.parse().ok()?;
            (force > 0.0 && force <= HARDEST_N).then_some(HandOrder::Force(force))
        }
    }
}

/// The next line. Where nobody can type, every press is as hard as is meant.
fn next(inbox: &Receiver<PressOrder>) -> Option<PressOrder> {
    match inbox.try_recv() {
        Ok(order) => Some(order),
        Err(TryRecvError::Empty) => None,
        Err(TryRecvError::Disconnected) => Some(HandOrder::AsMeant.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_as_people_write_them() {
        for (line, order) in [
            ("", HandOrder::AsMeant),
            ("9.5", HandOrder::Force(9.5)),
            ("9,5 N", HandOrder::Force(9.5)),
            ("skip", HandOrder::Skip),
            ("at", HandOrder::Elsewhere(None)),
            (
                "at 1, -2.5 3",
                HandOrder::Elsewhere(Some(DVec3::new(1.0, -2.5, 3.0) * 1e-3)),
            ),
        ] {
            assert_eq!(order_of(line), Some(order), "{line}");
        }
        for line in [
            "0", "-3", "20000", "nan", "inf", "at 1 2", "at 1 2 x", "1.2.3", "go",
        ] {
            assert_eq!(order_of(line), None, "{line}");
        }
    }
}
