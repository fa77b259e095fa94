//! The program itself on spoiled files: it ends with 0 and finite numbers, or with 1 or 2 and a message of one
//! screen, within 20 s and the memory that it was given.

use std::fmt::Write as _;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use hapdef::cli::examples::Example;
use hapdef::io::dataset_file;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::hard::reader::{PLACES, Reader, packed};
use crate::hard::{property, seeds, spoil};
use crate::{Args, create, write};

/// Runs where nobody says how many.
const RUNS: u64 = 200;
/// What a run may take.
const SECONDS: Duration = Duration::from_secs(20);
/// What it may hold over what it is told that it may take: the program, its libraries and its stacks.
const BESIDE: f64 = 0.3e9;
const LOOK: Duration = Duration::from_millis(20);
/// Inputs before this one may be files as they are.
const SPOILED: u64 = 1000;
/// Little to compute: what is tried is what comes in.
const LIMITS: &str = "\n[budget.limits]\nvertices = 300\ntouches = 60\ncandidates = 20\nselection_touches = 60\nselection_candidates = 20\ntuning_touches = 60\n";

/// What datasets are asked.
const QUESTIONS: [&str; 6] = [
    "select --selector greedy-svr --sensors 2 --folds 2 --json",
    "select --selector pca-qr --sensors 2 --folds 2 --json",
    "select --selector entropy --sensors 2 --folds 2 --json",
    "select --selector mutual-information --sensors 2 --folds 2 --json",
    "evaluate --sites 0,2 --folds 2 --json",
    "evaluate --sites 1 --folds 2 --tune --baseline --json",
];

/// What is spoiled, and which command gets it. Those that compute long come rarely.
#[derive(Clone, Copy, Debug)]
enum Trial {
    Mesh(Reader),
    Project,
    Touches,
    Dataset(Reader),
    Recording,
    Script,
}

/// How a run ended.
struct Run {
    trial: Trial,
    number: u64,
    code: Option<i32>,
    seconds: f64,
    /// Bytes, where the system says so.
    memory: f64,
    said: String,
    printed: String,
}

/// Runs the program; whether everything held.
pub fn run(args: &Args) -> Result<bool, String> {
    create(&args.out)?;
    let last = args.first + args.inputs.unwrap_or(RUNS);
    let (next, runs) = (AtomicU64::new(args.first), Mutex::new(Vec::new()));
    let work = || -> Result<(), String> {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= last {
                return Ok(());
            }
            let folder = args.out.join(format!("whole-{}-{number}", args.seed));
            let (run, wrong) = one(args, number, &folder)?;
            if wrong.is_empty() {
                // What was wrong stays, with the command.
                std::fs::remove_dir_all(&folder).map_err(|e| e.to_string())?;
            }
            let mut all = runs.lock().unwrap_or_else(PoisonError::into_inner);
            all.push((run, wrong));
        }
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..args.workers()).map(|_| scope.spawn(work)).collect();
        threads
            .into_iter()
            .try_for_each(|t| t.join().unwrap_or_else(|_| Err("a thread died".into())))
    })?;
    let mut runs = runs.into_inner().unwrap_or_else(PoisonError::into_inner);
    runs.sort_by_key(|(run, _)| run.number);
    report(args, &runs)?;
    Ok(runs.iter().all(|(_, wrong)| wrong.is_empty()))
}

/// Prepares a folder and runs the program in it; what does not hold of what it did.
fn one(args: &Args, number: u64, folder: &Path) -> Result<(Run, Vec<String>), String> {
    create(folder)?;
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    rng.set_stream(number);
    let trial = drawn(&mut rng);
    let command = prepared(args, trial, number, &mut rng, folder)?;
    write(&folder.join("command"), command.join(" "))?;
    let run = ran(args, trial, number, &command, folder)?;
    let wrong = judged(args, &run, folder);
    if !wrong.is_empty() {
        write(&folder.join("why"), wrong.join("\n"))?;
        eprintln!("{}: {}", folder.display(), wrong.join("; "));
    }
    Ok((run, wrong))
}

fn drawn(rng: &mut ChaCha8Rng) -> Trial {
    let meshes: Vec<Reader> = Reader::ALL.into_iter().filter(|r| r.is_mesh()).collect();
    match rng.random_range(0..20) {
        0..=7 => Trial::Mesh(meshes[rng.random_range(0..meshes.len())]),
        8..=11 => Trial::Project,
        12 | 13 => Trial::Touches,
        14 => Trial::Dataset(Reader::Npz),
        15 | 16 => Trial::Dataset(Reader::Arrays),
        17 => Trial::Dataset(Reader::Csv),
        18 => Trial::Recording,
        _ => Trial::Script,
    }
}

