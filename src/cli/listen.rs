//! `hapdef listen`: live touch without a window.

mod line;
mod orders;

use std::io::{BufWriter, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};

use anyhow::Context as _;
use clap::{Args, ValueEnum};
use serde_json::json;

use super::common::Common;
use super::ranges::between;
use super::spared::Spared;
use super::{out, progress::Bar};
use crate::design::{Learned, Sensing};
use crate::io::bench_folder::limb_key;
use crate::io::project_file::LoadedProject;
use crate::io::run::Provenance;
use crate::io::touch_file::{self, TouchFile};
use crate::io::{handover, kept_model};
use crate::link::{
    Address, BAUD, ConnectionState, FoxgloveServer, Listener, ListenerCommand, McapLog, Pace,
    Recorder, RecordingExtent, SampleTable, SessionEvent,
};
use crate::live::{Health, LiveUpdate, Pipeline, Sample, ShownEstimator};
use crate::plain;
use crate::session::{train, training_touches};
use crate::wire::Hello;

use orders::{Client, from_stdin, order};

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
    /// What finds the touch: model matching, or a regression that is trained on touches of the model first. Of how many
    /// touch, and of all of them, matching speaks anyway.
    #[arg(long, default_value = "matching")]
    pub estimator: ListenEstimatorArg,
    /// An estimator that was learned from presses (.hapdtouch), as `hapdef train` writes it, finds the touch instead. One of
    /// another limb or another board is refused.
    #[arg(long, conflicts_with = "estimator")]
    pub model: Option<PathBuf>,
    /// At most so many lines a second; all samples when left out.
    #[arg(long, value_parser = between(0.001, 1e6))]
    pub every: Option<f64>,
    /// Record the raw counts here (.hapdrec).
    #[arg(long)]
    pub record: Option<PathBuf>,
    /// Replay a recording as fast as it can be read.
    #[arg(long)]
    pub fast: bool,
    /// Write a table of counts and touches here too (.csv), with the truth where a recording has it; never over an
    /// older file. Where the number of channels changes it goes on in a file beside it.
    #[arg(long)]
    pub csv: Option<PathBuf>,
    /// Write touches into an MCAP file too, as messages of ROS (.mcap): all contacts, the wrench of the hardest and its frame on
    /// the link, found by matching. Never over an older file.
    #[arg(long)]
    pub mcap: Option<PathBuf>,
    /// Serve the messages of --mcap to Foxglove as they come, at HOST:PORT (its WebSocket connection).
    #[arg(long)]
    pub foxglove: Option<String>,
    /// Serve the same lines to whoever connects to HOST:PORT, and obey what they write: `tare`.
    #[arg(long)]
    pub serve: Option<String>,
    /// End after so many seconds.
    #[arg(long, value_parser = between(0.0, 1e9))]
    pub seconds: Option<f64>,
}

/// What finds the touch.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum ListenEstimatorArg {
    /// Model matching.
    Matching,
    /// The paper's regression, on the readings as they are.
    Svr,
    /// Regression on the readings over their norm.
    Normalized,
}

impl From<ListenEstimatorArg> for ShownEstimator {
    fn from(value: ListenEstimatorArg) -> Self {
        match value {
            ListenEstimatorArg::Matching => Self::Matching,
            ListenEstimatorArg::Svr => Self::Raw,
            ListenEstimatorArg::Normalized => Self::Normalized,
        }
    }
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
    let spared = spared(&loaded, &address);
    spared.check("--csv", args.csv.as_deref())?;
    spared.check("--mcap", args.mcap.as_deref())?;
    let held = address.hold().map_err(anyhow::Error::msg)?;
    let learned = learned(args, &loaded)?;
    let (commands, inbox) = channel();
    let mut output = Output::new(args, commands.clone(), learned)?;
    output.stream_touches(args, &address, &loaded)?;
    let recorder = args.record.as_deref().map(Recorder::create).transpose();
    let recorder = recorder.map_err(anyhow::Error::msg)?;
    let pipeline = pipeline(args, &loaded, output.learned.as_ref())?;
    let listener = Listener::new(address, pipeline)
        .holding(held)
        .at_rate(args.rate)
        .recording(recorder);

    let stop = Arc::new(AtomicBool::new(false));
    if output.log.is_some() {
        let asked = Arc::clone(&stop);
        // Whoever ends it wants a whole file.
        let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    }
    from_stdin(commands, say);
    let begun = std::time::Instant::now();
    let mut shown: anyhow::Result<()> = Ok(());
    let ended = listener.run(&stop, &inbox, |event| {
        let over = |s: f64| begun.elapsed().as_secs_f64() >= s;
        if shown.is_ok() {
            shown = output.on_event(&event);
        }
        if shown.is_err() || args.seconds.is_some_and(over) {
            stop.store(true, Ordering::Relaxed);
        }
    });
    output.end_log()?;
    shown?;
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
    project.live.check_gauges(&project.selection.sites)?;
    Ok(loaded)
}

