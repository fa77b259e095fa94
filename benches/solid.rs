//! Solids measured: `cargo bench --bench solid` writes `benches/solid.md`, which `RESULTS.md` takes in. With
//! names of cases behind `--` only those are measured, and nothing is written.

#[path = "../tests/bench/mod.rs"]
mod bench;
mod timing;

use std::fmt::Write as _;

use bench::solids::{Found, bent_tube, shell_of, slotted, strip};
use glam::{DQuat, DVec3};
use timing::{cpu_seconds, reference_seconds};

fn main() {
    let reference = reference_seconds();
    let mut text = format!(
        "## Solids: size and order of the cells against error and time\n\nRemade by `cargo bench --bench solid`. Processor seconds of one core from the closed mesh to the answer (cutting, assembling, factoring, all loads); a 4000 × 4000 matrix product took {reference:.1} s beside them. Plate: a strip 100 × 20 × 2 mm turned out of the grid, clamped and pressed at its end, against the beam with shear (ν = 0; the tip, 8 mm wide on 20, adds 0.4 %). Tube: 31.5 mm outside, wall 3 mm, bent by a couple, against the beam. Limb: the slotted tube of the shell's table made solid, wall 3 mm, against someone else's solid (747 000 freedoms): rms of the displacement under the load, and of the strain inside beyond two tip radii over the load's largest.\n\n| case | cells (walls) | order | unknowns | error of displacement (%) | of strain inside (%) | seconds |\n|---|---|---|---|---|---|---|\n"
    );
    let turned = DQuat::from_axis_angle(DVec3::X, 0.3);
    for order in 1..=4 {
        for cells in [4.0, 2.5, 1.5] {
            row(&mut text, "plate", cells, order, true, || {
                strip(turned, cells, order)
            });
        }
    }
    for order in 1..=4 {
        for cells in [3.0, 2.0, 1.33] {
            row(&mut text, "tube", cells, order, true, || {
                bent_tube(cells, order)
            });
        }
    }
    for (order, sizes) in [
        (1, &[2.67, 1.33][..]),
        (2, &[2.67, 2.0, 1.33, 1.0]),
        (3, &[4.0, 2.67, 2.0]),
        (4, &[4.0, 2.67]),
    ] {
        for &cells in sizes {
            row(&mut text, "limb", cells, order, false, || {
                slotted(3.0 * cells, order)
            });
        }
    }
    if wanted("shell") {
        shell_against_solid(&mut text);
    }
    println!("{text}");
    if some() {
        return;
    }
    std::fs::write("benches/solid.md", text).expect("benches/solid.md can be written");
}

fn names() -> impl Iterator<Item = String> {
    std::env::args().skip(1).filter(|a| !a.starts_with('-'))
}

fn some() -> bool {
    names().next().is_some()
}

fn wanted(name: &str) -> bool {
    !some() || names().any(|n| n == name)
}

/// What a shell leaves out of the limb as its wall grows.
fn shell_against_solid(text: &mut String) {
    text.push_str("\n## What a shell leaves out\n\nThe slotted tube (radius 30 mm, windows, held at its foot) as a shell of 16 000 vertices against itself as a solid of quadratic cells, over the thickness of the wall. rms over the loads of the displacement under the load, and of the strain inside beyond two tip radii over the load's largest.\n\n| wall (mm) | wall over radius | displacement (%) | strain inside (%) |\n|---|---|---|---|\n");
    for wall in [1.5, 3.0, 4.5, 6.0, 9.0] {
        let found = shell_of(wall);
        let line = format!(
            "| {wall} | {:.2} | {:.2} | {:.2} |",
            wall / 30.0,
            found.displacement,
            found.strain
        );
        eprintln!("{line}");
        let _ = writeln!(text, "{line}");
    }
}

/// A case at one size and order; `ratio` where it gives computed over exact.
fn row(
    text: &mut String,
    name: &str,
    cells: f64,
    order: usize,
    ratio: bool,
    case: impl FnOnce() -> Found + Send,
) {
    if !wanted(name) {
        return;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let before = cpu_seconds();
    let found = pool.expect("a thread").install(case);
    let seconds = cpu_seconds() - before;
    let percent = |x: f64| {
        if ratio {
            format!("{:+.2}", 100.0 * (x - 1.0))
        } else {
            format!("{x:.2}")
        }
    };
    let line = format!(
        "| {name} | {cells} | {order} | {} | {} | {} | {seconds:.1} |",
        found.unknowns,
        percent(found.displacement),
        percent(found.strain)
    );
    eprintln!("{line}");
    let _ = writeln!(text, "{line}");
}
