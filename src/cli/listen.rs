//! `hapdef listen`: live touch without a window.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use anyhow::Context as _;
use clap::Args;

use super::common::Common;
use super::ranges::between;
use super::spared::Spared;
use super::{out, progress::Bar};
use crate::design;
use crate::io::project_file::LoadedProject;
use crate::link::{Address, BAUD, Heard, Listener, Pace, Recorder, State};
use crate::live::{Pipeline, Sample, Update};
use crate::plain;
use crate::wire::Hello;

#[derive(Args, Debug, Clone)]
pub struct ListenArgs {
    /// A serial port, HOST:PORT, or a recording (.hapdrec).
    pub port: String,
    /// Project with the chosen gauges, or a mesh; the bundled limb when left out.
    #[arg(long = "project")]
    pub from: Option<PathBuf>,
    #[command(flatten)]
    pub common: Common,
    /// Rate of a serial port (baud); native USB does not care.
    #[arg(long, default_value_t = BAUD, value_parser = clap::value_parser!(u32).range(50..=20_000_000))]
    pub baud: u32,
    /// Samples a second that the board is asked for.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub rate: Option<u16>,
    /// At most so many lines a second; all samples when left out.
    #[arg(long, value_parser = between(0.001, 1e6))]
    pub every: Option<f64>,
    /// Record the raw counts here (.hapdrec).
    #[arg(long)]
    pub record: Option<PathBuf>,
    /// Replay a recording as fast as it can be read.
    #[arg(long)]
    pub fast: bool,
    /// Write a table of counts and touches here too (.csv), with the truth where a recording has it. Where the
    /// number of channels changes it goes on in a file beside it.
    #[arg(long)]
    pub csv: Option<PathBuf>,
    /// Serve the same lines to whoever connects to HOST:PORT.
    #[arg(long)]
    pub serve: Option<String>,
    /// End after so many seconds.
    #[arg(long, value_parser = between(0.0, 1e9))]
    pub seconds: Option<f64>,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &ListenArgs) -> anyhow::Result<()> {
    let loaded = load(args)?;
    let pace = if args.fast { Pace::Fast } else { Pace::Real };
    let address = Address::parse(&args.port, args.baud, pace);
    // All that may be wrong is found before the model is computed.
    spared(&loaded, &address).check("--csv", args.csv.as_deref())?;
    address.check().map_err(anyhow::Error::msg)?;
    let mut output = Output::new(args)?;
    let recorder = args.record.as_deref().map(Recorder::create).transpose();
    let recorder = recorder.map_err(anyhow::Error::msg)?;
    let listener = Listener::new(address, pipeline(args, &loaded)?)
        .at_rate(args.rate)
        .recording(recorder);

    let stop = AtomicBool::new(false);
    let (_commands, inbox) = channel();
    let begun = std::time::Instant::now();
    let mut told: anyhow::Result<()> = Ok(());
    let ended = listener.run(&stop, &inbox, |heard| {
        let over = |s: f64| begun.elapsed().as_secs_f64() >= s;
        if told.is_ok() {
            told = output.hear(&heard);
        }
        if told.is_err() || args.seconds.is_some_and(over) {
            stop.store(true, Ordering::Relaxed);
        }
    });
    told?;
    ended.map_err(anyhow::Error::msg)?;
    output.flush()
}

/// The project, whose gauges, channels and calibration fit each other.
fn load(args: &ListenArgs) -> anyhow::Result<LoadedProject> {
    anyhow::ensure!(
        args.from.is_none() || args.common.project.is_none(),
        "name the project once: --project {}",
        args.from.as_deref().unwrap_or(Path::new("FILE")).display()
    );
    let mut common = args.common.clone();
    common.project = args.from.clone().or(common.project);
    let loaded = common.load()?;
    let project = &loaded.inputs.project;
    project.check()?;
    project.live.check_gauges(project.selection.sites.len())?;
    Ok(loaded)
}

/// What is read, a recording too.
fn spared(loaded: &LoadedProject, address: &Address) -> Spared {
    let recording = match address {
        Address::Recording { path, .. } => Some(path.as_path()),
        _ => None,
    };
    Spared::of(loaded).and("the recording itself", recording)
}

