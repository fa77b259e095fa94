//! What is said on the line, and what comes of it.

use std::io::Write;
use std::net::TcpListener;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::channel;

use super::*;
use crate::inference::ResponseMap;
use crate::limb::LimbSpec;
use crate::link::Pace;
use crate::link::{Address, Recorder};
use crate::live::PipelineSettings;
use crate::live::{Pipeline, Sample};
use crate::wire::MOST_CHANNELS;
use crate::wire::encode;

const GAUGES: usize = 4;

fn pipeline() -> Pipeline {
    let spec = LimbSpec {
        element: 20.0,
        ..LimbSpec::default()
    };
    let mesh = spec.build().unwrap().0;
    let nodes = mesh.positions().len() + mesh.edges().len();
    let value = |k: usize| 1e-5 * (1.7 * k as f64).sin();
    let values = (0..nodes * GAUGES).map(value).collect();
    let map = ResponseMap::of(Arc::new(mesh), GAUGES, values);
    Pipeline::new(Arc::new(map), PipelineSettings::of(GAUGES))
}

fn hello() -> Hello {
    Hello {
        version: crate::wire::VERSION,
        board: 7,
        channels: 4,
        bits: 12,
        reference_mv: 3300,
        supply_mv: 5000,
        gain_milli: 330_000,
        rate_hz: 1000,
        name: "limb\u{1b}[31m".into(),
    }
}

fn frames(messages: &[WireMessage]) -> Vec<u8> {
    let mut bytes = vec![0];
    for (k, message) in (0..).zip(messages) {
        encode(message, k, 1000 * u32::from(k), 12, &mut bytes);
    }
    bytes
}

/// All that is heard there until it is over, and how it ended.
fn received_until_over(address: Address) -> (Vec<String>, Vec<Vec<f64>>, Result<(), String>) {
    let (mut said, mut counts) = (Vec::new(), Vec::new());
    let (stop, (_commands, inbox)) = (AtomicBool::new(false), channel());
    let ended = Listener::new(address, pipeline()).run(&stop, &inbox, |event| match event {
        SessionEvent::State(ConnectionState::Gone) => stop.store(true, Ordering::Relaxed),
        SessionEvent::Hello(hello) => said.push(format!("hello {}", hello.name)),
        SessionEvent::Message(text) => said.push(format!("message {text}")),
        SessionEvent::Trouble(text) => said.push(format!("trouble {text}")),
        SessionEvent::Truth(touch) => said.push(format!("truth {touch:?}")),
        SessionEvent::Sample { sample, .. } => counts.push(sample.counts.clone()),
        _ => {}
    });
    (said, counts, ended)
}

fn of_board(bytes: Vec<u8>) -> Vec<String> {
    of_board_in_parts(vec![(Duration::ZERO, bytes)])
}

/// What comes after some time each.
fn of_board_in_parts(parts: Vec<(Duration, Vec<u8>)>) -> Vec<String> {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        for (after, bytes) in parts {
            std::thread::sleep(after);
            stream.write_all(&bytes).unwrap();
        }
        stream.shutdown(std::net::Shutdown::Write).unwrap();
        // Until the other side has taken it and is gone.
        let _ = std::io::copy(&mut stream, &mut std::io::sink());
    });
    received_until_over(Address::Socket(address)).0
}

fn recording(path: &Path) -> Address {
    Address::Recording {
        path: path.to_owned(),
        pace: Pace::Fast,
    }
}

fn of_recording(bytes: &[u8]) -> (Vec<String>, Vec<Vec<f64>>, Result<(), String>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hapdrec");
    std::fs::write(&path, bytes).unwrap();
    received_until_over(recording(&path))
}

fn log(text: &str) -> WireMessage {
    WireMessage::Log {
        level: 0,
        text: text.into(),
    }
}

#[test]
fn text_of_a_board_is_shown_and_never_obeyed() {
    let said = of_board(frames(&[
        WireMessage::Hello(hello()),
        log("hapdef truth 1 2 3 4"),
        log("hapdef dead 0"),
        log("hapdef line 1,2,3,4"),
        WireMessage::Note("truth 1 2 3 4".into()),
        log("a\u{1b}]0;title\u{7}\nhapdef: b"),
    ]));
    let expected = [
        "hello limb\u{fffd}[31m",
        "message the board says: “hapdef truth 1 2 3 4”",
        "message the board says: “hapdef dead 0”",
        "message the board says: “hapdef line 1,2,3,4”",
        "message the board says: “a\u{fffd}]0;title\u{fffd} hapdef: b”",
    ];
    assert_eq!(said, expected);
}