/// The estimator that was learned on this limb.
fn learned(args: &ListenArgs, loaded: &LoadedProject) -> anyhow::Result<Option<TouchFile>> {
    let Some(path) = &args.model else {
        return Ok(None);
    };
    let file = touch_file::read(path)?;
    let gauges = loaded.inputs.project.selection.sites.len();
    file.check_channels(gauges)
        .and_then(|()| file.check_limb(&limb_key(&loaded.inputs)))
        .map_err(|why| anyhow::anyhow!("{}: {why}", path.display()))?;
    Ok(Some(file))
}

/// What is read, a recording too.
fn spared(loaded: &LoadedProject, address: &Address) -> Spared {
    let recording = match address {
        Address::Recording { path, .. } => Some(path.as_path()),
        _ => None,
    };
    Spared::of(loaded).and("the recording itself", recording)
}

/// The model of a project's gauges, with its progress on stderr: the one beside the project, where there is one.
///
/// # Errors
/// As [`kept_model::sensing`].
pub(super) fn sensing_for(common: &Common, loaded: &LoadedProject) -> anyhow::Result<Sensing> {
    let bar = Bar::default();
    let sensing = common.in_pool(|| {
        let watch = |p| bar.show(p);
        let budget = loaded.inputs.project.budget.budget();
        let project = (!loaded.bundled).then_some(&*loaded.path);
        Ok(kept_model::sensing(
            &loaded.inputs,
            project,
            &budget,
            &watch,
        )?)
    });
    bar.finish();
    sensing
}

/// Takes orders from standard input.
pub(super) fn obey_stdin(commands: Sender<ListenerCommand>) {
    from_stdin(commands, say);
}

/// What finds touches: by the map that presses have taught, which needs no model any more, or by that of the project.
fn pipeline(
    args: &ListenArgs,
    loaded: &LoadedProject,
    learned: Option<&TouchFile>,
) -> anyhow::Result<Pipeline> {
    let project = &loaded.inputs.project;
    if let Some(Learned::Matching(taught)) = learned.map(|file| &file.estimator) {
        let settings = taught.settings(project.live.settings(taught.channels()));
        return Ok(Pipeline::new(taught.model(), settings));
    }
    let sensing = sensing_for(&args.common, loaded)?;
    let gauges = sensing.gauges.len();
    let settings = project.live.settings(gauges);
    let mut pipeline = Pipeline::new(sensing.map_for(&project.live), settings);
    if args.estimator != ListenEstimatorArg::Matching {
        let bar = Bar::default();
        let used = vec![true; gauges];
        let trained = args.common.in_pool(|| {
            let (quality, noise) = (project.budget.quality, sensing.off.of_channel());
            let touches = training_touches(quality);
            let inputs = (&sensing, &loaded.inputs);
            Ok(train(inputs, &used, noise, touches, &|p| bar.show(p))?)
        });
        bar.finish();
        pipeline.set_trained(trained?, used);
    }
    Ok(pipeline)
}

/// A line for people.
fn say(text: &str) {
    out::say(&format!("hapdef: {text}"));
}

/// Where lines go.
struct Output {
    stdout: BufWriter<std::io::Stdout>,
    csv: Option<SampleTable>,
    log: Option<McapLog>,
    foxglove: Option<FoxgloveServer>,
    served: Option<(TcpListener, Vec<Client>)>,
    /// For whoever is served.
    commands: Sender<ListenerCommand>,
    estimator: ShownEstimator,
    learned: Option<TouchFile>,
    period_us: u64,
    last_us: Option<u64>,
    /// As it was told last.
    board: Option<Hello>,
}

