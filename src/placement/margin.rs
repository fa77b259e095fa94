//! How clearly a pick was the best. Symmetric parts have real ties, and what is nearly one may fall either way when
//! the input changes by next to nothing.

use super::SensorSet;

/// Relative tolerance of picks by criteria without an effort of their own: a margin of less than twice this is a tie.
/// It is what a relative change of 1e-6 in the input may grow to on its way through a model.
pub const TOLERANCE: f64 = 1e-4;

/// The best of some places, the first of equal ones, and the next best.
#[derive(Clone, Copy, Debug, Default)]
pub struct Best {
    best: Option<(usize, f64)>,
    second: Option<f64>,
}

impl Best {
    /// Values this near to each other, as a share, are equal: rounding.
    const EQUAL: f64 = 1e-10;

    /// Looks at a place with its worth; more is better, and the earlier of equal ones.
    pub fn offer(&mut self, place: usize, worth: f64) {
        let next = match self.best {
            Some((_, best)) if worth > best + Self::EQUAL * best.abs() => {
                self.best = Some((place, worth));
                Some(best)
            }
            Some(_) => Some(worth),
            None => {
                self.best = Some((place, worth));
                None
            }
        };
        if let Some(next) = next {
            self.second = Some(self.second.map_or(next, |second| second.max(next)));
        }
    }

    /// The best so far; absent before the first.
    #[must_use]
    pub fn place(&self) -> Option<usize> {
        self.best.map(|b| b.0)
    }

    /// How far the best is ahead of the next, over its own worth; nothing where there was no choice.
    #[must_use]
    pub fn margin(&self) -> Option<f64> {
        let ((_, best), second) = (self.best?, self.second?);
        Some(((best - second) / best.abs().max(f64::MIN_POSITIVE)).max(0.0))
    }
}

/// A word on the picks whose margin is less than twice the tolerance, where there are any.
#[must_use]
pub fn ties(sets: &[SensorSet], tolerance: f64) -> Option<String> {
    let tied: Vec<String> = sets
        .iter()
        .filter(|s| s.margin.is_some_and(|margin| margin <= 2.0 * tolerance))
        .map(|s| s.sites.len().to_string())
        .collect();
    (!tied.is_empty()).then(|| {
        format!(
            "Ties with {} gauges: another site is as good to within {:.2} % of the criterion, as mirrored ones are on a symmetric part. The first was taken; a change of next to nothing may take the other.",
            tied.join(", "),
            200.0 * tolerance
        )
    })
}

/// As [`ties`], for what elements leave open of the criterion: which picks are firm on any others as good.
#[must_use]
pub fn within_model(sets: &[SensorSet], tolerance: f64) -> Option<String> {
    // Where the mesh could not be judged that is said already.
    if tolerance.is_nan() || tolerance <= 0.0 {
        return None;
    }
    let firm = |s: &&SensorSet| s.margin.is_none_or(|margin| margin > 2.0 * tolerance);
    let number = |s: &SensorSet| s.sites.len().to_string();
    let open = sets.len() - sets.iter().filter(firm).count();
    if open == 0 {
        return None;
    }
    let firm: Vec<String> = sets.iter().filter(firm).map(number).collect();
    let clear = if firm.is_empty() {
        "none of them leads by more".to_owned()
    } else {
        format!("those with {} gauges lead by more", firm.join(", "))
    };
    Some(format!(
        "The elements leave {:.1} % open: of {} choices {open} lead the next best by less than twice that and may be others, as good, on other elements; {clear}.",
        100.0 * tolerance,
        sets.len()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_equal_ones_is_best_and_has_no_margin() {
        let mut best = Best::default();
        assert_eq!(best.margin(), None);
        for (place, worth) in [(3, 1.0), (5, 2.0), (7, 2.0), (9, 1.5)] {
            best.offer(place, worth);
        }
        assert_eq!((best.place(), best.margin()), (Some(5), Some(0.0)));
        best.offer(11, 4.0);
        assert_eq!((best.place(), best.margin()), (Some(11), Some(0.5)));
    }

    #[test]
    fn files_keep_their_name_for_it() {
        let set = SensorSet {
            sites: vec![4],
            criterion: None,
            criterion_mm: None,
            gap: None,
            margin: Some(0.25),
            certificate: None,
            expected_mm: None,
        };
        let written = serde_json::to_value(&set).unwrap();
        assert_eq!(written["lead"], 0.25);
        assert!(written.get("margin").is_none());
    }
}
