//! The bundled limb so coarse that a whole pipeline on it ends soon.

use std::sync::Arc;

use hapdef::design::Inputs;
use hapdef::limb::LimbSpec;

/// The limb on elements of 5 mm, sites 4 mm apart, two gauges.
pub fn limb() -> Inputs {
    let mut inputs = hapdef::cli::bundled().unwrap().inputs;
    let coarse = LimbSpec {
        element: 5.0,
        ..LimbSpec::default()
    };
    inputs.part = Arc::new(coarse.build().unwrap().0);
    // No multiple of it falls on a window's edge, where rounding would decide.
    inputs.project.sites.spacing_mm = 4.1;
    inputs.project.feasible.edge_radius_mm = 4.0;
    inputs.project.selection.sensors = 2;
    inputs
}
