//! Better sets than those that grow gauge by gauge: begun from several first gauges, and with gauges exchanged one at
//! a time while that helps (V. V. Fedorov, Theory of Optimal Experiments, 1972, ch. 3). What a greedy choice has taken
//! it never gives back, and what was best alone need not be among the best together.

use super::constraints::{Constraints, PartialSet, reached};
use super::{PlacementError, Pool, SelectionRequest, SensorSet};
use crate::plain;

/// How often each gauge may be exchanged.
pub const ROUNDS: usize = 4;
/// An exchange or another start must gain this share of the criterion: less is rounding.
const LEAST: f64 = 1e-4;

/// What sets are compared by, and how one grows.
pub(super) trait Criterion {
    /// Whether what is told on the way is rounded, so that sets are compared once more at the end.
    const ROUNDED: bool = false;
    /// The unit that it is reported in.
    const UNIT: &'static str;

    /// As it is reported: of some criteria more is better.
    fn as_reported(value: f64) -> f64 {
        value
    }

    /// Of a set (places in the pool), in the order in which its gauges were chosen; less is better.
    ///
    /// # Errors
    /// [`PlacementError`] when the watch asks for a stop.
    fn of(&mut self, set: &[usize]) -> Result<f64, PlacementError>;

    /// By a cheap look, with a gauge at each open place of a field that has the others; in the set its number is
    /// `number`.
    ///
    /// # Errors
    /// As [`Self::of`].
    fn screened(
        &mut self,
        others: &PartialSet,
        number: usize,
    ) -> Result<Vec<(usize, f64)>, PlacementError>;

    /// The open place with which the criterion is best.
    ///
    /// # Errors
    /// As [`Self::of`].
    fn best_for(
        &mut self,
        others: &PartialSet,
        number: usize,
    ) -> Result<Option<usize>, PlacementError> {
        let screened = self.screened(others, number)?;
        let best = screened.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(best.map(|(place, _)| place))
    }

    /// A place that is better for the gauge of a number than the one that it has in a set of some criterion, and the
    /// criterion there; nothing where none is. `others` is the field without it.
    ///
    /// # Errors
    /// As [`Self::of`].
    fn better_for(
        &mut self,
        others: &PartialSet,
        (set, number): (&[usize], usize),
        value: f64,
    ) -> Result<Option<(usize, f64)>, PlacementError> {
        let best = self.best_for(others, number)?;
        let Some(place) = best.filter(|place| *place != set[number]) else {
            return Ok(None);
        };
        let mut tried = set.to_vec();
        tried[number] = place;
        let with = self.of(&tried)?;
        Ok(gains(value, with).then_some((place, with)))
    }

    /// Adds gauge after gauge to a field, each the best in its turn, and tells of each set.
    ///
    /// # Errors
    /// As [`Self::of`].
    fn grow<'f>(
        &mut self,
        field: PartialSet<'f>,
        found: &dyn Fn(&SensorSet),
    ) -> Result<(PartialSet<'f>, Vec<SensorSet>), PlacementError>;
}

/// What was chosen.
pub(super) struct Exchanged<'f> {
    /// As the set grew.
    pub field: PartialSet<'f>,
    pub sets: Vec<SensorSet>,
    /// The last set, after exchanges (places in the pool).
    pub places: Vec<usize>,
    /// What starts and exchanges have brought.
    pub notes: Vec<String>,
}

