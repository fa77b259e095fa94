//! How far a solution is from the converged one, from two meshes of which one halves the other's
//! elements.
//!
//! With an error that falls as hᵖ, what changes from 2h to h is 2ᵖ - 1 times what is left (L. F.
//! Richardson 1911).

use glam::DVec3;
use serde::Serialize;

use super::Model;
use super::load::Touch;
use super::observe::{Face, turn};
use super::respond::{Quantity, gives_way, respond};
use crate::budget::{Cancelled, ElementBudget, Watch};
use crate::statistics::median;
use crate::units;

/// Change from 2h to h over the error at h. Displacements and smoothed strains converge with h² where all
/// is smooth (3), with less near corners of supports and openings: between the two.
const DISPLACEMENT: f64 = 2.0;
/// Strains a little slower, near the borders of supports and at slot ends.
const STRAIN: f64 = 2.0;
/// A load is judged by what it moves and strains, but by no less than this share of what the middle one moves.
const LEAST_MOVED: f64 = 0.05;
/// What gauges that are chosen read wrongly, over what those at any place do: they are where strains are large and smooth.
/// Against finer elements it was 0.52 to 0.65 (bundled limb at Draft and Standard, `assets/barrel`, the paper's limb).
const GAUGE: f64 = 0.6;
/// Strains are judged farther than this from the touch, in tip radii.
pub const BEYOND: f64 = 2.0;

/// What elements have to be good enough for.
#[derive(Clone, Copy, Debug)]
pub struct AccuracyTarget<'a> {
    /// The touches, or some that stand for them.
    pub touches: &'a [Touch],
    /// Places on the inside where strains matter (m).
    pub places: &'a [DVec3],
    /// Touches that will be solved for: what they take counts.
    pub count: usize,
    /// The errors that are allowed, and the most that may be spent on them.
    pub aim: &'a ElementBudget,
}

impl<'a> AccuracyTarget<'a> {
    /// For just these touches.
    #[must_use]
    pub fn new(touches: &'a [Touch], places: &'a [DVec3], aim: &'a ElementBudget) -> Self {
        Self {
            touches,
            places,
            count: touches.len(),
            aim,
        }
    }
}

/// Estimated discretization error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Discretization {
    /// Rms over the loads of the error of the displacement under the load (mm).
    pub displacement_mm: f64,
    /// The same as a share of each load's displacement (%), or of a twentieth of the middle one where a load
    /// moves less: what presses beside or on a support moves next to nothing, and nobody reads that.
    pub displacement_percent: f64,
    /// Rms over loads and places of the strain's error on the inside, farther than two tip radii from
    /// the touch, as a share of the load's largest strain there (%), or of a twentieth of the middle load's.
    pub strain_percent: f64,
    /// What a gauge reads wrongly there, as a share of what it reads (%): rms over loads, of the place in the middle.
    pub reading_percent: f64,
    /// Loads and places it was measured with.
    pub loads: usize,
    /// Places it was measured at.
    pub places: usize,
}

impl Discretization {
    /// The error of the coarser of the two meshes: what changed, and what was left after that.
    #[must_use]
    pub fn of_the_coarser(self) -> Self {
        self.scaled(1.0 + DISPLACEMENT, 1.0 + STRAIN)
    }

    /// Errors that are so many times as large.
    #[must_use]
    pub fn scaled(self, displacement: f64, strain: f64) -> Self {
        Self {
            displacement_mm: self.displacement_mm * displacement,
            displacement_percent: self.displacement_percent * displacement,
            strain_percent: self.strain_percent * strain,
            reading_percent: self.reading_percent * strain,
            ..self
        }
    }

