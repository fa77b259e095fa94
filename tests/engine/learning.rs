//! Estimators learned from measured touches alone: in units of their own, chosen fairly, kept in files.

use std::path::Path;
use std::process::{Command, Output};

use hapdef::budget::unwatched;
use hapdef::dataset::SignalMatrix;
use hapdef::io::npz::NpzFile;
use hapdef::learning::{Family, MeasuredTouches, Method, TrainedEstimator, TrainingRequest, train};
use hapdef::regression::Grouping;
use serde_json::Value;

/// A skin whose channels feel what is near them; touches at places spread without an order, with noise.
struct Skin {
    x: SignalMatrix,
    places_mm: Vec<[f64; 3]>,
    forces: Vec<f64>,
}

/// The k-th of a series of numbers that fill the unit interval evenly.
fn draw(k: usize, by: f64) -> f64 {
    (k as f64 * by).fract()
}

/// A round skin of so many channels under so many touches, some of which clip, with one channel that is dead.
fn skin(channels: usize, touches: usize) -> Skin {
    let at = |u: f64, v: f64| {
        let turn = 2.0 * (u - 0.5);
        [40.0 * turn.sin(), 40.0 * turn.cos(), 80.0 * v]
    };
    let places_mm: Vec<[f64; 3]> = (1..=touches)
        .map(|k| at(draw(k, 0.754_877_666), draw(k, 0.569_840_291)))
        .collect();
    let forces: Vec<f64> = (1..=touches)
        .map(|k| 2.0 + 10.0 * draw(k, 0.618_033_989))
        .collect();
    let mut values = Vec::new();
    for c in 0..channels {
        let own = at(draw(c + 1, 0.417), draw(c + 1, 0.731));
        for (t, (p, force)) in places_mm.iter().zip(&forces).enumerate() {
            let squared: f64 = (0..3).map(|a| (p[a] - own[a]).powi(2)).sum();
            let rough = draw(t * channels + c + 1, 0.324_717_957) - 0.5;
            let felt = force * (-squared / 2500.0).exp() + 0.05 * rough;
            values.push(if c == 1 { 3.5 } else { felt.min(9.0) });
        }
    }
    Skin {
        x: SignalMatrix::new(touches, values),
        places_mm,
        forces,
    }
}

impl Skin {
    fn train(&self, asked: &TrainingRequest) -> TrainedEstimator {
        let groups = Grouping::Place.of(&self.places_mm);
        let lessons = MeasuredTouches {
            x: &self.x,
            places_mm: &self.places_mm,
            forces: &self.forces,
            groups: &groups,
        };
        train(&lessons, asked, &unwatched).expect("enough to learn from")
    }

    fn save(&self, path: &Path) {
        let touches = self.places_mm.len();
        let metres: Vec<f64> = self.places_mm.iter().flatten().map(|v| v * 1e-3).collect();
        let mut file = NpzFile::default();
        file.add("X", &[self.x.rows(), touches], self.x.values())
            .unwrap();
        file.add("p_m", &[touches, 3], &metres).unwrap();
        file.add("force_n", &[touches], &self.forces).unwrap();
        file.save(path).unwrap();
    }
}

fn only(family: Family) -> TrainingRequest {
    TrainingRequest {
        family: Some(family),
        ..TrainingRequest::default()
    }
}

#[test]
fn the_best_on_validation_is_taken_and_its_radius_holds() {
    let skin = skin(8, 500);
    let trained = skin.train(&TrainingRequest::default());
    assert_eq!(trained.tried.len(), Family::ALL.len());
    let least = trained
        .tried
        .iter()
        .map(|t| t.validation_mm)
        .fold(f64::MAX, f64::min);
    assert_eq!(trained.validation_mm, least);
    let scores = &trained.scores;
    assert!(scores.mean_mm < 3.0, "{}", scores.mean_mm);
    assert!(
        (0.75..=1.0).contains(&scores.coverage),
        "{}",
        scores.coverage
    );
    assert!(
        scores.force_error_n.unwrap() < 0.6,
        "{:?}",
        scores.force_error_n
    );
    assert!(
        scores.by_force.iter().map(|r| r.touches).sum::<usize>() == trained.division.test.len()
    );
    assert!(
        trained
            .notes
            .iter()
            .any(|n| n.contains("1 channel reads the same"))
    );
    // The process knows which channels count; its nearest neighbours do not.
    let of = |family| {
        trained
            .tried
            .iter()
            .find(|t| t.estimator == Method::from(family))
            .unwrap()
            .validation_mm
    };
    assert!(of(Family::GaussianProcess) < of(Family::Nearest));
}

