//! What is known of the signals of a simulation beside their values: noise, gluing, how touches are made, and what its
//! elements leave: all that [`Uncertainty`] describes.
//!
//! What all gauges feel together of a touch is told as such: a tip of another size and a force along the surface, as far as
//! whoever finds touches allows for them, and a drift.

use super::{Inputs, SELECTION_NOISE_SEED, Simulated};
use crate::budget::{Budget, Cancelled, Watch};
use crate::dataset::{GluingSlopes, MakingSlope, MakingSlopes, Signal};
use crate::placement::expected_error::{
    Detail, NUISANCES, SceneForces, SharedUnknowns, SignalKnowledge, TouchScene, Variance, expected,
};
use crate::project::Project;
use crate::uncertainty::{Gluing, Making, Uncertainty};

/// A few sites are looked at in more detail than a choice among thousands can.
pub(super) const FINE: Detail = Detail {
    places: 1000,
    presses: 800,
};

/// What a choice by expected error is told of a simulation.
pub(super) struct KnownSimulation<'a> {
    simulated: &'a Simulated,
    off: Uncertainty,
    /// Force of each touch (N).
    forces: Vec<f64>,
    /// How many times as many come as elsewhere, where that differs.
    density: Option<Vec<f64>>,
    range: [f64; 2],
    possible: f64,
    seed: u64,
}

impl<'a> KnownSimulation<'a> {
    /// Gathers it from the project and from what was simulated of it.
    pub fn new(inputs: &Inputs, simulated: &'a Simulated) -> Self {
        let project = &inputs.project;
        Self {
            simulated,
            off: off(project, simulated),
            forces: (simulated.dataset.touches.iter())
                .map(|t| t.force)
                .collect(),
            density: density(inputs, simulated),
            range: project.touch.forces_n,
            possible: project.live.largest_force_n.max(project.touch.forces_n[1]),
            seed: project.budget.seed.wrapping_add(SELECTION_NOISE_SEED),
        }
    }

    /// What gluing and elements put on the signal of a site (as numbered in the dataset) under a touch.
    pub fn variance(&self, site: usize, touch: usize) -> f64 {
        let reading = self.simulated.dataset.x.row(site)[touch];
        let slopes = self.simulated.dataset.slopes.as_ref();
        self.variance_of(reading, slopes, site, touch)
    }

    /// What they put on a gauge's reading of a touch where it is known what that changes by: of a site among some.
    pub fn variance_of(
        &self,
        reading: f64,
        changes: Option<&GluingSlopes>,
        site: usize,
        touch: usize,
    ) -> f64 {
        let off = &self.off.of_gauges();
        let known = changes.and_then(|slopes| {
            let column = slopes.columns().of(touch)?;
            Some(slopes.variance(site, column, reading, off))
        });
        known.unwrap_or_else(|| off.variance(reading, 0.0, 0.0, 0.0))
    }

    /// What the way a touch is made puts on the signals of all sites together: of one of them (as numbered in the dataset).
    pub fn felt(&self, site: usize, touch: usize) -> [f64; NUISANCES] {
        let dataset = &self.simulated.dataset;
        let made = dataset.making.as_ref();
        made.map_or([0.0; NUISANCES], |made| self.felt_of(made, site, touch))
    }

    /// The same of a site among some: by a tip as much larger, and forces along the surface as large, as is allowed for.
    pub fn felt_of(&self, made: &MakingSlopes, site: usize, touch: usize) -> [f64; NUISANCES] {
        let Some(column) = made.columns().of(touch) else {
            return [0.0; NUISANCES];
        };
        let allowed = self.off.making_allowed();
        let MakingSlope { tip, shear } = made.of_touch(site, column);
        let [along, across] = shear.map(|by| allowed.along_either() * by);
        [allowed.tip * tip, along, across]
    }

