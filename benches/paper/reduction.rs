//! How many sites are left: by the filters, and by two measures of what candidates leave unexplained.

use std::fmt::Write as _;

use hapdef::budget::unwatched;
use hapdef::dataset::SignalMatrix;
use hapdef::feasible::Feasibility;
use hapdef::pca::Spectrum;
use hapdef::placement::PlacementError;
use hapdef::placement::candidates::{Reduction, reduce};

use crate::CANDIDATES;

/// The paper's 1 %.
const UNEXPLAINED: f64 = 0.01;
/// Fewer sites than this are not worth a row.
const LEAST: usize = 20;

/// What so many sites leave unexplained, as shares.
struct Left {
    sites: usize,
    /// Σ‖rebuilt - x‖ / Σ‖x‖.
    norms: f64,
    /// Nothing where the sites depend on each other.
    variance: Option<f64>,
}

/// What two measures say of signals.
pub struct Measured {
    /// Up to as many sites as the paper's candidates.
    left: Vec<Left>,
    /// The fewest sites that leave 1 % of the variance or less, where any number does.
    enough: Option<usize>,
}

impl Measured {
    /// Of signals (sites × touches).
    pub fn of(x: &SignalMatrix) -> Result<Self, PlacementError> {
        let reduced = |to: Reduction| reduce(x, to, usize::MAX, &unwatched);
        let enough = reduced(Reduction::Unexplained(UNEXPLAINED))?;
        let reached = enough.unexplained.is_some_and(|u| u <= UNEXPLAINED);
        let curve = reduced(Reduction::Count(CANDIDATES))?.curve;
        let mut counts: Vec<usize> = curve.iter().map(|p| p.sites).collect();
        counts.retain(|&sites| (LEAST..CANDIDATES).contains(&sites));
        counts.push(CANDIDATES);
        let spectrum = Spectrum::unscaled(x, &unwatched)?;
        let pca = spectrum.components(CANDIDATES, &unwatched)?;
        let left = |sites: usize| Left {
            sites,
            norms: pca.norms_missed(x, sites),
            variance: (curve.iter())
                .find(|p| p.sites == sites)
                .map(|p| p.unexplained),
        };
        Ok(Self {
            left: counts.into_iter().map(left).collect(),
            enough: reached.then_some(enough.rows.len()),
        })
    }
}

pub fn write(text: &mut String, feasibility: &Feasibility, measured: &Measured) {
    filters(text, feasibility);
    candidates(text, measured);
}

fn filters(text: &mut String, feasibility: &Feasibility) {
    let mut left = feasibility.verdicts.len();
    let _ = writeln!(
        text,
        "### Sites by filter\n\nThe paper: 3726 nodes, of which 2162 are feasible: not near rigid support, not at an edge.\n\n| filter | takes | leaves |\n|---|---|---|\n| all that faces inward | – | {left} |"
    );
    for (filter, taken) in feasibility.taken() {
        if taken > 0 {
            left -= taken;
            let _ = writeln!(text, "| {} | {taken} | {left} |", filter.label());
        }
    }
    text.push('\n');
}

fn candidates(text: &mut String, measured: &Measured) {
    let enough = (measured.enough).map_or("No number of".into(), |sites| format!("{sites}"));
    let _ = writeln!(
        text,
        "### Candidates\n\nThe paper keeps {CANDIDATES} of 2162 sites for “1 % unexplained variance”. What its authors compute is Σ‖rebuilt - x‖ / Σ‖x‖, neither centred nor squared, of signals as they are, with as many components as pivots, on the touches that these were made from. Variance here is that of standardized signals, by least squares, on touches held out. {enough} sites leave 1 % of it or less.\n\n| sites | their measure | variance |\n|---|---|---|"
    );
    for left in &measured.left {
        let variance = (left.variance).map_or("–".into(), |v| format!("{:.3} %", 100.0 * v));
        let _ = writeln!(
            text,
            "| {} | {:.2} % | {variance} |",
            left.sites,
            100.0 * left.norms
        );
    }
    text.push('\n');
}
