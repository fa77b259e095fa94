//! The readers tried hard: `cargo bench --bench hard -- --inputs 1000000`. Every input is made from its number,
//! so that a run can be repeated, and one input of it looked at again (`--reader stl --first 4711 --inputs 1`).
//!
//! Inputs are read in processes of their own: one that overflows its stack, is killed or hangs is a finding
//! like any other, and the run goes on. With `--whole` it is the program itself that is run.

#[path = "../../tests/hard/mod.rs"]
mod hard;
mod memory;
mod readers;
mod tally;
mod whole;
mod worker;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use hard::reader::Reader;
use hard::seeds;

#[global_allocator]
static COUNTING: memory::Counting = memory::Counting;

/// Tries the readers, or the whole program, with spoiled files.
#[derive(Parser, Debug, Clone)]
struct Args {
    /// Inputs a reader, or runs of the program; 20000 and 200 when left out.
    #[arg(long)]
    inputs: Option<u64>,
    /// Number of the first input.
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Readers, with commas; all when left out.
    #[arg(long, value_delimiter = ',')]
    reader: Vec<Reader>,
    /// Seed of everything that is drawn.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder of further files to spoil: earlier findings, say.
    #[arg(long)]
    seeds: Option<PathBuf>,
    /// Folder for findings and the report.
    #[arg(long, default_value = "target/hard")]
    out: PathBuf,
    /// Processes side by side; as many as cores when left out.
    #[arg(long)]
    workers: Option<usize>,
    /// What one input of a reader may take (s).
    #[arg(long, default_value_t = 2.0)]
    seconds: f64,
    /// What one input may take (GB), and what the program is told that it may take.
    #[arg(long, default_value_t = 1.0)]
    memory_gb: f64,
    /// Run the program itself on spoiled projects, meshes, datasets, tables and recordings.
    #[arg(long)]
    whole: bool,
    /// Only write the files to begin with into this folder, one folder a reader, for `cargo fuzz`.
    #[arg(long)]
    corpus: Option<PathBuf>,
    /// The folder of a process that reads; it is given by the one that watches it.
    #[arg(long, hide = true)]
    worker: Option<PathBuf>,
    /// Cargo says so.
    #[arg(long, hide = true)]
    bench: bool,
}

impl Args {
    fn readers(&self) -> Vec<Reader> {
        if self.reader.is_empty() {
            Reader::ALL.to_vec()
        } else {
            self.reader.clone()
        }
    }

    fn workers(&self) -> usize {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        self.workers.unwrap_or(cores).max(1)
    }

    /// What is spoiled for a reader.
    fn files(&self, reader: Reader) -> Result<Vec<Vec<u8>>, String> {
        let mut files = seeds::of(reader);
        if let Some(folder) = &self.seeds {
            files.extend(seeds::found(reader, folder)?);
        }
        Ok(files)
    }

    /// Bytes that one input may take.
    fn memory(&self) -> usize {
        (self.memory_gb * 1e9) as usize
    }

    fn write_corpus(&self, folder: &std::path::Path) -> Result<(), String> {
        for reader in self.readers() {
            let folder = folder.join(reader.name());
            create(&folder)?;
            for (k, file) in self.files(reader)?.iter().enumerate() {
                write(&folder.join(format!("{k}.{}", reader.ending())), file)?;
            }
        }
        Ok(())
    }
}

fn create(folder: &std::path::Path) -> Result<(), String> {
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))
}

fn write(path: &std::path::Path, bytes: impl AsRef<[u8]>) -> Result<(), String> {
    std::fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}

fn main() -> ExitCode {
    let args = Args::parse();
    let sound = match (&args.worker, &args.corpus) {
        (Some(folder), _) => worker::run(&args, folder).map(|()| true),
        (None, Some(folder)) => args.write_corpus(folder).map(|()| true),
        (None, None) if args.whole => whole::run(&args),
        (None, None) => readers::run(&args),
    };
    match sound {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprintln!("hard: {message}");
            ExitCode::from(2)
        }
    }
}