/// The bundled project, with little to compute.
fn small_project() -> String {
    Example::Tube
        .project()
        .replace("quality = \"standard\"", "quality = \"draft\"")
        .replace("\n[live]", &format!("{LIMITS}\n[live]"))
}

/// A project around a mesh file that is spoiled.
fn project_around(mesh: Reader, model: &str) -> String {
    let ending = mesh.ending();
    format!(
        "format = 1\n[part]\nmesh = \"part.{ending}\"\nunit = \"mm\"\nmodel = \"{model}\"\nthickness_mm = 1.5\n[[support]]\nkind = \"clamped\"\nbox_mm = [[-80, -80, -1], [80, 80, 5]]\n[selection]\nsensors = 3\n[budget]\nquality = \"draft\"\n{LIMITS}"
    )
}

/// Writes the files of a run; the command that gets them.
fn prepared(
    args: &Args,
    trial: Trial,
    number: u64,
    rng: &mut ChaCha8Rng,
    folder: &Path,
) -> Result<Vec<String>, String> {
    let spoiled = |reader: Reader| -> Result<Vec<u8>, String> {
        Ok(spoil::input(
            &args.files(reader)?,
            args.seed,
            number + SPOILED,
        ))
    };
    let put = |name: &str, bytes: &[u8]| write(&folder.join(name), bytes);
    put("limb.glb", Example::Tube.mesh())?;
    put("p.hapdef.toml", small_project().as_bytes())?;
    let line = match trial {
        Trial::Mesh(reader) => {
            let model = ["shell", "solid"][rng.random_range(0..2)];
            put(&format!("part.{}", reader.ending()), &spoiled(reader)?)?;
            put("p.hapdef.toml", project_around(reader, model).as_bytes())?;
            "simulate p.hapdef.toml --out d.npz --json"
        }
        Trial::Project => {
            // Of the small one only: what others ask for may well take long.
            let files = [small_project().into_bytes()];
            let text = spoil::input(&files, args.seed, number + SPOILED);
            put("p.hapdef.toml", &text)?;
            "simulate p.hapdef.toml --out d.npz --json"
        }
        Trial::Touches => {
            put("t.csv", &spoiled(Reader::Touches)?)?;
            put("s.csv", &seeds::of(Reader::Sites)[0])?;
            "simulate p.hapdef.toml --touches t.csv --sites s.csv --out a.csv --json"
        }
        Trial::Dataset(reader) => {
            dataset(reader, &spoiled(reader)?, folder)?;
            let question = QUESTIONS[rng.random_range(0..QUESTIONS.len())];
            let data = if reader == Reader::Csv {
                "d.csv --touches t.csv"
            } else {
                "d.npz"
            };
            return Ok(words(args, &format!("{question} --data {data}")));
        }
        Trial::Recording => {
            put("r.hapdrec", &spoiled(Reader::Recording)?)?;
            "listen r.hapdrec --project p.hapdef.toml --fast --seconds 15"
        }
        Trial::Script => {
            put("s.csv", &spoiled(Reader::Presses)?)?;
            "board p.hapdef.toml --simulate --script s.csv --tcp 127.0.0.1:0 --seconds 0.3"
        }
    };
    Ok(words(args, line))
}

fn dataset(reader: Reader, bytes: &[u8], folder: &Path) -> Result<(), String> {
    match reader {
        Reader::Csv => {
            write(&folder.join("t.csv"), PLACES)?;
            write(&folder.join("d.csv"), bytes)
        }
        Reader::Arrays => {
            // The first array is spoiled, the other one sound.
            let places = seeds::places_of_six();
            let arrays = [("X", bytes), ("p_m", places.as_slice())];
            write(&folder.join("d.npz"), packed(&arrays)?)
        }
        _ => write(&folder.join("d.npz"), bytes),
    }
}

/// A command line for one thread and the memory that is allowed.
fn words(args: &Args, line: &str) -> Vec<String> {
    let memory = args.memory_gb.to_string();
    let common = ["--threads", "1", "--memory-gb", memory.as_str()];
    line.split(' ').chain(common).map(str::to_owned).collect()
}

