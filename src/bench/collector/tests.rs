use glam::DVec3;

use super::super::check::CheckPlace;
use super::super::machine::tests::paper;
use super::super::{ContactLaw, PrinterFaults, SimulatedPrinter, TableMount, plan};
use super::*;
use crate::limb::LimbSpec;
use crate::mesh::{TriMesh, sample};

/// A limb on a simulated bench whose board reads three gauges and the tip.
struct Bench<'a> {
    printer: SimulatedPrinter,
    contact: ContactLaw<'a>,
    now_us: u64,
    /// The hardest that the tip really pressed (N).
    hardest: f64,
    silent_from: Option<u64>,
    /// Between two samples.
    every_us: u64,
    /// What the printer has said, on its way.
    said: Vec<u8>,
    /// Where the limb was really pressed last (m).
    place: DVec3,
    /// Where it was, each time that a press was over.
    pressed: Vec<(usize, DVec3)>,
}

const NEWTON_PER_COUNT: f64 = 0.05;
const TURN_US: u64 = 5000;

impl<'a> Bench<'a> {
    fn new(
        machine: &'a Machine,
        surface: &'a TriMesh,
        mount: TableMount,
        faults: PrinterFaults,
    ) -> Self {
        Self {
            printer: SimulatedPrinter::new([('X', 0.0), ('Z', 0.0), ('E', 0.0)], faults, 5),
            contact: ContactLaw {
                surface,
                mount,
                machine,
                machine_gives: 0.0,
                gives: vec![(DVec3::ZERO, 1e-4)],
            },
            now_us: 0,
            hardest: 0.0,
            silent_from: None,
            every_us: TURN_US,
            said: Vec::new(),
            place: DVec3::ZERO,
            pressed: Vec::new(),
        }
    }

    fn counts(&mut self) -> Vec<f64> {
        let printer = &self.printer;
        let number = |axis: &crate::bench::MachineAxis| printer.real(axis.letter).unwrap();
        let pose = self.contact.machine.pose_of(number);
        let push = self.contact.push(&pose);
        let force = push.map_or(0.0, |p| p.touch.force);
        self.hardest = self.hardest.max(force);
        self.place = push.map_or(self.place, |p| p.touch.position);
        // Strains change with the place about as those of a limb like the paper's do.
        let waves = self
            .place
            .to_array()
            .map(|x| 20.0 * force * (x / 0.015).sin());
        let mut counts: Vec<f64> = waves.map(|x| (2048.0 + x).round()).to_vec();
        counts.push((400.0 + force / NEWTON_PER_COUNT).round());
        counts
    }

    /// Until it has ended, or for so many seconds.
    fn run(&mut self, collector: &mut Collector, seconds: f64) -> Vec<CollectorNews> {
        let mut news = Vec::new();
        let until = self.now_us + (seconds * 1e6) as u64;
        while collector.ended().is_none() && self.now_us < until {
            let mut out = Vec::new();
            let known = news.len();
            let mut tell = |n| news.push(n);
            if self.silent_from.is_none_or(|from| self.now_us < from)
                && self.now_us.is_multiple_of(self.every_us)
            {
                let counts = self.counts();
                collector.felt(&counts, self.now_us, &mut out, &mut tell);
            }
            collector.look(self.now_us, &mut out, &mut tell);
            collector.receive(
                &std::mem::take(&mut self.said),
                self.now_us,
                &mut out,
                &mut tell,
            );
            self.printer.receive(&out, &mut self.said);
            self.now_us += TURN_US;
            self.printer.say(self.now_us, &mut self.said);
            self.note(&news[known..]);
        }
        news
    }
}

impl Bench<'_> {
    /// Remembers where what was pressed really was.
    fn note(&mut self, news: &[CollectorNews]) {
        for one in news {
            match one {
                CollectorNews::Press {
                    number,
                    failed: None,
                } => self.pressed.push((*number, self.place)),
                CollectorNews::Discarded(none) => {
                    self.pressed.truncate(self.pressed.len() - none.len());
                }
                _ => {}
            }
        }
    }
}

struct Case {
    surface: TriMesh,
    mount: TableMount,
    machine: Machine,
}

impl Case {
    fn new() -> Self {
        let (surface, _) = LimbSpec::default().build().unwrap();
        let (low, high) = surface.bounds();
        Self {
            mount: TableMount::upright(DVec3::Z, DVec3::X, (low + high) / 2.0),
            surface,
            machine: paper(),
        }
    }