    /// Of the loads and places of all, which have as many loads each. Strains count where there are any.
    #[must_use]
    pub fn of_all(all: &[Self]) -> Self {
        let rms = |value: fn(&Self) -> f64| {
            let values = all.iter().map(value).filter(|v| !v.is_nan());
            let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
            if count > 0.0 {
                f64::sqrt(sum / count)
            } else {
                f64::NAN
            }
        };
        Self {
            displacement_mm: rms(|d| d.displacement_mm),
            displacement_percent: rms(|d| d.displacement_percent),
            strain_percent: rms(|d| d.strain_percent),
            reading_percent: rms(|d| d.reading_percent),
            loads: all.iter().map(|d| d.loads).sum(),
            places: all.iter().map(|d| d.places).sum(),
        }
    }

    /// The larger of the estimated errors over what was asked for; displacements alone decide where no place is
    /// far enough from a touch.
    #[must_use]
    pub fn excess(&self, aim: &ElementBudget) -> f64 {
        let displacement = self.displacement_percent / aim.displacement_percent;
        displacement.max(self.strain_percent / aim.strain_percent)
    }

    /// Whether the estimated errors are within what was asked for.
    #[must_use]
    pub fn meets(&self, aim: &ElementBudget) -> bool {
        let strain = self.strain_percent.is_nan() || self.strain_percent <= aim.strain_percent;
        self.displacement_percent <= aim.displacement_percent && strain
    }
}

/// What one mesh says of some loads at some places.
#[derive(Default)]
pub struct ModelSample {
    /// Displacement under each load, along it (m).
    pub under: Vec<f64>,
    /// Strains (xx, yy, 2xy) at the places, load by load.
    pub strains: Vec<Vec<[f64; 3]>>,
    frames: Vec<super::observe::SiteFrame>,
}

impl ModelSample {
    /// Reads loads at places on the inside (m).
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn read(
        model: &dyn Model,
        touches: &[Touch],
        places: &[DVec3],
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let points: Vec<_> = places.iter().map(|&p| model.index().nearest(p).0).collect();
        let observer = model.observer(&points, Face::Inside);
        let responses = respond(model, touches, &observer, Quantity::Strain, watch)?;
        let mut strains = vec![vec![[0.0; 3]; places.len()]; touches.len()];
        let mut row = vec![0.0; touches.len()];
        for output in 0..responses.rows() {
            responses.row_into(output, &mut row);
            for (of_load, &strain) in strains.iter_mut().zip(&row) {
                of_load[output / 3][output % 3] = strain;
            }
        }
        Ok(Self {
            under: gives_way(model, touches),
            strains,
            frames: observer.frames().to_vec(),
        })
    }

    /// Reads solved loads at places on the inside (m).
    #[must_use]
    pub fn of(
        model: &dyn Model,
        touches: &[Touch],
        solutions: &[Vec<f64>],
        places: &[DVec3],
    ) -> Self {
        let points: Vec<_> = places.iter().map(|&p| model.index().nearest(p).0).collect();
        let observer = model.observer(&points, Face::Inside);
        Self {
            under: (touches.iter().zip(solutions))
                .map(|(touch, u)| under_load(&model.load(touch), touch, u))
                .collect(),
            strains: observer.strains_of(model, solutions),
            frames: observer.frames().to_vec(),
        }
    }
}

/// Work-conjugate displacement of a touch: the mean under the tip, along the force (m).
#[must_use]
pub fn under_load(load: &[(usize, f64)], touch: &Touch, u: &[f64]) -> f64 {
    let work: f64 = load.iter().map(|&(dof, f)| f * u[dof]).sum();
    work / touch.force
}

/// Where nothing says how large errors are.
#[must_use]
pub fn unknown(loads: usize, places: usize) -> Discretization {
    Discretization {
        displacement_mm: f64::NAN,
        displacement_percent: f64::NAN,
        strain_percent: f64::NAN,
        reading_percent: f64::NAN,
        loads,
        places,
    }
}

/// The error left in `fine`, from `coarse` with elements of twice the size.
#[must_use]
pub fn between(
    coarse: &ModelSample,
    fine: &ModelSample,
    touches: &[Touch],
    places: &[DVec3],
) -> Discretization {
    let displacement = left(coarse, fine, touches, places, DISPLACEMENT);
    Discretization {
        strain_percent: displacement.strain_percent * DISPLACEMENT / STRAIN,
        reading_percent: displacement.reading_percent * DISPLACEMENT / STRAIN,
        ..displacement
    }
}

