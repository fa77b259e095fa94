//! Maps arguments to commands and errors to exit codes: 0 done, 1 failed with a message, 2 wrong usage.

mod allocation;
#[cfg(feature = "studio")]
mod parting;

use std::process::ExitCode;

#[cfg(feature = "studio")]
use anyhow::Context as _;
use clap::Parser;
use hapdef::cli::{self, Cli, Command, out};

#[global_allocator]
static MEMORY: allocation::Spoken = allocation::Spoken;

fn main() -> ExitCode {
    let outcome = match Cli::try_parse() {
        Ok(cli) => run(&cli),
        Err(wrong) if wrong.use_stderr() => return misused(&wrong),
        Err(help) => out::printed(help.print()),
    };
    match outcome {
        Err(error) if !out::reader_left(&error) => {
            if let Some(wrong) = error.downcast_ref() {
                return misused(wrong);
            }
            let message = hapdef::plain::message(&format!("{error:#}"));
            out::say(&format!("hapdef: {message}"));
            ExitCode::FAILURE
        }
        _ => ExitCode::SUCCESS,
    }
}

/// Says what is wrong with the arguments.
fn misused(wrong: &clap::Error) -> ExitCode {
    /// Characters of a screen, and of its beginning: what was typed may be of any length.
    const SCREEN: usize = 4000;
    const BEGINNING: usize = 400;
    let said = wrong.render().to_string();
    // With stderr closed the exit code alone says it.
    if said.chars().count() <= SCREEN {
        let _ = wrong.print();
    } else {
        let beginning: String = said.chars().take(BEGINNING).collect();
        out::say(&format!("{}…", hapdef::plain::message(&beginning)));
    }
    ExitCode::from(2)
}

fn run(cli: &Cli) -> anyhow::Result<()> {
    cli.bound_memory();
    match &cli.command {
        Some(Command::Design(args)) => cli::design::run(args),
        Some(Command::Simulate(args)) => cli::simulate::run(args),
        Some(Command::Advise(args)) => cli::advise::run(args),
        Some(Command::Trade(args)) => cli::trade::run(args),
        Some(Command::Select(args)) => cli::select::run(args),
        Some(Command::Evaluate(args)) => cli::evaluate::run(args),
        Some(Command::Train(args)) => cli::train::run(args),
        Some(Command::Predict(args)) => cli::predict::run(args),
        Some(Command::ExportC(args)) => cli::export_c::run(args),
        Some(Command::Render(args)) => render(args),
        Some(Command::Board(args)) => cli::board::run(args),
        Some(Command::Listen(args)) => cli::listen::run(args),
        Some(Command::Collect(args)) => cli::collect::run(args),
        Some(Command::Export(args)) => cli::export::run(args),
        Some(Command::Dataset(args)) => cli::dataset::run(args),
        Some(Command::Calibrate(args)) => cli::calibrate::run(args),
        Some(Command::Limb(args)) => cli::limb::run(args),
        Some(Command::Study(args)) => cli::study::run(args),
        Some(Command::Keys(args)) => cli::keys::run(args),
        None => open_studio(cli),
    }
}

#[cfg(feature = "studio")]
fn open_studio(cli: &Cli) -> anyhow::Result<()> {
    parting::explain_at_exit();
    hapdef::studio::run(cli.file.as_deref(), cli.unit.map(Into::into))
}

#[cfg(feature = "studio")]
fn render(args: &cli::render::RenderArgs) -> anyhow::Result<()> {
    use cli::render::{BackdropArg, ViewArg};
    use hapdef::render::camera::Preset;
    use hapdef::studio::picture::{Backdrop, Floor, Picture, png, turning};

    let picture = Picture {
        size: args.size.0,
        view: match args.view {
            ViewArg::Oblique => None,
            ViewArg::Front => Some(Preset::Front),
            ViewArg::Back => Some(Preset::Back),
            ViewArg::Left => Some(Preset::Left),
            ViewArg::Right => Some(Preset::Right),
            ViewArg::Top => Some(Preset::Top),
            ViewArg::Bottom => Some(Preset::Bottom),
        },
        backdrop: match (args.transparent, args.backdrop) {
            (true, _) => Backdrop::Transparent,
            (false, BackdropArg::Dark) => Backdrop::Dark,
            (false, BackdropArg::Neutral) => Backdrop::Neutral,
        },
        floor: if args.no_floor {
            Floor::Nothing
        } else {
            Floor::Shadow
        },
    };
    let loaded = args.common().load()?;
    cli::spared::Spared::of(&loaded).check_result("--out", Some(&args.out))?;
    let ending = args.out.extension().unwrap_or_default();
    let is_png = ending.eq_ignore_ascii_case("png")
        || (args.turn.is_some() && ending.eq_ignore_ascii_case("apng"));
    anyhow::ensure!(
        is_png,
        "--out {}: pictures are written as PNG. Choose a name that ends in .png{}",
        hapdef::plain::path(&args.out),
        if args.turn.is_some() { " or .apng" } else { "" }
    );
    let tell = |done: usize, all: usize| {
        if done.is_multiple_of(12) || done == all {
            cli::out::say(&format!("{done} of {all} frames"));
        }
    };
    let png = match args.turn {
        Some(seconds) => turning(loaded, &picture, seconds, tell),
        None => png(loaded, &picture),
    };
    let png = png.map_err(anyhow::Error::msg)?;
    hapdef::io::atomic::write(&args.out, &png).context("the picture could not be written")
}

#[cfg(not(feature = "studio"))]
fn render(_args: &cli::render::RenderArgs) -> anyhow::Result<()> {
    anyhow::bail!("this build draws no pictures (feature \"studio\")")
}

#[cfg(not(feature = "studio"))]
fn open_studio(_cli: &Cli) -> anyhow::Result<()> {
    anyhow::bail!(
        "this build has no window (feature \"studio\"). Run `hapdef design --out DIR`, or see `hapdef --help`"
    )
}
