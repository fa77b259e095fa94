//! How long studies of a thousand and of a hundred thousand designs take on one, ten and a thousand workers:
//! `cargo bench --bench scale -- DIR/costs.csv`, with what the units of a study that was really computed took.
//!
//! An event simulation. A worker is one core and computes tasks of as many units as one simulation serves. The engine hands out
//! one task after another; the file system that all share serves one operation after another. Whichever is busy is waited for.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Units of a task, as `hapdef study submit` makes them of a grid whose last axis has five values.
const TOGETHER: usize = 5;
/// What the engine takes to hand out a task (s): 2000 tasks that do nothing, by `HyperQueue` 0.27 on one machine of two cores, their
/// processes included.
const OVERHEAD_S: f64 = 0.002;
/// Operations of a unit on the study's folder (`strace`: 94 of five units, 20 of them to have files on the disk), and how many a file server does in a second: what
/// one with mechanical disks is good for.
const OPERATIONS: f64 = 19.0;
const A_SECOND: f64 = 2000.0;
const UNITS: [usize; 2] = [1_000, 100_000];
const WORKERS: [usize; 3] = [1, 10, 1_000];

fn main() {
    let path = std::env::args().skip(1).find(|a| a.ends_with("costs.csv"));
    let Some(path) = path else {
        println!(
            "name the costs.csv of a study that was computed: cargo bench --bench scale -- DIR/costs.csv"
        );
        return;
    };
    let costs = costs(&std::fs::read_to_string(&path).expect("the file can be read"));
    let mean = costs.iter().sum::<f64>() / costs.len() as f64;
    println!(
        "{} units took {mean:.2} processor s each, {:.2} to {:.2}\n",
        costs.len(),
        costs.iter().copied().fold(f64::INFINITY, f64::min),
        costs.iter().copied().fold(0.0, f64::max)
    );
    println!(
        "| designs | workers | takes | share of the time that workers compute | engine, file system busy |"
    );
    println!("|---|---|---|---|---|");
    for units in UNITS {
        for workers in WORKERS {
            let run = run(&costs, units, workers);
            let computed: f64 = (0..units).map(|k| costs[k % costs.len()]).sum();
            println!(
                "| {units} | {workers} | {} | {:.0} % | {:.0} %, {:.0} % |",
                in_words(run.end),
                100.0 * computed / (run.end * workers as f64),
                100.0 * run.engine / run.end,
                100.0 * run.files / run.end
            );
        }
    }
    let of_task = TOGETHER as f64 * mean;
    let of_unit = OPERATIONS / A_SECOND;
    println!(
        "\nThe engine is busy all the time from {:.0} workers on, the file system from {:.0}.",
        of_task / OVERHEAD_S,
        mean / of_unit
    );
}

/// Processor seconds of each unit.
fn costs(table: &str) -> Vec<f64> {
    let seconds = |row: &str| row.split(',').nth(1).and_then(|s| s.parse().ok());
    let costs: Vec<f64> = table.lines().skip(1).filter_map(seconds).collect();
    assert!(!costs.is_empty(), "no unit was computed");
    costs
}

/// When all is done, and how long engine and file system were busy (s).
struct Run {
    end: f64,
    engine: f64,
    files: f64,
}

/// At a time (ns, so that times have an order) a worker is free, or has computed a unit that it reads and writes files for.
type Event = Reverse<(u64, usize, bool)>;

/// What is waited for in turn.
struct Queue {
    free: u64,
    each_s: f64,
    busy_s: f64,
}

impl Queue {
    fn new(each_s: f64) -> Self {
        Self {
            free: 0,
            each_s,
            busy_s: 0.0,
        }
    }

    /// When whoever comes now is through.
    fn serve(&mut self, now: u64) -> u64 {
        self.busy_s += self.each_s;
        self.free = now.max(self.free) + nanoseconds(self.each_s);
        self.free
    }
}

fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9) as u64
}

fn run(costs: &[f64], units: usize, workers: usize) -> Run {
    let mut events: BinaryHeap<Event> = (0..workers).map(|w| Reverse((0, w, false))).collect();
    // Units of its task that each worker has still to compute.
    let mut tasks = vec![0..0; workers];
    let mut handed_out = 0;
    let (mut engine, mut files) = (Queue::new(OVERHEAD_S), Queue::new(OPERATIONS / A_SECOND));
    let mut end = 0;
    while let Some(Reverse((mut now, worker, computed))) = events.pop() {
        end = now;
        if computed {
            events.push(Reverse((files.serve(now), worker, false)));
            continue;
        }
        if tasks[worker].is_empty() {
            if handed_out >= units {
                continue;
            }
            tasks[worker] = handed_out..(handed_out + TOGETHER).min(units);
            handed_out = tasks[worker].end;
            now = engine.serve(now);
        }
        let unit = tasks[worker].start;
        tasks[worker].start += 1;
        let through = now + nanoseconds(costs[unit % costs.len()]);
        events.push(Reverse((through, worker, true)));
    }
    Run {
        end: end as f64 * 1e-9,
        engine: engine.busy_s,
        files: files.busy_s,
    }
}

fn in_words(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.1} days", s / 86_400.0),
    }
}