#[test]
fn units_of_readings_and_places_change_nothing() {
    let plain = skin(6, 200);
    for family in Family::ALL {
        let error = |x: f64, places: f64| {
            let scaled = Skin {
                x: plain.x.scaled(x),
                places_mm: plain
                    .places_mm
                    .iter()
                    .map(|p| p.map(|v| v * places))
                    .collect(),
                forces: Vec::new(),
            };
            let trained = scaled.train(&only(family));
            [trained.validation_mm, trained.scores.mean_mm].map(|mm| mm / places)
        };
        let wanted = error(1.0, 1.0);
        for (x, places) in [(1e-6, 1.0), (1e6, 1.0), (1.0, 0.01), (1.0, 100.0)] {
            let found = error(x, places);
            for (found, wanted) in found.iter().zip(wanted) {
                assert!(
                    (found / wanted - 1.0).abs() < 0.01,
                    "{family:?} {x} {places}: {found} {wanted}"
                );
            }
        }
    }
}

#[test]
fn more_touches_teach_more_and_the_same_seed_the_same() {
    let skin = skin(8, 500);
    let with = |touches: usize| {
        let asked = TrainingRequest {
            train_touches: Some(touches),
            ..only(Family::KernelRidge)
        };
        skin.train(&asked)
    };
    let (few, many) = (with(40), with(400));
    assert_eq!(few.division.test, many.division.test);
    assert!(few.scores.mean_mm > 1.5 * many.scores.mean_mm);
    assert_eq!(few, with(40));
}

#[test]
fn the_same_bytes_come_of_any_number_of_threads() {
    let skin = skin(5, 150);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| skin.train(&TrainingRequest::default()))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn answers_on_a_flat_skin_lie_in_its_plane() {
    let mut skin = skin(8, 200);
    for p in &mut skin.places_mm {
        p[1] = 12.0 + 0.5 * p[0];
    }
    let trained = skin.train(&only(Family::GaussianProcess));
    for answer in trained.estimator.find(&skin.x) {
        let [x, y, _] = answer.place_mm;
        assert!((y - 12.0 - 0.5 * x).abs() < 1e-6);
    }
}

fn hapdef(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn the_program_trains_and_predicts_and_says_what_it_cannot() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (data, model, other) = (path("d.npz"), path("m.hapdtouch"), path("other.npz"));
    skin(6, 200).save(Path::new(&data));
    skin(7, 60).save(Path::new(&other));
    let json = |arguments: &[&str]| -> Value {
        let output = hapdef(arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let trained = json(&[
        "train",
        "--data",
        &data,
        "--out",
        &model,
        "--estimator",
        "kernel-ridge",
        "--seed",
        "3",
        "--json",
    ]);
    assert_eq!(trained["estimator"], "kernel-ridge");
    assert_eq!(trained["train_touches"], 160);
    for key in [
        "validation_mm",
        "test_mm",
        "median_mm",
        "p95_mm",
        "force_error_n",
        "coverage",
        "cpu_seconds",
    ] {
        assert!(trained[key].is_number(), "{key}: {trained}");
    }
    let answers = path("p.csv");
    let predicted = json(&[
        "predict", "--model", &model, "--data", &data, "--out", &answers, "--json",
    ]);
    assert!(predicted["notes"].to_string().contains("no test of it"));
    let table = std::fs::read_to_string(&answers).unwrap();
    assert!(table.starts_with("x_mm,y_mm,z_mm,radius_mm,force_n\n"));
    assert_eq!(table.lines().count(), 201);

    for (arguments, words) in [
        (
            vec!["predict", "--model", &model, "--data", &other],
            "trained on 6 channels",
        ),
        (
            vec!["predict", "--model", &data, "--data", &data],
            "no trained estimator",
        ),
        (
            vec!["train", "--data", &data, "--out", &data],
            "this is the dataset",
        ),
        (
            vec![
                "train",
                "--data",
                &other,
                "--out",
                &model,
                "--train-touches",
                "50",
            ],
            "48 touches",
        ),
        (
            vec![
                "train", "--data", &other, "--out", &model, "--groups", "nobody",
            ],
            "nobody",
        ),
    ] {
        let output = hapdef(&arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            !output.status.success() && said.contains(words),
            "{arguments:?}: {said}"
        );
    }
}
