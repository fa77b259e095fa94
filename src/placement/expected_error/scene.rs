//! The touches that gauges are chosen for: places all over the part as every site would report them, and presses of
//! known place, force and noise that the choice is tried on.

mod around;
mod merged;
mod places;
mod reports;
mod scatter;
mod shared;

use glam::DVec3;
use rayon::prelude::*;

pub use self::scatter::ReadingScatter;
pub use self::shared::{NUISANCES, SharedUnknowns};

use self::around::{Around, PlaceNeighbour};
use self::merged::Merged;
pub(super) use self::places::{ForceLevel, Neighbourhood, OWN, ScenePlace};
use self::places::{
    REACH, draws, farthest_first, in_neighbourhoods, in_turns, levels, spacing, standing,
};
use self::reports::ROWS;
pub(super) use self::reports::{LANES, Report, Reports};
use self::shared::TouchUnknown;
use crate::budget::{Cancelled, Watch, report};
use crate::dataset::SignalMatrix;
use crate::regression::folds::evenly;

/// How many places and presses a choice looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detail {
    /// Places that a reading is compared with.
    pub places: usize,
    /// Presses that it is tried on.
    pub presses: usize,
}

impl Detail {
    /// As much as tells promising sites from others.
    #[must_use]
    pub fn coarse(self) -> Self {
        /// With fewer presses the best sites are lost among others.
        const FEW: usize = 32;
        Self {
            places: self.places.div_ceil(4),
            presses: self.presses.div_ceil(6).max(FEW.min(self.presses)),
        }
    }
}

impl Default for Detail {
    /// As a design at Standard.
    fn default() -> Self {
        Self {
            places: 1024,
            presses: 510,
        }
    }
}

/// Variance of each reading (sites × touches) that is not noise, in the square of the signal's unit, at the force of
/// the touch: what gluing and model put on it, or what data scatter by ([`ReadingScatter`]).
pub type Variance<'a> = &'a (dyn Fn(usize, usize) -> f64 + Sync);

/// How hard touches are.
#[derive(Clone, Copy)]
pub struct SceneForces<'a> {
    /// Of each touch of the data (N); the signals grow with it.
    pub touches: &'a [f64],
    /// The lightest and the hardest that will come (N).
    pub coming: [f64; 2],
    /// The hardest that the estimator thinks possible (N).
    pub possible: f64,
}

/// What is known of the signals beside their values.
pub struct SignalKnowledge<'a> {
    /// Standard deviation of the noise, in the unit of the signals.
    pub noise: f64,
    /// Absent where nothing but noise is known to be off, which is true of no measurement: for data alone it is
    /// [`ReadingScatter`]'s. A simulation is exact, and knows what gluing and elements do to it; guessing at its scatter
    /// from its neighbours would count how it bends twice.
    pub variance: Option<Variance<'a>>,
    /// What all sites feel together of a touch, beside its place and force; nothing where absent.
    pub shared: Option<&'a SharedUnknowns<'a>>,
    /// How many times as many of the touches come to a piece of the surface as to others, of each touch; as many
    /// everywhere where absent. Whoever finds touches takes any piece to be as likely as another.
    pub density: Option<&'a [f64]>,
    /// Touches that places are taken from, rising: those whose variance is known. All where absent.
    pub among: Option<&'a [usize]>,
    /// Absent where the signals are what they are.
    pub forces: Option<SceneForces<'a>>,
    /// Of places, presses and noise.
    pub seed: u64,
}

/// Everything that a choice needs to know of the touches; the readings of all sites are in it.
pub struct TouchScene {
    pub(super) places: Vec<ScenePlace>,
    pub(super) at_places: Reports,
    pub(super) presses: Vec<ScenePlace>,
    /// Of each press.
    pub(super) around: Vec<Neighbourhood>,
    pub(super) at_presses: Reports,
    pub(super) levels: Vec<ForceLevel>,
    /// The hardest force that is thought possible (N); nothing to find where it is absent.
    pub(super) hardest: Option<f64>,
    /// What else there is to find of a touch, of unit deviation.
    pub(super) unknowns: Vec<TouchUnknown>,
    draws: Vec<f32>,
    /// What it is: unknowns × presses.
    made: Vec<f32>,
    sites: usize,
}

