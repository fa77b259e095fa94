//! Matching where there is no elastic model: the templates are touches that were measured.
//!
//! Live matching (`matching`) reads templates off a surface that the model has filled; data have no surface, only
//! places. Each stands for its surroundings: there the reading is linear in where the touch is and how hard, so that
//! the posterior is normal around every place, and a sum of them over all (D. L. Alspach and H. W. Sorenson, 1972).
//! Its mean is the estimate. That is the estimator which a choice by expected error supposes
//! (`placement::expected_error`), on the very numbers that the choice was made with.

use glam::DVec3;
use nalgebra::{Matrix3, Vector3};

use crate::dataset::SignalMatrix;
use crate::placement::expected_error::{SignalKnowledge, SiteSignal, Template, templates};

/// Matches readings of some sites to those of touches that are known.
#[derive(Clone, Debug)]
pub struct MeasuredMatching {
    templates: Vec<Template>,
    /// One over what readings are measured in.
    scale: f64,
    /// The largest force thought possible (N); absent where readings are what they are.
    most_force: Option<f64>,
}

/// What a template makes of a reading.
struct TemplateFit {
    /// Of its likelihood, over the surroundings.
    log: f64,
    /// Where the touch is thought to be there (mm).
    position: DVec3,
}

/// Turns in which a force and the weights that depend on it settle, as in live matching.
const TURNS: usize = 2;

impl MeasuredMatching {
    /// From the signals (sites × touches) of touches at positions (mm).
    #[must_use]
    pub fn new(x: &SignalMatrix, targets: &[[f64; 3]], known: &SignalKnowledge) -> Self {
        let (templates, unit) = templates(x, targets, known);
        Self {
            templates,
            scale: unit.recip(),
            most_force: known.forces.map(|f| f.possible),
        }
    }

    /// Where the touch was (mm) that a reading is of: a value a site, of which some are used.
    #[must_use]
    pub fn find(&self, reading: &[f64], used: &[bool]) -> DVec3 {
        let scaled: Vec<f64> = reading.iter().map(|r| r * self.scale).collect();
        let fits: Vec<TemplateFit> = (self.templates.iter())
            .map(|template| {
                let sites = || {
                    let all = template.sites.iter().zip(&scaled).zip(used);
                    all.filter(|(_, used)| **used).map(|(observed, _)| observed)
                };
                self.fit(template, &sites)
            })
            .collect();
        let best = fits.iter().map(|f| f.log).fold(f64::NEG_INFINITY, f64::max);
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for fit in &fits {
            let weight = if best.is_finite() {
                (fit.log - best).exp()
            } else {
                1.0
            };
            sum += fit.position * weight;
            weights += weight;
        }
        sum / weights
    }

    /// The posterior around a template: of the place along both directions in units of its reach, and of the force
    /// in units of the largest.
    fn fit<'a, I>(&self, template: &Template, sites: &dyn Fn() -> I) -> TemplateFit
    where
        I: Iterator<Item = (&'a SiteSignal, &'a f64)>,
    {
        let force = self.most_force.map_or(1.0, |most| force(sites, most));
        let mut information = Matrix3::<f64>::identity();
        let mut pull = Vector3::<f64>::zeros();
        let (mut squares, mut logs) = (0.0, 0.0);
        for (site, observed) in sites() {
            let variance = 1.0 + force * force * site.variance;
            let [along, across] = site.slopes.map(|s| s * force * template.reach);
            // Any force up to the largest; or the one there is.
            let (by_force, off) = match self.most_force {
                Some(most) => (most * site.value, *observed),
                None => (0.0, observed - site.value),
            };
            let row = Vector3::new(along, across, by_force);
            information += row * row.transpose() / variance;
            pull += row * (off / variance);
            squares += off * off / variance;
            logs += variance.ln();
        }
        let Some(factor) = information.cholesky() else {
            return TemplateFit {
                log: f64::NEG_INFINITY,
                position: template.position,
            };
        };
        let mean = factor.solve(&pull);
        // Nothing pulls.
        let pulls = mean[2].min(0.0).powi(2) * information[(2, 2)];
        let [along, across] = [0, 1].map(|k| template.plane[k] * (mean[k] * template.reach));
        TemplateFit {
            log: -0.5 * (squares - pull.dot(&mean) + logs + factor.ln_determinant() + pulls),
            position: template.position + along + across,
        }
    }
}

