use super::*;
use crate::gauge::Gauge;

/// The same as by looking at all of them.
fn is_nearest(positions: &[DVec3], i: usize, list: &[usize]) -> bool {
    let mut all: Vec<usize> = (0..positions.len()).filter(|&j| j != i).collect();
    let distance = |j: usize| positions[j].distance(positions[i]);
    all.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
    list == &all[..list.len()]
}

#[test]
fn what_lies_far_from_the_rest_costs_the_rest_nothing() {
    // A radius at which the far ones find others spans the whole plate: 400 million pairs.
    let plate = (0..20_000).map(|i| {
        let (x, y) = (f64::from(i % 200), f64::from(i / 200));
        DVec3::new(x, y, 0.0)
    });
    let line = (0..60).map(|i| DVec3::new(0.0, 0.0, 1e3 * f64::from(i + 1)));
    let positions: Vec<DVec3> = plate.chain(line).collect();
    let lists = nearest(&positions, 20);
    assert!(lists.iter().all(|list| list.len() == 20));
    for i in [0, 7, 10_101, 19_999, 20_000, 20_030, 20_059] {
        assert!(is_nearest(&positions, i, &lists[i]), "{i}");
    }
}

#[test]
fn a_gauge_on_a_site_is_as_far_from_an_edge_as_the_site() {
    let plate: Vec<DVec3> = (0..400)
        .map(|i| DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.0) * 2.1e-3)
        .collect();
    let site = |&position: &DVec3| Site {
        gauge: Gauge {
            position,
            direction: DVec3::X,
            normal: DVec3::Z,
        },
        rms_strain: 0.0,
        peak_strain: 0.0,
    };
    let sites: Vec<Site> = plate.iter().map(site).collect();
    let all = off_centre(&sites, 8);
    for i in [0, 7, 105, 210, 399] {
        let own = off_centre_of(&plate, plate[i], 8);
        assert!((own - all[i]).abs() < 1e-12, "{i}: {own} {}", all[i]);
    }
    // Between the sites of the middle it is near no edge, beside the last ones it is.
    let between = off_centre_of(&plate, plate[210] + DVec3::new(1.05e-3, 1.05e-3, 0.0), 8);
    assert!(between < 1e-12, "{between}");
    assert!(off_centre_of(&plate, plate[399] + DVec3::X * 1e-3, 8) > all[399]);
}

#[test]
fn places_may_be_equal() {
    let positions = [DVec3::ONE; 5];
    let lists = nearest(&positions, 4);
    assert_eq!(lists[2], [0, 1, 3, 4]);
}
