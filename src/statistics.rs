//! Means, medians and quantiles of a handful of numbers, and how large noise may be: one definition each.

/// The mean; NaN of none.
#[must_use]
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The value that a share (0 to 1) of sorted values lies below: the one whose rank is nearest, so that it is always one
/// of them. Nothing of none.
#[must_use]
pub(crate) fn quantile<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((share * last as f64).round() as usize).copied()
}

/// The middle value, of two in the middle the larger: always one of them. Nothing of none.
#[must_use]
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    if values.is_empty() {
        return None;
    }
    let half = values.len() / 2;
    Some(*values.select_nth_unstable_by(half, f64::total_cmp).1)
}

/// The middle value, of two in the middle what lies halfway between them: for a few differences of either sign, where
/// always taking the larger would lean to one side. NaN of none.
#[must_use]
pub(crate) fn midpoint_median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else {
        return f64::NAN;
    };
    f64::midpoint(values[last / 2], values[values.len() / 2])
}

/// What χ² with so many degrees of freedom is at most, to so many standard deviations beyond its mean.
#[must_use]
pub(crate) fn chi_squared_bound(free: f64, deviations: f64) -> f64 {
    free + deviations * (2.0 * free).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_of_two_has_a_deviation_of_two() {
        assert_eq!(chi_squared_bound(2.0, 0.0), 2.0);
        assert_eq!(chi_squared_bound(2.0, 3.0), 8.0);
    }

    #[test]
    fn of_an_even_number_the_larger_in_the_middle_is_taken() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), Some(3.0));
        assert_eq!(median([]), None);
        assert_eq!(midpoint_median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(midpoint_median(vec![3.0, 1.0, 2.0]), 2.0);
    }

    #[test]
    fn quantiles_are_values_that_there_are() {
        let sorted = [1.0, 2.0, 4.0, 8.0];
        assert_eq!(quantile(&sorted, 0.0), Some(1.0));
        assert_eq!(quantile(&sorted, 0.5), Some(4.0));
        assert_eq!(quantile(&sorted, 0.95), Some(8.0));
        assert_eq!(quantile::<f64>(&[], 0.5), None);
    }
}
