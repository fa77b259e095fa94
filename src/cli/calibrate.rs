//! `hapdef calibrate`: how the gauges are really glued, from presses at known places.

mod asked;
mod part;
mod summary;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use anyhow::Context as _;
use clap::Args;

use super::common::Common;
use super::listen::sensing_for;
use super::ranges::between;
use super::simulate::in_file;
use super::spared::Spared;
use super::{listen, out};
use crate::design::{Sensing, check_reach};
use crate::elasticity::Touch;
use crate::inference::calibration::judged::{MISFIT, PressOutlook, misfits, outlook};
use crate::inference::calibration::part::of_part;
use crate::inference::{Calibration, KnownPress, calibrate};
use crate::io::points::{AskedPoint, read_points};
use crate::io::project_file::{self, LoadedProject};
use crate::link::{Address, BAUD, HeldConnection, Listener, Pace, SessionEvent};
use crate::live::Pipeline;
use crate::mesh::SurfacePoint;
use crate::uncertainty::{HandPressing, Uncertainty};

use asked::AskedPresses;
use part::{FittedPart, PartArg};
use summary::{FittedBedding, FoundOfPart, PressRow, Summary};

/// A calibration needs as many presses at least.
const LEAST: usize = 4;

#[derive(Args, Debug, Clone)]
pub struct CalibrateArgs {
    /// A serial port, HOST:PORT, or a recording (.hapdrec).
    #[arg(required_unless_present = "recording")]
    pub port: Option<String>,
    /// A recording of the presses (.hapdrec), in place of a port.
    #[arg(long, conflicts_with = "port")]
    pub recording: Option<PathBuf>,
    /// Project with the chosen gauges; the bundled limb when left out.
    #[arg(long = "project")]
    pub from: Option<PathBuf>,
    #[command(flatten)]
    pub common: Common,
    /// Where to press, in this order (.csv): `x_mm,y_mm,z_mm`, and where they are known `force_n`, `start_s` and
    /// `duration_s`; twelve places that are spread over the part when left out.
    #[arg(long, alias = "presses")]
    pub points: Option<PathBuf>,
    /// How hard each press is, where the points do not say it (N).
    #[arg(long, default_value_t = 10.0, value_parser = between(0.01, 1e4))]
    pub force: f64,
    /// A machine presses: places and forces are exact.
    #[arg(long)]
    pub machine: bool,
    /// Use presses that do not fit the others too.
    #[arg(long)]
    pub keep_all: bool,
    /// Fit these properties of the part too, and write them into the project. A force that is not known well says nothing of
    /// either; one that is says more of both the more is known of the other.
    #[arg(long, value_delimiter = ',')]
    pub fit: Vec<PartArg>,
    /// Rate of a serial port (baud); native USB does not care.
    #[arg(long, default_value_t = BAUD, value_parser = clap::value_parser!(u32).range(50..=20_000_000))]
    pub baud: u32,
    /// Where the calibrated project is written; over the project itself when left out.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Write the presses with their readings here too (.csv).
    #[arg(long)]
    pub table: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &CalibrateArgs) -> anyhow::Result<()> {
    let mut common = args.common.clone();
    common.project = args.from.clone().or(common.project);
    let loaded = common.load()?;
    loaded.inputs.project.check()?;
    let target = target(args, &loaded)?;
    let points = (args.points.as_deref()).map_or(Ok(Vec::new()), read_points)?;
    let source = match (&args.port, &args.recording) {
        (Some(port), _) => port.clone(),
        (None, recording) => recording.clone().unwrap_or_default().display().to_string(),
    };
    let address = Address::parse(&source, args.baud, Pace::Fast);
    let recording = match &address {
        Address::Recording { path, .. } => Some(path.as_path()),
        _ => None,
    };
    let spared = Spared::of(&loaded).and("the recording itself", recording);
    let spared = spared.and("the points", args.points.as_deref());
    spared.check_result("--table", args.table.as_deref())?;
    if let Some(path) = &args.points {
        check_points(path, &points, &loaded)?;
    }
    let held = address.hold().map_err(anyhow::Error::msg)?;
    part::check(&args.fit, &loaded.inputs.project)?;
    let sensing = sensing_for(&common, &loaded)?;
    let points = on_part(points, &sensing, args.force);
    let off = part::unsure(&args.fit, off_with(&loaded, &sensing, args.machine));
    let read = read((address, held), &loaded, &sensing, points)?;
    let (noise, board) = (read.noise.clone(), read.board.clone());
    let rows = read.rows(&sensing.drawn.map.mesh);
    if let Some(path) = &args.table {
        // Whoever pressed by hand keeps that, whatever comes of it.
        summary::write_table(path, &rows)?;
    }
    check_count(&rows)?;
    let part = FittedPart::as_drawn(loaded, sensing);
    let (part, found) = fit_all(args, &common, part, rows, (&noise, &off))?;
    let FittedPart {
        loaded, sensing, ..
    } = part;
    if let Some(path) = &args.table {
        summary::write_table(path, &found.rows)?;
    }
    check_fit(&found.calibration)?;
    save(&loaded, &target, &found, board.as_deref())?;
    found.print(&sensing, &target, args.common.json)
}

