use super::*;
use crate::budget::unwatched;

fn line(n: usize, step: f64) -> Distances {
    let d: Vec<f64> = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i as f64 - j as f64).abs() * step))
        .collect();
    Distances::new(n, "along a line", &d)
}

#[test]
fn a_covariance_on_a_line_is_left_alone_and_one_on_a_ring_is_clipped() {
    let kernel = GpKernel::default();
    let straight = Covariance::new(&line(60, 0.004), &kernel, &unwatched).unwrap();
    assert_eq!(straight.clipped, 0.0);
    // Distances around a ring with p = 2 are the known counterexample.
    let n = 60;
    let d: Vec<f64> = (0..n)
        .flat_map(|i: i32| (0..n).map(move |j: i32| (i - j).abs().min(n - (i - j).abs())))
        .map(|k| f64::from(k) * 0.004)
        .collect();
    let wide = GpKernel {
        length_m: 0.1,
        power: 2.0,
        ..kernel
    };
    let ring = Distances::new(n as usize, "around a ring", &d);
    let clipped = Covariance::new(&ring, &wide, &unwatched).unwrap();
    assert!(
        clipped.clipped > 1e-4 && clipped.clipped < 0.5,
        "{}",
        clipped.clipped
    );
    assert!(!clipped.notes().is_empty());
    let least = clipped.k.self_adjoint_eigen(Side::Lower).unwrap();
    assert!((0..n as usize).all(|i| least.S().column_vector()[i] > -1e-12));
}

#[test]
fn the_search_finds_the_scale_of_the_field() {
    // Sums of waves whose correlation over the line falls with a length of 12 mm.
    let n = 80;
    let field = |i: usize, t: usize| {
        (0..40)
            .map(|k| {
                let w = f64::from(k) * 4.0;
                let amplitude = (-(w * 0.012f64).powi(2) / 8.0).exp();
                let phase = (t * 71 + k as usize * 131) as f64;
                amplitude * (w * i as f64 * 0.004 + phase).cos()
            })
            .sum::<f64>()
    };
    let values = (0..n)
        .flat_map(|i| (0..300).map(move |t| field(i, t)))
        .collect();
    let x = SignalMatrix::new(300, values);
    let map = search(&x, &line(n, 0.004), 1e-6, &unwatched).unwrap();
    assert_eq!(map.len(), LENGTHS_M.len() * POWERS.len());
    let found = best(&map).unwrap();
    assert!(
        found.power >= 1.9 && (0.007..=0.045).contains(&found.length_m),
        "{found:?}"
    );
    let error = |length: f64| {
        map.iter()
            .find(|t| t.kernel.length_m == length && t.kernel.power == 1.9)
            .unwrap()
            .error
    };
    assert!(error(0.004) > 1.5 * error(found.length_m));
    // A field that is a hundred times as small is found as well, with the same error.
    let small = search(&x, &line(n, 4e-5), 1e-6, &unwatched).unwrap();
    let smaller = best(&small).unwrap();
    let ratio = found.length_m / smaller.length_m;
    assert!(
        (60.0..160.0).contains(&ratio) && smaller.power >= 1.9,
        "{smaller:?}"
    );
    assert!(small.is_sorted_by(|a, b| a.kernel.length_m <= b.kernel.length_m));
    assert!(edge_notes(&map).is_empty() && edge_notes(&small).is_empty());
    // Had the search ended at that length, that would be said.
    let of_best = |t: &GpTrial| t.kernel.length_m == found.length_m;
    let first = map.iter().position(of_best).unwrap();
    let last = map.iter().rposition(of_best).unwrap();
    let said = |map: &[GpTrial]| edge_notes(map).join(" ");
    assert!(said(&map[first..]).contains("so short"));
    assert!(said(&map[..=last]).contains("so long"));
    let rough: Vec<GpTrial> = map.iter().step_by(POWERS.len()).copied().collect();
    assert!(said(&rough).contains("power is the lowest"));
    // One kernel alone is tried as in the grid.
    let alone = |kernel: &GpKernel| trial(&x, &line(n, 0.004), kernel);
    assert_eq!(alone(&map[3].kernel), map[3]);
    let bare = GpKernel {
        length_m: 0.0175,
        power: 2.0,
        noise: 0.0,
    };
    let tried = alone(&bare).error;
    assert!(tried.is_nan() || tried >= 0.0, "{tried}");
}
