//! What the presses say of the part beside its gauges: how stiff its material is, how thick a shell's wall, and how far
//! its supports give way.
//!
//! Of the material every reading tells alike. Another thickness changes how the wall bends and stretches: each is a model
//! of its own, and that which makes the presses most likely is taken.

use anyhow::Context as _;
use clap::ValueEnum;
use glam::DVec3;

use super::summary::{FittedBedding, PressRow, Summary};
use crate::cli::common::Common;
use crate::cli::progress::Bar;
use crate::design::{self, Inputs, Sensing};
use crate::inference::calibration::likeliest::{LogLattice, likeliest};
use crate::inference::calibration::part::of_part;
use crate::inference::{AsDrawn, KnownPress};
use crate::io::project_file::LoadedProject;
use crate::project::{PartModel, Project, SupportKeys, SupportKind};
use crate::uncertainty::Uncertainty;
use crate::units;

/// What may be fitted of a part.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartArg {
    /// Young's modulus of the material, from forces that are known.
    Stiffness,
    /// The thickness of a shell's wall.
    Thickness,
    /// How far the supports give way: one bedding for all of them.
    Supports,
}

/// The part as it was fitted.
pub struct FittedPart {
    /// The project with its wall and supports.
    pub loaded: LoadedProject,
    /// Its model.
    pub sensing: Sensing,
    /// How thick the wall is, and its standard deviation (mm); nothing where that was not asked for.
    pub thickness: Option<[f64; 2]>,
    /// How stiff the supports are (N/mm³), likewise.
    pub bedding: Option<FittedBedding>,
}

/// How far off the stiffness is taken to be where it is to be found (a share, as a standard deviation).
const UNSURE: f64 = 0.5;

/// Refuses what the part does not have.
pub fn check(fit: &[PartArg], project: &Project) -> anyhow::Result<()> {
    anyhow::ensure!(
        !fit.contains(&PartArg::Thickness) || project.part.model == PartModel::Shell,
        "--fit thickness: the part is a solid, whose walls are those of its mesh; fit its stiffness, or open the middle of its walls as a shell"
    );
    let can_give = |s: &SupportKeys| s.kind != SupportKind::Symmetry;
    anyhow::ensure!(
        !fit.contains(&PartArg::Supports) || project.supports.iter().any(can_give),
        "--fit supports: the part is held by mirror planes alone, which do not give way; leave supports out of --fit"
    );
    let gives_way = project.supports.iter().any(|s| s.bedding().is_some());
    anyhow::ensure!(
        !fit.contains(&PartArg::Stiffness) || !gives_way || fit.contains(&PartArg::Supports),
        "--fit stiffness: the project has supports that give way, and a softer part is not all that moves. Fit them too: --fit stiffness,supports"
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
            bedding: None,
        }
    }

    /// With the supports and the wall that the presses speak for, as far as that is asked for.
    pub fn fitted(
        mut self,
        fit: &[PartArg],
        common: &Common,
        rows: &[PressRow],
        noise: &[f64],
        off: &Uncertainty,
    ) -> anyhow::Result<Self> {
        let asked = [PartArg::Supports, PartArg::Thickness].map(|of| fit.contains(&of));
        let bar = Bar::default();
        let trials = Trials {
            common,
            rows,
            noise,
            off,
            bar: &bar,
        };
        // Each is found with the other as it is known by then.
        let rounds = if asked == [true; 2] { 2 } else { 1 };
        for _ in 0..rounds {
            if asked[0] {
                self = self.with_bedding(&trials)?;
            }
            if asked[1] {
                self = self.with_thickness(&trials)?;
            }
        }
        bar.finish();
        Ok(self)
    }

    fn with_thickness(mut self, trials: &Trials<'_>) -> anyhow::Result<Self> {
        let drawn = self.loaded.inputs.project.part.thickness_mm;
        let set = |project: &mut Project, log: f64| project.part.thickness_mm = drawn * log.exp();
        let lattice = LogLattice::THICKNESS;
        let (log, deviation) = trials
            .likeliest(&lattice, &self.loaded.inputs, set)
            .context(UNSAID)?;
        set(&mut self.loaded.inputs.project, log);
        self.sensing = trials.sensing(&self.loaded.inputs)?;
        let thickness = drawn * log.exp();
        self.thickness = Some([thickness, thickness * deviation]);
        Ok(self)
    }

    /// Supports that give way, where that is much likelier than that they do not.
    fn with_bedding(mut self, trials: &Trials<'_>) -> anyhow::Result<Self> {
        /// What the logarithm of the evidence has to gain: two deviations.
        const GAIN: f64 = 2.0;
        let inputs = &mut self.loaded.inputs;
        let start = first_bedding(inputs);
        let set = |project: &mut Project, log: f64| hold_by(project, Some(start * log.exp()));
        let top = trials.likeliest(&LogLattice::BEDDING, inputs, set);
        hold_by(&mut inputs.project, None);
        let holds = trials.evidence(inputs);
        let gives = top.filter(|top| {
            let mut given = inputs.clone();
            set(&mut given.project, top.0);
            trials.evidence(&given) > holds + GAIN
        });
        self.bedding = Some(match gives {
            Some((log, deviation)) => {
                set(&mut inputs.project, log);
                FittedBedding::Gives([1.0, deviation].map(|share| start * log.exp() * share))
            }
            None => FittedBedding::Firm,
        });
        self.sensing = trials.sensing(&self.loaded.inputs)?;
        Ok(self)
    }
}

