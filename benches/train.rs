//! Estimators learned from measured skins: `cargo bench --bench train -- FOLDER` trains on every NPZ in the folder (the
//! measured touches are nobody's to ship, so they are not in the repository), prints the tables and writes them to
//! `benches/train.md`, which `RESULTS.md` takes in (`cargo bench --bench results -- assemble`).

mod timing;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use hapdef::budget::unwatched;
use hapdef::dataset::SignalMatrix;
use hapdef::io::dataset_file;
use hapdef::learning::{
    Family, MeasuredTouches, Scores, Still, TrainedEstimator, TrainingRequest, train, update,
};
use hapdef::regression::Grouping;
use hapdef::study::Data;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use timing::{cpu_seconds, reference_seconds};

const FILE: &str = "benches/train.md";
/// Points of the learning curve, as far as a skin has so many.
const CURVE: [usize; 5] = [100, 300, 1000, 2000, 3000];
/// Divisions that the whole is trained on.
const SEEDS: u64 = 3;

fn main() {
    let folder = std::env::args().skip(1).find(|a| !a.starts_with("--"));
    let Some(folder) = folder else {
        println!("name the folder of the measured skins: cargo bench --bench train -- FOLDER");
        return;
    };
    let mut text = format!(
        "## Learned from measured skins\n\nRemade by `cargo bench --bench train -- FOLDER`; the skins are not in the repository. Places are divided 80/10/10 by a seed, touches of one place never; errors are distances in all coordinates that vary. A 4000 × 4000 matrix product on one core took {:.1} s beside it.\n",
        reference_seconds()
    );
    for path in skins(Path::new(&folder)) {
        text += &skin(&path);
        text += &wear(&path);
    }
    println!("{text}");
    std::fs::write(FILE, &text).expect("the figures can be written");
}

fn skins(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the folder can be read");
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "npz"));
    paths.sort();
    paths
}

/// Families and a learning curve on one skin.
fn skin(path: &Path) -> String {
    let data = dataset_file::read(path, None)
        .expect("a dataset with places")
        .data;
    let groups = Grouping::Place.of(&data.targets);
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut text = format!(
        "\n### {name}: {} channels, {} touches\n\n| learned from | seed | estimator | validation | mean | median | 95 % (mm) | within the radius | CPU s |\n|---:|---:|---|---:|---:|---:|---:|---:|---:|\n",
        data.x.rows(),
        data.targets.len()
    );
    let asked = |family, seed, train_touches| TrainingRequest {
        family,
        seed,
        train_touches,
    };
    let every = Family::ALL.map(|family| asked(Some(family), 0, None));
    let seeds = (0..SEEDS).map(|seed| asked(None, seed, None));
    let most = data.targets.len() * 7 / 10;
    let curve = CURVE.into_iter().filter(|&n| n <= most);
    let curve = curve.map(|n| asked(None, 0, Some(n)));
    for asked in every.into_iter().chain(curve).chain(seeds) {
        text += &row(&data, &groups, &asked);
        eprint!(".");
    }
    text
}

fn row(data: &Data, groups: &[usize], asked: &TrainingRequest) -> String {
    let lessons = MeasuredTouches {
        x: &data.x,
        places_mm: &data.targets,
        forces: &data.forces,
        groups,
    };
    let before = cpu_seconds();
    let trained: TrainedEstimator =
        train(&lessons, asked, &unwatched).expect("enough to learn from");
    let seconds = cpu_seconds() - before;
    let by = if asked.family.is_some() {
        ""
    } else {
        " (chosen)"
    };
    let scores = &trained.scores;
    let mut line = String::new();
    let _ = writeln!(
        line,
        "| {} | {} | {}{by} | {:.3} | **{:.3}** | {:.3} | {:.3} | {:.0} % | {seconds:.0} |",
        trained.division.train.len(),
        asked.seed,
        trained.family.name(),
        trained.validation_mm,
        scores.mean_mm,
        scores.median_mm,
        scores.p95_mm,
        100.0 * scores.coverage
    );
    line
}

