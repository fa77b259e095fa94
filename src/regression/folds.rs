//! The split of the touches for cross-validation.

use std::ops::Range;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// At most `most` indices of `count`, evenly spaced: the touches come in no order.
#[must_use]
pub fn evenly(count: usize, most: usize) -> Vec<usize> {
    let kept = count.min(most);
    (0..kept).map(|k| k * count / kept).collect()
}

/// Disjoint parts of the touches, drawn by a seed. The touches are put into the order of their parts, so
/// that what one fit holds out lies together.
#[derive(Clone, Debug, PartialEq)]
pub struct Folds {
    /// Touch at each place of the new order.
    pub order: Vec<usize>,
    /// Places of each part's test touches.
    pub parts: Vec<Range<usize>>,
}

impl Folds {
    /// `count` touches in `number` parts (at least two) whose sizes differ by at most one.
    #[must_use]
    pub fn draw(count: usize, number: usize, seed: u64) -> Self {
        let order = shuffled(count, seed);
        let k = number.clamp(2, count.max(2));
        let parts = (0..k).map(|f| f * count / k..(f + 1) * count / k).collect();
        Self { order, parts }
    }

    /// As [`Self::draw`], with the touches of a group (numbered from zero) always in the same part; the number
    /// of groups in each differs by at most one.
    #[must_use]
    pub fn of_groups(groups: &[usize], number: usize, seed: u64) -> Self {
        let members = members(groups);
        let drawn = Self::draw(members.len(), number, seed);
        let mut order = Vec::with_capacity(groups.len());
        let mut parts = Vec::with_capacity(drawn.parts.len());
        for part in drawn.parts {
            let start = order.len();
            order.extend(drawn.order[part].iter().flat_map(|&g| &members[g]));
            parts.push(start..order.len());
        }
        Self { order, parts }
    }

    /// The part that each touch is tested in.
    #[must_use]
    pub fn of_touches(&self) -> Vec<usize> {
        let mut fold = vec![0; self.order.len()];
        for (f, part) in self.parts.iter().enumerate() {
            for &touch in &self.order[part.clone()] {
                fold[touch] = f;
            }
        }
        fold
    }

    /// About `most` of the places, spread evenly over the parts, and where their parts lie among them.
    #[must_use]
    pub fn thinned(&self, most: usize) -> (Vec<usize>, Vec<Range<usize>>) {
        let stride = self.order.len().div_ceil(most.max(1)).max(1);
        let mut places = Vec::new();
        let mut parts = Vec::with_capacity(self.parts.len());
        for part in &self.parts {
            let start = places.len();
            places.extend(part.clone().step_by(stride));
            parts.push(start..places.len());
        }
        (places, parts)
    }
}

/// Touches of so many groups, drawn by a seed, to judge on; and all others, to learn from.
#[must_use]
pub fn hold_out(groups: &[usize], number: usize, seed: u64) -> (Vec<usize>, Vec<usize>) {
    let members = members(groups);
    let order = shuffled(members.len(), seed);
    let (test, train) = order.split_at(number.min(order.len()));
    let touches = |chosen: &[usize]| -> Vec<usize> {
        let all = chosen.iter().flat_map(|&g| &members[g]);
        all.copied().collect()
    };
    (touches(test), touches(train))
}

/// How many groups there are, numbered from zero without gaps.
#[must_use]
pub fn number_of(groups: &[usize]) -> usize {
    groups.iter().max().map_or(0, |g| g + 1)
}

/// The touches of each group, by its number; none of a number that no touch has.
#[must_use]
pub fn members(groups: &[usize]) -> Vec<Vec<usize>> {
    let mut members = vec![Vec::new(); number_of(groups)];
    for (touch, &group) in groups.iter().enumerate() {
        members[group].push(touch);
    }
    members
}

fn shuffled(count: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_disjoint_and_cover_all() {
        for (count, number) in [(10, 3), (4000, 5), (7, 7), (5, 1)] {
            let folds = Folds::draw(count, number, 3);
            let mut order = folds.order.clone();
            order.sort_unstable();
            assert_eq!(order, (0..count).collect::<Vec<_>>());
            assert_eq!(folds.parts[0].start, 0);
            assert_eq!(folds.parts.last().unwrap().end, count);
            assert!(folds.parts.windows(2).all(|w| w[0].end == w[1].start));
            let fold = folds.of_touches();
            assert!(
                folds
                    .parts
                    .iter()
                    .enumerate()
                    .all(|(f, part)| { fold.iter().filter(|&&g| g == f).count() == part.len() })
            );
            let (places, parts) = folds.thinned(4);
            assert!(parts.iter().all(|p| !p.is_empty()) && places.len() >= parts.len());
        }
    }

    #[test]
    fn groups_stay_together_and_groups_of_one_are_drawn_as_before() {
        let single: Vec<usize> = (0..40).collect();
        assert_eq!(Folds::of_groups(&single, 5, 3), Folds::draw(40, 5, 3));
        let (test, train) = hold_out(&single, 6, 9);
        let order = Folds::draw(40, 2, 9).order;
        assert_eq!((&test[..], &train[..]), (&order[..6], &order[6..]));
        let groups: Vec<usize> = (0..60).map(|t| t % 12).collect();
        let folds = Folds::of_groups(&groups, 5, 3);
        let fold = folds.of_touches();
        assert!((0..60).all(|t| fold[t] == fold[groups[t]]));
        assert!(folds.parts.iter().all(|p| [10, 15].contains(&p.len())));
        let (test, train) = hold_out(&groups, 3, 9);
        assert_eq!((test.len(), train.len()), (15, 45));
        assert!(
            test.iter()
                .all(|&t| train.iter().all(|&o| groups[o] != groups[t]))
        );
    }
}