/// Gauges with noise of their own; many more are never chosen.
const TURNS: usize = 64;
/// Noise is taken to be no less than this share of the signals' rms: no model is better than that.
const LEAST_NOISE: f64 = 1e-3;

impl TouchScene {
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(
        x: &SignalMatrix,
        targets: &[[f64; 3]],
        known: &SignalKnowledge,
        detail: Detail,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        SceneOutlook::new(x, targets, known, detail, watch)?.scene(x, known.beside(), watch)
    }

    /// Noise of unit deviation in what the gauge of a turn reads of each press.
    pub(super) fn draws(&self, turn: usize) -> &[f32] {
        let presses = self.presses.len();
        &self.draws[turn % TURNS * presses..][..presses]
    }

    /// The unknowns of all presses, as far off as they really are, over what is allowed for: unknowns × presses.
    pub(super) fn made(&self) -> &[f32] {
        &self.made
    }

    /// How many sites there are.
    #[must_use]
    pub fn sites(&self) -> usize {
        self.sites
    }
}

/// Where a scene looks, whatever is glued: what gauges report there may be taken again for one of them alone.
pub(super) struct SceneOutlook<'a> {
    merged: Merged,
    places: Spots,
    presses: Spots,
    /// One over the unit of readings.
    unit: f64,
    forces: Option<SceneForces<'a>>,
    unknowns: Vec<TouchUnknown>,
    seed: u64,
}

/// Some of the places of data.
struct Spots {
    numbers: Vec<usize>,
    neighbours: Vec<Vec<PlaceNeighbour>>,
    standing: Vec<ScenePlace>,
}

impl<'a> SceneOutlook<'a> {
    /// Of touches under which sites read `x`; readings are measured in their noise.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(
        x: &SignalMatrix,
        targets: &[[f64; 3]],
        known: &SignalKnowledge<'a>,
        detail: Detail,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        report(watch, "Looking at touches", 0, 2)?;
        let merged = Merged::new(targets, known.forces.map(|f| f.touches));
        let all = merged.among(known.among);
        let mut places = farthest_first(&merged.positions, &all, detail.places);
        // A press may come to one of the places: what stands near it is its own all the same.
        let presses = in_turns(&evenly(all.len(), detail.presses));
        let presses: Vec<usize> = presses.into_iter().map(|k| all[k]).collect();
        in_neighbourhoods(&mut places, &merged.positions);
        let around = Around::new(&merged.positions, &merged.groups);
        let thinned = |touches: &Vec<(usize, f64)>| {
            known
                .density
                .map_or(1.0, |density| density[touches[0].0].recip())
        };
        let by_area: Vec<f64> = merged.touches.iter().map(thinned).collect();
        let as_they_come = vec![1.0; merged.len()];
        let of = [(places, by_area), (presses, as_they_come)];
        let [places, presses] = of.map(|(numbers, masses)| Spots {
            neighbours: (numbers.par_iter().map(|&at| around.of(at).neighbours)).collect(),
            standing: standing(&merged.positions, &masses, &numbers),
            numbers,
        });
        let unit = unit(x, known.noise).recip();
        Ok(Self {
            places,
            presses,
            unknowns: known.shared.map_or_else(Vec::new, |s| s.unknowns(unit)),
            unit,
            forces: known.forces,
            seed: known.seed,
            merged,
        })
    }

    /// With what some sites report: `x` of each under every touch, and what is off with it.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn scene(
        &self,
        x: &SignalMatrix,
        beside: Beside,
        watch: Watch,
    ) -> Result<TouchScene, Cancelled> {
        let reader = self.reader(x, beside);
        let at_places = reader.reports(&self.places);
        report(watch, "Looking at touches", 1, 2)?;
        let at_presses = reader.reports(&self.presses);
        let presses = self.presses.numbers.len();
        let (standing, places) = (&self.presses.standing, &self.places.standing);
        Ok(TouchScene {
            around: (standing.iter())
                .map(|p| Neighbourhood::of(p, places))
                .collect(),
            levels: levels(presses, self.forces.map(|f| f.coming)),
            draws: draws(TURNS, presses, self.seed),
            made: shared::made(&self.unknowns, presses, self.seed),
            unknowns: self.unknowns.clone(),
            sites: x.rows(),
            places: self.places.standing.clone(),
            presses: self.presses.standing.clone(),
            at_places,
            at_presses,
            hardest: self.forces.map(|f| f.possible),
        })
    }

    /// Puts another gauge in the stead of a site of a scene: what it reads under every touch, as one row, and what is
    /// off with it.
    pub fn retake(&self, scene: &mut TouchScene, site: usize, x: &SignalMatrix, beside: Beside) {
        let reader = self.reader(x, beside);
        let of = [
            (&mut scene.at_places, &self.places),
            (&mut scene.at_presses, &self.presses),
        ];
        for (reports, spots) in of {
            reports.of_mut(site).copy_from_slice(&reader.rows(0, spots));
        }
    }

    fn reader<'b>(&'b self, x: &'b SignalMatrix, beside: Beside<'b>) -> SignalReader<'b> {
        SignalReader {
            x,
            merged: &self.merged,
            beside,
            nuisances: (self.unknowns.iter())
                .filter_map(|unknown| unknown.of_touch())
                .collect(),
            forces: self.forces,
            unit: self.unit,
        }
    }
}

