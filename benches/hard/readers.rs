//! The process that watches: it hands inputs out, notices who dies or hangs, and keeps what was found.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::hard::reader::Reader;
use crate::hard::spoil;
use crate::tally::{Kind, Tally};
use crate::worker::AT;
use crate::{Args, create, write};

/// Inputs a reader where nobody says how many.
const INPUTS: u64 = 20_000;
/// Inputs that a process is begun for.
const PIECE: u64 = 20_000;
/// An input that takes longer never ends.
const HANG: Duration = Duration::from_secs(20);
/// Between two looks at a process.
const LOOK: Duration = Duration::from_millis(20);
/// Inputs that are kept of each kind of wrong.
const KEPT: usize = 3;
/// Characters that are kept of what a process said when it died.
const LAST_WORDS: usize = 300;
const ERRORS: &str = "stderr";

/// Inputs of one reader.
#[derive(Clone, Copy)]
struct Piece {
    reader: Reader,
    first: u64,
    end: u64,
}

/// Tries all readers; whether everything held.
pub fn run(args: &Args) -> Result<bool, String> {
    create(&args.out)?;
    let pieces = pieces(args);
    let (next, tallies) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    let work = |number: usize| -> Result<(), String> {
        let folder = args.out.join(format!("worker-{number}"));
        create(&folder)?;
        while let Some(piece) = pieces.get(next.fetch_add(1, Ordering::Relaxed)) {
            let tally = try_piece(args, *piece, &folder)?;
            let mut all = tallies.lock().unwrap_or_else(PoisonError::into_inner);
            let known: &mut Tally = all.entry(piece.reader.name()).or_default();
            known.add(tally);
            let (name, inputs, wrong) = (piece.reader.name(), known.inputs, known.wrong.len());
            eprintln!("{name}: {inputs} inputs, {wrong} wrong");
        }
        std::fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..args.workers())
            .map(|number| scope.spawn(move || work(number)))
            .collect();
        threads
            .into_iter()
            .try_for_each(|t| t.join().unwrap_or_else(|_| Err("a thread died".into())))
    })?;
    let tallies = tallies.into_inner().unwrap_or_else(PoisonError::into_inner);
    report(args, &tallies)?;
    Ok(tallies.values().all(|t| t.wrong.is_empty()))
}

fn pieces(args: &Args) -> Vec<Piece> {
    let end = args.first + args.inputs.unwrap_or(INPUTS);
    let mut pieces = Vec::new();
    for reader in args.readers() {
        let firsts = (args.first..end).step_by(PIECE as usize);
        pieces.extend(firsts.map(|first| Piece {
            reader,
            first,
            end: end.min(first + PIECE),
        }));
    }
    pieces
}

/// Goes on behind every input that ends its process.
fn try_piece(args: &Args, piece: Piece, folder: &Path) -> Result<Tally, String> {
    let mut tally = Tally {
        next: piece.first,
        ..Tally::default()
    };
    while tally.next < piece.end {
        let rest = Piece {
            first: tally.next,
            ..piece
        };
        let Some(why) = supervised(args, rest, folder, &mut tally)? else {
            break;
        };
        let Some(number) = number_at(folder) else {
            return Err(format!("no input could be read: {why}"));
        };
        let number = number.max(tally.next);
        tally.wrong.push((number, why));
        tally.inputs += number + 1 - tally.next;
        tally.next = number + 1;
    }
    Ok(tally)
}

/// Runs a process to its end; why it ended, unless it did what it should.
fn supervised(
    args: &Args,
    piece: Piece,
    folder: &Path,
    tally: &mut Tally,
) -> Result<Option<String>, String> {
    let _ = std::fs::remove_file(folder.join(AT));
    let mut child = begin(args, piece, folder).map_err(|e| e.to_string())?;
    let output = child.stdout.take();
    let (why, heard) = std::thread::scope(|scope| {
        let listener = scope.spawn(move || output.map_or_else(Vec::new, listen));
        (
            watch(&mut child, folder),
            listener.join().unwrap_or_default(),
        )
    });
    for part in heard {
        tally.add(part);
    }
    why.map_err(|e| e.to_string())
}

fn begin(args: &Args, piece: Piece, folder: &Path) -> std::io::Result<Child> {
    let mut command = Command::new(std::env::current_exe()?);
    command
        .args(["--reader", piece.reader.name()])
        .arg(format!("--seed={}", args.seed))
        .arg(format!("--first={}", piece.first))
        .arg(format!("--inputs={}", piece.end - piece.first))
        .arg(format!("--seconds={}", args.seconds))
        .arg(format!("--memory-gb={}", args.memory_gb))
        .arg("--worker")
        .arg(folder);
    if let Some(seeds) = &args.seeds {
        command.arg("--seeds").arg(seeds);
    }
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(File::create(folder.join(ERRORS))?)
        .spawn()
}

