//! Several spots at once: the likeliest places and forces near a start, and how well they explain a reading.
//!
//! With all channels that are trusted x = Σ f g(p) + e, e ~ N(0, C), where C holds noise, what gluing puts on each channel
//! under these forces, a common drift, and what each touch may have about it. Gauss–Newton with Levenberg's damping moves
//! all places at once; the forces of given places have a closed form. What the reading's density is with all of them
//! integrated out is P. S. Laplace's approximation around the likeliest.
//!
//! Of touches that were there before (`known`) it is known what they read, and where they were: a normal prior, which stands
//! in the equations as two more rows for each.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::known::KnownSpots;
use super::spot::{Felt, RADII, Spot};
use crate::inference::deviation::{Nuisance, TouchDoubts};
use crate::inference::matching::Matching;
use crate::inference::matching::weighed::Observation;

const STEPS: usize = 8;
/// Turns in which weights and places settle.
const TURNS: usize = 2;
/// Two touches nearer to each other (m) are one.
pub(super) const APART: f64 = 12e-3;
/// Less is no touch (N): alone, and one of several, where something so light explains what the model lacks.
const LEAST_ALONE: f64 = 1e-3;
const LEAST_OF_SEVERAL: f64 = 0.05;

/// The likeliest spots, and the normal distribution around them.
#[derive(Clone)]
pub(super) struct Joint {
    pub spots: Vec<Spot>,
    /// Standard deviation of each spot's force along the surface (N).
    pub drag_deviations: Vec<f64>,
    /// Of each spot: its directions, and what is known of its places and force, in the order of the unknowns.
    pub planes: Vec<[glam::DVec3; 2]>,
    pub covariance: DMatrix<f64>,
    /// Half the weighted squares left over.
    pub left: f64,
    /// Logarithm of the reading's density over all such spots, but for the prior of there being so many, and for 2π to the
    /// power of half the channels.
    pub log_evidence: f64,
    /// ln |L|.
    log: f64,
}

impl Joint {
    /// Logarithm of the density at the likeliest, but for 2π to the power of half the channels.
    pub fn log_likelihood(&self) -> f64 {
        -self.left - self.log
    }

    /// The first unknown of a spot.
    pub fn first(&self, spot: usize) -> usize {
        let before = &self.spots[..spot];
        before.iter().map(|s| s.places() + 1).sum()
    }
}

/// What is held while spots near by are tried.
struct HeldSpots<'a> {
    /// The first spots are touches that were there before.
    known: Option<&'a KnownSpots>,
    trusted: Vec<usize>,
    /// L of C = L Lᵀ.
    lower: DMatrix<f64>,
    /// ln |L|.
    log: f64,
    nuisances: Vec<Vec<Nuisance>>,
    /// L⁻¹ x, with as much more as is known already of how the touches are made.
    reading: DVector<f64>,
}

impl HeldSpots<'_> {
    /// How many spots were there before.
    fn count_known(&self) -> usize {
        self.known.map_or(0, |known| known.spots.len())
    }

    fn whiten(&self, values: &[f64]) -> DVector<f64> {
        let picked = self.trusted.iter().map(|&c| values[c]);
        let mut v = DVector::from_iterator(self.trusted.len(), picked);
        self.lower.solve_lower_triangular_mut(&mut v);
        v
    }
}

/// Spots that were tried: what is read of a newton at each, whitened, the best forces and half the squares left over.
struct TriedSpots {
    spots: Vec<Spot>,
    felt: Vec<Felt>,
    readings: Vec<DVector<f64>>,
    left: f64,
}

impl Matching {
    /// The likeliest spots near a start, in so many steps at most; nothing where one of them vanishes.
    pub(super) fn joined(
        &self,
        observed: &Observation,
        start: &[Spot],
        steps: Option<usize>,
    ) -> Option<Joint> {
        self.joined_with(observed, None, start, steps)
    }

    /// The same where the first spots are touches that were there before, if any were.
    pub(super) fn joined_with(
        &self,
        observed: &Observation,
        known: Option<&KnownSpots>,
        start: &[Spot],
        steps: Option<usize>,
    ) -> Option<Joint> {
        let mut spots = start.to_vec();
        let turns = if steps.is_some() { 1 } else { TURNS };
        let mut held = self.held(observed, known, &spots)?;
        for _ in 0..turns {
            let tried = self.descend_together(&held, spots, steps.unwrap_or(STEPS))?;
            spots = tried.spots;
            let about = about(&held, &spots, &tried.readings);
            for (spot, (about, _)) in spots.iter_mut().zip(about) {
                spot.about = about;
            }
            held = self.held(observed, known, &spots)?;
        }
        let tried = self.try_spots(&held, spots)?;
        self.distributed(&held, &tried)
    }