/// The part as far as that is asked for, then its gauges; and once more where presses turn out not to fit.
fn fit_all(
    args: &CalibrateArgs,
    common: &Common,
    part: FittedPart,
    rows: Vec<PressRow>,
    (noise, off): (&[f64], &Uncertainty),
) -> anyhow::Result<(FittedPart, Summary)> {
    let used = |rows: &[PressRow]| rows.iter().filter(|r| r.used).count();
    let before = used(&rows);
    let mut part = part.fitted(&args.fit, common, &rows, noise, off)?;
    let mut found = fit((&part.sensing, &part.loaded), rows, (noise, off), args)?;
    let is_fitted = part.thickness.is_some() || part.bedding.is_some();
    if is_fitted && used(&found.rows) < before {
        part = part.fitted(&args.fit, common, &found.rows, noise, off)?;
        let model = (&part.sensing, &part.loaded);
        found = fit(model, found.rows, (noise, off), args)?;
    }
    found.of_part.thickness_mm = part.thickness;
    found.of_part.bedding = part.bedding;
    part::take_stiffness(&args.fit, &part.loaded.inputs.project, &mut found)?;
    Ok((part, found))
}

/// Refuses to calibrate with hardly any presses.
fn check_count(rows: &[PressRow]) -> anyhow::Result<()> {
    let read = rows.iter().filter(|r| r.used).count();
    anyhow::ensure!(
        read >= LEAST,
        "a calibration takes {LEAST} presses that were read, and there are {read}: press for a second at each place, and let go between"
    );
    Ok(())
}

/// Refuses what was pressed elsewhere.
fn check_fit(found: &Calibration) -> anyhow::Result<()> {
    anyhow::ensure!(
        found.explains(),
        "the presses are of another limb or of other places: of a reading the model leaves {:.0} %. See that the points are those that were pressed, in their order and in millimetres, and that the channels are those of the gauges. Nothing was saved",
        100.0 * found.relative
    );
    Ok(())
}

/// Which file the calibrated project goes to.
fn target(args: &CalibrateArgs, loaded: &LoadedProject) -> anyhow::Result<PathBuf> {
    if let Some(out) = &args.out {
        let out = project_file::with_ending(out);
        crate::io::outlet::file(&out).context("--out")?;
        return Ok(out);
    }
    let own = !loaded.bundled && loaded.path.is_file();
    anyhow::ensure!(
        own,
        "the calibration goes into a project file, and there is none yet: name one with --out"
    );
    Ok(loaded.path.clone())
}

/// What is known of the presses and of all else.
fn off_with(loaded: &LoadedProject, sensing: &Sensing, machine: bool) -> Uncertainty {
    let mut off = Uncertainty {
        elements: sensing.off.elements,
        ..loaded.inputs.project.uncertainty()
    };
    if machine {
        off.pressing = HandPressing::EXACT;
    }
    off
}

/// Refuses points of a file that lie farther from the part than it is large: people's points are some millimetres off.
fn check_points(path: &Path, points: &[AskedPoint], of: &LoadedProject) -> anyhow::Result<()> {
    let places = points.iter().map(|p| p.position);
    check_reach(&of.inputs.part, "point", places).map_err(|error| in_file(error, path, path))
}

/// The points on the part's surface, with a force each; those that are proposed where none are given.
fn on_part(points: Vec<AskedPoint>, sensing: &Sensing, force: f64) -> Vec<AskedPoint> {
    let map = &sensing.drawn.map;
    let mut points = points;
    if points.is_empty() {
        let proposed = sensing.proposed.iter();
        points.extend(proposed.map(|touch| AskedPoint::at(touch.position)));
    }
    for point in &mut points {
        let (at, _) = map.mesh.index().nearest(point.position);
        point.position = map.mesh.point(at);
        point.force.get_or_insert(force);
    }
    points
}

/// One press after another, as they are made.
fn read(
    (address, held): (Address, Option<HeldConnection>),
    loaded: &LoadedProject,
    sensing: &Sensing,
    points: Vec<AskedPoint>,
) -> anyhow::Result<AskedPresses> {
    let project = &loaded.inputs.project;
    let settings = project.live.settings(sensing.gauges.len());
    let mut plain = project.live.clone();
    // What an earlier calibration found is not to be taken for how they were drawn.
    plain.forget();
    let pipeline = Pipeline::new(sensing.map_for(&plain), settings);
    let (commands, inbox) = channel();
    let prompts = !matches!(address, Address::Recording { .. });
    if prompts {
        listen::obey_stdin(commands);
        out::say("hapdef: waiting for the board; leave the limb alone until its rest is taken");
    }
    let mut asked = AskedPresses::new(points, prompts);
    let stop = AtomicBool::new(false);
    let listener = Listener::new(address, pipeline).holding(held);
    let ended = listener.run(&stop, &inbox, |event| {
        if let SessionEvent::Hello(hello) = &event {
            asked.board = Some(format!("{:08x}", hello.board));
        }
        if let Some(text) = event.words() {
            out::say(&format!("hapdef: {text}"));
        }
        if let SessionEvent::Sample {
            update, pipeline, ..
        } = event
        {
            asked.take(update, pipeline);
        }
        if asked.is_done() {
            stop.store(true, Ordering::Relaxed);
        }
    });
    ended.map_err(anyhow::Error::msg)?;
    Ok(asked)
}