/// A bedding (N/mm³) that gives way about as much as the part on it.
fn first_bedding(inputs: &Inputs) -> f64 {
    let (lower, upper) = inputs.part.bounds();
    let size_mm = (upper - lower).length() * 1e3;
    inputs.project.material.youngs_modulus_gpa * 1e3 / size_mm
}

/// Gives all supports that can give way this bedding (N/mm³).
pub fn hold_by(project: &mut Project, bedding: Option<f64>) {
    let supports = project.supports.iter_mut();
    for support in supports.filter(|s| s.kind != SupportKind::Symmetry) {
        support.bedding_n_per_mm3 = bedding;
    }
}

/// Parts as they might be, each with a model of its own, and what presses say of them.
struct Trials<'a> {
    common: &'a Common,
    rows: &'a [PressRow],
    noise: &'a [f64],
    off: &'a Uncertainty,
    bar: &'a Bar,
}

impl Trials<'_> {
    fn sensing(&self, inputs: &Inputs) -> anyhow::Result<Sensing> {
        let watch = |p| self.bar.show(p);
        let budget = inputs.project.budget.budget();
        self.common
            .in_pool(|| Ok(design::sensing(inputs, &budget, &watch)?))
    }

    /// The logarithm of how likely the presses are. A part that cannot be computed is not the one that was pressed.
    fn evidence(&self, inputs: &Inputs) -> f64 {
        let places: Vec<DVec3> = used(self.rows)
            .map(|(row, _)| units::from_mm(row.place))
            .collect();
        let watch = |p| self.bar.show(p);
        let budget = inputs.project.budget.budget();
        let drawn = self
            .common
            .in_pool(|| Ok(design::drawn_at(inputs, &budget, &places, &watch)?));
        let found = drawn.ok().and_then(|drawn| {
            let known = known(self.rows, &drawn);
            of_part(&drawn, &known, self.noise, self.off)
        });
        found.map_or(f64::NEG_INFINITY, |f| f.evidence)
    }

    /// What is likeliest of something that `set` gives a project, and its deviation; both as logarithms.
    fn likeliest(
        &self,
        lattice: &LogLattice,
        inputs: &Inputs,
        set: impl Fn(&mut Project, f64),
    ) -> Option<(f64, f64)> {
        likeliest(lattice, |log| {
            let mut tried = inputs.clone();
            set(&mut tried.project, log);
            self.evidence(&tried)
        })
    }
}

/// The presses on a model's own surface.
fn known(rows: &[PressRow], drawn: &AsDrawn) -> Vec<KnownPress> {
    let mesh = &drawn.map.mesh;
    let known = used(rows).map(|(row, known)| KnownPress {
        at: mesh.index().nearest(units::from_mm(row.place)).0,
        ..known.clone()
    });
    known.collect()
}

/// The presses that are heeded, and what was read of them.
fn used(rows: &[PressRow]) -> impl Iterator<Item = (&PressRow, &KnownPress)> {
    let used = rows.iter().filter(|row| row.used);
    used.filter_map(|row| Some((row, row.known.as_ref()?)))
}

const UNSAID: &str = "the presses do not say how thick the wall is: press at more places, with a force that is known, or leave thickness out of --fit";

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
    // Readings grow alike where all that gives way is softer alike.
    if let Some(FittedBedding::Gives(bedding)) = &mut found.of_part.bedding {
        *bedding = bedding.map(|b| b / factor);
    }
    Ok(())
}