    fn held<'a>(
        &self,
        observed: &Observation,
        known: Option<&'a KnownSpots>,
        spots: &[Spot],
    ) -> Option<HeldSpots<'a>> {
        let trusted: Vec<usize> = (0..observed.w.len())
            .filter(|&c| observed.w[c] > 0.0)
            .collect();
        let n = trusted.len();
        let mut covariance = DMatrix::from_element(n, n, observed.drift);
        for (k, &c) in trusted.iter().enumerate() {
            covariance[(k, k)] += observed.w[c].recip();
        }
        let mut x = observed.reading().to_vec();
        let mut nuisances = Vec::with_capacity(spots.len());
        for (number, spot) in spots.iter().enumerate() {
            let known = known.filter(|known| number < known.spots.len());
            if let Some(deviations) = &self.errors.deviations {
                let own = deviations.own.at(spot.at);
                let doubt = known.map_or(1.0, |known| known.doubt);
                for (k, &c) in trusted.iter().enumerate() {
                    covariance[(k, k)] += (doubt * spot.force * own[c]).powi(2);
                }
            }
            let of_spot = self.nuisances_of(spot);
            for nuisance in &of_spot {
                let felt = trusted.iter().map(|&c| spot.force * nuisance.reading[c]);
                let felt = DVector::from_iterator(n, felt);
                covariance.ger(1.0, &felt, &felt, 1.0);
            }
            nuisances.push(of_spot);
            if let Some(shared) = self
                .nuisances()
                .filter(|_| known.is_none() && spot.about != TouchDoubts::default())
            {
                for (x, known) in x.iter_mut().zip(shared.reading(&spot.about, spot.at)) {
                    *x += spot.force * known;
                }
            }
        }
        let lower = covariance.cholesky()?.unpack();
        let mut held = HeldSpots {
            known,
            log: (0..n).map(|k| lower[(k, k)].ln()).sum(),
            reading: DVector::zeros(n),
            trusted,
            lower,
            nuisances,
        };
        held.reading = held.whiten(&x);
        Some(held)
    }

    /// Best forces at these places; nothing where two of them are one, or one vanishes.
    fn try_spots(&self, held: &HeldSpots, mut spots: Vec<Spot>) -> Option<TriedSpots> {
        for (k, a) in spots.iter().enumerate() {
            let place = self.map.mesh.point(a.at);
            let near = |b: &Spot| self.map.mesh.point(b.at).distance(place) < APART;
            if spots[..k].iter().any(near) {
                return None;
            }
        }
        let mut felt: Vec<Felt> = spots.iter().map(|spot| self.felt(spot)).collect();
        if let Some(known) = held.known {
            for felt in &mut felt[..known.spots.len()] {
                known.correct(&mut felt.reading);
            }
        }
        let readings: Vec<_> = felt.iter().map(|f| held.whiten(&f.reading)).collect();
        let columns = DMatrix::from_columns(&readings);
        let solved = columns.tr_mul(&columns).cholesky()?;
        let forces = solved.solve(&columns.tr_mul(&held.reading));
        let least = if spots.len() > 1 {
            LEAST_OF_SEVERAL
        } else {
            LEAST_ALONE
        };
        for (spot, force) in spots.iter_mut().zip(forces.iter()) {
            if !(least..f64::INFINITY).contains(force) {
                return None;
            }
            spot.force = force.min(self.most_force);
        }
        let forces = DVector::from_iterator(spots.len(), spots.iter().map(|s| s.force));
        let moved = (held.known).map_or(0.0, |known| known.moved(&self.map, &spots));
        Some(TriedSpots {
            left: 0.5 * (&held.reading - columns * forces).norm_squared() + 0.5 * moved,
            spots,
            felt,
            readings,
        })
    }

    /// Gauss–Newton on all places, with the best forces at each.
    fn descend_together(
        &self,
        held: &HeldSpots,
        start: Vec<Spot>,
        steps: usize,
    ) -> Option<TriedSpots> {
        let mut best = self.try_spots(held, start)?;
        let most = 3.0 * self.map.spacing();
        let mut damping = 1e-4;
        for _ in 0..steps {
            let (columns, left) = self.equations(held, &best);
            let mut normal = columns.tr_mul(&columns);
            for k in 0..normal.nrows() {
                normal[(k, k)] *= 1.0 + damping;
                normal[(k, k)] += f64::MIN_POSITIVE;
            }
            let Some(step) = normal
                .cholesky()
                .map(|c| c.solve(&columns.tr_mul(&left)))
                .filter(|step| step.iter().all(|s| s.is_finite()))
            else {
                break;
            };
            let mut first = 0;
            let moved = best.spots.iter().zip(&best.felt).map(|(spot, felt)| {
                let step = &step.as_slice()[first..first + spot.places()];
                first += spot.places() + 1;
                spot.moved(&self.map, felt.plane, step, most)
            });
            let next = self.try_spots(held, moved.collect());
            let better = next.filter(|next| next.left < best.left);
            if let Some(next) = better {
                let gained = best.left - next.left;
                best = next;
                damping *= 0.1;
                if gained < 1e-3 {
                    break;
                }
            } else {
                if step.iter().all(|s| s.abs() < 1e-6) {
                    break;
                }
                damping = (damping * 20.0).max(1e-3);
            }
        }
        Some(best)
    }

    /// Columns of all unknowns, whitened, and what is left over of the reading; below them what is known of places.
    fn equations(&self, held: &HeldSpots, tried: &TriedSpots) -> (DMatrix<f64>, DVector<f64>) {
        let mut columns = Vec::new();
        let mut left = held.reading.clone();
        for ((spot, felt), reading) in tried.spots.iter().zip(&tried.felt).zip(&tried.readings) {
            let places = felt.columns.iter();
            columns.extend(places.map(|change| held.whiten(change) * spot.force));
            columns.push(reading.clone());
            left.axpy(-spot.force, reading, 1.0);
        }
        let mut columns = DMatrix::from_columns(&columns);
        if let Some(known) = held.known {
            let pairs = tried.spots.iter().zip(&tried.felt);
            let planes = pairs.map(|(spot, felt)| (spot, felt.plane));
            let off = known.off(&self.map, planes);
            let rows = left.len();
            columns = columns.resize_vertically(rows + off.len(), 0.0);
            left = left.resize_vertically(rows + off.len(), 0.0);
            for (k, off) in off.into_iter().enumerate() {
                // Of each of them two places and a force are unknown.
                columns[(rows + k, 3 * (k / 2) + k % 2)] = known.moves.recip();
                left[rows + k] = -off;
            }
        }
        (columns, left)
    }

    /// The normal distribution around the likeliest, and what lies under it.
    fn distributed(&self, held: &HeldSpots, tried: &TriedSpots) -> Option<Joint> {
        let (columns, _) = self.equations(held, tried);
        let mut precision = columns.tr_mul(&columns);
        let area: f64 = self.map.areas.iter().sum();
        let mut first = 0;
        // What is known before anything is measured: places anywhere on the part, no force above the largest. As normal
        // distributions that are as high as these are, so that no touch has more room than there is.
        let mut prior = 0.0;
        for (k, spot) in tried.spots.iter().enumerate() {
            if let Some(known) = held.known.filter(|known| k < known.spots.len()) {
                prior -= (TAU * known.moves.powi(2)).ln() + self.most_force.ln();
            } else {
                precision[(first, first)] += TAU / area;
                precision[(first + 1, first + 1)] += TAU / area;
                prior -= area.ln() + self.most_force.ln();
            }
            if spot.radius.is_some() {
                let radii = (RADII[1] / RADII[0]).ln();
                precision[(first + 2, first + 2)] += TAU / (radii * radii);
                prior -= radii.ln();
            }
            first += spot.places();
            precision[(first, first)] += TAU / (self.most_force * self.most_force);
            first += 1;
        }
        let unknowns = precision.nrows() as f64;
        let factor = precision.cholesky()?;
        let log_root: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        let covariance = factor.inverse();
        let known = about(held, &tried.spots, &tried.readings);
        // Those that were there before are told apart.
        let alike = tried.spots.len() - held.count_known();
        let orders: f64 = (1..=alike).map(|k| (k as f64).ln()).sum();
        Some(Joint {
            log_evidence: -tried.left - held.log + prior + orders + 0.5 * unknowns * TAU.ln()
                - log_root,
            log: held.log,
            left: tried.left,
            planes: tried.felt.iter().map(|f| f.plane).collect(),
            drag_deviations: known.iter().map(|k| k.1).collect(),
            spots: (tried.spots.iter().zip(known))
                .map(|(spot, (about, _))| Spot { about, ..*spot })
                .collect(),
            covariance,
        })
    }
}

