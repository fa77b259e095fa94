//! A search of settings on a grid without an edge: from a start to the best neighbour, as long as one is better.

use std::collections::HashMap;

/// A neighbour has to be better by this share.
const BETTER: f64 = 1e-3;
/// Steps along each axis, to either side of the start, that are thought possible: whoever gets there has a cost that
/// falls for ever.
const REACH: i32 = 20;

/// The place that no neighbour along an axis is better than, and its cost, from the best of some starts. Costs that are
/// no number lose.
pub fn walk<const N: usize, E>(
    starts: &[[i32; N]],
    mut cost: impl FnMut([i32; N]) -> Result<f64, E>,
) -> Result<([i32; N], f64), E> {
    let mut known = HashMap::new();
    let mut asked = |at: [i32; N]| -> Result<f64, E> {
        if let Some(found) = known.get(&at) {
            return Ok(*found);
        }
        let found = cost(at)?;
        let found = if found.is_nan() { f64::INFINITY } else { found };
        known.insert(at, found);
        Ok(found)
    };
    let mut best = ([0; N], f64::INFINITY);
    for &start in starts {
        let found = asked(start)?;
        if found < best.1 || best.1.is_infinite() {
            best = (start, found);
        }
    }
    loop {
        let mut next = best;
        for axis in 0..N {
            for step in [-1, 1] {
                let mut at = best.0;
                at[axis] += step;
                if at[axis].abs() > REACH {
                    continue;
                }
                let found = asked(at)?;
                if found < next.1 {
                    next = (at, found);
                }
            }
        }
        // Where nothing can be computed at all the start is as good as any other.
        let better = next.1 < (1.0 - BETTER) * best.1;
        if !better {
            return Ok(best);
        }
        best = next;
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn it_goes_as_far_as_it_has_to_and_asks_for_nothing_twice() {
        let mut asked = Vec::new();
        let cost = |at: [i32; 2]| -> Result<f64, Infallible> {
            assert!(!asked.contains(&at), "{at:?} twice");
            asked.push(at);
            Ok(1.0 + f64::from((at[0] - 9).pow(2) + (at[1] + 4).pow(2)))
        };
        let Ok(found) = walk(&[[0, 0], [3, 0]], cost);
        assert_eq!(found, ([9, -4], 1.0));
    }

    #[test]
    fn it_ends_where_nothing_can_be_computed_or_all_is_the_same() {
        let Ok((_, cost)) = walk(&[[0]], |_| Ok::<_, Infallible>(f64::NAN));
        assert!(cost.is_infinite());
        let Ok((at, _)) = walk(&[[2]], |_| Ok::<_, Infallible>(0.0));
        assert_eq!(at, [2]);
    }
}