/// Chooses from an empty field, with at most so many rounds of exchange.
///
/// # Errors
/// [`PlacementError`] when the watch asks for a stop, and where the criterion cannot be computed.
pub(super) fn search<'f, C: Criterion>(
    criterion: &mut C,
    pool: &Pool,
    request: &SelectionRequest,
    empty: &PartialSet<'f>,
    rounds: usize,
) -> Result<Exchanged<'f>, PlacementError> {
    let starts = request.constraints.thorough.starts;
    if rounds == 0 && starts <= 1 {
        let (field, sets) = criterion.grow(empty.clone(), request.found)?;
        return Ok(Exchanged {
            places: field.chosen.clone(),
            field,
            sets,
            notes: Vec::new(),
        });
    }
    let mut best = GrownSet::new(criterion, empty, None, rounds, request.found)?;
    let (begun, mut from) = (best.value, 1);
    let other_starts = other_starts(criterion, pool, &best, empty, starts.saturating_sub(1))?;
    for (&margin, start) in other_starts.iter().zip(2..) {
        let run = GrownSet::new(criterion, empty, Some(margin), rounds, &|_| ())?;
        if run.beats(&best, request.constraints) {
            (best, from) = (run, start);
        }
    }
    let mut notes = Vec::new();
    if !other_starts.is_empty() {
        let starts = other_starts.len() + 1;
        let (now, first) = (C::as_reported(best.value), C::as_reported(begun));
        notes.push(if from > 1 {
            let unit = C::UNIT;
            format!("Of {starts} first gauges number {from} led to the best set: {now:.2} {unit} instead of {first:.2}.")
        } else {
            format!("Of {starts} first gauges the best one led to the best set too.")
        });
    }
    notes.extend(best.exchange_note::<C>());
    let exchanged = best.take_over::<C>(pool);
    if let Some(last) = best.sets.last()
        && (exchanged || from > 1)
    {
        (request.found)(last);
    }
    Ok(Exchanged {
        field: best.field,
        sets: best.sets,
        places: best.places,
        notes,
    })
}

/// Rounds of exchange for a selector that makes none unless it is asked to.
pub(super) fn rounds_asked(constraints: &Constraints) -> usize {
    if constraints.thorough.exchange {
        ROUNDS
    } else {
        0
    }
}

/// A set that grew from one first gauge, and what exchanges made of it.
struct GrownSet<'f> {
    field: PartialSet<'f>,
    sets: Vec<SensorSet>,
    /// Its criterion as it grew.
    grown: f64,
    places: Vec<usize>,
    value: f64,
}

impl<'f> GrownSet<'f> {
    fn new<C: Criterion>(
        criterion: &mut C,
        empty: &PartialSet<'f>,
        margin: Option<usize>,
        rounds: usize,
        found: &dyn Fn(&SensorSet),
    ) -> Result<Self, PlacementError> {
        let field = empty.clone();
        let field = match margin {
            Some(margin) => field.led_by(margin),
            None => field,
        };
        let (field, sets) = criterion.grow(field, found)?;
        let grown = criterion.of(&field.chosen)?;
        let (places, value) = exchange(criterion, empty, &field.chosen, grown, rounds)?;
        Ok(Self {
            field,
            sets,
            grown,
            places,
            value,
        })
    }

    /// Whether it is better than another: fewer gauges for the error that was asked for, else more of those asked for,
    /// else the better criterion.
    fn beats(&self, other: &Self, constraints: &Constraints) -> bool {
        let (own, others) = (self.places.len(), other.places.len());
        match (
            reached(&self.sets, constraints),
            reached(&other.sets, constraints),
        ) {
            (true, false) => true,
            (false, true) => false,
            (both, _) if own != others => (own < others) == both,
            _ => gains(other.value, self.value),
        }
    }

    fn exchanged(&self) -> usize {
        let new = |place: &&usize| !self.field.chosen.contains(place);
        self.places.iter().filter(new).count()
    }

    fn exchange_note<C: Criterion>(&self) -> Option<String> {
        let exchanged = self.exchanged();
        (exchanged > 0).then(|| {
            format!(
                "{exchanged} of {} exchanged after all were chosen: {:.2} {} instead of {:.2}.",
                plain::count(self.places.len(), "gauge"),
                C::as_reported(self.value),
                C::UNIT,
                C::as_reported(self.grown)
            )
        })
    }

    /// Puts the exchanged set in the place of the last one that grew, where it is another.
    fn take_over<C: Criterion>(&mut self, pool: &Pool) -> bool {
        if self.places == self.field.chosen {
            return false;
        }
        let as_reported = C::as_reported(self.value);
        if let Some(last) = self.sets.last_mut() {
            *last = SensorSet {
                sites: self.places.iter().map(|&p| pool.sites[p]).collect(),
                criterion: Some(as_reported),
                criterion_mm: last.criterion_mm.map(|_| as_reported),
                gap: None,
                margin: None,
                certificate: None,
                expected_mm: None,
            };
        }
        true
    }
}