/// What is in that which the spots leave over of how each was made, and the standard deviation of its force along the
/// surface (N).
fn about(held: &HeldSpots, spots: &[Spot], readings: &[DVector<f64>]) -> Vec<(TouchDoubts, f64)> {
    let mut left = held.reading.clone();
    for (spot, reading) in spots.iter().zip(readings) {
        left.axpy(-spot.force, reading, 1.0);
    }
    let of_spot = |(number, (spot, nuisances)): (usize, (&Spot, &Vec<Nuisance>))| {
        // What was known already has been taken off reading and model alike: this is all of it.
        let (mut about, mut variance) = (TouchDoubts::default(), 0.0);
        for nuisance in nuisances {
            let felt = held.whiten(&nuisance.reading) * spot.force;
            let share = felt.dot(&left);
            about.aside += nuisance.force * share;
            about.tip += nuisance.tip * share;
            let of_share = (1.0 - felt.norm_squared()).max(0.0);
            variance += (nuisance.force.length() * spot.force).powi(2) * of_share / 2.0;
        }
        // How those lean that were there before is known with what they read.
        let about = if number < held.count_known() {
            spot.about
        } else {
            about
        };
        (about, variance.sqrt())
    };
    let spots = spots.iter().zip(&held.nuisances);
    spots.enumerate().map(of_spot).collect()
}