/// As [`between`] where what changes is `change` times what is left.
#[must_use]
pub fn left(
    coarse: &ModelSample,
    fine: &ModelSample,
    touches: &[Touch],
    places: &[DVec3],
    change: f64,
) -> Discretization {
    let under: Vec<f64> = (coarse.under.iter().zip(&fine.under))
        .map(|(c, f)| (f - c) / change)
        .collect();
    let strain = |load: usize, i: usize| {
        let turned = turn(coarse.frames[i], fine.frames[i]);
        let (c, f) = (coarse.strains[load][i], fine.strains[load][i]);
        std::array::from_fn(|r| ((0..3).map(|k| turned[r][k] * c[k]).sum::<f64>() - f[r]) / change)
    };
    of(fine, touches, places, &under, strain)
}

/// The estimate from what is left of each displacement under its load (m), and of the strain by load and place.
#[must_use]
pub fn of(
    fine: &ModelSample,
    touches: &[Touch],
    places: &[DVec3],
    under: &[f64],
    strain: impl Fn(usize, usize) -> [f64; 3],
) -> Discretization {
    let (mut square, mut relative) = (0.0, 0.0);
    let least = LEAST_MOVED * median(fine.under.iter().map(|f| f.abs())).unwrap_or(0.0);
    for (left, f) in under.iter().zip(&fine.under) {
        square += left * left;
        let moved = f.abs().max(least);
        if moved > 0.0 {
            relative += (left / moved).powi(2);
        }
    }
    let loads = touches.len().max(1) as f64;
    Discretization {
        displacement_mm: units::mm((square / loads).sqrt()),
        displacement_percent: (relative / loads).sqrt() * 100.0,
        strain_percent: 100.0 * strain_apart(fine, touches, places, &strain),
        reading_percent: 100.0 * GAUGE * readings_apart(fine, touches, places, &strain),
        loads: touches.len(),
        places: places.len(),
    }
}

/// Rms over loads and places beyond the tip (NaN where there is none) of what strains are off by over the load's largest,
/// or over a twentieth of the middle load's where a load strains less: what presses on a support strains next to nothing,
/// and what is off by as little is no share of anything that gauges read.
fn strain_apart(
    fine: &ModelSample,
    touches: &[Touch],
    places: &[DVec3],
    off: impl Fn(usize, usize) -> [f64; 3],
) -> f64 {
    let far = |touch: &Touch| {
        let is_far = |i: &usize| places[*i].distance(touch.position) > BEYOND * touch.tip_radius;
        (0..places.len()).filter(is_far).collect::<Vec<_>>()
    };
    let far: Vec<Vec<usize>> = touches.iter().map(far).collect();
    let largest = |(load, far): (usize, &Vec<usize>)| {
        let strains = far
            .iter()
            .map(|&i| largest_principal(fine.strains[load][i]));
        strains.fold(0.0, f64::max)
    };
    let largest: Vec<f64> = far.iter().enumerate().map(largest).collect();
    let least = LEAST_MOVED * median(largest.iter().copied()).unwrap_or(0.0);
    let (mut sum, mut count) = (0.0, 0usize);
    for (load, (far, largest)) in far.iter().zip(&largest).enumerate() {
        let strained = largest.max(least);
        if strained == 0.0 {
            continue;
        }
        for &i in far {
            sum += (largest_principal(off(load, i)) / strained).powi(2);
            count += 1;
        }
    }
    if count == 0 {
        return f64::NAN;
    }
    (sum / count as f64).sqrt()
}

