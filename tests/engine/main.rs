//! What is computed and what the command line says of it: no window is opened and no board is connected.

#[path = "../agreement/mod.rs"]
mod agreement;
#[path = "../bench/mod.rs"]
mod bench;
#[path = "../coarse/mod.rs"]
mod coarse;
#[path = "../hard/mod.rs"]
mod hard;

mod analytic;
mod axis;
mod bedding;
mod certificate;
mod cli;
mod continuity;
mod convergence;
mod data_files;
mod decks;
mod docs;
mod drift;
mod effectivity;
mod elements_left;
mod expected;
mod export_c;
mod extremes;
mod fuzz;
mod gauges;
mod given_tetrahedra;
mod groups;
mod halved;
mod inference;
mod judge;
mod jumps;
mod learning;
mod libsvm;
mod making;
mod mesh_files;
mod parameter_studies;
mod pictures;
mod placement;
mod properties;
mod reach;
mod real_parts;
mod refine;
mod regions;
mod remesh;
mod rest;
mod rewritten;
mod same_part;
mod session_core;
mod several;
mod solid;
mod solid_extremes;
mod solids;
mod study;
mod test_bed;
mod tried;
mod volumes;
mod words;
mod workshop;

/// Whether a file beside the repository is not there, which is said: what a test prints is not seen where it passes.
fn is_missing(path: &std::path::Path) -> bool {
    use std::io::Write as _;

    let missing = !path.is_file();
    if missing {
        let _ = writeln!(
            std::io::stderr(),
            "skipped: {} is not there",
            path.display()
        );
    }
    missing
}
