use super::*;
use crate::budget::unwatched;

/// Three independent patterns over eight sites.
fn signals(touches: usize) -> SignalMatrix {
    let wave = |i: usize, t: usize| {
        let t = t as f64;
        let parts = [(0.7 * t).sin(), (1.3 * t + 1.0).sin(), (2.9 * t).cos()];
        parts[i % 3] * (1.0 + i as f64) + if i >= 6 { parts[0] } else { 0.0 }
    };
    let values = (0..8)
        .flat_map(|i| (0..touches).map(move |t| wave(i, t)))
        .collect();
    SignalMatrix::new(touches, values)
}

#[test]
fn both_gram_matrices_give_the_same_picks() {
    let (wide, tall) = (signals(40), signals(5));
    let pca = Pca::new(&wide, 8, &unwatched).unwrap();
    assert_eq!((pca.reach(), pca.complete), (3, true));
    assert_eq!(pca.pivots(8).len(), 3, "picks end at the numerical rank");
    assert!(Pca::new(&tall, 8, &unwatched).unwrap().reach() <= 4);
    let mut kinds: Vec<usize> = pca.pivots(3).iter().map(|i| i % 3).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, [0, 1, 2]);
}

/// Pivots that project every direction out of every column at once.
fn plain_pivots(pca: &Pca, count: usize) -> Vec<usize> {
    let mut columns: Vec<Vec<f64>> = (0..pca.sites)
        .map(|i| (0..count).map(|c| pca.modes[(i, c)]).collect())
        .collect();
    let mut chosen = Vec::new();
    while chosen.len() < count {
        let norm = |i: usize| dot(&columns[i], &columns[i]);
        let best = (0..pca.sites).fold(0, |b, i| if norm(i) > norm(b) { i } else { b });
        let length = norm(best).sqrt();
        let direction: Vec<f64> = columns[best].iter().map(|v| v / length).collect();
        for column in &mut columns {
            let share = dot(column, &direction);
            for (v, d) in column.iter_mut().zip(&direction) {
                *v -= share * d;
            }
        }
        chosen.push(best);
    }
    chosen
}

#[test]
fn panels_change_no_pivot() {
    let values = (0..120usize)
        .flat_map(|i| (0..300usize).map(move |t| ((i * i * 7 + t * (3 + i)) as f64).sin()))
        .collect();
    let pca = Pca::new(&SignalMatrix::new(300, values), 100, &unwatched).unwrap();
    for count in [1, 31, 33, 75, 100] {
        assert_eq!(pca.pivots(count), plain_pivots(&pca, count), "{count}");
    }
}

#[test]
fn enough_sites_explain_all() {
    let x = signals(40);
    let (train, test): (Vec<usize>, Vec<usize>) = (0..40).partition(|t| t % 4 != 0);
    let judge = Reconstruction::new(&x, &train, &test);
    let pca = Pca::new(&x, 3, &unwatched).unwrap();
    let curve: Vec<f64> = (1..=3)
        .map(|k| judge.unexplained(&pca.pivots(k)).unwrap())
        .collect();
    assert!(curve[0] > 0.3 && curve[0] < 0.9, "{curve:?}");
    assert!(curve[2] < 1e-12 && curve[1] > curve[2], "{curve:?}");
    assert!(judge.unexplained(&[0, 3]).is_none_or(|u| u > 0.3));
}

#[test]
fn the_authors_measure_is_of_norms_and_not_of_variance() {
    // Two sites: one moves by 3 either way, the other by 1 about a rest of its own.
    let signals = |rest: f64| {
        let second = [0.0, 0.0, 1.0, -1.0].map(|v| v + rest);
        SignalMatrix::new(4, [[3.0, -3.0, 0.0, 0.0], second].concat())
    };
    let missed = |x: &SignalMatrix, count: usize| {
        let spectrum = Spectrum::unscaled(x, &unwatched).unwrap();
        spectrum
            .components(2, &unwatched)
            .unwrap()
            .norms_missed(x, count)
    };
    // A tenth of the variance, a quarter of the norms.
    let about_zero = signals(0.0);
    assert!((missed(&about_zero, 1) - 2.0 / 8.0).abs() < 1e-12);
    // The rest counts too.
    let off_centre = signals(5.0);
    let all = 2.0 * 34f64.sqrt() + 10.0;
    assert!((missed(&off_centre, 1) - 20.0 / all).abs() < 1e-12);
    assert!(missed(&off_centre, 2) < 1e-12);
    // Standardized, both sites move alike.
    let standard = Spectrum::new(&about_zero, &unwatched).unwrap();
    let variances = standard.components(2, &unwatched).unwrap().variances;
    assert!((variances[0] - variances[1]).abs() < 1e-12);
}

#[test]
fn constant_signals_are_named() {
    let flat = SignalMatrix::new(3, vec![1.0; 6]);
    assert_eq!(
        Pca::new(&flat, 3, &unwatched).err(),
        Some(PcaError::Constant)
    );
}