    fn bench(&self, faults: PrinterFaults) -> Bench<'_> {
        Bench::new(&self.machine, &self.surface, self.mount, faults)
    }

    fn collector(&self, places: usize) -> Collector {
        let places: Vec<(DVec3, DVec3)> = (sample::random(&self.surface, 4 * places, 3, |_| true)
            .into_iter())
        .map(|at| (self.surface.point(at), self.surface.normal(at)))
        .collect();
        let reach = plan(&places, &self.surface, &self.machine, &self.mount).unwrap();
        let presses = reach.presses.into_iter().take(places.len() / 4);
        Collector::new(
            self.machine.clone(),
            PressLimits::default(),
            presses.enumerate(),
            reach.retreat,
        )
    }
}

fn done(news: &[CollectorNews]) -> Vec<usize> {
    (news.iter())
        .filter_map(|n| match n {
            CollectorNews::Press {
                number,
                failed: None,
            } => Some(*number),
            _ => None,
        })
        .collect()
}

/// Every reading that is kept, with the place that was really pressed meanwhile against the one that was meant.
fn depths(news: &[CollectorNews]) -> Vec<f64> {
    (news.iter())
        .filter_map(|n| match n {
            CollectorNews::Note(note) => note.strip_prefix("read depth ")?.parse().ok(),
            _ => None,
        })
        .collect()
}

#[test]
fn a_plan_is_pressed_step_by_step() {
    let case = Case::new();
    let mut collector = case.collector(6);
    let mut bench = case.bench(PrinterFaults::default());
    let news = bench.run(&mut collector, 1e4);
    assert_eq!(collector.ended(), Some(&RunEnd::Finished));
    assert_eq!(done(&news), [0, 1, 2, 3, 4, 5]);
    let depths = depths(&news);
    // 10 N/mm to 2 mm by 0.15 mm: from the contact on fourteen readings each.
    assert!(depths.len() >= 6 * 13, "{}", depths.len());
    assert!(depths.iter().all(|d| (-0.001..2.2).contains(d)));
    assert!(
        bench.hardest > 15.0 && bench.hardest < 35.0,
        "{}",
        bench.hardest
    );
    assert!((collector.hardest - bench.hardest).abs() < 0.2);
}

#[test]
fn lines_that_are_lost_or_garbled_change_nothing_but_the_time() {
    let case = Case::new();
    let faults = PrinterFaults {
        lose: 0.03,
        garble: 0.03,
        lose_answer: 0.03,
        garble_answer: 0.01,
        ..PrinterFaults::default()
    };
    let mut clean = case.collector(4);
    let mut bench = case.bench(PrinterFaults::default());
    let wanted = bench.run(&mut clean, 1e4);
    let mut collector = case.collector(4);
    let mut bench = case.bench(faults);
    let news = bench.run(&mut collector, 1e5);
    assert_eq!(collector.ended(), Some(&RunEnd::Finished));
    assert_eq!(done(&news), done(&wanted));
    assert_eq!(depths(&news), depths(&wanted));
    assert!(collector.resent() > 10, "{}", collector.resent());
}

#[test]
fn a_machine_that_began_anew_is_sent_home_and_the_press_is_repeated() {
    let case = Case::new();
    let faults = PrinterFaults {
        reset: 0.008,
        ..PrinterFaults::default()
    };
    let mut collector = case.collector(4);
    let mut bench = case.bench(faults);
    let news = bench.run(&mut collector, 1e5);
    assert!(bench.printer.restarts > 0);
    assert_eq!(collector.ended(), Some(&RunEnd::Finished));
    assert_eq!(done(&news), [0, 1, 2, 3]);
    // Without a way to find its place again it is not gone on with.
    let mut machine = case.machine.clone();
    machine.home.clear();
    let mut collector = case.collector(4);
    collector.machine = machine;
    let mut bench = case.bench(faults);
    bench.run(&mut collector, 1e5);
    let ended = collector.ended();
    assert!(
        matches!(ended, Some(RunEnd::Stopped(why)) if why.contains("began anew")),
        "{ended:?}"
    );
}

