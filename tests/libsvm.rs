//! The SVR solver against LIBSVM, on fixtures made by `tests/make_svr_fixtures.py` with scikit-learn.

use hapdef::dataset::SignalMatrix;
use hapdef::regression::kernel::{gaussian, squared_distances};
use hapdef::regression::svr::{self, SvrParams};
use serde::Deserialize;

#[derive(Deserialize)]
struct Fixtures {
    problems: Vec<Problem>,
}

#[derive(Deserialize)]
struct Problem {
    c: f64,
    epsilon: f64,
    gamma: f64,
    /// Size of the target: what tolerances are relative to.
    size: f64,
    /// Features × touches.
    x: Vec<Vec<f64>>,
    y: Vec<f64>,
    unseen: Vec<Vec<f64>>,
    objective: f64,
    predictions: Vec<f64>,
}

fn matrix(rows: &[Vec<f64>]) -> SignalMatrix {
    SignalMatrix::new(rows[0].len(), rows.concat())
}

#[test]
fn objective_and_predictions_are_those_of_libsvm() {
    let fixtures: Fixtures = serde_json::from_str(include_str!("fixtures/svr.json")).unwrap();
    assert!(fixtures.problems.len() >= 7);
    for (k, p) in fixtures.problems.iter().enumerate() {
        let (x, unseen) = (matrix(&p.x), matrix(&p.unseen));
        let kernel = gaussian(&squared_distances(&x, &x), p.gamma);
        let params = SvrParams {
            c: p.c,
            epsilon: p.epsilon,
            tolerance: 1e-9 * p.size,
            max_steps: 20_000_000,
        };
        let fit = svr::fit(&kernel, &p.y, &params, None);
        assert!(
            fit.converged,
            "problem {k}: gap {:e} after {}",
            fit.gap, fit.steps
        );
        let relative = (fit.objective / p.objective - 1.0).abs();
        assert!(
            relative < 1e-6,
            "problem {k}: objective off by {relative:e}"
        );
        let rows = gaussian(&squared_distances(&unseen, &x), p.gamma);
        // LIBSVM keeps its kernel in single precision: C times rounding shows in its predictions.
        for (ours, theirs) in svr::predict(&fit, &rows).iter().zip(&p.predictions) {
            assert!(
                (ours - theirs).abs() < 3e-4 * p.size,
                "problem {k}: {ours} against {theirs}"
            );
        }
    }
}
