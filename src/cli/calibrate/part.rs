//! What the presses say of the part beside its gauges: how stiff its material is, and how thick a shell's wall.
//!
//! Of the material every reading tells alike. Another thickness changes how the wall bends and stretches: each is a model
//! of its own, and that which makes the presses most likely is taken.

use anyhow::Context as _;
use clap::ValueEnum;

use super::summary::{Row, Summary};
use crate::cli::common::Common;
use crate::cli::progress::Bar;
use crate::design::{self, Sensing};
use crate::inference::Known;
use crate::inference::calibration::part::of_part;
use crate::io::project_file::LoadedProject;
use crate::project::{PartModel, Project};
use crate::uncertainty::Uncertainty;

/// What may be fitted of a part.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartArg {
    /// Young's modulus (material.youngs_modulus_gpa), from forces that are known.
    Stiffness,
    /// The thickness of a shell's wall (part.thickness_mm).
    Thickness,
}

/// The part as it was fitted.
pub struct Fitted {
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

impl Fitted {
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
        rows: &[Row],
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
        let evidence = |log: f64| -> anyhow::Result<f64> {
            let sensing = of(log)?;
            let found = of_part(&sensing.drawn, &known(rows, &sensing), noise, off);
            Ok(found.map_or(f64::NEG_INFINITY, |f| f.evidence))
        };
        let (log, deviation) = likeliest(evidence)?;
        let sensing = of(log)?;
        bar.finish();
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
fn known(rows: &[Row], sensing: &Sensing) -> Vec<Known> {
    let mesh = &sensing.drawn.map.mesh;
    let known = rows.iter().filter(|row| row.used).filter_map(|row| {
        let known = row.known.clone()?;
        let at = mesh.index().nearest(row.place * 1e-3).0;
        Some(Known { at, ..known })
    });
    known.collect()
}

/// Where a concave function is largest, and the standard deviation that its curvature there stands for: a parabola through
/// three places, laid anew around its top until that stays.
fn likeliest(evidence: impl Fn(f64) -> anyhow::Result<f64>) -> anyhow::Result<(f64, f64)> {
    /// Logarithms of the thickness: the first step, how far the top may lie, and how near two tops are one.
    const STEP: f64 = 0.15;
    const FARTHEST: f64 = 1.0;
    const NEAR: f64 = 0.003;
    const TURNS: usize = 8;
    let (mut middle, mut step) = (0.0_f64, STEP);
    for _ in 0..TURNS {
        let [below, at, above] = [
            evidence(middle - step)?,
            evidence(middle)?,
            evidence(middle + step)?,
        ];
        let curvature = (below - 2.0 * at + above) / (step * step);
        let slope = (above - below) / (2.0 * step);
        let top = if curvature < 0.0 {
            (-slope / curvature).clamp(-2.0 * step, 2.0 * step)
        } else {
            2.0 * step * slope.signum()
        };
        middle = (middle + top).clamp(-FARTHEST, FARTHEST);
        if top.abs() < NEAR && curvature < 0.0 {
            return Ok((middle, (-curvature).recip().sqrt()));
        }
        if top.abs() < step {
            step = (step / 2.0).max(NEAR);
        }
    }
    None.context(
        "the presses do not say how thick the wall is: press at more places, with a force that is known, or leave --fit thickness out",
    )
}

/// Takes the factor that all gauges share for the material's.
pub fn take_stiffness(fit: &[PartArg], loaded: &mut LoadedProject, found: &mut Summary) {
    let Some([factor, deviation]) = found.of_part.factor else {
        return;
    };
    if !fit.contains(&PartArg::Stiffness) || factor <= 0.0 {
        return;
    }
    let modulus = &mut loaded.inputs.project.material.youngs_modulus_gpa;
    *modulus /= factor;
    found.of_part.youngs_modulus_gpa = Some([*modulus, *modulus * deviation / factor]);
    found.calibration = found.calibration.clone().on_softer(factor);
}