#[test]
fn a_force_beyond_the_limit_stops_and_takes_back() {
    let case = Case::new();
    let mut collector = case.collector(4);
    collector.limits.most_force = 12.0;
    collector.limits.enough = 50.0;
    let mut bench = case.bench(PrinterFaults::default());
    // It is foreseen, and no press comes beyond it.
    let news = bench.run(&mut collector, 1e4);
    assert_eq!(done(&news).len(), 4);
    assert!(bench.hardest < 12.0, "{}", bench.hardest);
    // However stiff the limb is, the tip is stopped on its way.
    let mut collector = case.collector(4);
    let mut bench = case.bench(PrinterFaults::default());
    bench.contact.gives[0].1 = 2e-6;
    let news = bench.run(&mut collector, 1e4);
    assert_eq!(done(&news).len(), 4);
    assert!(bench.hardest < 35.0, "{}", bench.hardest);
    // Where the board is too slow for that, all ends, and the tip is taken back.
    let mut collector = case.collector(4);
    let mut bench = case.bench(PrinterFaults::default());
    (bench.contact.gives[0].1, bench.every_us) = (2e-6, 400_000);
    bench.run(&mut collector, 1e4);
    let ended = collector.ended();
    assert!(
        matches!(ended, Some(RunEnd::Stopped(why)) if why.contains("the most")),
        "{ended:?}"
    );
    let counts = bench.counts();
    assert_eq!(counts[3], 400.0, "the tip was not taken back");
}

#[test]
fn a_board_that_falls_silent_stops_it_with_the_tip_taken_back() {
    let case = Case::new();
    let mut collector = case.collector(3);
    let mut bench = case.bench(PrinterFaults::default());
    while bench.hardest < 5.0 {
        bench.run(&mut collector, 0.1);
    }
    bench.silent_from = Some(bench.now_us);
    bench.run(&mut collector, 100.0);
    let ended = collector.ended();
    assert!(
        matches!(ended, Some(RunEnd::Stopped(why)) if why.contains("silent")),
        "{ended:?}"
    );
    assert_eq!(bench.counts()[3], 400.0);
}

#[test]
fn a_limb_that_is_not_where_it_should_be_is_found_out() {
    let case = Case::new();
    let mut collector = case.collector(12);
    let mut bench = case.bench(PrinterFaults::default());
    bench.contact.mount.shift.z += 500e-3;
    let news = bench.run(&mut collector, 1e5);
    let ended = collector.ended();
    assert!(
        matches!(ended, Some(RunEnd::Stopped(why)) if why.contains("mounted")),
        "{ended:?}"
    );
    assert!(done(&news).is_empty());
}

#[test]
fn what_is_paused_goes_on_and_what_is_stopped_ends_out_of_the_way() {
    let case = Case::new();
    let mut collector = case.collector(3);
    let mut bench = case.bench(PrinterFaults::default());
    bench.run(&mut collector, 5.0);
    collector.pause(true);
    bench.run(&mut collector, 200.0);
    assert_eq!((collector.left(), collector.ended()), (2, None));
    collector.pause(false);
    bench.run(&mut collector, 5.0);
    let mut out = Vec::new();
    collector.stop("asked to", bench.now_us, &mut out);
    bench.printer.receive(&out, &mut Vec::new());
    bench.run(&mut collector, 100.0);
    assert_eq!(collector.ended(), Some(&RunEnd::Stopped("asked to".into())));
    assert_eq!(bench.counts()[3], 400.0);
}

#[test]
fn a_machine_that_cannot_be_believed_is_told_to_stop() {
    let case = Case::new();
    let mut collector = case.collector(2);
    let mut bench = case.bench(PrinterFaults::default());
    bench.run(&mut collector, 3.0);
    let mut out = Vec::new();
    let halted = b"Error:Printer halted. kill() called!\n";
    collector.receive(halted, bench.now_us, &mut out, &mut |_| {});
    assert!(out.ends_with(b"M410\n"));
    assert!(matches!(collector.ended(), Some(RunEnd::Stopped(_))));
}

