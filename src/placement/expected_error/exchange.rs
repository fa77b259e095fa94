//! Better sets by exchange: each gauge in turn is taken out, and the best of all sites put in that cost no more.

use super::Scenes;
use crate::budget::Cancelled;
use crate::placement::Request;
use crate::placement::wishes::Field;

/// An exchange must gain this share of the error: less is rounding.
const LEAST: f64 = 1e-4;

/// The set after at most so many rounds, from one that was `chosen` on an `empty` field, with its expected error (mm); nothing where there is nothing to exchange.
///
/// # Errors
/// [`Cancelled`] when the watch asks for a stop.
pub(super) fn exchange(
    scenes: &Scenes,
    request: &Request,
    empty: &Field,
    chosen: &[usize],
    rounds: usize,
) -> Result<Option<(Vec<usize>, f64)>, Cancelled> {
    let mut chosen = chosen.to_vec();
    let kept = request.wishes.required.len();
    if chosen.len() <= kept || rounds == 0 {
        return Ok(None);
    }
    // A gauge need not be looked at again while nothing else has changed.
    let mut unchanged = 0;
    for turn in 0..rounds * (chosen.len() - kept) {
        let k = kept + turn % (chosen.len() - kept);
        let others: Vec<usize> = chosen.iter().copied().filter(|&c| c != chosen[k]).collect();
        let mut field = empty.clone();
        for &place in &others {
            field.add(place);
        }
        let mut open = field.open();
        // What a gain may cost was weighed when the gauge was chosen.
        open.retain(|&place| field.cost(place) <= field.cost(chosen[k]));
        let step = (chosen.len(), chosen.len());
        let banks = scenes.banks(&others);
        let errors = banks.scan(&open, request.watch, step)?;
        let best = errors.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        // The gauge that is there takes the same turn: all hear the same noise.
        let now = banks.fine.with(chosen[k], &mut banks.fine.rows());
        unchanged += 1;
        if let Some((place, with)) = best
            && with < now * (1.0 - LEAST)
        {
            (chosen[k], unchanged) = (place, 1);
        }
        if unchanged >= chosen.len() - kept {
            break;
        }
    }
    let error = scenes.banks(&chosen).fine.error();
    Ok(Some((chosen, error)))
}
