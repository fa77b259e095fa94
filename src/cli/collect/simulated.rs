//! A simulated bench: printer, limb as a workshop builds it, and board.

use glam::DVec3;

use super::args::CollectArgs;
use crate::bench::{Collector, Contact, Ended, News, PrinterFaults, Reach, SimulatedPrinter};
use crate::board::{Faults, Options, Script};
use crate::cli::progress::Bar;
use crate::design::Sensing;
use crate::design::simulated_board::{gives_way, options, simulated};
use crate::elasticity::Touch;
use crate::io::machine_file::MachineFile;
use crate::io::project_file::LoadedProject;
use crate::link::{Recorder, press_simulated};

/// Of the printer's faults, beside the project's.
const SEED: u64 = 0xbe7c;

/// A printer's frame with a force sensor on it: 50 N/mm.
const MACHINE_GIVES: f64 = 2e-5;

/// Presses what is left. The outer error is of the model, the inner one of the recording.
pub(super) fn press(
    args: &CollectArgs,
    (loaded, sensing, file): (&LoadedProject, &Sensing, &MachineFile),
    reach: &Reach,
    collector: &mut Collector,
    recorder: Recorder,
    tell: impl FnMut(News),
) -> anyhow::Result<Result<Ended, String>> {
    let inputs = &loaded.inputs;
    let seed = inputs.project.budget.seed;
    let machine = &file.machine;
    let touches: Vec<Touch> = (reach.presses.iter())
        .map(|press| Touch {
            position: press.at,
            normal: press.normal,
            force: 1.0,
            tip_radius: machine.tip_radius,
        })
        .collect();
    let bar = Bar::default();
    let built = args.common.in_pool(|| {
        let watch = |p| bar.show(p);
        let gives = gives_way(inputs, sensing, &touches, &watch)?;
        let options = Options {
            tip_n: machine.sensor.map(|s| s.newton_per_count),
            ..options(inputs, sensing.gauges.len() + 1)
        };
        let script = Script::Held(None, 0);
        let workshop = args.faults.workshop;
        let board = simulated(
            inputs,
            sensing,
            workshop,
            script,
            args.most_force,
            options,
            Faults::default(),
            &watch,
        )?;
        Ok((gives, board))
    });
    bar.finish();
    let (gives, board) = built?;
    let stance = inputs.project.part.axis.stance(&inputs.part);
    let (mut mount, _) = (file.mount(&inputs.part, &stance)).map_err(anyhow::Error::msg)?;
    mount.shift += DVec3::new(1.0, 1.0, 0.0).normalize() * args.faults.askew * 1e-3;
    let contact = Contact {
        surface: &sensing.drawn.map.mesh,
        mount,
        machine,
        machine_gives: MACHINE_GIVES,
        gives: touches.iter().map(|t| t.position).zip(gives).collect(),
    };
    let faults = PrinterFaults {
        lose: args.faults.lose,
        lose_answer: args.faults.lose,
        garble: args.faults.garble,
        garble_answer: args.faults.garble,
        reset: args.faults.reset,
        stall: args.faults.stall,
    };
    // What goes wrong in one run of it is not what went wrong in the last.
    let left = collector.left() as u64;
    let axes = [
        Some(&machine.radial),
        Some(&machine.along),
        Some(&machine.rotary),
        machine.lateral.as_ref(),
    ];
    let at = axes.into_iter().flatten().map(|axis| (axis.letter, 0.0));
    let printer = SimulatedPrinter::new(at, faults, seed ^ SEED ^ (left << 32));
    Ok(press_simulated(
        collector,
        (printer, &contact),
        board,
        recorder,
        tell,
    ))
}
