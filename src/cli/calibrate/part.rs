//! What the presses say of the part beside its gauges: how stiff its material is, and how thick a shell's wall.
//!
//! Of the material every reading tells alike. Another thickness changes how the wall bends and stretches: each is a model
//! of its own, and that which makes the presses most likely is taken.

use std::collections::BTreeMap;

use anyhow::Context as _;
use clap::ValueEnum;

use super::summary::{PressRow, Summary};
use crate::cli::common::Common;
use crate::cli::progress::Bar;
use crate::design::{self, Sensing};
use crate::inference::KnownPress;
use crate::inference::calibration::part::of_part;
use crate::io::project_file::LoadedProject;
use crate::project::{PartModel, Project};
use crate::uncertainty::Uncertainty;

/// What may be fitted of a part.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartArg {
    /// Young's modulus of the material, from forces that are known.
    Stiffness,
    /// The thickness of a shell's wall.
    Thickness,
}

/// The part as it was fitted.
pub struct FittedPart {
    /// The project with its wall.
    pub loaded: LoadedProject,
    /// Its model.
    pub sensing: Sensing,
    /// How thick the wall is, and its standard deviation (mm); nothing where that was not asked for.
    pub thickness: Option<[f64; 2]>,
}

/// How far off the stiffness is taken to be where it is to be found (a share, as a standard deviation).
const UNSURE: f64 = 0.5;

/// Refuses what the part does not have.
pub fn check(fit: &[PartArg], project: &Project) -> anyhow::Result<()> {
    anyhow::ensure!(
        !fit.contains(&PartArg::Thickness) || project.part.model == PartModel::Shell,
        "--fit thickness: the part is a solid, whose walls are those of its mesh; fit its stiffness, or open the middle of its walls as a shell"
    );
    Ok(())
}

/// What is taken to be off where the stiffness is to be found.
pub fn unsure(fit: &[PartArg], off: Uncertainty) -> Uncertainty {
    let stiffness = if fit.contains(&PartArg::Stiffness) {
        off.stiffness.max(UNSURE)
    } else {
        off.stiffness
    };
    Uncertainty { stiffness, ..off }
}

impl FittedPart {
    /// As its project says.
    pub fn as_drawn(loaded: LoadedProject, sensing: Sensing) -> Self {
        Self {
            loaded,
            sensing,
            thickness: None,
        }
    }

    /// With the wall that the presses speak for, where that is asked for.
    pub fn fitted(
        mut self,
        fit: &[PartArg],
        common: &Common,
        rows: &[PressRow],
        noise: &[f64],
        off: &Uncertainty,
    ) -> anyhow::Result<Self> {
        if !fit.contains(&PartArg::Thickness) {
            return Ok(self);
        }
        let bar = Bar::default();
        let watch = |p| bar.show(p);
        let drawn = self.loaded.inputs.project.part.thickness_mm;
        let of = |log: f64| {
            let mut inputs = self.loaded.inputs.clone();
            inputs.project.part.thickness_mm = drawn * log.exp();
            let budget = inputs.project.budget.budget();
            common.in_pool(|| Ok(design::sensing(&inputs, &budget, &watch)?))
        };
        // A wall that cannot be computed is not the one that was pressed.
        let evidence = |log: f64| {
            let found = of(log)
                .ok()
                .and_then(|sensing| of_part(&sensing.drawn, &known(rows, &sensing), noise, off));
            found.map_or(f64::NEG_INFINITY, |f| f.evidence)
        };
        let found = likeliest(evidence).map(|top| of(top.0).map(|sensing| (top, sensing)));
        bar.finish();
        let ((log, deviation), sensing) = found.context(UNSAID)??;
        let thickness = drawn * log.exp();
        self.loaded.inputs.project.part.thickness_mm = thickness;
        Ok(Self {
            loaded: self.loaded,
            sensing,
            thickness: Some([thickness, thickness * deviation]),
        })
    }
}

/// The presses on a model's own surface.
fn known(rows: &[PressRow], sensing: &Sensing) -> Vec<KnownPress> {
    let mesh = &sensing.drawn.map.mesh;
    let known = rows.iter().filter(|row| row.used).filter_map(|row| {
        let known = row.known.clone()?;
        let at = mesh.index().nearest(row.place * 1e-3).0;
        Some(KnownPress { at, ..known })
    });
    known.collect()
}