/// What the strain of the place in the middle is off by over the strain there, both rms over the loads beyond the tip (NaN
/// where there is none).
fn readings_apart(
    fine: &ModelSample,
    touches: &[Touch],
    places: &[DVec3],
    off: impl Fn(usize, usize) -> [f64; 3],
) -> f64 {
    let share = |i: usize| {
        let far = |touch: &Touch| places[i].distance(touch.position) > BEYOND * touch.tip_radius;
        let loads = (0..touches.len()).filter(|&load| far(&touches[load]));
        let (left, own) = loads.fold((0.0, 0.0), |(left, own), load| {
            let square = |strain| largest_principal(strain).powi(2);
            (
                left + square(off(load, i)),
                own + square(fine.strains[load][i]),
            )
        });
        (own > 0.0).then(|| (left / own).sqrt())
    };
    median((0..places.len()).filter_map(share)).unwrap_or(f64::NAN)
}

/// Largest principal strain in size, of strains (xx, yy, 2xy).
#[must_use]
pub fn largest_principal([xx, yy, xy]: [f64; 3]) -> f64 {
    f64::midpoint(xx, yy).abs() + ((xx - yy) / 2.0).hypot(xy / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gauge is off by a share of what it reads, whatever others read; near the tip nobody asks.
    #[test]
    fn readings_are_off_by_what_they_are_at_the_place_in_the_middle() {
        let touch = |x: f64| Touch {
            position: DVec3::X * x,
            normal: DVec3::Z,
            force: 1.0,
            tip_radius: 1e-3,
        };
        let touches = [touch(0.0), touch(1.0)];
        let places = [0.3, 0.5, 1.0].map(|x| DVec3::X * x);
        // Much strain where little is wrong; the last place lies under the second touch.
        let shares = [0.1, 0.4, 0.2];
        let strain = |load: usize, i: usize| 1e-6 * ((1 + load) * (1 + 10 * i)) as f64;
        let of = |load: usize| (0..3).map(|i| [strain(load, i), 0.0, 0.0]).collect();
        let fine = ModelSample {
            under: vec![1e-3; 2],
            strains: (0..2).map(of).collect(),
            frames: Vec::new(),
        };
        let off = |load: usize, i: usize| {
            let near = i == 2 && load == 1;
            [
                if near {
                    1.0
                } else {
                    shares[i] * strain(load, i)
                },
                0.0,
                0.0,
            ]
        };
        let said = super::of(&fine, &touches, &places, &[0.0; 2], off);
        assert!((said.reading_percent - 100.0 * GAUGE * 0.2).abs() < 1e-9);
        assert!((said.scaled(1.0, 2.0).reading_percent / said.reading_percent - 2.0).abs() < 1e-12);
        let said = super::of(&fine, &touches, &[], &[0.0; 2], off);
        assert!(said.reading_percent.is_nan());
    }

    /// What presses on a support strains nothing, and is off by as little: that is no share of what gauges read.
    #[test]
    fn a_load_that_strains_nothing_does_not_decide() {
        let touch = Touch {
            position: DVec3::ZERO,
            normal: DVec3::Z,
            force: 1.0,
            tip_radius: 1e-3,
        };
        let (touches, places) = ([touch; 3], [DVec3::X]);
        let strains = [1e-4, 1e-4, 1e-9];
        let fine = ModelSample {
            under: vec![1e-3; 3],
            strains: strains.map(|strain| vec![[strain, 0.0, 0.0]]).into(),
            frames: Vec::new(),
        };
        // A hundredth of the first two, and of the last one twice as much as it strains.
        let off = |load: usize, _: usize| [[1e-6, 1e-6, 2e-9][load], 0.0, 0.0];
        let said = super::of(&fine, &touches, &places, &[0.0; 3], off).strain_percent;
        assert!((0.7..1.0).contains(&said), "{said}");
        // Where none strains anything there is no share.
        let still = ModelSample {
            strains: vec![vec![[0.0; 3]]; 3],
            ..fine
        };
        let said = super::of(&still, &touches, &places, &[0.0; 3], off).strain_percent;
        assert!(said.is_nan());
    }
}
