//! The selectors measured: `cargo bench --bench selection` writes `benches/selection.md`, which
//! `RESULTS.md` takes in. With names of sections behind `--` it makes only those anew.

mod timing;

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::time::Instant;

use hapdef::budget::{Quality, unwatched};
use hapdef::dataset::{Signal, SignalMatrix};
use hapdef::design::{self, Simulated};
use hapdef::gaussian_process::{self, Covariance, Distances, GpKernel};
use hapdef::mesh::{SurfacePoint, geodesic};
use hapdef::placement::candidates::{Reduction, reduce};
use hapdef::placement::entropy::Entropy;
use hapdef::placement::greedy_svr::{Audit, Comparison, GreedySvr, TOLERANCE};
use hapdef::placement::information::Geometry;
use hapdef::placement::mutual_information::MutualInformation;
use hapdef::placement::pca_qr::PcaQr;
use hapdef::placement::{Constraints, Pool, Selection, SelectionRequest, Selector};
use hapdef::regression::folds::evenly;
use hapdef::regression::tune::Effort;
use hapdef::regression::{Grouping, Hyper};
use timing::{cpu_seconds, reference_seconds};

const FILE: &str = "benches/selection.md";

/// Targets in metres, C 20, ε 1e-6, γ 2e-3.
const PAPER: Hyper = Hyper {
    c: 20_000.0,
    epsilon: 1e-3,
    gamma: 2e-3,
};
const TUNED: Hyper = Hyper {
    c: 200.0,
    epsilon: 0.1,
    gamma: 0.1,
};

type Both<'a> = [(&'a str, &'a Signals); 2];
/// A word to ask for it by, its heading, and what it measures.
type Section = (&'static str, &'static str, fn(&mut String, &Both));

const SECTIONS: [Section; 5] = [
    ("full-size", "Greedy SVR at full size", full_size),
    (
        "exhaustive",
        "Greedy SVR against the plain algorithm",
        exhaustive,
    ),
    ("others", "The other selectors", others),
    ("cancel", "Cancelling", cancel),
    ("trade", "The trade of selecting", trade),
];

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let named = |word: &str| asked.iter().any(|a| a == word);
    let every = !SECTIONS.iter().any(|s| named(s.0));
    let reference = reference_seconds();
    let strain = Signals::new(Signal::Strain);
    let displacement = Signals::new(Signal::Displacement);
    let both = [("strain", &strain), ("displacement", &displacement)];
    let old = std::fs::read_to_string(FILE).unwrap_or_default();
    let mut text = format!(
        "The figures of the selectors are remade by `cargo bench --bench selection` (about an hour on two cores, nearly all of it the exact fits of what was *not* chosen). Processor seconds of one core; a 4000 × 4000 matrix product on one core took {reference:.1} s beside them. Data: the bundled limb at Standard, seed 0.\n\n"
    );
    for (word, heading, measure) in SECTIONS {
        let kept = old.split("\n## ").find(|part| part.starts_with(heading));
        match kept {
            Some(kept) if !every && !named(word) => {
                let _ = write!(text, "## {}\n\n", kept.trim_end());
            }
            _ => {
                eprintln!("{word}");
                let _ = write!(text, "## {heading}\n\n");
                measure(&mut text, &both);
            }
        }
    }
    println!("{text}");
    std::fs::write(FILE, text).expect("the figures can be written");
}

/// A simulated limb with its targets.
struct Signals {
    simulated: Simulated,
    feasible: Vec<usize>,
    targets: Vec<[f64; 3]>,
}

/// What a selector chooses from.
struct Part {
    x: SignalMatrix,
    targets: Vec<[f64; 3]>,
    sites: Vec<usize>,
}

impl Part {
    fn pool(&self) -> Pool<'_> {
        Pool {
            x: &self.x,
            targets: &self.targets,
            sites: &self.sites,
            positions: &[],
        }
    }
}

impl Signals {
    fn new(signal: Signal) -> Self {
        let mut inputs = hapdef::cli::bundled()
            .expect("the bundled limb loads")
            .inputs;
        inputs.project.gauge.signal = signal;
        let budget = Quality::Standard.budget();
        let simulated = design::simulate(&inputs, &budget, &unwatched).expect("the limb simulates");
        Self {
            feasible: design::filter(&inputs, &simulated).sites(),
            targets: simulated.dataset.targets_mm(),
            simulated,
        }
    }