const UNSAID: &str = "the presses do not say how thick the wall is: press at more places, with a force that is known, or leave thickness out of --fit";

/// Where a function with one top is largest, and the standard deviation that its curvature there stands for; nothing where it
/// is too flat to say. Away from the top evidence falls ever more slowly, for the model is then trusted less and less:
/// slopes do not lead there, but the best of five places does, which are laid anew around it, nearer to each other.
/// Elements are laid anew for every thickness, which makes evidence tremble: places that lie too near each other would say
/// nothing.
fn likeliest(evidence: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    /// Places lie on a lattice of this (logarithms of the thickness), at first so many steps apart and at last one.
    const LATTICE: f64 = 0.03;
    const FIRST: i32 = 4;
    /// The farthest that the top may lie, in steps, and the largest deviation that says anything.
    const FARTHEST: i32 = 36;
    const VAGUE: f64 = 0.15;
    let mut known = BTreeMap::new();
    let (mut middle, mut step) = (0_i32, FIRST);
    while middle.abs() < FARTHEST {
        let places = [-2, -1, 0, 1, 2].map(|k| middle + k * step);
        let found = places.map(|at| {
            let value = || evidence(f64::from(at) * LATTICE);
            *known.entry(at).or_insert_with(value)
        });
        let best = (0..5).max_by(|&a, &b| found[a].total_cmp(&found[b]))?;
        middle = places[best];
        if best == 0 || best == 4 {
            continue;
        }
        if step > 1 {
            step /= 2;
            continue;
        }
        let (off, deviation) = top_of(found)?;
        let off = off + f64::from(places[2] - middle);
        let (top, deviation) = (LATTICE * (f64::from(middle) + off), LATTICE * deviation);
        return (deviation < VAGUE).then_some((top, deviation));
    }
    None
}

/// Where the parabola nearest to five values at even steps has its top, from the midst, and the standard deviation of a
/// density with that logarithm; both in steps. Nothing where it has none near.
fn top_of([a, b, c, d, e]: [f64; 5]) -> Option<(f64, f64)> {
    let slope = (2.0 * (e - a) + (d - b)) / 10.0;
    let bend = (b + d + 2.0 * c - 2.0 * (a + e)) / 7.0;
    let top = slope / bend;
    (bend > 0.0 && top.abs() <= 2.0).then(|| (top, bend.recip().sqrt()))
}

/// Takes the factor that all gauges share for the material's.
pub fn take_stiffness(
    fit: &[PartArg],
    project: &Project,
    found: &mut Summary,
) -> anyhow::Result<()> {
    if !fit.contains(&PartArg::Stiffness) {
        return Ok(());
    }
    let [factor, deviation] = (found.of_part.factor)
        .filter(|[factor, _]| *factor > 0.0)
        .context("the presses do not say how stiff the part is: press at more places, with a force that is known, or leave stiffness out of --fit")?;
    let modulus = project.material.youngs_modulus_gpa / factor;
    found.of_part.youngs_modulus_gpa = Some([modulus, modulus * deviation / factor]);
    found.calibration = found.calibration.clone().on_softer(factor);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_is_found_wherever_it_lies_and_however_the_values_tremble() {
        for top in [-0.7, 0.02, 0.17, 0.4] {
            let tremble = |x: f64| 0.02 * (1e4 * x).sin();
            // As it falls where the model is trusted less and less.
            let value = |x: f64| -80.0 * (1.0 + ((x - top) / 0.1).powi(2)).ln() + tremble(x);
            let (found, said) = likeliest(value).unwrap();
            assert!((found - top).abs() < 5e-3, "{found} for {top}");
            let right = 0.1 / 160.0_f64.sqrt();
            assert!((0.8..1.8).contains(&(said / right)), "{said} for {right}");
        }
        // What is flat, has no top or is no number says nothing.
        let flat = |x: f64| -2.0 * x * x;
        assert!(likeliest(flat).is_none() && likeliest(|x| x * x).is_none());
        assert!(likeliest(|_| f64::NAN).is_none() && likeliest(|_| f64::NEG_INFINITY).is_none());
    }
}
