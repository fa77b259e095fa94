//! A simulated bench: printer, limb as a workshop builds it, and board.

use glam::DVec3;

use super::asked::Flaws;
use super::ready::Ready;
use crate::bench::{Collector, CollectorNews, ContactLaw, PrinterFaults, RunEnd, SimulatedPrinter};
use crate::board::{BoardOptions, Faults, HardestUse, PressScript, SimulatedBoard};
use crate::budget::Watch;
use crate::design::DesignError;
use crate::design::simulated_board::{BoardRequest, LASTS_S, gives_way, options, simulated};
use crate::elasticity::Touch;
use crate::link::{BenchOrder, press_simulated};

/// Of the printer's faults, beside the project's.
const SEED: u64 = 0xbe7c;

/// A printer's frame with a force sensor on it: 50 N/mm.
const MACHINE_GIVES: f64 = 2e-5;

/// Presses what is left of a run on a simulated bench, as fast as that can be computed. `orders` is asked for the next one
/// at every look.
///
/// # Errors
/// As for the model of the simulated board, or when the recording cannot be written.
pub fn press_on_simulated(
    ready: &Ready,
    collector: &mut Collector,
    watch: Watch,
    orders: &mut dyn FnMut() -> Option<BenchOrder>,
    tell: impl FnMut(CollectorNews),
) -> anyhow::Result<RunEnd> {
    let flaws = &ready.asked.simulated.clone().unwrap_or_default();
    let machine = &ready.machine;
    let touches: Vec<Touch> = (ready.reach.presses.iter())
        .map(|press| Touch {
            position: press.at,
            normal: press.normal,
            force: 1.0,
            tip_radius: machine.tip_radius,
        })
        .collect();
    let (gives, board) = built(ready, flaws, &touches, watch)?;
    let mut mount = ready.mount;
    mount.shift += DVec3::new(1.0, 1.0, 0.0).normalize() * flaws.askew_mm * 1e-3;
    let contact = ContactLaw {
        surface: &ready.sensing.drawn.map.mesh,
        mount,
        machine,
        machine_gives: MACHINE_GIVES,
        gives: touches.iter().map(|t| t.position).zip(gives).collect(),
    };
    let printer = printer(ready, flaws, collector.left());
    let recorder = ready.recorder()?;
    let bench = (printer, &contact);
    press_simulated(collector, bench, board, recorder, orders, tell).map_err(anyhow::Error::msg)
}

/// How far the limb gives way at these touches (m/N), and the board that reads its gauges.
fn built(
    ready: &Ready,
    flaws: &Flaws,
    touches: &[Touch],
    watch: Watch,
) -> Result<(Vec<f64>, SimulatedBoard), DesignError> {
    let (inputs, sensing) = (&ready.inputs, &*ready.sensing);
    let gives = gives_way(inputs, sensing, touches, watch)?;
    let options = BoardOptions {
        tip_n: ready.machine.sensor.map(|s| s.newton_per_count),
        ..options(inputs, sensing.gauges.len() + 1)
    };
    let asked = BoardRequest {
        workshop: flaws.workshop,
        script: PressScript::Held(None, 0),
        hardest: Some(HardestUse {
            force: ready.asked.most_force_n,
            seconds: LASTS_S,
        }),
        options,
        faults: Faults::default(),
    };
    Ok((gives, simulated(inputs, sensing, asked, watch)?))
}

fn printer(ready: &Ready, flaws: &Flaws, left: usize) -> SimulatedPrinter {
    let faults = PrinterFaults {
        lose: flaws.lose,
        lose_answer: flaws.lose,
        garble: flaws.garble,
        garble_answer: flaws.garble,
        reset: flaws.reset,
        stall: flaws.stall,
    };
    let machine = &ready.machine;
    let axes = [
        Some(&machine.radial),
        Some(&machine.along),
        Some(&machine.rotary),
        machine.lateral.as_ref(),
    ];
    let at = axes.into_iter().flatten().map(|axis| (axis.letter, 0.0));
    // What goes wrong in one run of it is not what went wrong in the last.
    let seed = ready.inputs.project.budget.seed;
    SimulatedPrinter::new(at, faults, seed ^ SEED ^ ((left as u64) << 32))
}
