use std::path::Path;
use std::sync::Arc;

use super::{TouchFile, TrainingOrigin, read, write};
use crate::budget::unwatched;
use crate::dataset::SignalMatrix;
use crate::design::{Learned, Taught, TaughtKnowledge, TrainingOutcome};
use crate::inference::ResponseMap;
use crate::io::npz::NpzFile;
use crate::learning::{Family, MeasuredTouches, TrainingRequest, train};
use crate::mesh::TriMesh;

/// Four channels that feel what is near them, on a flat skin, pressed at random.
fn touched() -> (SignalMatrix, Vec<[f64; 3]>, Vec<f64>) {
    let draw = |k: usize, by: f64| (k as f64 * by).fract();
    let places: Vec<[f64; 3]> = (1..=120)
        .map(|k| [40.0 * draw(k, 0.754_877), 30.0 * draw(k, 0.569_840), 2.0])
        .collect();
    let forces: Vec<f64> = (1..=120).map(|k| 1.0 + 9.0 * draw(k, 0.618_034)).collect();
    let corners = [[0.0, 0.0], [40.0, 0.0], [0.0, 30.0], [40.0, 30.0]];
    let values = corners.iter().flat_map(|c| {
        (places.iter().zip(&forces)).map(|(p, force)| {
            let squared = (p[0] - c[0]).powi(2) + (p[1] - c[1]).powi(2);
            force * (-squared / 900.0).exp()
        })
    });
    (SignalMatrix::new(120, values.collect()), places, forces)
}

fn trained(family: Family) -> TrainingOutcome {
    let (x, places_mm, forces) = touched();
    let groups: Vec<usize> = (0..120).collect();
    let lessons = MeasuredTouches {
        x: &x,
        places_mm: &places_mm,
        forces: &forces,
        groups: &groups,
    };
    let asked = TrainingRequest {
        family: Some(family),
        ..TrainingRequest::default()
    };
    train(&lessons, &asked, &unwatched).unwrap().into()
}

fn origin(trained: &TrainingOutcome) -> TrainingOrigin {
    TrainingOrigin {
        data: "d.npz".into(),
        fingerprint: "00".into(),
        touches: 120,
        train_touches: trained.division.train.len(),
        seed: 0,
        estimator: trained.method,
        validation_mm: trained.validation_mm,
        tried: trained.tried.clone(),
        test: trained.scores.clone(),
        limb: Some("finger".into()),
        board: None,
        update: None,
    }
}

/// The message of a file that is refused.
fn refused(path: &Path) -> String {
    read(path).expect_err("it is no estimator").to_string()
}

#[test]
fn an_estimator_comes_back_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.hapdtouch");
    for family in [Family::Nearest, Family::KernelRidge] {
        let trained = trained(family);
        write(&path, origin(&trained), &trained.estimator).unwrap();
        let TouchFile { header, estimator } = read(&path).unwrap();
        let (Learned::Regression(read), Learned::Regression(written)) =
            (&estimator, &trained.estimator)
        else {
            panic!("another kind came back");
        };
        assert_eq!(read, written);
        assert_eq!(header.origin, origin(&trained));
        let (x, ..) = touched();
        assert_eq!(estimator.find(&x), trained.estimator.find(&x));
        assert!(estimator.find(&x)[0].force_n.is_some());
    }
}

/// Matching on one triangle.
fn taught() -> Learned {
    const CHANNELS: usize = 4;
    let corners = [
        glam::DVec3::ZERO,
        glam::DVec3::X * 0.01,
        glam::DVec3::Y * 0.01,
    ];
    let (mesh, _) = TriMesh::new(&corners, &[[0, 1, 2]], 0).unwrap();
    let mesh = Arc::new(mesh);
    let map = |size: f64, by: f64| {
        let value = |k: usize| size * (1.1 + (by * (k + 1) as f64).sin());
        let values = (0..6 * CHANNELS).map(value).collect();
        ResponseMap::of(Arc::clone(&mesh), CHANNELS, values)
    };
    Learned::Matching(Box::new(Taught {
        map: Arc::new(map(1e-5, 1.7)),
        own: Arc::new(map(1e-7, 2.3)),
        tip: Some(Arc::new(map(1e-4, 0.3))),
        axes: Some(Arc::new([0.4, 0.5, 0.6].map(|by| map(1e-5, by)))),
        known: TaughtKnowledge {
            noise: 1e-7,
            relative: 0.01,
            most_force: 60.0,
            tip: 5e-4,
            friction: 0.25,
            drift: 1e-7,
            stiffness: 0.1,
            remainder: None,
        },
        ratios: vec![0.25, 0.5, 1.5],
    }))
}

#[test]
fn matching_comes_back_to_the_last_bit_and_what_is_damaged_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.hapdtouch");
    let (x, ..) = touched();
    // As strains.
    let values = x.values().iter().map(|v| v * 1e-5).collect();
    let x = SignalMatrix::new(x.columns(), values);
    let estimator = taught();
    let origin = origin(&trained(Family::Nearest));
    write(&path, origin.clone(), &estimator).unwrap();
    let file = read(&path).unwrap();
    assert_eq!(file.header.origin, origin);
    assert_eq!(file.estimator.find(&x), estimator.find(&x));
    assert_eq!(file.estimator.known_ratios(), estimator.known_ratios());
    let first = std::fs::read(&path).unwrap();
    write(&path, origin.clone(), &file.estimator).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), first);

    let Learned::Matching(mut broken) = estimator else {
        unreachable!()
    };
    broken.known.friction = -1.0;
    write(&path, origin.clone(), &Learned::Matching(broken.clone())).unwrap();
    assert!(refused(&path).contains("the friction is -1"));
    broken.known.friction = 0.0;
    let mut values = broken.own.values().to_vec();
    values[3] = -1e-9;
    broken.own = Arc::new(ResponseMap::of(Arc::clone(&broken.map.mesh), 4, values));
    write(&path, origin, &Learned::Matching(broken)).unwrap();
    assert!(refused(&path).contains("map of readings is damaged"));
}

#[test]
fn other_boards_are_refused_with_both_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.hapdtouch");
    let trained = trained(Family::Nearest);
    write(&path, origin(&trained), &trained.estimator).unwrap();
    let file = read(&path).unwrap();
    assert_eq!(file.check_channels(4), Ok(()));
    let said = file.check_channels(6).unwrap_err();
    assert!(
        said.contains("4 channels") && said.contains("6 here"),
        "{said}"
    );
}

#[test]
fn wrong_versions_cut_files_and_other_archives_are_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.hapdtouch");
    let header = |text: &str| {
        let mut file = NpzFile::default();
        file.add("header", &[text.len()], text.as_bytes()).unwrap();
        std::fs::write(&path, file.finish().unwrap()).unwrap();
        refused(&path)
    };
    let said = header(r#"{"format": "hapdtouch", "version": 9}"#);
    assert!(
        said.contains("version 9") && said.contains("versions 1 and 2"),
        "{said}"
    );
    let said = header(r#"{"format": "hapdrec", "version": 1}"#);
    assert!(said.contains("“hapdrec”"), "{said}");
    let said = header("{");
    assert!(said.contains("damaged"), "{said}");

    let mut other = NpzFile::default();
    other.add("X", &[1], &[1.0]).unwrap();
    std::fs::write(&path, other.finish().unwrap()).unwrap();
    assert!(refused(&path).contains("no header"));

    let trained = trained(Family::Nearest);
    write(&path, origin(&trained), &trained.estimator).unwrap();
    let whole = std::fs::read(&path).unwrap();
    for length in [0, 10, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(refused(&path).contains("m.hapdtouch"));
    }
}