/// Whether a criterion is better than before by more than rounding.
pub(super) fn gains(before: f64, after: f64) -> bool {
    before - after > LEAST * before.abs()
}

/// A set after at most so many rounds in which each gauge in turn is taken out and the best of all sites put in, with
/// its criterion, which never gets worse. Gauges that must be there, which come first, stay.
fn exchange<C: Criterion>(
    criterion: &mut C,
    empty: &PartialSet,
    chosen: &[usize],
    grown: f64,
    rounds: usize,
) -> Result<(Vec<usize>, f64), PlacementError> {
    let (mut set, mut value) = (chosen.to_vec(), grown);
    let kept = empty.required();
    let free = set.len().saturating_sub(kept);
    // A gauge need not be looked at again while nothing else has changed.
    let mut unchanged = 0;
    for turn in 0..rounds * free {
        let number = kept + turn % free;
        let others = empty.without(&set, number);
        unchanged += 1;
        if let Some((place, with)) = criterion.better_for(&others, (&set, number), value)? {
            (set[number], value, unchanged) = (place, with, 1);
        }
        if unchanged >= free {
            break;
        }
    }
    if set == chosen || !C::ROUNDED {
        return Ok((set, value));
    }
    let last = criterion.of(&set)?;
    Ok(if gains(grown, last) {
        (set, last)
    } else {
        (chosen.to_vec(), grown)
    })
}

/// At most so many other first gauges than a run had: the best ones whose signals differ from that one's and each
/// other.
fn other_starts<C: Criterion>(
    criterion: &mut C,
    pool: &Pool,
    run: &GrownSet,
    empty: &PartialSet,
    count: usize,
) -> Result<Vec<usize>, PlacementError> {
    let kept = empty.required();
    let Some(&first) = run.field.chosen.get(kept).filter(|_| count > 0) else {
        return Ok(Vec::new());
    };
    let field = empty.with_required();
    let before = criterion.of(&field.chosen)?;
    let mut screened = criterion.screened(&field, kept)?;
    let worth = |&(place, value): &(usize, f64)| field.worth(place, before - value);
    screened.sort_by(|a, b| worth(b).total_cmp(&worth(a)).then(a.0.cmp(&b.0)));
    let mut other_starts = vec![first];
    for (place, _) in screened {
        let row = pool.x.row(place);
        if other_starts
            .iter()
            .all(|&margin| !alike(row, pool.x.row(margin)))
        {
            other_starts.push(place);
        }
        if other_starts.len() > count {
            break;
        }
    }
    other_starts.remove(0);
    Ok(other_starts)
}