/// Fits the gauges to the presses that fit each other.
fn fit(
    (sensing, loaded): (&Sensing, &LoadedProject),
    mut rows: Vec<PressRow>,
    (noise, off): (&[f64], &Uncertainty),
    args: &CalibrateArgs,
) -> anyhow::Result<Summary> {
    loop {
        let used: Vec<usize> = (0..rows.len()).filter(|&k| rows[k].used).collect();
        let known: Vec<KnownPress> = (used.iter())
            .filter_map(|&k| rows[k].known.clone())
            .collect();
        for (&k, misfit) in used.iter().zip(misfits(&sensing.drawn, &known, noise, off)) {
            rows[k].misfit = Some(misfit);
        }
        let worst = (used.iter().copied()).max_by(|&a, &b| {
            rows[a]
                .misfit
                .unwrap_or(0.0)
                .total_cmp(&rows[b].misfit.unwrap_or(0.0))
        });
        match worst.filter(|&k| rows[k].misfit > Some(MISFIT)) {
            Some(k) if !args.keep_all && used.len() > LEAST => rows[k].leave_out(
                "it does not fit the others: pressed elsewhere, or not as hard as it says".into(),
            ),
            _ => {
                let calibration = calibrate(&sensing.drawn, &known, noise, off);
                let (found, uncertain) = ((&known[..], &calibration), (noise, off));
                let outlook = next((sensing, loaded), found, uncertain, args.force)?;
                let factor = of_part(&sensing.drawn, &known, noise, off).map(|part| part.factor);
                return Ok(Summary {
                    rows,
                    calibration,
                    outlook,
                    of_part: FoundOfPart {
                        factor,
                        ..FoundOfPart::default()
                    },
                });
            }
        }
    }
}

/// Where to press next, among places that a finger reaches.
fn next(
    (sensing, loaded): (&Sensing, &LoadedProject),
    found: (&[KnownPress], &Calibration),
    uncertain: (&[f64], &Uncertainty),
    force: f64,
) -> anyhow::Result<PressOutlook> {
    const PLACES: usize = 96;
    let mesh = &sensing.drawn.map.mesh;
    let touches = sensing.touches(&loaded.inputs, PLACES, 0, true)?;
    let at = |touch: &Touch| mesh.index().nearest(touch.position).0;
    let places: Vec<SurfacePoint> = touches.iter().map(at).collect();
    Ok(outlook(&sensing.drawn, found, uncertain, &places, force))
}

/// Writes the project with what was found, and nothing else changed.
fn save(
    loaded: &LoadedProject,
    target: &Path,
    found: &Summary,
    board: Option<&str>,
) -> anyhow::Result<()> {
    let own = !loaded.bundled && loaded.path.is_file();
    let fresh = own.then(|| project_file::load(&loaded.path)).transpose()?;
    let mut project = fresh.map_or_else(|| loaded.inputs.project.clone(), |l| l.inputs.project);
    if let Some([thickness, _]) = found.of_part.thickness_mm {
        project.part.thickness_mm = thickness;
    }
    match found.of_part.bedding {
        Some(FittedBedding::Gives([bedding, _])) => part::hold_by(&mut project, Some(bedding)),
        Some(FittedBedding::Firm) => part::hold_by(&mut project, None),
        None => {}
    }
    if let Some([modulus, _]) = found.of_part.youngs_modulus_gpa {
        project.material.youngs_modulus_gpa = modulus;
    }
    let presses = found.rows.iter().filter_map(|row| row.keys(board));
    let sites = &loaded.inputs.project.selection.sites;
    (project.live).take(&found.calibration, sites, presses.collect());
    let folder = target.parent().unwrap_or(Path::new("."));
    let mesh = if loaded.bundled {
        crate::io::examples::write_bundled_mesh(folder, &loaded.mesh_path)?
    } else {
        loaded.mesh_path.clone()
    };
    project.part.mesh = project_file::relative_to(target, &mesh);
    let painted = loaded.inputs.painted.as_ref().map(|p| &p[..]);
    project_file::save(target, &project, painted, &loaded.inputs.masks)
        .with_context(|| "the calibration could not be saved".to_owned())
}
