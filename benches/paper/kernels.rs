//! The authors' kernel for entropy and mutual information beside the one that is searched: exp(-(d / l)²) over arcs on
//! a barrel, without noise.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use glam::DVec3;
use hapdef::budget::unwatched;
use hapdef::design::DesignError;
use hapdef::evaluation::Evaluation;
use hapdef::gaussian_process::{self, Covariance, Distances, GpKernel};
use hapdef::placement::entropy::Entropy;
use hapdef::placement::information::Geometry;
use hapdef::placement::mutual_information::MutualInformation;
use hapdef::placement::{
    Constraints, PlacementError, Pool, Selection, SelectionRequest, Selector, SelectorKind,
};

use crate::displaced::{Displaced, Judged, of_sizes, row};
use crate::{FEW, MANY, cell};

/// The authors', as their scripts have it.
const THEIRS: GpKernel = GpKernel {
    length_m: 0.0175,
    power: 2.0,
    noise: 0.0,
};
/// Radius (m) of the barrel's side from end to end.
const SIDE: f64 = 0.4292;

/// A kernel, and what is chosen by it.
pub struct Chosen {
    whose: &'static str,
    kernel: GpKernel,
    distance: &'static str,
    /// Share of its spectrum that is negative.
    clipped: f64,
    /// Of predicting sites that were left out, as a share of the signals' own rms; no number where it is no covariance.
    error: f64,
    /// By entropy and by mutual information, as far as they are defined; of ours none, which are judged elsewhere.
    pub selections: Vec<Selection>,
}

/// The one that the selectors have used.
pub fn ours(displaced: &Displaced) -> Option<Chosen> {
    let geometry = displaced.reduced.geometry()?;
    let tried = geometry.map.iter().find(|t| t.kernel == geometry.kernel);
    Some(Chosen {
        whose: "ours, searched",
        kernel: geometry.kernel,
        distance: geometry.distance,
        clipped: geometry.covariance.clipped,
        error: tried.map_or(f64::NAN, |t| t.error),
        selections: Vec::new(),
    })
}

/// The authors' over the same locations, as it is and with the noise of ours.
pub fn theirs(displaced: &Displaced) -> Result<Vec<Chosen>, DesignError> {
    let Some(located) = displaced.reduced.located() else {
        return Ok(Vec::new());
    };
    let (reduced, dataset) = (&displaced.reduced, &displaced.simulated.dataset);
    let places: Vec<DVec3> = (located.sites.iter())
        .map(|&s| dataset.sites[s].gauge.position)
        .collect();
    let arcs = (places.iter()).flat_map(|&a| places.iter().map(move |&b| arc(a, b)));
    let arcs: Vec<f64> = arcs.collect();
    let distances = Distances::new(places.len(), "arcs on a barrel", &arcs);
    let x = reduced.x.select_rows(&located.rows);
    let sites: Vec<usize> = located.rows.iter().map(|&r| reduced.feasible[r]).collect();
    let pool = Pool {
        x: &x,
        targets: &dataset.targets_mm(),
        sites: &sites,
        positions: &[],
    };
    let covariance = Covariance::new(&distances, &THEIRS, &unwatched)?;
    let noisy = GpKernel {
        noise: located.geometry.kernel.noise,
        ..THEIRS
    };
    let mut kernels = Vec::new();
    for (whose, kernel) in [("theirs", THEIRS), ("theirs, our noise", noisy)] {
        let geometry = Geometry {
            covariance: Covariance {
                noise: kernel.noise,
                ..covariance.clone()
            },
            kernel,
            distance: distances.kind,
            coinciding: 0,
            map: Vec::new(),
        };
        kernels.push(Chosen {
            whose,
            kernel,
            distance: distances.kind,
            clipped: covariance.clipped,
            error: gaussian_process::trial(&x, &distances, &kernel).error,
            selections: chosen(&geometry, &pool)?,
        });
    }
    Ok(kernels)
}

/// Distance (m) by the authors' formula for barrels around y: an arc of the side from end to end, and one around the
/// axis at the mean radius.
fn arc(a: DVec3, b: DVec3) -> f64 {
    let [near, far] = [a, b].map(|p| p.x.hypot(p.z));
    let chord = (a.y - b.y).hypot(near - far);
    let along = 2.0 * SIDE * (chord / (2.0 * SIDE)).asin();
    let turned = (a.z.atan2(a.x) - b.z.atan2(b.x)).abs();
    let around = f64::midpoint(near, far) * turned.min(TAU - turned);
    along.hypot(around)
}

/// What entropy and mutual information choose; nothing of one that the covariance leaves undefined.
fn chosen(geometry: &Geometry, pool: &Pool) -> Result<Vec<Selection>, PlacementError> {
    let constraints = Constraints::count(MANY);
    let request = SelectionRequest {
        constraints: &constraints,
        watch: &unwatched,
        found: &|_| (),
    };
    let mut selections = Vec::new();
    for selection in [
        Entropy { geometry }.select(pool, &request),
        MutualInformation { geometry }.select(pool, &request),
    ] {
        match selection {
            Ok(selection) => selections.push(of_sizes(&selection, &[FEW, MANY])),
            Err(PlacementError::Singular) => {}
            Err(other) => return Err(other),
        }
    }
    Ok(selections)
}

/// All kernels, ours first where there is one.
pub fn write(text: &mut String, kernels: &[&Chosen], judged: &Judged) {
    let _ = writeln!(
        text,
        "### Kernels\n\nk = exp(-(d / l)^p), β⁻¹ on the diagonal. Negative: the share of the spectrum that no covariance has, which is set to zero. Sites left out: error of predicting them from the others, as a share of the signals' own rms; – where the kernel is no covariance. Mean errors (mm) at {FEW} / {MANY} gauges by regression; – where nothing is defined to be chosen by.\n\n| kernel | distance | l (mm) | p | β⁻¹ | negative | sites left out | entropy | mutual information |\n|---|---|---|---|---|---|---|---|---|"
    );
    let own = kernels.len() - judged.theirs.len();
    let found = std::iter::repeat_n(&judged.evaluation, own).chain(&judged.theirs);
    for (kernel, found) in kernels.iter().zip(found) {
        let error = Some(kernel.error).filter(|e| !e.is_nan());
        let _ = writeln!(
            text,
            "| {} | {} | {:.1} | {} | {} | {:.2} % | {} | {} | {} |",
            kernel.whose,
            kernel.distance,
            kernel.kernel.length_m * 1e3,
            kernel.kernel.power,
            kernel.kernel.noise,
            100.0 * kernel.clipped,
            cell(error),
            few_and_many(found, SelectorKind::Entropy),
            few_and_many(found, SelectorKind::MutualInformation)
        );
    }
    text.push('\n');
}

fn few_and_many(found: &Evaluation, kind: SelectorKind) -> String {
    let cells = [FEW, MANY].map(|gauges| cell(row(found, kind, gauges).map(|r| r.error_mm)));
    cells.join(" / ")
}