    /// So many candidates by the reduction, and so many touches evenly taken.
    fn part(&self, candidates: usize, touches: usize) -> Part {
        let x = self.simulated.dataset.x.select_rows(&self.feasible);
        let kept = reduce(&x, Reduction::Count(candidates), usize::MAX, &unwatched)
            .expect("candidates")
            .rows;
        let columns = evenly(self.targets.len(), touches);
        Part {
            x: x.select_rows(&kept).select_columns(&columns),
            targets: columns.iter().map(|&t| self.targets[t]).collect(),
            sites: (0..kept.len()).collect(),
        }
    }
}

fn svr(hyper: Hyper) -> GreedySvr {
    GreedySvr {
        hyper,
        folds: 5,
        seed: 0,
        grouping: Grouping::Touch,
        effort: Effort {
            tolerance: 0.05,
            max_steps: 1_000_000,
        },
        tolerance: TOLERANCE,
        landmarks: 1.0,
    }
}

/// The result and what it took on one core.
fn on_one_core<T: Send>(work: impl FnOnce() -> T + Send) -> (T, f64) {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread starts");
    let before = cpu_seconds();
    let result = pool.install(work);
    (result, cpu_seconds() - before)
}

fn choose(selector: &(dyn Selector + Sync), part: &Part, sensors: usize) -> (Selection, f64) {
    on_one_core(|| {
        let request = SelectionRequest {
            constraints: &Constraints::count(sensors),
            watch: &unwatched,
            found: &|_| (),
        };
        selector
            .select(&part.pool(), &request)
            .expect("sites are chosen")
    })
}

/// The worst step, in words.
fn worst(steps: &[Comparison]) -> String {
    let excess = steps.iter().map(Comparison::excess);
    let worst = excess.fold(f64::NEG_INFINITY, f64::max);
    let compared: usize = steps.iter().map(|s| s.compared).sum();
    let departure = steps.iter().map(|s| s.departure).fold(0.0, f64::max);
    let exact = if steps.iter().all(|s| s.converged) {
        ""
    } else {
        " (some fits stopped at the steps allowed)"
    };
    format!(
        "{compared} compared{exact}: the choice against the best other {:+.2} % at worst | {:.2} %",
        100.0 * worst,
        100.0 * departure
    )
}

fn full_size(text: &mut String, both: &Both) {
    let _ = writeln!(
        text,
        "407 candidates × 4000 touches, 10 gauges, 5 folds, 3 outputs. The paper's setting: targets in metres, C 20, ε 1e-6, γ 2e-3 (limit 60 s); the tuned one: targets in mm, C 200, ε 0.1, γ 0.1 (limit 300 s). Gap: by how much a step could have been better by the screens' own account. Then, at every step, the 20 most promising and 20 random sites that were not chosen, fitted exactly: a minus says that the choice was the best of all. The last screen is quoted with the landmarks it begins with; a run gives it more where it departs.\n\n| signals | setting | seconds | criterion at 5, 10 (mm) | fitted exactly | largest gap | check | last screen departs |\n|---|---|---|---|---|---|---|---|"
    );
    let audit = Audit {
        top: 20,
        random: 20,
        seed: 1,
    };
    for &(name, signals) in both {
        let part = signals.part(407, 4000);
        for (setting, hyper) in [("paper", PAPER), ("tuned", TUNED)] {
            eprintln!("full size: {name}, {setting}");
            let svr = svr(hyper);
            let (chosen, seconds) = choose(&svr, &part, 10);
            let sets = &chosen.sets;
            let gap = sets.iter().filter_map(|s| s.gap).fold(0.0, f64::max);
            // The tuned fits are dear: one set of signals will do.
            let checked = if setting == "tuned" && name != "strain" {
                "– | –".to_owned()
            } else {
                let steps = svr
                    .audit(&part.pool(), &sets[9].sites, audit, &unwatched)
                    .expect("nobody cancels");
                worst(&steps)
            };
            let _ = writeln!(
                text,
                "| {name} | {setting} | {seconds:.0} | {:.2}, {:.2} | {} | {:.2} % | {checked} |",
                sets[4].criterion.unwrap_or(f64::NAN),
                sets[9].criterion.unwrap_or(f64::NAN),
                chosen.achieved.effort.fits / 15,
                100.0 * gap
            );
            eprintln!("{}", text.lines().next_back().unwrap_or_default());
        }
    }
    text.push('\n');
}

