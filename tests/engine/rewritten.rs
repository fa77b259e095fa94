//! A recording written anew, as a table or as messages: what is cancelled or fails leaves what was there, and nothing beside it.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use hapdef::budget::{Cancelled, Progress, unwatched};
use hapdef::link::{Recorder, write_table};
use hapdef::live::{Pipeline, Sample};
use hapdef::wire::{Hello, VERSION};

use crate::inference::lab;

fn pipeline() -> Pipeline {
    let lab = lab();
    let gauges = lab.sensing.gauges.len();
    let settings = lab.inputs.project.live.settings(gauges);
    Pipeline::new(Arc::clone(&lab.sensing.drawn.map), settings)
}

/// Of a board that has 10 channels for 500 samples, and then 12 for 300.
fn recorded(path: &Path) {
    let mut recorder = Recorder::create(path).unwrap();
    let mut time_us = 0;
    for (channels, count) in [(10, 500), (12, 300)] {
        recorder.hello(&Hello {
            version: VERSION,
            board: 7,
            channels,
            bits: 12,
            reference_mv: 3300,
            supply_mv: 3300,
            gain_milli: 100_000,
            rate_hz: 1000,
            name: "a board".into(),
        });
        for _ in 0..count {
            time_us += 1000;
            recorder.sample(&Sample {
                time_us,
                counts: vec![2000.0; usize::from(channels)],
            });
        }
    }
}

/// The names in a folder, in their order.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Whoever cancels at the first report, and at the last.
const CANCELS: [fn(Progress) -> ControlFlow<()>; 2] = [
    |_| ControlFlow::Break(()),
    |p| {
        if p.done == p.total {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    },
];

#[test]
fn a_table_is_there_as_a_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    recorded(&at("x.hapdrec"));
    std::fs::write(at("x.csv"), "older").unwrap();
    for cancel in CANCELS {
        let cancelled = write_table(&at("x.hapdrec"), &at("x.csv"), pipeline(), &cancel);
        assert!(cancelled.unwrap_err().is::<Cancelled>());
        assert_eq!(names(folder.path()), ["x.csv", "x.hapdrec"]);
        assert_eq!(std::fs::read_to_string(at("x.csv")).unwrap(), "older");
    }
    std::fs::create_dir(at("y.csv")).unwrap();
    let refused = write_table(&at("x.hapdrec"), &at("y.csv"), pipeline(), &unwatched);
    let said = format!("{:#}", refused.unwrap_err());
    assert!(said.contains("y.csv: it was not written"), "{said}");
    assert_eq!(names(&at("y.csv")), [""; 0]);

    std::fs::write(at("x-2.csv"), "somebody's").unwrap();
    let written = write_table(&at("x.hapdrec"), &at("x.csv"), pipeline(), &unwatched);
    assert_eq!(written.unwrap(), [at("x.csv"), at("x-3.csv")]);
    let rows = |name: &str| std::fs::read_to_string(at(name)).unwrap().lines().count();
    assert_eq!(
        [rows("x.csv"), rows("x-3.csv"), rows("x-2.csv")],
        [501, 301, 1]
    );
    let all = ["x-2.csv", "x-3.csv", "x.csv", "x.hapdrec", "y.csv"];
    assert!(
        names(folder.path())
            .iter()
            .all(|name| all.contains(&name.as_str())),
        "{:?}",
        names(folder.path())
    );
}

#[cfg(feature = "mcap")]
#[test]
fn messages_are_there_as_a_whole_or_not_at_all() {
    use hapdef::link::write_messages;

    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    recorded(&at("x.hapdrec"));
    std::fs::write(at("x.mcap"), "older").unwrap();
    for cancel in CANCELS {
        let to = at("x.mcap");
        let to = (to.as_path(), "limb");
        let cancelled = write_messages(&at("x.hapdrec"), to, pipeline(), &cancel);
        assert!(cancelled.unwrap_err().is::<Cancelled>());
        assert_eq!(names(folder.path()), ["x.hapdrec", "x.mcap"]);
        assert_eq!(std::fs::read_to_string(at("x.mcap")).unwrap(), "older");
    }
    let to = at("x.mcap");
    write_messages(
        &at("x.hapdrec"),
        (to.as_path(), "limb"),
        pipeline(),
        &unwatched,
    )
    .unwrap();
    let bytes = std::fs::read(&to).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap();
    assert!(messages.map(Result::unwrap).count() >= 800);
    assert_eq!(names(folder.path()), ["x.hapdrec", "x.mcap"]);
}