impl Output {
    fn new(
        args: &ListenArgs,
        commands: Sender<ListenerCommand>,
        learned: Option<TouchFile>,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            learned,
            commands,
            log: None,
            foxglove: None,
            served: args.serve.as_deref().map(serve).transpose()?,
            csv: args.csv.as_deref().map(SampleTable::create).transpose()?,
            stdout: BufWriter::new(std::io::stdout()),
            estimator: args.estimator.into(),
            period_us: args.every.map_or(0, |r| (1e6 / r) as u64),
            last_us: None,
            board: None,
        })
    }

    /// Where touches go as messages.
    fn stream_touches(
        &mut self,
        args: &ListenArgs,
        address: &Address,
        loaded: &LoadedProject,
    ) -> anyhow::Result<()> {
        let provenance = Provenance {
            mesh_path: &loaded.mesh_path,
            version: env!("CARGO_PKG_VERSION"),
            taken_in: None,
        };
        let link = handover::link(&provenance);
        let asked = args.foxglove.as_deref();
        let server = asked.map(|address| FoxgloveServer::open(address, &link));
        let refused = |why| anyhow::anyhow!("--foxglove {why}. Choose another address");
        self.foxglove = server.transpose().map_err(refused)?;
        // After what may be refused: a file that is begun stays.
        let log = args
            .mcap
            .as_deref()
            .map(|path| McapLog::create(path, &link));
        self.log = log.transpose().map_err(anyhow::Error::msg)?;
        if let Some(log) = &mut self.log
            && address.is_recording()
        {
            let extent = RecordingExtent::of(Path::new(&args.port));
            log.began(extent.map_err(anyhow::Error::msg)?.began_ns);
        }
        if let Some(address) = self.foxglove.as_ref().and_then(FoxgloveServer::address) {
            say(&format!("Foxglove finds touches at ws://{address}"));
        }
        Ok(())
    }

    fn on_event(&mut self, event: &SessionEvent) -> anyhow::Result<()> {
        match event {
            SessionEvent::State(state) => {
                say(in_words(state));
                if let Some(server) = self.foxglove.as_ref()
                    && **state != ConnectionState::Live
                {
                    server.let_go();
                }
            }
            SessionEvent::Hello(hello) => self.greet(hello)?,
            SessionEvent::Message(text) | SessionEvent::Trouble(text) => say(text),
            SessionEvent::News(news) => say(&news.in_words()),
            // Nobody wants to find out afterwards.
            SessionEvent::Unrecorded(why) => anyhow::bail!("{why}"),
            SessionEvent::Truth(touch) => {
                if let Some(csv) = &mut self.csv {
                    csv.truth = *touch;
                }
            }
            SessionEvent::Clock { .. } => {
                let told = self.log.as_mut().map(|log| log.event(event));
                told.transpose().map_err(anyhow::Error::msg)?;
            }
            SessionEvent::Sample {
                sample,
                update,
                pipeline,
            } => {
                self.row(sample, update)?;
                self.line(update, pipeline.health())?;
            }
            // What waits is written as soon as nothing more is there.
            SessionEvent::Turn { .. } => {
                self.obey();
                self.flush()?;
            }
        }
        Ok(())
    }

    /// What those who are served ask for; they are told why something is no order.
    fn obey(&mut self) {
        let Some((_, clients)) = &mut self.served else {
            return;
        };
        for client in clients {
            for line in client.hear() {
                match order(&line) {
                    Ok(None) => {}
                    // A listener that has ended hears nothing any more.
                    Ok(Some(command)) => drop(self.commands.send(command)),
                    Err(why) => drop(client.tell(&json!({ "error": why }).to_string())),
                }
            }
        }
    }

    /// Says which board it is, once: a board repeats itself.
    fn greet(&mut self, hello: &Hello) -> anyhow::Result<()> {
        if self.board.as_ref() == Some(hello) {
            return Ok(());
        }
        if let Some(learned) = &self.learned {
            let board = format!("{:08x}", hello.board);
            learned.check_board(&board).map_err(anyhow::Error::msg)?;
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
        Ok(())
    }

    fn row(&mut self, sample: &Sample, update: &LiveUpdate) -> anyhow::Result<()> {
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

    fn line(&mut self, update: &LiveUpdate, health: &[Health]) -> anyhow::Result<()> {
        if self
            .last_us
            .is_some_and(|last| update.time_us.abs_diff(last) < self.period_us)
        {
            return Ok(());
        }
        self.last_us = Some(update.time_us);
        self.log(update)?;
        if let Some(server) = &self.foxglove {
            server.sample(update);
        }
        let line = match &self.learned {
            Some(TouchFile {
                estimator: Learned::Regression(regression),
                ..
            }) => line::learned(update, health, regression),
            _ => line::of(update, health, self.estimator),
        };
        if let Some((listener, clients)) = &mut self.served {
            while let Ok((client, _)) = listener.accept() {
                clients.extend(Client::new(client).ok());
            }
            clients.retain_mut(|client| client.tell(&line));
        }
        out::printed(writeln!(self.stdout, "{line}"))
    }

    fn log(&mut self, update: &LiveUpdate) -> anyhow::Result<()> {
        let written = self.log.as_mut().map(|log| log.sample(update));
        written.transpose().map(drop).map_err(anyhow::Error::msg)
    }

    fn end_log(&mut self) -> anyhow::Result<()> {
        let ended = self.log.as_mut().map(McapLog::finish);
        ended.transpose().map(drop).map_err(anyhow::Error::msg)
    }

    fn flush(&mut self) -> anyhow::Result<()> {
        if let Some(csv) = &mut self.csv {
            csv.flush()?;
        }
        out::printed(self.stdout.flush())
    }
}

fn in_words(state: &ConnectionState) -> &'static str {
    match state {
        ConnectionState::Waiting => "waiting for the board",
        ConnectionState::Live => "live",
        ConnectionState::Silent => "the board has fallen silent",
        ConnectionState::Gone => "unplugged; waiting for the board to come back",
        ConnectionState::Ended => "the recording is over",
    }
}

fn serve(address: &str) -> anyhow::Result<(TcpListener, Vec<Client>)> {
    let listener = TcpListener::bind(address).with_context(|| {
        format!("--serve {address}: nothing can be served there. Choose another address")
    })?;
    listener.set_nonblocking(true)?;
    Ok((listener, Vec::new()))
}