fn exhaustive(text: &mut String, both: &Both) {
    let _ = writeln!(
        text,
        "60 candidates × 800 touches, 10 gauges: at every step *every* other site fitted exactly. `benches/sklearn_criterion.py` does the same with scikit-learn on any dataset.\n\n| signals | setting | seconds | largest gap | check | last screen departs |\n|---|---|---|---|---|---|"
    );
    let all = Audit {
        top: 60,
        random: 0,
        seed: 0,
    };
    for &(name, signals) in both {
        let part = signals.part(60, 800);
        for (setting, hyper) in [("paper", PAPER), ("tuned", TUNED)] {
            eprintln!("exhaustive: {name}, {setting}");
            let svr = svr(hyper);
            let (chosen, seconds) = choose(&svr, &part, 10);
            let gap = chosen.sets.iter().filter_map(|s| s.gap).fold(0.0, f64::max);
            let steps = svr
                .audit(&part.pool(), &chosen.sets[9].sites, all, &unwatched)
                .expect("nobody cancels");
            let _ = writeln!(
                text,
                "| {name} | {setting} | {seconds:.1} | {:.2} % | {} |",
                100.0 * gap,
                worst(&steps)
            );
        }
    }
    text.push('\n');
}

fn others(text: &mut String, both: &Both) {
    let _ = writeln!(
        text,
        "| selector | size | seconds | limit |\n|---|---|---|---|"
    );
    for &(name, signals) in both {
        let rows = evenly(signals.simulated.dataset.x.rows(), 2162);
        let part = Part {
            x: signals.simulated.dataset.x.select_rows(&rows),
            targets: signals.targets.clone(),
            sites: (0..rows.len()).collect(),
        };
        for sensors in [10, 407] {
            let (chosen, seconds) = choose(&PcaQr, &part, sensors);
            let placed = chosen.sets.last().map_or(0, |s| s.sites.len());
            let _ = writeln!(
                text,
                "| PCA-QR, {name} | 2162 sites × 4000 touches, {placed} gauges ({} numbers of gauges, each chosen anew) | {seconds:.2} | {} |",
                chosen.sets.len(),
                if sensors == 407 { "2" } else { "" }
            );
        }
    }
    let (part, geometry) = informed(text, both[0].1);
    let entropy = Entropy {
        geometry: &geometry,
    };
    let information = MutualInformation {
        geometry: &geometry,
    };
    let selectors: [(&str, &(dyn Selector + Sync)); 2] =
        [("entropy", &entropy), ("mutual information", &information)];
    for (name, selector) in selectors {
        let (_, seconds) = choose(selector, &part, 30);
        let _ = writeln!(
            text,
            "| {name} | 2162 feasible of 3000 locations, 30 gauges | {seconds:.2} | 1.5 |"
        );
    }
    text.push('\n');
}

/// 3000 locations on the limb with a kernel found by search, 2162 of them feasible.
fn informed(text: &mut String, signals: &Signals) -> (Part, Geometry) {
    let all = evenly(signals.simulated.points.len(), 3000);
    let feasible = evenly(all.len(), 2162);
    let mut inside = vec![false; all.len()];
    for &k in &feasible {
        inside[k] = true;
    }
    let rest = (0..all.len()).filter(|&k| !inside[k]);
    let order: Vec<usize> = feasible
        .iter()
        .copied()
        .chain(rest)
        .map(|k| all[k])
        .collect();
    let places: Vec<SurfacePoint> = order.iter().map(|&s| signals.simulated.points[s]).collect();
    let x = signals.simulated.dataset.x.select_rows(&order[..2162]);
    let mesh = &signals.simulated.mesh;
    let (measured, distance_seconds) =
        on_one_core(|| geodesic::between(mesh, &places, &unwatched).expect("nobody cancels"));
    let distances = Distances::new(places.len(), "over the surface", &measured);
    let noise = GpKernel::default().noise;
    let (map, search_seconds) = on_one_core(|| {
        gaussian_process::search(&x, &distances, noise, &unwatched).expect("nobody cancels")
    });
    let kernel = gaussian_process::best(&map).unwrap_or_default();
    let (covariance, seconds) =
        on_one_core(|| Covariance::new(&distances, &kernel, &unwatched).expect("nobody cancels"));
    for (what, seconds) in [
        ("distances over the surface, all pairs", distance_seconds),
        ("search of the kernel, by cross-validation", search_seconds),
        ("covariance of all locations", seconds),
    ] {
        let _ = writeln!(text, "| {what} | 3000 locations | {seconds:.2} | |");
    }
    let geometry = Geometry {
        covariance,
        kernel,
        distance: distances.kind,
        coinciding: 0,
        map,
    };
    let part = Part {
        x,
        targets: signals.targets.clone(),
        sites: (0..2162).collect(),
    };
    (part, geometry)
}