fn pipeline(args: &ListenArgs, loaded: &LoadedProject) -> anyhow::Result<Pipeline> {
    let project = &loaded.inputs.project;
    let bar = Bar::default();
    let sensing = args.common.in_pool(|| {
        let watch = |p| bar.show(p);
        Ok(design::sense(
            &loaded.inputs,
            &project.budget.budget(),
            &watch,
        )?)
    });
    bar.finish();
    let sensing = sensing?;
    let gauges = sensing.gauges.len();
    Ok(Pipeline::new(
        sensing.map_for(&project.live),
        project.live.settings(gauges),
    ))
}

/// A line for people.
fn say(text: &str) {
    out::say(&format!("hapdef: {text}"));
}

/// Where lines go.
struct Output {
    stdout: BufWriter<std::io::Stdout>,
    csv: Option<Table>,
    served: Option<(TcpListener, Vec<TcpStream>)>,
    period_us: u64,
    last_us: Option<u64>,
    /// As it was told last.
    board: Option<Hello>,
}

impl Output {
    fn new(args: &ListenArgs) -> anyhow::Result<Self> {
        Ok(Self {
            served: args.serve.as_deref().map(serve).transpose()?,
            csv: args.csv.as_deref().map(Table::create).transpose()?,
            stdout: BufWriter::new(std::io::stdout()),
            period_us: args.every.map_or(0, |r| (1e6 / r) as u64),
            last_us: None,
            board: None,
        })
    }

    fn hear(&mut self, heard: &Heard) -> anyhow::Result<()> {
        match heard {
            Heard::State(state) => say(in_words(state)),
            Heard::Hello(hello) => self.greet(hello),
            Heard::Message(text) | Heard::Trouble(text) => say(text),
            // Nobody wants to find out afterwards.
            Heard::Unrecorded(why) => anyhow::bail!("{why}"),
            Heard::Truth(touch) => {
                if let Some(csv) = &mut self.csv {
                    csv.truth = *touch;
                }
            }
            Heard::Sample { sample, update, .. } => {
                self.row(sample, update)?;
                self.line(update)?;
            }
            // What waits is written as soon as nothing more is there.
            Heard::Turn { .. } => self.flush()?,
        }
        Ok(())
    }

    /// Says which board it is, once: a board repeats itself.
    fn greet(&mut self, hello: &Hello) {
        if self.board.as_ref() == Some(hello) {
            return;
        }
        say(&format!(
            "{} ({:08x}), {} channels, {} bits, {} Hz",
            plain::quote(&hello.name),
            hello.board,
            hello.channels,
            hello.bits,
            hello.rate_hz
        ));
        self.board = Some(hello.clone());
    }

    fn row(&mut self, sample: &Sample, update: &Update) -> anyhow::Result<()> {
        let Some(csv) = &mut self.csv else {
            return Ok(());
        };
        if let Some(next) = csv.take(sample, update)? {
            say(&format!(
                "the board has {} channels now: the table goes on in {}",
                sample.counts.len(),
                next.display()
            ));
        }
        Ok(())
    }

    fn line(&mut self, update: &Update) -> anyhow::Result<()> {
        if self
            .last_us
            .is_some_and(|last| update.time_us.abs_diff(last) < self.period_us)
        {
            return Ok(());
        }
        self.last_us = Some(update.time_us);
        let line = line(update);
        if let Some((listener, clients)) = &mut self.served {
            while let Ok((client, _)) = listener.accept() {
                let _ = client.set_nonblocking(true);
                clients.push(client);
            }
            // One who does not keep up is let go rather than waited for.
            clients.retain_mut(|c| c.write_all(format!("{line}\n").as_bytes()).is_ok());
        }
        out::printed(writeln!(self.stdout, "{line}"))
    }

    fn flush(&mut self) -> anyhow::Result<()> {
        if let Some(csv) = &mut self.csv {
            csv.flush()?;
        }
        out::printed(self.stdout.flush())
    }
}

fn in_words(state: &State) -> &'static str {
    match state {
        State::Waiting => "waiting for the board",
        State::Live => "live",
        State::Silent => "the board has fallen silent",
        State::Gone => "unplugged; waiting for the board to come back",
        State::Ended => "the recording is over",
    }
}

