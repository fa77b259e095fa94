//! What of a part is likeliest, where each value is a model of its own.

use std::collections::BTreeMap;

/// Places that are tried: logarithms of what is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogLattice {
    /// They lie this far apart …
    pub step: f64,
    /// … at first so many times, and at last once.
    pub first: i32,
    /// The farthest that the top may lie, in steps.
    pub farthest: i32,
    /// The largest deviation that says anything.
    pub vague: f64,
}

impl LogLattice {
    /// Of a wall's thickness, which is known to a few tenths.
    pub const THICKNESS: Self = Self {
        step: 0.03,
        first: 4,
        farthest: 36,
        vague: 0.15,
    };
    /// Of the bedding of supports, of which only the order of magnitude is known.
    pub const BEDDING: Self = Self {
        step: 0.25,
        first: 8,
        farthest: 44,
        vague: 0.8,
    };
}

/// Where a function of a logarithm with one top is largest, and the standard deviation that its curvature there stands for; nothing where it
/// is too flat to say. Away from the top evidence falls ever more slowly, for the model is then trusted less and less:
/// slopes do not lead there, but the best of five places does, which are laid anew around it, nearer to each other.
/// Elements are laid anew for every part, which makes evidence tremble: places that lie too near each other would say
/// nothing.
pub fn likeliest(lattice: &LogLattice, evidence: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    let mut known = BTreeMap::new();
    let (mut middle, mut step) = (0_i32, lattice.first);
    while middle.abs() < lattice.farthest {
        let places = [-2, -1, 0, 1, 2].map(|k| middle + k * step);
        let found = places.map(|at| {
            let value = || evidence(f64::from(at) * lattice.step);
            *known.entry(at).or_insert_with(value)
        });
        let best = (0..5).max_by(|&a, &b| found[a].total_cmp(&found[b]))?;
        middle = places[best];
        if best == 0 || best == 4 {
            continue;
        }
        if step > 1 {
            step /= 2;
            continue;
        }
        let (off, deviation) = top_of(found)?;
        let off = off + f64::from(places[2] - middle);
        let top = lattice.step * (f64::from(middle) + off);
        let deviation = lattice.step * deviation;
        return (deviation < lattice.vague).then_some((top, deviation));
    }
    None
}

/// Where the parabola nearest to five values at even steps has its top, from the midst, and the standard deviation of a
/// density with that logarithm; both in steps. Nothing where it has none near.
fn top_of([a, b, c, d, e]: [f64; 5]) -> Option<(f64, f64)> {
    let slope = (2.0 * (e - a) + (d - b)) / 10.0;
    let bend = (b + d + 2.0 * c - 2.0 * (a + e)) / 7.0;
    let top = slope / bend;
    (bend > 0.0 && top.abs() <= 2.0).then(|| (top, bend.recip().sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_is_found_wherever_it_lies_and_however_the_values_tremble() {
        for top in [-0.7, 0.02, 0.17, 0.4] {
            let tremble = |x: f64| 0.02 * (1e4 * x).sin();
            // As it falls where the model is trusted less and less.
            let value = |x: f64| -80.0 * (1.0 + ((x - top) / 0.1).powi(2)).ln() + tremble(x);
            let (found, said) = likeliest(&LogLattice::THICKNESS, value).unwrap();
            assert!((found - top).abs() < 5e-3, "{found} for {top}");
            let right = 0.1 / 160.0_f64.sqrt();
            assert!((0.8..1.8).contains(&(said / right)), "{said} for {right}");
        }
        // What is flat, has no top or is no number says nothing.
        let of = |value: fn(f64) -> f64| likeliest(&LogLattice::THICKNESS, value);
        assert!(of(|x| -2.0 * x * x).is_none() && of(|x| x * x).is_none());
        assert!(of(|_| f64::NAN).is_none() && of(|_| f64::NEG_INFINITY).is_none());
        // On a plateau that rises to where nothing gives way there is no top.
        let firm = |x: f64| -50.0 * (1.0 + (-x).exp()).ln();
        assert!(likeliest(&LogLattice::BEDDING, firm).is_none());
    }
}