/// What is known of readings beside their values.
#[derive(Clone, Copy, Default)]
pub(super) struct Beside<'a> {
    pub variance: Option<Variance<'a>>,
    pub shared: Option<&'a SharedUnknowns<'a>>,
}

impl<'a> SignalKnowledge<'a> {
    fn beside(&self) -> Beside<'a> {
        Beside {
            variance: self.variance,
            shared: self.shared,
        }
    }
}

/// What readings are measured in: the noise, or where there is next to none, a small share of the signals.
fn unit(x: &SignalMatrix, noise: f64) -> f64 {
    let squares: f64 = x.values().iter().map(|v| v * v).sum();
    let rms = (squares / x.values().len().max(1) as f64).sqrt();
    noise.max(LEAST_NOISE * rms).max(f64::MIN_POSITIVE)
}

struct SignalReader<'a> {
    x: &'a SignalMatrix,
    merged: &'a Merged,
    beside: Beside<'a>,
    /// Which nuisances of a touch are of use.
    nuisances: Vec<usize>,
    forces: Option<SceneForces<'a>>,
    /// One over the unit of readings.
    unit: f64,
}

impl SignalReader<'_> {
    fn reports(&self, at: &Spots) -> Reports {
        Reports {
            count: at.numbers.len().next_multiple_of(LANES),
            rows: ROWS + self.nuisances.len(),
            values: (0..self.x.rows())
                .into_par_iter()
                .flat_map_iter(|site| self.rows(site, at))
                .collect(),
        }
    }

    /// Those of one site.
    fn rows(&self, site: usize, at: &Spots) -> Vec<f32> {
        let count = at.numbers.len().next_multiple_of(LANES);
        let mut rows = vec![0.0; (ROWS + self.nuisances.len()) * count];
        let values = self.values(site);
        for (k, (&place, neighbours)) in at.numbers.iter().zip(&at.neighbours).enumerate() {
            let of = self.report(&values, site, place, neighbours);
            let felt = self.felt(site, place);
            for (row, value) in of.into_iter().chain(felt).enumerate() {
                rows[row * count + k] = value as f32;
            }
        }
        rows
    }

    /// What a site reads at every place.
    fn values(&self, site: usize) -> Vec<f64> {
        let readings = self.x.row(site);
        let value = |place| self.merged.value(readings, place) * self.unit;
        (0..self.merged.len()).map(value).collect()
    }

    /// Value, slopes and variance of a site of these values.
    fn report(
        &self,
        values: &[f64],
        site: usize,
        place: usize,
        around: &[PlaceNeighbour],
    ) -> [f64; 4] {
        let value = values[place];
        let mut slopes = [0.0; 2];
        for neighbour in around {
            let rise = values[neighbour.place] - value;
            for (slope, by) in slopes.iter_mut().zip(neighbour.slopes) {
                *slope += by * rise;
            }
        }
        [value, slopes[0], slopes[1], self.variance(site, place)]
    }

    /// Per newton squared.
    fn variance(&self, site: usize, place: usize) -> f64 {
        let Some(variance) = self.beside.variance else {
            return 0.0;
        };
        let touches = || self.merged.touches[place].iter().map(|&(t, _)| t);
        let of = |t: usize| {
            let force = self.forces.map_or(1.0, |f| f.touches[t]);
            variance(site, t) / (force * force)
        };
        touches().map(of).sum::<f64>() / touches().count() as f64 * self.unit * self.unit
    }

    /// What a deviation of each nuisance adds, per newton.
    fn felt(&self, site: usize, place: usize) -> impl Iterator<Item = f64> {
        let mut sum = [0.0; NUISANCES];
        if let Some(shared) = self.beside.shared.filter(|_| !self.nuisances.is_empty()) {
            for &(touch, weight) in &self.merged.touches[place] {
                let felt = (shared.felt)(site, touch);
                for (sum, felt) in sum.iter_mut().zip(felt) {
                    *sum += weight * felt * self.unit;
                }
            }
        }
        self.nuisances.iter().map(move |&k| sum[k])
    }
}

