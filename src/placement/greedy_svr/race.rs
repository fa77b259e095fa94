//! Which candidates go from a cheap score to a dearer one.

use crate::budget::Cancelled;
use crate::statistics::median;

/// A candidate with its score (mm, smaller is better).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// Which candidate.
    pub place: usize,
    /// Its score (mm).
    pub error: f64,
}

/// How two scores of the same candidates relate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Relation {
    /// Median of the dearer over the cheaper.
    pub ratio: f64,
    /// Largest departure from that, as a share.
    pub deviation: f64,
}

impl Relation {
    fn of(pairs: &[(f64, f64)]) -> Self {
        let ratios = pairs.iter().map(|(cheap, dear)| dear / cheap);
        let ratios = ratios.filter(|r| r.is_finite());
        let Some(ratio) = median(ratios.clone()) else {
            return Self {
                ratio: 1.0,
                deviation: 1.0,
            };
        };
        let deviation = ratios.map(|r| (r / ratio - 1.0).abs()).fold(0.0, f64::max);
        Self { ratio, deviation }
    }

    /// The least that the dearer score may be where the cheaper one is `error`.
    #[must_use]
    pub fn least(&self, error: f64) -> f64 {
        /// Those not looked at may depart further than those that were.
        const WIDEN: f64 = 1.5;
        error * self.ratio * (1.0 - WIDEN * self.deviation).max(0.0)
    }
}

/// How a race between two scores is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaceRules {
    /// The fewest candidates that are scored: a relation known from one candidate is none.
    pub least: usize,
    /// Candidates scored at once after those.
    pub batch: usize,
    /// Of each batch, how many are taken from all over the rest: so that the relation is known for
    /// others than the best.
    pub audits: usize,
    /// The relation departs at least this much: what was seen in the step before, halved.
    pub least_deviation: f64,
    /// Candidates within this share of the best go on even if they cannot be better by this score: what
    /// later scores may still change.
    pub slack: f64,
    /// The most candidates that are scored, whatever may be left behind then.
    pub most: usize,
}

/// The outcome of a race.
pub struct Raced {
    /// By the dearer score, in the order they were scored.
    pub scored: Vec<Scored>,
    /// Those left behind, by the cheaper score.
    pub rest: Vec<Scored>,
    /// How the two scores relate over all that were scored twice.
    pub relation: Relation,
}

/// Scores candidates again, the most promising first, until none that is left can be among the best:
/// not even if its cheap score departs from the dear one half as much again as was seen so far; or until the most are scored.
/// `worth` says how much a place with a score counts (more is better).
///
/// # Errors
/// [`Cancelled`] from the scores.
pub fn race(
    cheap: &[Scored],
    rules: &RaceRules,
    worth: &dyn Fn(Scored) -> f64,
    mut score: impl FnMut(&[usize]) -> Result<Vec<f64>, Cancelled>,
) -> Result<Raced, Cancelled> {
    let mut rest = cheap.to_vec();
    rest.sort_by(|a, b| worth(*b).total_cmp(&worth(*a)).then(a.place.cmp(&b.place)));
    let mut scored: Vec<Scored> = Vec::new();
    let mut pairs = Vec::new();
    let mut relation = Relation::default();
    while !rest.is_empty() {
        let size = if scored.is_empty() {
            rules.least
        } else {
            rules.batch
        };
        let batch = taken(&mut rest, size, rules.audits);
        let places: Vec<usize> = batch.iter().map(|b| b.place).collect();
        for (before, error) in batch.iter().zip(score(&places)?) {
            pairs.push((before.error, error));
            scored.push(Scored {
                place: before.place,
                error,
            });
        }
        relation = Relation::of(&pairs);
        relation.deviation = relation.deviation.max(rules.least_deviation);
        let best = scored
            .iter()
            .map(|&s| {
                worth(Scored {
                    error: s.error * (1.0 + rules.slack),
                    ..s
                })
            })
            .fold(f64::NEG_INFINITY, f64::max);
        let hopeful = |s: &Scored| {
            worth(Scored {
                error: relation.least(s.error),
                ..*s
            }) > best
        };
        if scored.len() >= rules.most || !rest.iter().any(hopeful) {
            break;
        }
    }
    Ok(Raced {
        scored,
        rest,
        relation,
    })
}

/// Takes the next ones out of the rest: so many audits from all over it, and then its first ones.
fn taken(rest: &mut Vec<Scored>, size: usize, audits: usize) -> Vec<Scored> {
    let mut batch = Vec::new();
    for k in 0..size.min(rest.len()) {
        let at = if k < audits {
            (k + 1) * rest.len() / (audits + 1)
        } else {
            0
        };
        batch.push(rest.remove(at));
    }
    batch
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cheap score that departs by up to `noise` from the true one, the best candidate at its worst.
    fn run(noise: f64, most: usize) -> (usize, usize) {
        let truth = |p: usize| 10.0 + 0.01 * p as f64;
        let departs = |p: usize| 1.0 + noise * if p == 0 { 1.0 } else { (p as f64 * 1.7).sin() };
        let cheap: Vec<Scored> = (0..400)
            .map(|place| Scored {
                place,
                error: truth(place) * departs(place),
            })
            .collect();
        let rules = RaceRules {
            least: 12,
            batch: 12,
            audits: 4,
            least_deviation: 0.0,
            slack: 0.0,
            most,
        };
        let raced = race(&cheap, &rules, &|s| -s.error, |places| {
            Ok(places.iter().map(|&p| truth(p)).collect())
        })
        .unwrap();
        let best = raced
            .scored
            .iter()
            .min_by(|a, b| a.error.total_cmp(&b.error))
            .unwrap();
        (best.place, raced.scored.len())
    }

    #[test]
    fn a_race_widens_as_far_as_the_cheap_score_departs() {
        let (exact, few) = run(0.0, usize::MAX);
        let (near, more) = run(0.01, usize::MAX);
        let (rough, most) = run(0.1, usize::MAX);
        assert_eq!([exact, near, rough], [0, 0, 0]);
        assert!(
            few <= 12 && few < more && more < most,
            "{few} {more} {most}"
        );
    }

    #[test]
    fn a_race_may_be_cut_off() {
        let (_, all) = run(0.1, usize::MAX);
        let (_, some) = run(0.1, 24);
        assert!(all > 100 && some == 24, "{all} {some}");
    }
}