/// The force (N) that fits a reading best at a template, whose weights depend on it.
fn force<'a, I>(sites: &dyn Fn() -> I, most: f64) -> f64
where
    I: Iterator<Item = (&'a SiteSignal, &'a f64)>,
{
    let mut force = 0.0;
    for _ in 0..=TURNS {
        let (mut along, mut squares) = (0.0, f64::MIN_POSITIVE);
        for (site, observed) in sites() {
            let weight = (1.0 + force * force * site.variance).recip();
            along += weight * site.value * observed;
            squares += weight * site.value * site.value;
        }
        force = (along / squares).clamp(0.0, most);
    }
    force
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::placement::expected_error::SceneForces;

    /// A row of places 2 mm apart, three sites that feel what is near them, and forces.
    fn row(force: impl Fn(usize) -> f64) -> (SignalMatrix, Vec<[f64; 3]>) {
        let targets: Vec<[f64; 3]> = (0..30)
            .map(|t| [2.0 * f64::from(t / 3), 2.0 * f64::from(t % 3), 4.0])
            .collect();
        let values = [2.0, 9.0, 16.0].into_iter().flat_map(|site| {
            (targets.iter().enumerate())
                .map(|(t, p)| force(t) * read(site, p))
                .collect::<Vec<f64>>()
        });
        (SignalMatrix::new(30, values.collect()), targets)
    }

    fn read(site: f64, p: &[f64; 3]) -> f64 {
        (-((p[0] - site).powi(2) + (p[1] - 0.1 * site).powi(2)) / 60.0).exp()
    }

    fn known(forces: Option<SceneForces<'_>>) -> SignalKnowledge<'_> {
        SignalKnowledge {
            noise: 1e-3,
            variance: None,
            shared: None,
            density: None,
            among: None,
            forces,
            seed: 1,
        }
    }

    #[test]
    fn a_touch_between_templates_is_found_between_them() {
        let (x, targets) = row(|_| 1.0);
        let matching = MeasuredMatching::new(&x, &targets, &known(None));
        let there = [7.3, 2.6, 4.0];
        let reading = [2.0, 9.0, 16.0].map(|site| read(site, &there));
        let found = matching.find(&reading, &[true; 3]);
        let off = found.distance(DVec3::from_array(there));
        assert!(off < 0.5, "{found} {off}");
    }

    #[test]
    fn the_force_is_found_with_the_place() {
        let forces: Vec<f64> = (0..30).map(|t| 1.0 + 0.1 * f64::from(t % 7)).collect();
        let (x, targets) = row(|t| forces[t]);
        let of = SceneForces {
            touches: &forces,
            coming: [0.5, 5.0],
            possible: 20.0,
        };
        let matching = MeasuredMatching::new(&x, &targets, &known(Some(of)));
        let there = [11.2, 1.7, 4.0];
        let reading = [2.0, 9.0, 16.0].map(|site| 4.2 * read(site, &there));
        let found = matching.find(&reading, &[true; 3]);
        let off = found.distance(DVec3::from_array(there));
        assert!(off < 0.8, "{found} {off}");
    }

    #[test]
    fn no_reading_at_all_is_somewhere_in_the_middle() {
        let (x, targets) = row(|_| 1.0);
        let matching = MeasuredMatching::new(&x, &targets, &known(None));
        let found = matching.find(&[0.3; 3], &[false; 3]);
        assert!(found.distance(DVec3::new(9.0, 2.0, 4.0)) < 1e-9, "{found}");
    }
}