fn serve(address: &str) -> anyhow::Result<(TcpListener, Vec<TcpStream>)> {
    let listener = TcpListener::bind(address).with_context(|| {
        format!("--serve {address}: nothing can be served there. Choose another address")
    })?;
    listener.set_nonblocking(true)?;
    Ok((listener, Vec::new()))
}

/// A table of samples, with the truth where a simulated board has told it. Each file has as many columns in every
/// row: one for each number of channels.
struct Table {
    /// The last one is being written.
    paths: Vec<PathBuf>,
    file: BufWriter<File>,
    truth: Option<(glam::DVec3, f64)>,
    channels: Option<usize>,
}

impl Table {
    fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path)
            .with_context(|| format!("{}: the table cannot be written there", path.display()))?;
        Ok(Self {
            paths: vec![path.to_owned()],
            file: BufWriter::new(file),
            truth: None,
            channels: None,
        })
    }

    fn path(&self) -> &Path {
        self.paths.last().map_or(Path::new(""), PathBuf::as_path)
    }

    fn unwritten(&self) -> String {
        let path = self.path().display();
        format!("{path}: the table ends here, because it can be written no more")
    }

    /// Takes a sample in; the file that the table goes on in where the number of channels has changed.
    fn take(&mut self, sample: &Sample, update: &Update) -> anyhow::Result<Option<PathBuf>> {
        let channels = sample.counts.len();
        let before = self.channels.replace(channels);
        let moved = before.is_some_and(|b| b != channels);
        if moved {
            self.go_on(channels)?;
        }
        let head = if before == Some(channels) {
            Ok(())
        } else {
            self.head(channels)
        };
        head.and_then(|()| self.row(sample, update))
            .with_context(|| self.unwritten())?;
        Ok(moved.then(|| self.path().to_owned()))
    }

    /// Another file beside the first, never over an older one.
    fn go_on(&mut self, channels: usize) -> anyhow::Result<()> {
        /// A board that changes its mind more often is ill.
        const MOST: usize = 99;
        self.flush()?;
        let first = self.paths[0].clone();
        let ordinary = self.file.get_ref().metadata().is_ok_and(|m| m.is_file());
        anyhow::ensure!(
            ordinary && self.paths.len() < MOST,
            "{}: the board has {channels} channels now, and the rows of a table are all alike: it ends here. Listen again for another table",
            self.path().display()
        );
        let (path, file) = another(&first)?;
        self.file = BufWriter::new(file);
        self.paths.push(path);
        Ok(())
    }

    fn flush(&mut self) -> anyhow::Result<()> {
        let flushed = self.file.flush();
        flushed.with_context(|| self.unwritten())
    }

    fn head(&mut self, channels: usize) -> std::io::Result<()> {
        write!(self.file, "t_us")?;
        for k in 0..channels {
            write!(self.file, ",count_{k}")?;
        }
        writeln!(
            self.file,
            ",x_mm,y_mm,z_mm,force_n,uncertainty_mm,channels_ok,true_x_mm,true_y_mm,true_z_mm,true_force_n"
        )
    }

    fn row(&mut self, sample: &Sample, update: &Update) -> std::io::Result<()> {
        write!(self.file, "{}", sample.time_us)?;
        for count in &sample.counts {
            write!(self.file, ",{count}")?;
        }
        match update.contact {
            Some(c) => {
                let (p, radius) = (c.position * 1e3, c.region.radius * 1e3);
                write!(
                    self.file,
                    ",{:.3},{:.3},{:.3},{:.4},{radius:.3}",
                    p.x, p.y, p.z, c.force
                )?;
            }
            None => write!(self.file, ",,,,,")?,
        }
        write!(self.file, ",{}", update.good)?;
        match self.truth {
            Some((p, force)) => {
                let p = p * 1e3;
                writeln!(self.file, ",{:.3},{:.3},{:.3},{force:.4}", p.x, p.y, p.z)
            }
            None => writeln!(self.file, ",,,,"),
        }
    }
}

/// The first file after this one that is not there yet.
fn another(first: &Path) -> anyhow::Result<(PathBuf, File)> {
    let mut number = 2;
    loop {
        let path = numbered(first, number);
        match File::create_new(&path) {
            Ok(file) => return Ok((path, file)),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => number += 1,
            Err(e) => {
                let what = format!("{}: the table cannot go on there", path.display());
                return Err(anyhow::Error::new(e).context(what));
            }
        }
    }
}