#[test]
fn steps_that_a_motor_loses_are_noticed_and_their_presses_made_again() {
    let case = Case::new();
    let faults = PrinterFaults {
        stall: 0.004,
        ..PrinterFaults::default()
    };
    let far = |collector: &Collector, pressed: &[(usize, DVec3)]| {
        let wanted: Vec<(usize, Planned)> = collector.plan.iter().copied().collect();
        farthest(&wanted, pressed)
    };
    // Believed as it says, some are at wrong places.
    let blind = case.collector(40);
    let mut bench = case.bench(faults);
    let mut collector = case.collector(40);
    bench.run(&mut collector, 1e5);
    assert!(far(&blind, &bench.pressed) > 3e-3);
    // Looked at again and again, none is.
    let reference = CheckPlace {
        // There, the waves rise along all axes.
        at: blind.plan[4].1,
        every: 5,
        answer: None,
    };
    let mut bench = case.bench(faults);
    let mut collector = case.collector(40).checked_at(reference.clone());
    let news = bench.run(&mut collector, 1e6);
    assert_eq!(collector.ended(), Some(&RunEnd::Finished));
    let mut numbers: Vec<usize> = bench.pressed.iter().map(|p| p.0).collect();
    numbers.sort_unstable();
    assert_eq!(numbers, (0..blind.left()).collect::<Vec<_>>());
    let off = far(&blind, &bench.pressed);
    assert!(off < 1e-3, "{off}");
    let again = |n: &&CollectorNews| matches!(n, CollectorNews::Discarded(_));
    assert!(news.iter().filter(again).count() >= 2);
    // Without a way to find its place it is not gone on with.
    let mut bench = case.bench(faults);
    let mut collector = case.collector(40).checked_at(reference);
    collector.machine.home.clear();
    bench.run(&mut collector, 1e6);
    let ended = collector.ended();
    assert!(
        matches!(ended, Some(RunEnd::Stopped(why)) if why.contains("lost steps")),
        "{ended:?}"
    );
}

#[test]
fn rounds_of_presses_are_one_run_and_its_end_is_waited_for() {
    let case = Case::new();
    let all: Vec<(usize, Planned)> = case.collector(9).plan.into_iter().collect();
    let reference = CheckPlace {
        at: all[4].1,
        every: 20,
        answer: None,
    };
    for checked in [false, true] {
        let mut bench = case.bench(PrinterFaults::default());
        let mut collector = case.collector(9).waiting_for_more();
        collector.plan.truncate(3);
        if checked {
            collector = collector.checked_at(reference.clone());
        }
        let waits =
            |news: &[CollectorNews]| news.iter().filter(|n| **n == CollectorNews::Waits).count();
        let first = bench.run(&mut collector, 600.0);
        assert_eq!((done(&first), waits(&first)), (vec![0, 1, 2], 1));
        // Nothing moves, and it is not said again.
        let (moves, idle) = (collector.moves, bench.run(&mut collector, 5.0));
        assert!(collector.ended().is_none() && collector.moves == moves && idle.is_empty());
        collector.go_on(all[3..].iter().copied());
        let second = bench.run(&mut collector, 1200.0);
        assert_eq!((done(&second), waits(&second)), ((3..9).collect(), 1));
        let off = farthest(&all, &bench.pressed);
        assert!(off < 1e-3, "{off}");
        // What was pressed is believed before more is asked for.
        let sure = |news: &[CollectorNews]| news.contains(&CollectorNews::Note("checked".into()));
        assert!(!checked || (sure(&first) && sure(&second)));
        collector.go_on([]);
        assert_eq!(collector.ended(), Some(&RunEnd::Finished));
    }
}

/// The farthest that a place was pressed from where it should have been (m).
fn farthest(wanted: &[(usize, Planned)], pressed: &[(usize, DVec3)]) -> f64 {
    let off = pressed.iter().map(|(number, place)| {
        let planned = wanted.iter().find(|w| w.0 == *number).unwrap();
        planned.1.at.distance(*place)
    });
    off.fold(0.0, f64::max)
}

#[test]
fn a_press_that_failed_is_tried_again_at_the_end() {
    let case = Case::new();
    let mut collector = case.collector(6);
    // A place that is beside the limb at first.
    let lost = collector.plan[2].1.pose.along;
    collector.plan[2].1.pose.along += 0.3;
    let mut bench = case.bench(PrinterFaults::default());
    while collector.plan.front().is_some_and(|p| p.0 != 3) {
        bench.run(&mut collector, 0.1);
    }
    let last = collector.plan.back_mut().unwrap();
    assert_eq!(last.0, 2);
    last.1.pose.along = lost;
    let news = bench.run(&mut collector, 1e4);
    assert_eq!(collector.ended(), Some(&RunEnd::Finished));
    assert_eq!(done(&news), [3, 4, 5, 2]);
}

#[test]
fn a_limb_that_turns_into_the_tip_stops_the_machine() {
    let case = Case::new();
    let mut collector = case.collector(3);
    let mut bench = case.bench(PrinterFaults::default());
    while collector.left() > 2 {
        bench.run(&mut collector, 0.1);
    }
    // The tip is out of the way, and something presses it all the same.
    let mut out = Vec::new();
    let counts = [2048.0, 2048.0, 2048.0, 400.0 + 60.0 / NEWTON_PER_COUNT];
    collector.felt(&counts, bench.now_us, &mut out, &mut |_| {});
    assert!(out.starts_with(b"M410\n"));
}
