//! A run before its gauges are known: its machine, its settings, and whether its folder is of them.

use std::path::{Path, PathBuf};

use anyhow::ensure;

use super::asked::BenchRequest;
use super::places::points_of;
use crate::design::Inputs;
use crate::io::bench_folder::{self, PressedPart, limb_key};
use crate::io::machine_file::{self, MachineFile};
use crate::io::source;

/// What is to be pressed into a folder.
pub struct PressingRun {
    pub(super) asked: BenchRequest,
    pub(super) folder: PathBuf,
    pub(super) about: PressedPart,
    pub(super) file: MachineFile,
    /// Whether the folder holds a part of it already.
    pub begun: bool,
}

impl PressingRun {
    /// Of a project, into a folder, which need not be there yet.
    ///
    /// # Errors
    /// A message in the user's terms: no gauges, a machine that cannot be read, limits that do not go together, or a folder
    /// that something else was begun in.
    pub fn new(asked: BenchRequest, inputs: &Inputs, folder: &Path) -> anyhow::Result<Self> {
        let (about, file) = about(&asked, inputs)?;
        let before = PressedPart::read(folder)?;
        // A plan of which nothing was pressed yet gives way to another one.
        let pressed = before.is_some() && !bench_folder::parts(folder)?.is_empty();
        let before = before.filter(|_| pressed);
        if let Some(before) = &before {
            same(before, &about, folder)?;
        } else if let Some(path) = &asked.points {
            // What cannot be pressed is said before anything is computed.
            points_of(path, inputs)?;
        }
        Ok(Self {
            asked,
            folder: folder.to_owned(),
            about,
            file,
            begun: before.is_some(),
        })
    }
}

/// What is written of it, and its machine.
fn about(asked: &BenchRequest, inputs: &Inputs) -> anyhow::Result<(PressedPart, MachineFile)> {
    let project = &inputs.project;
    let gauges = project.selection.sites.len();
    ensure!(
        gauges > 0,
        "the project has no gauges yet: choose them first (hapdef design)"
    );
    ensure!(
        asked.by_hand || asked.force_n < asked.most_force_n,
        "the force that is enough, {} N, must be less than that at which the machine stops, {} N",
        asked.force_n,
        asked.most_force_n
    );
    let (text, mut file) = if let Some(path) = &asked.machine {
        (source::read_text(path)?, machine_file::read(path)?)
    } else {
        let file = machine_file::parse(machine_file::PAPER).map_err(anyhow::Error::msg)?;
        let text = if asked.by_hand {
            ""
        } else {
            machine_file::PAPER
        };
        (text.to_owned(), file)
    };
    if asked.simulated.is_some()
        && let Some(sensor) = &mut file.machine.sensor
    {
        // The simulated board has its force sensor behind the gauges.
        sensor.channel = gauges;
    }
    let settings = project.live.settings(gauges);
    let about = PressedPart {
        format: PressedPart::format(),
        limb: limb_key(inputs),
        machine: text,
        seed: project.budget.seed,
        step_mm: asked.step_mm,
        depth_mm: asked.depth_mm,
        force_n: asked.force_n,
        most_force_n: asked.most_force_n,
        channels: settings.channels,
        gauge_factor: settings.chain.gauge_factor,
        active_arms: settings.chain.active_arms,
        simulated: asked.simulated.is_some(),
        by_hand: asked.by_hand,
    };
    Ok((about, file))
}

/// A run is gone on with only as it was begun.
fn same(before: &PressedPart, now: &PressedPart, folder: &Path) -> anyhow::Result<()> {
    let what = if before.limb != now.limb {
        "another limb or other gauges"
    } else if before.machine != now.machine {
        "another machine file"
    } else if before != now {
        "other settings (seed, step, depth, forces, channels, by hand or simulated and not)"
    } else {
        return Ok(());
    };
    anyhow::bail!(
        "{}: a run was begun there with {what}. Name another folder, or go on as it was begun",
        folder.display()
    )
}