    /// What there is to find of a touch beside place and force, where `felt` says what sites feel of it.
    pub fn shared<'b>(
        &self,
        felt: &'b (dyn Fn(usize, usize) -> [f64; NUISANCES] + Sync),
    ) -> SharedUnknowns<'b> {
        let (made, allowed) = (self.off.making, self.off.making_allowed());
        let share = |made: f64, allowed: f64| (allowed > 0.0).then(|| made / allowed);
        let aside = share(made.friction, allowed.friction);
        SharedUnknowns {
            felt,
            nuisances: [share(made.tip, allowed.tip), aside, aside],
            drift: self.off.drift,
        }
    }

    /// For a pool whose rows have this variance, and feel so much together.
    pub fn knowledge<'b>(
        &'b self,
        variance: Variance<'b>,
        shared: &'b SharedUnknowns<'b>,
    ) -> SignalKnowledge<'b> {
        SignalKnowledge {
            noise: self.off.of_channel(),
            variance: Some(variance),
            shared: Some(shared),
            density: self.density.as_deref(),
            among: (self.simulated.dataset.slopes.as_ref())
                .map(|slopes| slopes.columns().touches()),
            forces: Some(SceneForces {
                touches: &self.forces,
                coming: self.range,
                possible: self.possible,
            }),
            seed: self.seed,
        }
    }
}

/// How many times as many touches come to where each of them is as to places beside what is often touched; nothing where
/// no place is.
fn density(inputs: &Inputs, simulated: &Simulated) -> Option<Vec<f64>> {
    let touch = &inputs.project.touch;
    let often = inputs.masks.get(touch.often.as_ref()?)?;
    let index = inputs.part.index();
    let there = |at: glam::DVec3| inputs.part.mostly_in(often, index.nearest(at).0);
    let touches = simulated.dataset.touches.iter();
    let of = touches.map(|t| {
        if there(t.position) {
            touch.often_times
        } else {
            1.0
        }
    });
    Some(of.collect())
}

/// Everything that is known to be off with a simulation's signals: of strain what the project says and the elements are
/// estimated to leave, of displacements nothing but the gluing.
pub(super) fn off(project: &Project, simulated: &Simulated) -> Uncertainty {
    let off = project.uncertainty();
    match simulated.dataset.signal {
        Signal::Strain => {
            let left = &simulated.discretization;
            off.with_elements(left.strain_percent)
                .with_elements_of_gauges(left.reading_percent, simulated.length_scale)
        }
        Signal::Displacement | Signal::NormalDisplacement => Uncertainty {
            noise: 0.0,
            resolution: 0.0,
            drift: 0.0,
            making: Making::EXACT,
            allowed: 0.0,
            elements: 0.0,
            as_glued: Gluing::EXACT,
            ..off
        },
    }
}

/// How much a choice by expected error looks at.
pub(super) fn detail(budget: &Budget) -> Detail {
    Detail {
        places: budget.expected_places,
        presses: budget.expected_presses,
    }
}

/// The error (mm) that matching is expected to make with each of some sets of sites (as numbered in the dataset), over
/// where touches come, how hard they are and what is off.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn expected_errors(
    inputs: &Inputs,
    simulated: &Simulated,
    sets: &[Vec<usize>],
    watch: Watch,
) -> Result<Vec<f64>, Cancelled> {
    let known = KnownSimulation::new(inputs, simulated);
    let mut sites: Vec<usize> = sets.concat();
    sites.sort_unstable();
    sites.dedup();
    let variance = |row: usize, touch: usize| known.variance(sites[row], touch);
    let felt = |row: usize, touch: usize| known.felt(sites[row], touch);
    let scene = TouchScene::new(
        &simulated.dataset.x.select_rows(&sites),
        &simulated.dataset.targets_mm(),
        &known.knowledge(&variance, &known.shared(&felt)),
        FINE,
        watch,
    )?;
    let rows = |set: &Vec<usize>| -> Vec<usize> {
        set.iter()
            .filter_map(|s| sites.binary_search(s).ok())
            .collect()
    };
    Ok(sets
        .iter()
        .map(|set| expected(&scene, &rows(set)).0)
        .collect())
}