/// What every site reports of a touch at one place, in units of the noise and per newton where forces are known: the
/// reading changes with the place along two directions, and is off by a variance of its own.
#[derive(Clone, Debug)]
pub struct Template {
    /// mm.
    pub position: DVec3,
    /// The two directions along the surface, of unit length.
    pub plane: [DVec3; 2],
    /// Standard deviation (mm) along either of where a touch is that this place stands for.
    pub reach: f64,
    /// Of each site.
    pub sites: Vec<SiteSignal>,
}

/// What one site reports of a template.
#[derive(Clone, Copy, Debug)]
pub struct SiteSignal {
    /// How much.
    pub value: f64,
    /// A millimetre.
    pub slopes: [f64; 2],
    /// Beside the noise's, which is 1.
    pub variance: f64,
}

/// A template for every place of data, and the unit that their readings are in (in that of the signals): the very
/// numbers that a choice by expected error is made with.
#[must_use]
pub fn templates(
    x: &SignalMatrix,
    targets: &[[f64; 3]],
    known: &SignalKnowledge,
) -> (Vec<Template>, f64) {
    let merged = Merged::new(targets, known.forces.map(|f| f.touches));
    let around = Around::new(&merged.positions, &merged.groups);
    let unit = unit(x, known.noise);
    let reader = SignalReader {
        x,
        merged: &merged,
        beside: known.beside(),
        nuisances: Vec::new(),
        forces: known.forces,
        unit: unit.recip(),
    };
    let values: Vec<Vec<f64>> = (0..x.rows()).map(|site| reader.values(site)).collect();
    let template = |place: usize| {
        let surroundings = around.of(place);
        let near = surroundings.neighbours.iter().map(|n| n.place);
        let reading = |site: usize| {
            let [value, along, across, variance] =
                reader.report(&values[site], site, place, &surroundings.neighbours);
            SiteSignal {
                value,
                slopes: [along, across],
                variance,
            }
        };
        Template {
            position: merged.positions[place],
            plane: surroundings.plane,
            reach: REACH * spacing(&merged.positions, near, place),
            sites: (0..x.rows()).map(reading).collect(),
        }
    };
    let all = (0..merged.len()).into_par_iter().map(template).collect();
    (all, unit)
}
