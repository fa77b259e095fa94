//! The settings of a run, and what it achieved with them.

use std::fmt::Write as _;

use crate::design::{Design, Inputs, Simulated};
use crate::io::run::{Provenance, run_key};

/// What the elastic model says of its own error, and what it was checked for.
fn trust(simulated: &Simulated) -> [(&'static str, String); 3] {
    [
        (
            "Error of the mesh, estimated",
            format!(
                "{:.1e} mm ({:.1} %) under a touch, {:.1} % of a touch's largest strain (rms over {} touches)",
                simulated.discretization.displacement_mm,
                simulated.discretization.displacement_percent,
                simulated.discretization.strain_percent,
                simulated.discretization.loads
            ),
        ),
        (
            "Error of linearity, estimated",
            simulated.linearity.as_ref().map_or_else(
                || "not estimated for solids".into(),
                |l| {
                    format!(
                        "up to {:.1} %, half of the touches below {:.1} %, at {} N",
                        l.largest_percent.abs(),
                        l.median_percent,
                        l.force_n
                    )
                },
            ),
        ),
        (
            "Checks",
            format!(
                "reactions sum to the load to {:.0e}, ½ u·f is the strain energy to {:.0e}, pieces held: {}",
                simulated.checks.reaction_error,
                simulated.checks.energy_error,
                simulated.checks.pieces_held
            ),
        ),
    ]
}

pub(super) fn settings(
    page: &mut String,
    inputs: &Inputs,
    design: &Design,
    provenance: &Provenance,
) {
    page.push_str("<h2>Filters</h2><table><tr><th>Filter</th><th>Sites taken</th></tr>");
    for (filter, count) in design.feasibility.taken() {
        let _ = write!(page, "<tr><td>{}</td><td>{count}</td></tr>", filter.label());
    }
    page.push_str("</table><h2>Settings and what was achieved</h2><table>");
    for (label, value) in rows(inputs, design, provenance) {
        let _ = write!(page, "<tr><td>{label}</td><td>{value}</td></tr>");
    }
    page.push_str("</table>");
}

/// What was asked for, what was achieved with it, and how long each stage took.
#[must_use]
pub fn rows(inputs: &Inputs, design: &Design, provenance: &Provenance) -> Vec<(String, String)> {
    let mut rows: Vec<(String, String)> = (asked(inputs, design).into_iter())
        .chain(trust(&design.simulated))
        .map(|(label, value)| (label.to_owned(), value))
        .collect();
    let time = |s: &crate::design::StageTime| {
        (format!("Time, {}", s.stage), format!("{:.2} s", s.seconds))
    };
    rows.extend(design.seconds.iter().map(time));
    rows.push(("Version".into(), format!("HapDef {}", provenance.version)));
    rows.push((
        "Run, as in the files beside this one".into(),
        run_key(inputs, design),
    ));
    rows
}

fn asked(inputs: &Inputs, design: &Design) -> Vec<(&'static str, String)> {
    let p = &inputs.project;
    let work = design.work();
    vec![
        (
            "Touch",
            format!(
                "{} N over a radius of {} mm; expected from {} to {} N",
                p.touch.force_n, p.touch.tip_radius_mm, p.touch.forces_n[0], p.touch.forces_n[1]
            ),
        ),
        (
            "Gauge noise and range",
            format!(
                "{} and {} microstrain",
                p.gauge.noise_microstrain, p.gauge.range_microstrain
            ),
        ),
        (
            "Gauge grid",
            format!("{} × {} mm", p.gauge.grid_length_mm, p.gauge.grid_width_mm),
        ),
        (
            "Quality and seed",
            format!("{}, {}", design.budget.quality.name(), p.budget.seed),
        ),
        (
            "Model",
            format!(
                "{} vertices, {} unknowns, smallest scaled pivot {:.1e}",
                design.simulated.mesh.positions().len(),
                design.simulated.unknowns,
                design.simulated.checks.smallest_pivot
            ),
        ),
        (
            "Work",
            format!(
                "{} assemblies, {} factorizations, {} solves, {} kernel entries, {} fits",
                work.assemblies,
                work.factorizations,
                work.solves,
                work.kernel_evaluations,
                work.fits
            ),
        ),
    ]
}
