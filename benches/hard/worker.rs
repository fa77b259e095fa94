//! The process that reads: one input after the other, each with its time and memory.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use hapdef::io::mesh_file::parse_mesh;
use hapdef::mesh::repair::Repair;

use crate::hard::reader::{Outcome, Reader};
use crate::hard::spoil;
use crate::tally::{Tally, count};
use crate::{Args, memory};

/// File with the number of the input that is being read.
pub const AT: &str = "at";
/// Inputs between two words to the process that watches.
const SAID: u64 = 1000;
/// Over what an input may take, at which nothing more is given.
const CEILING: usize = 4;

/// The last panic, also of one that was caught.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

/// What came of one input.
struct Trial {
    outcome: Result<Outcome, String>,
    seconds: f64,
    bytes: usize,
    caught: Option<String>,
}

/// Reads the inputs that the arguments name and tells what came of them, a tally a line.
pub fn run(args: &Args, folder: &Path) -> Result<(), String> {
    let [reader] = args.reader[..] else {
        return Err("one reader at a time".into());
    };
    // Everything in this one thread, so that memory and time are those of one input.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global();
    pool.map_err(|e| e.to_string())?;
    // Readers silence the panics that they catch with a hook of their own: once it is there, ours goes before it
    // and knows of them.
    drop(parse_mesh(&[], "stl", None, 1.0, 0, &Repair::default()));
    std::panic::set_hook(Box::new(|info| {
        *PANIC.lock().unwrap_or_else(PoisonError::into_inner) = Some(info.to_string());
    }));
    let files = args.files(reader)?;
    hapdef::memory::allow(args.memory() as u64);
    memory::bound(args.memory().saturating_mul(CEILING));
    let mut at = File::create(folder.join(AT)).map_err(|e| e.to_string())?;
    let last = args.first + args.inputs.unwrap_or(1);
    let mut tally = Tally::default();
    for number in args.first..last {
        at.seek(SeekFrom::Start(0))
            .and_then(|_| at.write_all(&number.to_le_bytes()))
            .map_err(|e| e.to_string())?;
        let bytes = spoil::input(&files, args.seed, number);
        note(
            &mut tally,
            args,
            number,
            tried(args, reader, &bytes, folder),
        );
        let is_told = tally.inputs >= SAID || !tally.wrong.is_empty() || number + 1 == last;
        if is_told {
            tally.next = number + 1;
            let line = serde_json::to_string(&tally).map_err(|e| e.to_string())?;
            writeln!(std::io::stdout(), "{line}").map_err(|e| e.to_string())?;
            tally = Tally::default();
        }
    }
    Ok(())
}

/// One that takes too long is given a second chance: the machine may have had other things to do.
fn tried(args: &Args, reader: Reader, bytes: &[u8], folder: &Path) -> Trial {
    let first = once(reader, bytes, folder);
    if first.seconds <= args.seconds {
        return first;
    }
    let second = once(reader, bytes, folder);
    if second.seconds < first.seconds {
        second
    } else {
        first
    }
}

fn once(reader: Reader, bytes: &[u8], folder: &Path) -> Trial {
    let held = memory::forget();
    let begun = Instant::now();
    let caught = catch_unwind(AssertUnwindSafe(|| reader.hold(bytes, folder)));
    let seconds = begun.elapsed().as_secs_f64();
    let bytes = memory::most().saturating_sub(held);
    let mut panic = PANIC.lock().unwrap_or_else(PoisonError::into_inner).take();
    let outcome = caught.unwrap_or_else(|_| Err(panic.take().unwrap_or_else(|| "panic".into())));
    Trial {
        outcome,
        seconds,
        bytes,
        caught: panic,
    }
}

fn note(tally: &mut Tally, args: &Args, number: u64, trial: Trial) {
    tally.inputs += 1;
    tally.seconds += trial.seconds;
    if trial.seconds > tally.slowest.0 {
        tally.slowest = (trial.seconds, number);
    }
    if trial.bytes as u64 > tally.largest.0 {
        tally.largest = (trial.bytes as u64, number);
    }
    if let Some(panic) = &trial.caught {
        count(&mut tally.caught, number, panic);
    }
    match trial.outcome {
        Ok(Outcome::Taken) => tally.taken += 1,
        Ok(Outcome::Refused(said)) => count(&mut tally.said, number, &said),
        Err(wrong) => tally.wrong.push((number, wrong)),
    }
    if trial.seconds > args.seconds {
        let wrong = format!("it took {:.1} s", trial.seconds);
        tally.wrong.push((number, wrong));
    }
    if trial.bytes > args.memory() {
        let wrong = format!("it took {:.1} GB", trial.bytes as f64 / 1e9);
        tally.wrong.push((number, wrong));
    }
}