/// `touches.csv`, `touches-2.csv`, …
fn numbered(first: &Path, number: usize) -> PathBuf {
    let mut name = first.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number}"));
    if let Some(ending) = first.extension() {
        name.push(".");
        name.push(ending);
    }
    first.with_file_name(name)
}

/// Replays a recording into a table; the files that it takes, more than one where the number of channels changes.
///
/// # Errors
/// When the one cannot be read or the other not written.
pub fn write_table(
    recording: &Path,
    table: &Path,
    pipeline: Pipeline,
) -> anyhow::Result<Vec<PathBuf>> {
    let address = Address::Recording {
        path: recording.to_owned(),
        pace: Pace::Fast,
    };
    let mut rows = Table::create(table)?;
    let (_commands, inbox) = channel();
    let stop = AtomicBool::new(false);
    let mut written: anyhow::Result<Option<PathBuf>> = Ok(None);
    Listener::new(address, pipeline)
        .run(&stop, &inbox, |heard| match heard {
            Heard::Truth(touch) => rows.truth = touch,
            Heard::Sample { sample, update, .. } if written.is_ok() => {
                written = rows.take(sample, update);
                stop.store(written.is_err(), Ordering::Relaxed);
            }
            _ => {}
        })
        .map_err(anyhow::Error::msg)?;
    written?;
    rows.flush()?;
    Ok(rows.paths)
}

/// One sample as JSON: nulls where nothing touches. `uncertainty_mm` is the radius within which the touch lies
/// with a probability of 90 %. Written by hand, because a thousand of them come in a second.
fn line(update: &Update) -> String {
    let time = update.time_us;
    let good = update.good;
    let Some(c) = update.contact else {
        return format!(
            "{{\"t_us\":{time},\"x_mm\":null,\"y_mm\":null,\"z_mm\":null,\"force_n\":null,\"uncertainty_mm\":null,\"channels_ok\":{good}}}"
        );
    };
    let p = c.position * 1e3;
    format!(
        "{{\"t_us\":{time},\"x_mm\":{:.3},\"y_mm\":{:.3},\"z_mm\":{:.3},\"force_n\":{:.4},\"uncertainty_mm\":{:.3},\"channels_ok\":{good}}}",
        p.x,
        p.y,
        p.z,
        c.force,
        c.region.radius * 1e3
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(time_us: u64, channels: usize) -> (Sample, Update) {
        let counts = vec![7.0; channels];
        let update = Update {
            time_us,
            strain: None,
            contact: None,
            guesses: [None; 2],
            good: 0,
        };
        (Sample { time_us, counts }, update)
    }

    /// Rows never stand under a head of another number of channels, and no file is written over.
    #[test]
    fn a_table_goes_on_in_another_file_where_the_channels_change() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a-2.csv"), "older").unwrap();
        let mut table = Table::create(&at("a.csv")).unwrap();
        let mut moved = Vec::new();
        for (time, channels) in [(1, 2), (2, 2), (3, 4), (4, 4), (5, 2)] {
            let (sample, update) = sample(time, channels);
            moved.push(table.take(&sample, &update).unwrap());
        }
        table.flush().unwrap();
        let next = [None, None, Some(at("a-3.csv")), None, Some(at("a-4.csv"))];
        assert_eq!(moved, next);
        for (name, rows) in [("a.csv", 3), ("a-3.csv", 3), ("a-4.csv", 2)] {
            let text = std::fs::read_to_string(at(name)).unwrap();
            let columns: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
            assert_eq!(columns.len(), rows, "{text}");
            assert!(columns.iter().all(|c| *c == columns[0]), "{text}");
        }
        assert_eq!(std::fs::read_to_string(at("a-2.csv")).unwrap(), "older");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_table_on_a_full_disk_says_so() {
        let mut table = Table::create(Path::new("/dev/full")).unwrap();
        let (first, update) = sample(1, 2);
        table.take(&first, &update).unwrap();
        let said = format!("{:#}", table.flush().unwrap_err());
        assert!(
            said.contains("/dev/full") && said.contains("space"),
            "{said}"
        );
    }
}