/// Everything that a process tells until it ends. What was cut off is not known.
fn listen(stdout: ChildStdout) -> Vec<Tally> {
    let lines = BufReader::new(stdout).lines().map_while(Result::ok);
    lines
        .filter_map(|line| serde_json::from_str(&line).ok())
        .collect()
}

/// Waits for a process; why it ended, unless it did what it should.
fn watch(child: &mut Child, folder: &Path) -> std::io::Result<Option<String>> {
    let (mut number, mut since) = (None, Instant::now());
    loop {
        if let Some(status) = child.try_wait()? {
            let why = || format!("the process died, {status}: {}", last_words(folder));
            return Ok((!status.success()).then(why));
        }
        let now = number_at(folder);
        if now != number {
            (number, since) = (now, Instant::now());
        } else if since.elapsed() > HANG {
            child.kill()?;
            child.wait()?;
            return Ok(Some(format!("no end after {} s", HANG.as_secs())));
        }
        std::thread::sleep(LOOK);
    }
}

/// The input that is being read.
fn number_at(folder: &Path) -> Option<u64> {
    let bytes = std::fs::read(folder.join(AT)).ok()?;
    Some(u64::from_le_bytes(bytes.try_into().ok()?))
}

fn last_words(folder: &Path) -> String {
    let said = std::fs::read(folder.join(ERRORS)).unwrap_or_default();
    let said = String::from_utf8_lossy(&said);
    said.trim().chars().take(LAST_WORDS).collect()
}

/// Keeps the inputs that matter and says what came of all.
fn report(args: &Args, tallies: &BTreeMap<&str, Tally>) -> Result<(), String> {
    let mut table = String::from(
        "| reader | inputs | read | refused | kinds of message | inputs a second and core | slowest (s) | most memory (MB) | panics caught | wrong |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut words = String::new();
    for reader in args.readers() {
        let Some(tally) = tallies.get(reader.name()) else {
            continue;
        };
        row(&mut table, reader, tally);
        heading(&mut words, reader, tally);
        keep(args, reader, tally)?;
    }
    println!("{table}");
    write(&args.out.join("report.md"), table)?;
    write(&args.out.join("words.md"), words)?;
    println!(
        "findings, the slowest and the largest inputs, and every kind of message: {}",
        args.out.display()
    );
    Ok(())
}

fn row(table: &mut String, reader: Reader, tally: &Tally) {
    let count = |kinds: &BTreeMap<String, Kind>| -> u64 { kinds.values().map(|k| k.count).sum() };
    let _ = writeln!(
        table,
        "| {} | {} | {} | {} | {} | {:.0} | {:.3} | {:.1} | {} | {} |",
        reader.name(),
        tally.inputs,
        tally.taken,
        count(&tally.said),
        tally.said.len(),
        tally.inputs as f64 / tally.seconds.max(1e-9),
        tally.slowest.0,
        tally.largest.0 as f64 / 1e6,
        count(&tally.caught),
        tally.wrong.len()
    );
}

/// Every kind of message once, to be read by a person.
fn heading(words: &mut String, reader: Reader, tally: &Tally) {
    let _ = writeln!(words, "# {}\n", reader.name());
    for (what, kinds) in [("said", &tally.said), ("caught", &tally.caught)] {
        for kind in kinds.values() {
            let example = kind.example.replace('\n', "\n  ");
            let (count, first) = (kind.count, kind.first);
            let _ = writeln!(words, "- {what} {count} times, first by {first}: {example}");
        }
    }
    words.push('\n');
}

/// Writes what is worth another look: some inputs of each kind of wrong, the slowest and the largest.
fn keep(args: &Args, reader: Reader, tally: &Tally) -> Result<(), String> {
    let files = args.files(reader)?;
    let input = |number: u64| spoil::input(&files, args.seed, number);
    let named = |folder: &str, number: u64| {
        let folder = args.out.join(folder);
        let (name, ending) = (reader.name(), reader.ending());
        let name = format!("{name}-{}-{number}.{ending}", args.seed);
        create(&folder).map(|()| folder.join(name))
    };
    for (folder, number) in [("slowest", tally.slowest.1), ("largest", tally.largest.1)] {
        write(&named(folder, number)?, input(number))?;
    }
    for (shape, wrong) in tally.kinds_of_wrong() {
        println!("{}: {} times: {shape}", reader.name(), wrong.len());
        for (number, why) in wrong.into_iter().take(KEPT) {
            let path = named("wrong", *number)?;
            write(&path, input(*number))?;
            write(&path.with_extension("why"), why)?;
        }
    }
    Ok(())
}