/// A skin that has worn since it was trained on: every channel's gain off by 15 % and its rest by 0.3 of its spread (standard
/// deviations, drawn by a seed), brought up to date by a few presses and judged by others.
fn wear(path: &Path) -> String {
    const FEW: [usize; 3] = [10, 20, 50];
    let data = dataset_file::read(path, None)
        .expect("a dataset with places")
        .data;
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut order: Vec<usize> = (0..data.targets.len()).collect();
    for k in (1..order.len()).rev() {
        order.swap(k, rng.random_range(0..=k));
    }
    let (known, others) = order.split_at(order.len() / 2);
    let worn = worn(&data.x, &mut rng);
    let old = learned(&data.x, &data, known);
    let mut text = String::from(
        "\nWorn (gains ±15 %, rests ±0.3 of the spread), trained on half, judged on presses that nobody has learned from:\n\n| presses | believed to be as it was | before (mm) | after (mm) | within the radius after | CPU s |\n|---:|---|---:|---:|---:|---:|\n",
    );
    for few in FEW {
        let (presses, judged) = others.split_at(few);
        let before = cpu_seconds();
        let (x, places, groups) = some(&worn, &data, presses);
        let lessons = MeasuredTouches {
            x: &x,
            places_mm: &places,
            forces: &[],
            groups: &groups,
        };
        let found = update(&old.estimator, &lessons, 0, &unwatched).expect("enough presses");
        let seconds = cpu_seconds() - before;
        let still = Still::of(
            &old.estimator.known_ratios(),
            &old.estimator.find(&x),
            &places,
        );
        let (x, places, _) = some(&worn, &data, judged);
        let score = |of: &hapdef::learning::TouchEstimator| Scores::of(&of.find(&x), &places, &[]);
        let (was, now) = (score(&old.estimator), score(&found.estimator));
        let believed = still.is_some_and(|s| s.holds());
        let _ = writeln!(
            text,
            "| {few} | {} | {:.3} | **{:.3}** | {:.0} % | {seconds:.0} |",
            if believed { "yes" } else { "no" },
            was.mean_mm,
            now.mean_mm,
            100.0 * now.coverage
        );
    }
    text
}

fn learned(x: &SignalMatrix, data: &Data, touches: &[usize]) -> TrainedEstimator {
    let (x, places, groups) = some(x, data, touches);
    let lessons = MeasuredTouches {
        x: &x,
        places_mm: &places,
        forces: &[],
        groups: &groups,
    };
    train(&lessons, &TrainingRequest::default(), &unwatched).expect("enough to learn from")
}

fn some(
    x: &SignalMatrix,
    data: &Data,
    touches: &[usize],
) -> (SignalMatrix, Vec<[f64; 3]>, Vec<usize>) {
    let places: Vec<[f64; 3]> = touches.iter().map(|&t| data.targets[t]).collect();
    let groups = Grouping::Place.of(&places);
    (x.select_columns(touches), places, groups)
}

fn worn(x: &SignalMatrix, rng: &mut ChaCha8Rng) -> SignalMatrix {
    let mut normal = || -> f64 { rng.sample(rand_distr::StandardNormal) };
    let mut values = Vec::with_capacity(x.values().len());
    for channel in 0..x.rows() {
        let row = x.row(channel);
        let mut sorted = row.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted[sorted.len() / 2];
        let mut off: Vec<f64> = row.iter().map(|v| (v - middle).abs()).collect();
        off.sort_by(f64::total_cmp);
        let spread = off[off.len() / 2];
        let (gain, rest) = ((0.15 * normal()).exp(), 0.3 * spread * normal());
        values.extend(row.iter().map(|v| gain * v + rest));
    }
    SignalMatrix::new(x.columns(), values)
}