/// Whether two sites report nearly the same: what their signals share.
fn alike(a: &[f64], b: &[f64]) -> bool {
    /// Correlation.
    const ALIKE: f64 = 0.9;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
    let (of_a, of_b) = (mean(a), mean(b));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a - of_a, b - of_b);
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    ab.abs() >= ALIKE * (aa * bb).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::constraints::Thorough;
    use super::super::margin::Best;
    use super::*;
    use crate::budget::unwatched;
    use crate::dataset::SignalMatrix;

    /// Six sites that each know some of eight things; what counts is how many a set does not know, and a little by
    /// which sites it has.
    struct Cover;

    const KNOWN: [u8; 6] = [
        0b0011_1110,
        0b0000_0111,
        0b0011_1000,
        0b0100_0000,
        0b0000_1111,
        0b1111_0000,
    ];

    impl Cover {
        fn missing(set: &[usize]) -> f64 {
            let known = set.iter().fold(0, |known, &site| known | KNOWN[site]);
            f64::from(known.count_zeros())
        }
    }

    impl Criterion for Cover {
        const UNIT: &'static str = "things";

        fn of(&mut self, set: &[usize]) -> Result<f64, PlacementError> {
            Ok(Self::missing(set))
        }

        fn screened(
            &mut self,
            others: &PartialSet,
            number: usize,
        ) -> Result<Vec<(usize, f64)>, PlacementError> {
            let with = |place: usize| {
                let mut set = others.chosen.clone();
                set.insert(number, place);
                (place, Self::missing(&set))
            };
            Ok(others.open().into_iter().map(with).collect())
        }

        fn grow<'f>(
            &mut self,
            mut field: PartialSet<'f>,
            found: &dyn Fn(&SensorSet),
        ) -> Result<(PartialSet<'f>, Vec<SensorSet>), PlacementError> {
            let mut sets = Vec::new();
            while !field.full() {
                let number = field.chosen.len();
                let mut best = Best::default();
                for (place, missing) in self.screened(&field, number)? {
                    best.offer(place, field.worth(place, -missing));
                }
                let Some(place) = best.place() else { break };
                field.add(place);
                let missing = Self::missing(&field.chosen);
                sets.push(SensorSet {
                    sites: field.sites(),
                    criterion: Some(missing),
                    criterion_mm: None,
                    gap: None,
                    margin: best.margin(),
                    certificate: None,
                    expected_mm: None,
                });
                found(&sets[sets.len() - 1]);
            }
            Ok((field, sets))
        }
    }

    fn missing(constraints: &Constraints, rounds: usize) -> (Vec<usize>, f64, Vec<String>) {
        // Signals that have nothing in common.
        let values = (0..36)
            .map(|k| if k % 7 == 0 { 1.0 } else { 0.0 })
            .collect();
        let x = SignalMatrix::new(6, values);
        let pool = Pool {
            x: &x,
            targets: &[],
            sites: &[10, 11, 12, 13, 14, 15],
            positions: &[],
        };
        let request = SelectionRequest {
            constraints,
            watch: &unwatched,
            found: &|_| {},
        };
        let empty = PartialSet::new(&pool, constraints).unwrap();
        let chosen = search(&mut Cover, &pool, &request, &empty, rounds).unwrap();
        let last = chosen.sets.last().unwrap();
        assert_eq!(last.sites.len(), chosen.places.len());
        assert!(
            (last.sites.iter().zip(&chosen.places)).all(|(site, place)| *site == place + 10),
            "{last:?}"
        );
        (chosen.places, last.criterion.unwrap(), chosen.notes)
    }

    fn with_starts(starts: usize) -> Constraints {
        Constraints {
            thorough: Thorough {
                exchange: false,
                starts,
            },
            ..Constraints::count(2)
        }
    }

    #[test]
    fn exchanges_take_back_what_was_best_alone() {
        let (grown, short, notes) = missing(&Constraints::count(2), 0);
        assert_eq!((grown[0], short, notes.len()), (0, 1.0, 0));
        let (places, missing, notes) = missing(&Constraints::count(2), ROUNDS);
        assert_eq!((places, missing), (vec![4, 5], 0.0));
        assert!(
            notes[0].contains("0.00 things instead of 1.00"),
            "{notes:?}"
        );
    }

    #[test]
    fn other_starts_are_never_worse_and_here_better() {
        let mut before = f64::INFINITY;
        for starts in 1..=6 {
            let (_, missing, _) = missing(&with_starts(starts), 0);
            assert!(missing <= before, "{starts} starts");
            before = missing;
        }
        assert_eq!(before, 0.0);
    }

    #[test]
    fn what_must_be_there_stays_and_nothing_dearer_comes() {
        let must = Constraints {
            required: vec![0],
            ..Constraints::count(2)
        };
        let (places, _, _) = missing(&must, ROUNDS);
        assert_eq!(places[0], 0);
        let dear = Constraints {
            costs: Some(vec![1.0, 1.0, 1.0, 1.0, 9.0, 1.0]),
            ..Constraints::count(2)
        };
        let (places, _, _) = missing(&dear, ROUNDS);
        assert!(!places.contains(&4), "{places:?}");
    }
}
