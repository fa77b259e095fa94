//! Estimators learned from measured skins: `cargo bench --bench train -- FOLDER` trains on every NPZ in the folder (the
//! measured touches are nobody's to ship, so they are not in the repository), prints the tables and writes them to
//! `benches/train.md`, which `RESULTS.md` takes in (`cargo bench --bench results -- assemble`).

mod timing;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use hapdef::budget::unwatched;
use hapdef::io::dataset_file;
use hapdef::learning::{Asked, Family, Lessons, Trained, train};
use hapdef::regression::Grouping;
use hapdef::study::Data;
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
    let asked = |family, seed, train_touches| Asked {
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

fn row(data: &Data, groups: &[usize], asked: &Asked) -> String {
    let lessons = Lessons {
        x: &data.x,
        places_mm: &data.targets,
        forces: &data.forces,
        groups,
    };
    let before = cpu_seconds();
    let trained: Trained = train(&lessons, asked, &unwatched).expect("enough to learn from");
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
