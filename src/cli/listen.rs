//! `hapdef listen`: live touch without a window.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use anyhow::Context as _;
use clap::Args;

use super::{Common, progress::Bar};
use crate::design;
use crate::link::{Address, BAUD, Command, Heard, Listener, Pace, State};
use crate::live::{Pipeline, Sample, Update};

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
    #[arg(long, default_value_t = BAUD)]
    pub baud: u32,
    /// Samples a second that the board is asked for.
    #[arg(long)]
    pub rate: Option<u16>,
    /// At most so many lines a second; all samples when left out.
    #[arg(long)]
    pub every: Option<f64>,
    /// Record the raw counts here (.hapdrec).
    #[arg(long)]
    pub record: Option<PathBuf>,
    /// Replay a recording as fast as it can be read.
    #[arg(long)]
    pub fast: bool,
    /// Write a table of counts and touches here too (.csv), with the truth where a recording has it.
    #[arg(long)]
    pub csv: Option<PathBuf>,
    /// Serve the same lines to whoever connects to HOST:PORT.
    #[arg(long)]
    pub serve: Option<String>,
    /// End after so many seconds.
    #[arg(long)]
    pub seconds: Option<f64>,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &ListenArgs) -> anyhow::Result<()> {
    let pace = if args.fast { Pace::Fast } else { Pace::Real };
    let address = Address::parse(&args.port, args.baud, pace);
    let pipeline = pipeline(args)?;
    let stop = AtomicBool::new(false);
    let (commands, inbox) = channel();
    if let Some(path) = &args.record {
        let _ = commands.send(Command::Record(path.clone()));
    }
    let mut out = Output::new(args)?;
    let begun = std::time::Instant::now();
    let listener = Listener::new(address, pipeline).at_rate(args.rate);
    listener
        .run(&stop, &inbox, |heard| {
            if args
                .seconds
                .is_some_and(|s| begun.elapsed().as_secs_f64() >= s)
                || !out.hear(&heard)
            {
                stop.store(true, Ordering::Relaxed);
            }
        })
        .map_err(anyhow::Error::msg)
}

fn pipeline(args: &ListenArgs) -> anyhow::Result<Pipeline> {
    anyhow::ensure!(
        args.from.is_none() || args.common.project.is_none(),
        "name the project once: --project {}",
        args.from
            .as_deref()
            .unwrap_or(std::path::Path::new("FILE"))
            .display()
    );
    let mut common = args.common.clone();
    common.project = args.from.clone().or(common.project);
    let loaded = common.load()?;
    let project = &loaded.inputs.project;
    let bar = Bar::default();
    let sensing = common.in_pool(|| {
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

/// Where lines go.
struct Output {
    stdout: BufWriter<std::io::Stdout>,
    csv: Option<Table>,
    served: Option<(TcpListener, Vec<std::net::TcpStream>)>,
    period_us: u64,
    last_us: Option<u64>,
}

impl Output {
    fn new(args: &ListenArgs) -> anyhow::Result<Self> {
        let csv = args.csv.as_deref().map(Table::create).transpose()?;
        let served = match &args.serve {
            Some(address) => {
                let listener = TcpListener::bind(address)
                    .map_err(|e| anyhow::anyhow!("--serve {address}: nothing can be served there ({e}). Choose another address"))?;
                listener.set_nonblocking(true)?;
                Some((listener, Vec::new()))
            }
            None => None,
        };
        let period_us = args
            .every
            .filter(|r| *r > 0.0)
            .map_or(0, |r| (1e6 / r) as u64);
        Ok(Self {
            stdout: BufWriter::new(std::io::stdout()),
            csv,
            served,
            period_us,
            last_us: None,
        })
    }

    /// Whether anybody still wants to know.
    fn hear(&mut self, heard: &Heard) -> bool {
        match heard {
            Heard::State(state) => {
                let said = match state {
                    State::Waiting => "waiting for the board",
                    State::Live => "live",
                    State::Silent => "the board has fallen silent",
                    State::Gone => "unplugged; waiting for the board to come back",
                    State::Ended => "the recording is over",
                };
                eprintln!("hapdef: {said}");
                true
            }
            Heard::Hello(hello) => {
                eprintln!(
                    "hapdef: {} ({:08x}), {} channels, {} bits, {} Hz",
                    hello.name, hello.board, hello.channels, hello.bits, hello.rate_hz
                );
                true
            }
            Heard::Message(text) => {
                eprintln!("hapdef: {text}");
                true
            }
            Heard::Truth(touch) => {
                if let Some(csv) = &mut self.csv {
                    csv.truth = *touch;
                }
                true
            }
            Heard::Sample { sample, update, .. } => {
                let written = self
                    .csv
                    .as_mut()
                    .is_none_or(|t| t.row(sample, update).is_ok());
                written && self.line(update)
            }
            // Lines that wait are written as soon as nothing more is there.
            Heard::Turn { .. } => self.stdout.flush().is_ok(),
        }
    }

    fn line(&mut self, update: &Update) -> bool {
        if self
            .last_us
            .is_some_and(|last| update.time_us.abs_diff(last) < self.period_us)
        {
            return true;
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
        writeln!(self.stdout, "{line}").is_ok()
    }
}

/// A table of samples, with the truth where a simulated board has told it.
struct Table {
    file: BufWriter<File>,
    truth: Option<(glam::DVec3, f64)>,
    headed: bool,
}

impl Table {
    fn create(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path)
            .with_context(|| format!("{}: the table cannot be written there", path.display()))?;
        Ok(Self {
            file: BufWriter::new(file),
            truth: None,
            headed: false,
        })
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
        if !self.headed {
            self.headed = true;
            self.head(sample.counts.len())?;
        }
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

/// Replays a recording into a table.
///
/// # Errors
/// When the one cannot be read or the other not written.
pub fn write_table(recording: &Path, table: &Path, pipeline: Pipeline) -> anyhow::Result<()> {
    let address = Address::Recording {
        path: recording.to_owned(),
        pace: Pace::Fast,
    };
    let mut rows = Table::create(table)?;
    let (_commands, inbox) = channel();
    let stop = AtomicBool::new(false);
    let mut written = Ok(());
    Listener::new(address, pipeline)
        .run(&stop, &inbox, |heard| match heard {
            Heard::Truth(touch) => rows.truth = touch,
            Heard::Sample { sample, update, .. } if written.is_ok() => {
                written = rows.row(sample, update);
            }
            _ => {}
        })
        .map_err(anyhow::Error::msg)?;
    written
        .and_then(|()| rows.file.flush())
        .with_context(|| format!("{}: the table could not be written", table.display()))
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