/// How long a stop takes to be heard.
fn cancel(text: &mut String, both: &Both) {
    let part = both[0].1.part(407, 4000);
    let svr = svr(TUNED);
    let mut waits = Vec::new();
    for after in [0.05, 0.4, 2.0, 6.0, 15.0, 30.0, 45.0] {
        let started = Instant::now();
        let watch = |_| {
            if started.elapsed().as_secs_f64() < after {
                return ControlFlow::Continue(());
            }
            ControlFlow::Break(())
        };
        let request = SelectionRequest {
            constraints: &Constraints::count(10),
            watch: &watch,
            found: &|_| (),
        };
        if svr.select(&part.pool(), &request).is_err() {
            waits.push(1e3 * (started.elapsed().as_secs_f64() - after));
        }
    }
    let cells: Vec<String> = waits.iter().map(|w| format!("{w:.0}")).collect();
    let _ = writeln!(
        text,
        "Greedy SVR at full size, the tuned setting, told to stop after 0.05 to 45 s: it had ended {} ms later (by the clock, on all cores; limit 100).\n",
        cells.join(", ")
    );
}

fn trade(text: &mut String, both: &Both) {
    const SENSORS: usize = 6;
    let signals = both[0].1;
    let _ = writeln!(
        text,
        "Greedy SVR on strain, {SENSORS} gauges, the tuned setting. Each line changes one thing of the first. The error is always the same one: cross-validated in five folds over 4000 touches, fitted exactly. Landmarks are the rank of the screens' features; a choice may be worse than the best by the tolerance.\n\n| changed | seconds | error (mm) | fitted exactly |\n|---|---|---|---|"
    );
    let judge = svr(TUNED);
    let kept = |count: usize| signals.part(count, 4000);
    let mut line = |what: &str, settings: &GreedySvr, candidates: usize, touches: usize| {
        eprintln!("trade: {what}");
        let large = kept(candidates);
        let columns = evenly(large.targets.len(), touches);
        let part = Part {
            x: large.x.select_columns(&columns),
            targets: columns.iter().map(|&t| large.targets[t]).collect(),
            sites: large.sites.clone(),
        };
        let (chosen, seconds) = choose(settings, &part, SENSORS);
        let sites = chosen.sets[SENSORS - 1].sites.clone();
        let error = judge
            .criteria(&large.pool(), &[sites], &unwatched)
            .expect("nobody cancels")[0];
        let _ = writeln!(
            text,
            "| {what} | {seconds:.1} | {error:.2} | {} |",
            chosen.achieved.effort.fits / (3 * settings.folds as u64)
        );
    };
    let plain = svr(TUNED);
    line(
        "200 candidates, 2000 touches, 5 folds, landmarks × 1, tolerance 0.2 %",
        &plain,
        200,
        2000,
    );
    for landmarks in [0.25, 0.5, 2.0] {
        let settings = GreedySvr { landmarks, ..plain };
        line(&format!("landmarks × {landmarks}"), &settings, 200, 2000);
    }
    for tolerance in [0.0, 0.02, 0.1] {
        let settings = GreedySvr { tolerance, ..plain };
        let what = format!("tolerance {:.1} %", 100.0 * tolerance);
        line(&what, &settings, 200, 2000);
    }
    for folds in [3, 10] {
        line(
            &format!("{folds} folds"),
            &GreedySvr { folds, ..plain },
            200,
            2000,
        );
    }
    for touches in [500, 1000, 4000] {
        line(&format!("{touches} touches"), &plain, 200, touches);
    }
    for candidates in [25, 50, 100, 407] {
        line(
            &format!("{candidates} candidates"),
            &plain,
            candidates,
            2000,
        );
    }
    text.push('\n');
}