fn ran(
    args: &Args,
    trial: Trial,
    number: u64,
    command: &[String],
    folder: &Path,
) -> Result<Run, String> {
    let file = |name: &str| File::create(folder.join(name)).map_err(|e| e.to_string());
    let begun = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(command)
        .current_dir(folder)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .stdin(Stdio::null())
        .stdout(file("stdout")?)
        .stderr(file("stderr")?)
        .spawn()
        .map_err(|e| e.to_string())?;
    let (mut memory, mut code) = (0.0_f64, None);
    loop {
        memory = memory.max(most_memory(child.id()));
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            code = status.code();
            break;
        }
        // Long before the machine has none left for anybody else.
        let is_over = memory > 2.0 * args.memory() as f64 + BESIDE;
        if begun.elapsed() > SECONDS || is_over {
            child
                .kill()
                .and_then(|()| child.wait())
                .map_err(|e| e.to_string())?;
            break;
        }
        std::thread::sleep(LOOK);
    }
    let seconds = begun.elapsed().as_secs_f64();
    let text = |name: &str| {
        let bytes = std::fs::read(folder.join(name)).unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    };
    Ok(Run {
        trial,
        number,
        code,
        seconds,
        memory,
        said: text("stderr"),
        printed: text("stdout"),
    })
}

/// The most that a process has held so far (bytes), where the system says so.
fn most_memory(process: u32) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) * 1024.0
}

/// What does not hold of a run.
fn judged(args: &Args, run: &Run, folder: &Path) -> Vec<String> {
    let mut wrong = Vec::new();
    if run.seconds > SECONDS.as_secs_f64() {
        wrong.push(format!("no end after {:.0} s", run.seconds));
    } else if !matches!(run.code, Some(0..=2)) {
        wrong.push(format!("it ended with {:?}", run.code));
    }
    if run.memory > args.memory() as f64 + BESIDE {
        wrong.push(format!("it held {:.1} GB", run.memory / 1e9));
    }
    let mut shown = run.said.chars().chain(run.printed.chars());
    if shown.any(|c| c.is_control() && c != '\n') {
        wrong.push("it prints control characters".into());
    }
    if run.code == Some(1) {
        wrong.extend(property::message(last_message(&run.said)).err());
    }
    if run.code == Some(0) {
        wrong.extend(finite(run, folder).err());
    }
    wrong
}

/// The message that the program ends with.
fn last_message(said: &str) -> &str {
    said.rfind("hapdef: ").map_or("", |at| &said[at..])
}

/// Whether what was written and printed is numbers.
fn finite(run: &Run, folder: &Path) -> Result<(), String> {
    let none = |word: &str| matches!(word.to_lowercase().as_str(), "nan" | "inf" | "infinity");
    let divided = |c: char| !c.is_alphanumeric();
    if let Some(word) = run.printed.split(divided).find(|w| none(w)) {
        return Err(format!("it prints “{word}”"));
    }
    for line in run.printed.lines() {
        serde_json::from_str::<serde_json::Value>(line)
            .map_err(|e| format!("a line that is no JSON ({e}): {line}"))?;
    }
    match run.trial {
        Trial::Mesh(_) | Trial::Project => {
            let data = dataset_file::read(&folder.join("d.npz"), None);
            let data = data.map_err(|e| format!("its dataset is not read: {e}"))?;
            property::dataset(&data.data)
        }
        Trial::Touches => {
            let table = std::fs::read_to_string(folder.join("a.csv")).unwrap_or_default();
            let cells = table.lines().skip(1).flat_map(|row| row.split(','));
            property::finite(cells.map(|c| c.parse().unwrap_or(f64::NAN)))
        }
        Trial::Dataset(_) | Trial::Recording | Trial::Script => Ok(()),
    }
}

fn report(args: &Args, runs: &[(Run, Vec<String>)]) -> Result<(), String> {
    let ended = |code: i32| runs.iter().filter(|(r, _)| r.code == Some(code)).count();
    let slowest = runs.iter().map(|(r, _)| r.seconds).fold(0.0, f64::max);
    let memory = runs.iter().map(|(r, _)| r.memory).fold(0.0, f64::max);
    let wrong: Vec<&(Run, Vec<String>)> = runs.iter().filter(|(_, w)| !w.is_empty()).collect();
    let mut text = format!(
        "{} runs: {} ended with 0, {} with 1, {} with 2; the slowest took {slowest:.1} s, the largest held {:.2} GB; {} wrong\n\n",
        runs.len(),
        ended(0),
        ended(1),
        ended(2),
        memory / 1e9,
        wrong.len()
    );
    for (run, why) in wrong {
        let folder: PathBuf = args.out.join(format!("whole-{}-{}", args.seed, run.number));
        let why = why.join("; ");
        let _ = writeln!(text, "- {:?}, {}: {why}", run.trial, folder.display());
    }
    println!("{text}");
    text.push_str("\nWhat was said:\n\n");
    for (run, _) in runs.iter().filter(|(r, _)| r.code == Some(1)) {
        let said = last_message(&run.said).trim().replace('\n', "\n  ");
        let _ = writeln!(text, "- {} ({:?}): {said}", run.number, run.trial);
    }
    write(&args.out.join("whole.md"), text)
}