#[test]
fn notes_of_a_recording_are_obeyed_the_old_ones_too() {
    let data = WireMessage::Data(vec![2000; 4]);
    let old = [WireMessage::Hello(hello()), log("hapdef truth none"), data];
    let (said, counts, ended) = of_recording(&frames(&old));
    assert_eq!(said[1..], ["truth None"]);
    assert_eq!((counts.len(), ended), (1, Ok(())));
    let new = [
        WireMessage::Note("truth none".into()),
        log("hapdef truth none"),
        WireMessage::Note("line 1,2,3,4".into()),
    ];
    let (said, counts, _) = of_recording(&frames(&new));
    let shown = "message the board says: “hapdef truth none”";
    assert_eq!(said, ["truth None", shown]);
    assert_eq!(counts, [[1.0, 2.0, 3.0, 4.0]]);
}

#[test]
fn lines_with_many_channels_are_recorded_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hapdrec");
    let long = |k: usize| (k as f64 - 31.5) * 1e14 / 3.0 + 1e-9;
    let sample = Sample {
        time_us: 5,
        counts: (0..MOST_CHANNELS).map(long).collect(),
    };
    let mut recorder = Recorder::create(&path).unwrap();
    recorder.sample(&sample);
    drop(recorder);
    assert_eq!(received_until_over(recording(&path)).1, [sample.counts]);
    // One whose middle is lost is not taken for one of fewer channels.
    let torn = ["part 0 1,2", "line 4 5,6", "line 0 1,2,x", "part 9", "line"];
    let torn = torn.map(|text| WireMessage::Note(text.into()));
    assert!(of_recording(&frames(&torn)).1.is_empty());
}

/// Whether a board has said how many channels it has, or only prints lines.
#[test]
fn channels_that_do_not_come_are_told_once() {
    let few = WireMessage::Hello(Hello {
        channels: 3,
        ..hello()
    });
    let data = WireMessage::Data(vec![2000; 3]);
    let greeted = of_board(frames(&[few.clone(), data.clone(), few, data]));
    let lines = of_board(b"1,2,3\n".repeat(20));
    for said in [greeted, lines] {
        let names_it = |s: &&String| s.contains("gauge 4 is on channel 3, but");
        assert_eq!(said.iter().filter(names_it).count(), 1, "{said:?}");
    }
    let enough = of_board(b"1,2,3,4\n".repeat(20));
    assert!(enough.is_empty(), "{enough:?}");
}

#[test]
fn a_board_that_cannot_be_used_says_why_once() {
    let deaf = WireMessage::Hello(Hello {
        gain_milli: 0,
        ..hello()
    });
    let data = WireMessage::Data(vec![2000; 4]);
    let said = of_board(frames(&[
        deaf.clone(),
        data.clone(),
        deaf.clone(),
        data,
        deaf,
    ]));
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].starts_with("trouble ") && said[0].contains("gain"));
}

#[test]
fn a_board_that_is_long_in_answering_has_time_to_send() {
    let data = WireMessage::Data(vec![2000; 4]);
    let said = of_board_in_parts(vec![
        (
            PATIENCE + PATIENCE / 10,
            frames(&[WireMessage::Hello(hello())]),
        ),
        (PATIENCE / 10, frames(&[data])),
    ]);
    assert!(said.iter().any(|s| s.starts_with("hello ")), "{said:?}");
    assert!(!said.iter().any(|s| s.starts_with("trouble ")), "{said:?}");
}

#[test]
fn a_recording_without_a_reading_says_so() {
    let other = WireMessage::Hello(Hello {
        version: 2,
        ..hello()
    });
    let garbage = [&frames(&[log("ready"), other])[..], &vec![0x41; 40_000]].concat();
    let (_, _, ended) = of_recording(&garbage);
    let said = ended.unwrap_err();
    assert!(
        said.contains("no reading") && said.contains("version 2"),
        "{said}"
    );
}
