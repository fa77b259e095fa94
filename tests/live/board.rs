//! The real program at real ports: a simulated board, and boards that speak in lines, garbage and floods.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use hapdef::wire::{Decoded, Decoder, Hello, VERSION, WireMessage, encode};
use serde_json::Value;

/// A program that ends with the test.
pub struct Running {
    child: Child,
    out: Receiver<String>,
    err: Receiver<String>,
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn lines(source: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(source).lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

pub fn start(args: &[&str]) -> Running {
    let mut child = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let out = lines(child.stdout.take().unwrap());
    let err = lines(child.stderr.take().unwrap());
    Running { child, out, err }
}

impl Running {
    fn line(&self) -> String {
        self.out
            .recv_timeout(Duration::from_mins(1))
            .expect("a line")
    }

    pub fn json(&self) -> Value {
        serde_json::from_str(&self.line()).unwrap()
    }

    /// Waits until it says something on stderr.
    pub fn says(&self, what: &str) -> String {
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_mins(1) {
            let line = self.err.recv_timeout(Duration::from_mins(1)).expect(what);
            if line.contains(what) {
                return line;
            }
        }
        panic!("it never said “{what}”");
    }
}

pub fn board(more: &[&str]) -> (Running, String) {
    let args = [&["board", "--simulate", "--quality", "draft"], more].concat();
    let running = start(&args);
    let first = running.json();
    let port = first["port"].as_str().unwrap().to_owned();
    (running, port)
}

pub fn listen(port: &str, more: &[&str]) -> Running {
    start(&[&["listen", port, "--quality", "draft"], more].concat())
}

#[test]
fn a_simulated_board_speaks_the_protocol() {
    let (_board, port) = board(&[
        "--tcp",
        "--channels",
        "12",
        "--rate",
        "500",
        "--truth",
        "/dev/null",
    ]);
    let mut stream = TcpStream::connect(&port).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_millis(50)))
        .unwrap();
    let mut decoder = Decoder::default();
    let mut bytes = Vec::new();
    encode(&WireMessage::AskHello, 0, 0, 12, &mut bytes);
    encode(&WireMessage::Ping(77), 1, 0, 12, &mut bytes);
    encode(&WireMessage::Start, 2, 0, 12, &mut bytes);
    stream.write_all(&bytes).unwrap();
    let (mut hello, mut pong, mut times) = (None, None, Vec::new());
    let begun = Instant::now();
    let mut buffer = [0; 4096];
    while times.len() < 300 && begun.elapsed() < Duration::from_secs(20) {
        let Ok(count) = stream.read(&mut buffer) else {
            continue;
        };
        decoder.push(&buffer[..count], |event| match event {
            Decoded::Message {
                message: WireMessage::Hello(h),
                ..
            } => hello = Some(h),
            Decoded::Message {
                message: WireMessage::Pong(p),
                ..
            } => pong = Some(p),
            Decoded::Message {
                message: WireMessage::Data(counts),
                time_us,
                ..
            } => {
                assert!(counts.len() == 12 && counts.iter().all(|c| *c < 4096));
                times.push(time_us);
            }
            Decoded::Message { .. } => {}
            other => panic!("{other:?}"),
        });
    }
    let hello = hello.unwrap();
    assert_eq!(
        (hello.channels, hello.bits, hello.rate_hz, pong),
        (12, 12, 500, Some(77))
    );
    assert!(
        times.windows(2).all(|w| w[1] - w[0] == 2000),
        "{:?}",
        &times[..5]
    );
}

/// A board sends as often as it is asked to, whatever it would do by itself.
#[test]
fn a_board_is_asked_for_its_rate() {
    let (_board, port) = board(&["--rate", "500"]);
    let steps = |more: &[&str]| {
        let listening = listen(&port, more);
        let times: Vec<u64> = (0..60)
            .map(|_| listening.json()["t_us"].as_u64().unwrap())
            .collect();
        let mut steps: Vec<u64> = times.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_unstable();
        steps[steps.len() / 2]
    };
    assert_eq!(steps(&[]), 2000);
    assert_eq!(steps(&["--rate", "200"]), 5000);
}

/// Scripted touches at known places, gauges exactly as drawn: each is found where it is, and nothing between them.
/// They begin late enough for a busy machine to have tared.
#[test]
fn touches_are_found_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("touches.csv");
    let truth = folder.path().join("truth.csv");
    std::fs::write(
        &script,
        "start_s,duration_s,x_mm,y_mm,z_mm,force_n\n12,1,22.5,22.5,60,8\n14,1,-22.5,22.5,40,12\n16,1,22.5,-22.5,80,6\n",
    )
    .unwrap();
    let (script, truth) = (script.to_str().unwrap(), truth.to_str().unwrap());
    let (_board, port) = board(&["--workshop", "exact", "--script", script, "--truth", truth]);
    let listening = listen(&port, &["--every", "200"]);
    let mut found: Vec<Value> = Vec::new();
    loop {
        let line = listening.json();
        let keys: Vec<&String> = line.as_object().unwrap().keys().collect();
        assert_eq!(
            keys,
            [
                "area_radius_mm",
                "blind_share",
                "channels_ok",
                "count",
                "count_probability",
                "force_n",
                "fx_n",
                "fy_n",
                "fz_n",
                "kind",
                "left_out",
                "t_us",
                "touches",
                "uncertainty_mm",
                "unexplained",
                "x_mm",
                "y_mm",
                "z_mm"
            ]
        );
        let time = line["t_us"].as_u64().unwrap();
        found.push(line);
        if time > 17_500_000 {
            break;
        }
    }
    let rows: Vec<Vec<f64>> = std::fs::read_to_string(truth)
        .unwrap()
        .lines()
        .skip(1)
        .map(|l| l.split(',').filter_map(|w| w.parse().ok()).collect())
        .collect();
    let at = |time: u64| rows.iter().find(|r| r.first() == Some(&(time as f64)));
    let (mut pressed, mut quiet, mut errors) = (0, 0, Vec::new());
    for line in &found {
        let Some(row) = at(line["t_us"].as_u64().unwrap()) else {
            continue;
        };
        let value = |key: &str| line[key].as_f64();
        match (row.len(), value("x_mm")) {
            (5, Some(x)) if row[4] > 3.0 => {
                let off = (x - row[1])
                    .hypot(value("y_mm").unwrap() - row[2])
                    .hypot(value("z_mm").unwrap() - row[3]);
                let sure = value("uncertainty_mm").unwrap();
                assert!(off < 2.0 * sure, "{off} mm off: {line} {row:?}");
                assert!(
                    (value("force_n").unwrap() - row[4]).abs() < 0.25 * row[4],
                    "{line} {row:?}"
                );
                errors.push(off);
                pressed += 1;
            }
            (5, None) if row[4] > 3.0 => panic!("not felt: {line} {row:?}"),
            (1, None) => quiet += 1,
            // A few samples of patience at the end of a touch.
            _ => {}
        }
    }
    errors.sort_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    assert!(
        pressed > 300 && quiet > 300 && median < 4.0,
        "{pressed} {quiet} {median} mm"
    );
}

#[test]
fn an_unplugged_board_is_found_again() {
    // Of an id of its own: it is looked for at all ports, and other tests have boards there.
    let fault = ["--fault", "unplug@10+1", "--flip", "1e-4", "--drop", "1e-4"];
    let (_board, port) = board(&[&fault[..], &["--seed", "77"]].concat());
    let listening = listen(&port, &["--every", "100"]);
    listening.says("live");
    listening.says("unplugged");
    listening.says("live");
    let before = listening.json()["t_us"].as_u64().unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let last = listening
        .out
        .try_iter()
        .last()
        .map(|l| serde_json::from_str::<Value>(&l).unwrap());
    let last = last.unwrap()["t_us"].as_u64().unwrap();
    assert!(last > before, "{last} after {before}");
}

/// Which gauges fail, how and when, in the lines and in words; and that they are taken back.
#[test]
fn gauges_that_fail_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("faults.hapdrec");
    let recording = recording.to_str().unwrap();
    let faults = ["--fault", "stuck:2@10+4", "--fault", "noisy:4@12+4"];
    let once = ["--seconds", "25", "--record", recording];
    // Of a coarser converter nobody could tell that a channel does not change.
    let fine = [
        "board",
        "--simulate",
        "--quality",
        "draft",
        "--rate",
        "500",
        "--bits",
        "16",
    ];
    let mut board = start(&[&fine[..], &once, &faults].concat());
    assert!(board.child.wait().unwrap().success());
    let listening = listen(recording, &["--fast", "--every", "50"]);
    let lines: Vec<String> = listening.out.iter().collect();
    let mut seen = Vec::new();
    for line in lines {
        let line: Value = serde_json::from_str(&line).unwrap();
        let second = line["t_us"].as_f64().unwrap() / 1e6;
        let out: Vec<_> = line["left_out"].as_object().unwrap().iter().collect();
        let used = line["channels_ok"].as_u64().unwrap();
        assert!(used == 0 || used == 10 - out.len() as u64, "{line}");
        for (gauge, why) in out {
            seen.push((gauge.clone(), why.as_str().unwrap().to_owned(), second));
        }
    }
    for (gauge, why, from) in [("3", "stuck", 10.0), ("5", "noisy", 12.0)] {
        let ills = seen.iter().filter(|(g, w, _)| g == gauge && w == why);
        let seconds: Vec<f64> = ills.map(|(.., second)| *second).collect();
        let (first, last) = (seconds[0] - from, seconds[seconds.len() - 1] - from);
        // For as long as it lasts, and a little.
        let told = (0.0..1.0).contains(&first) && (3.9..5.5).contains(&last);
        assert!(told, "gauge {gauge}: {first} to {last} s");
    }
    assert!(seen.iter().all(|(g, ..)| g == "3" || g == "5"), "{seen:?}");
    let words: Vec<String> = listening.err.iter().collect();
    let told: Vec<&str> = (words.iter())
        .filter_map(|w| w.strip_prefix("hapdef: gauge "))
        .collect();
    let begins = |k: usize, with: &str| assert!(told[k].starts_with(with), "{told:?}");
    begins(0, "3 is left out. It does not change");
    begins(1, "5 is left out. It is far noisier");
    begins(2, "3 is trusted again");
    begins(3, "5 is trusted again");
    assert_eq!(told.len(), 4, "{told:?}");
}

/// What a board says when it has recorded a minute with some options more, and the rms of what presses along the surface over
/// what presses, by its truth; nothing where that is not told.
fn recorded_with(more: &[&str]) -> (Value, Option<f64>) {
    let folder = tempfile::tempdir().unwrap();
    let [recording, truth] = ["b.hapdrec", "t.csv"].map(|name| folder.path().join(name));
    let minute = ["board", "--simulate", "--quality", "draft", "--rate", "20"];
    let files = ["--seconds", "60", "--record", recording.to_str().unwrap()];
    let truth_args = ["--truth", truth.to_str().unwrap()];
    let said = start(&[&minute[..], &files, &truth_args, more].concat()).json();
    let text = std::fs::read_to_string(&truth).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|h| *h == name);
    let force = column("force_n").unwrap();
    let Some(first) = column("fx_n") else {
        return (said, None);
    };
    let squares = text.lines().skip(1).filter_map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |k: usize| cells[k].parse::<f64>().ok();
        let pressing = number(force)?;
        let whole: f64 = (first..first + 3).filter_map(number).map(|f| f * f).sum();
        Some((whole / (pressing * pressing) - 1.0).max(0.0))
    });
    let squares: Vec<f64> = squares.collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    (said, Some(mean.sqrt()))
}

#[test]
fn a_board_has_the_gain_and_its_touches_the_friction_that_were_asked_for() {
    let (weak, straight) = recorded_with(&["--gain", "5"]);
    let (strong, aside) = recorded_with(&["--gain", "50", "--friction", "30"]);
    assert_eq!(
        (&weak["gain"], &strong["gain"]),
        (&5.0.into(), &50.0.into())
    );
    let count = |said: &Value| said["microstrain_per_count"].as_f64().unwrap();
    // To three digits.
    assert!((count(&weak) / count(&strong) - 10.0).abs() < 0.1);
    assert_eq!(straight, None);
    let aside = aside.unwrap();
    assert!((0.2..0.4).contains(&aside), "{aside}");
}

/// A recording outlives the program that is killed while it writes it, and says the same each time.
#[test]
fn a_recording_survives_a_kill() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("killed.hapdrec");
    let (_board, port) = board(&["--tcp"]);
    let mut listening = listen(
        &port,
        &["--every", "50", "--record", file.to_str().unwrap()],
    );
    // A busy machine takes its time to be live; counted is what comes after.
    listening.says("live");
    let end = Instant::now() + Duration::from_secs(5);
    while Instant::now() < end {
        listening.line();
    }
    listening.child.kill().unwrap();
    let table = |name: &str| {
        let csv = folder.path().join(name);
        let replay = listen(
            file.to_str().unwrap(),
            &["--fast", "--csv", csv.to_str().unwrap()],
        );
        replay.says("the recording is over");
        let lines: Vec<String> = replay.out.iter().collect();
        (lines, std::fs::read_to_string(csv).unwrap())
    };
    let (first, csv) = table("a.csv");
    let (second, again) = table("b.csv");
    assert!(first.len() > 2000, "{}", first.len());
    assert_eq!(first, second);
    assert_eq!(csv, again);
    assert_eq!(csv.lines().count(), first.len() + 1);
    assert!(csv.starts_with("t_us,count_0,count_1,"));
    // Nothing is written over.
    let refused = listen(
        &port,
        &["--record", file.to_str().unwrap(), "--seconds", "2"],
    );
    refused.says("already");
}

/// A board of another kind: what it sends, to the first who connects. It takes nobody else.
fn other_board(send: impl Fn(&mut TcpStream) -> std::io::Result<()> + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        let (mut visitor, _) = listener.accept().unwrap();
        drop(listener);
        let _ = send(&mut visitor);
    });
    address
}

#[test]
fn plain_lines_are_understood_behind_any_garbage() {
    let address = other_board(|stream| {
        let noise: Vec<u8> = (0..3_000_000_u32)
            .map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8)
            .collect();
        stream.write_all(&noise)?;
        stream.write_all(b"\r\nHello from a sketch\r\n")?;
        for k in 0..u32::MAX {
            let row: Vec<String> = (0..10)
                .map(|c| (2000 + c + (k * 7 + c * 3) % 5).to_string())
                .collect();
            stream.write_all(format!("{}\r\n", row.join(",")).as_bytes())?;
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    });
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lines.hapdrec");
    let file = file.to_str().unwrap();
    let mut listening = listen(&address, &["--record", file]);
    listening.says("live");
    let (mut good, mut seen, begun) = (0, Vec::new(), Instant::now());
    // Those that came while the model was computed come at once; a recording is written every second.
    while seen.len() < 500 || begun.elapsed() < Duration::from_secs(3) {
        let line = listening.json();
        assert!(line["x_mm"].is_null(), "nothing touches: {line}");
        good = good.max(line["channels_ok"].as_u64().unwrap());
        seen.push(line);
    }
    listening.child.kill().unwrap();
    let again = listen(file, &["--fast"]);
    for line in seen.iter().take(400) {
        assert_eq!(&again.json(), line);
    }
    assert_eq!(good, 10);
}

#[test]
fn what_is_no_board_is_said() {
    let refused = |args: &[&str], said: &str| {
        let running = start(args);
        running.says(said);
    };
    refused(
        &["listen", "/dev/no-such-port", "--quality", "draft"],
        "plug the board in",
    );
    refused(
        &["listen", "127.0.0.1:1", "--quality", "draft"],
        "does not answer",
    );
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().join("empty.hapdrec");
    std::fs::write(&empty, b"no recording").unwrap();
    refused(
        &["listen", empty.to_str().unwrap(), "--quality", "draft"],
        "no recording",
    );
    refused(&["board", "--simulate", "--fault", "deaf:3"], "is no fault");
    assert!(!Path::new("/dev/no-such-port").exists());
}

/// How a command ended, and what it said on stderr; what it prints goes where it is told.
fn ended(args: &[&str], stdout: Stdio) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(args)
        .stdin(Stdio::null())
        .stdout(stdout)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
        .wait_with_output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    (output.status.code(), said)
}

#[test]
fn numbers_out_of_range_are_wrong_usage() {
    for (command, flag, value, range) in [
        ("listen", "--every", "nan", "from 0.001 to 1000000"),
        ("listen", "--every", "0", "from 0.001"),
        ("listen", "--seconds", "nan", "from 0 to"),
        ("listen", "--seconds", "inf", "from 0 to"),
        ("listen", "--rate", "0", "1..=65535"),
        ("listen", "--baud", "0", "50..="),
        ("board", "--seconds", "nan", "from 0 to"),
        ("board", "--rate", "0", "1..=10000"),
        ("board", "--bits", "25", "1..=24"),
        ("board", "--channels", "0", "1..=64"),
        ("board", "--channels", "65", "1..=64"),
        ("board", "--noise", "nan", "from 0 to 100000"),
        ("board", "--drift", "inf", "from 0 to 100000"),
        ("board", "--drift", "-1", "from 0 to 100000"),
        ("board", "--wander", "4@0", "as 4@10"),
        ("board", "--friction", "101", "from 0 to 100"),
        ("board", "--flip", "1.5", "from 0 to 1"),
        ("board", "--drop", "nan", "from 0 to 1"),
        ("board", "--duplicate", "nan", "from 0 to 1"),
        ("board", "--lose", "2", "from 0 to 1"),
        ("board", "--workshop", "any", "exact, gains or all"),
        ("board", "--fault", "dead:x", "is no fault"),
    ] {
        let first = if command == "listen" {
            "COM99"
        } else {
            "--simulate"
        };
        let (code, said) = ended(&[command, first, flag, value], Stdio::null());
        assert!(
            code == Some(2) && said.contains(range) && said.contains(flag),
            "{command} {flag} {value}: {code:?} {said}"
        );
    }
}

fn hello(version: u8) -> WireMessage {
    WireMessage::Hello(Hello {
        version,
        board: 7,
        channels: 16,
        bits: 12,
        reference_mv: 3300,
        supply_mv: 5000,
        gain_milli: 330_000,
        rate_hz: 1000,
        name: "limb".into(),
    })
}

/// A board at rest.
fn recording(samples: u16) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode(&hello(VERSION), 0, 0, 12, &mut bytes);
    for k in 1..=samples {
        let count = |c: u32| 2000 + (u32::from(k) * 7 + c * 3) % 5;
        let counts = WireMessage::Data((0..16).map(count).collect());
        encode(&counts, k, 1000 * u32::from(k), 12, &mut bytes);
    }
    bytes
}

/// With a quality that takes minutes: what is wrong is said in seconds.
#[test]
fn what_is_wrong_is_said_before_the_model_is_computed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (garbage, far, sound) = (at("garbage.hapdrec"), at("far.csv"), at("sound.hapdrec"));
    let (nowhere, csv) = (at("none/a"), at("a.csv"));
    let head = "start_s,duration_s,x_mm,y_mm,z_mm,force_n";
    std::fs::write(&garbage, vec![0x41; 20_000]).unwrap();
    std::fs::write(&far, format!("{head}\n1,1,1e160,0,0,5\n")).unwrap();
    std::fs::write(&sound, recording(1)).unwrap();
    let cases: Vec<(Vec<&str>, &str)> = vec![
        (
            vec!["listen", "127.0.0.1:1", "--csv", &csv],
            "does not answer",
        ),
        (vec!["listen", &garbage], "no recording"),
        (
            vec!["listen", &sound, "--record", &nowhere],
            "cannot be begun",
        ),
        (
            vec!["listen", &sound, "--csv", &nowhere],
            "cannot be written",
        ),
        (
            vec!["listen", &sound, "--csv", &sound],
            "the recording itself",
        ),
        (
            vec!["listen", &sound, "--serve", "nowhere"],
            "--serve nowhere",
        ),
        (
            vec!["board", "--simulate", "--script", &nowhere],
            "no such file",
        ),
        (
            vec!["board", "--simulate", "--script", &far],
            "from the part",
        ),
        (
            vec!["board", "--simulate", "--truth", &nowhere],
            "cannot be written",
        ),
        (
            vec!["board", "--simulate", "--tcp", "127.0.0.1:99999"],
            "nothing can be listened to",
        ),
        (vec!["board", "--simulate", "--fault", "dead:99"], "from 0"),
        (
            vec!["board", "--simulate", "--channels", "1"],
            "--channels 1",
        ),
        (
            vec!["board", "--simulate", "--force", "9", "2"],
            "smaller one first",
        ),
    ];
    for (args, why) in cases {
        let args = [&args[..], &["--quality", "reference"]].concat();
        let (code, said) = ended(&args, Stdio::null());
        assert!(
            code == Some(1) && said.contains(why),
            "{args:?}: {code:?} {said}"
        );
        assert!(
            !said.contains("Assembling"),
            "before anything is computed: {said}"
        );
    }
    assert!(!Path::new(&csv).exists(), "nothing was begun");
    assert_eq!(std::fs::read(&sound).unwrap(), recording(1));
}

/// Whoever is served may have the rest taken again, and is told what is no order.
#[test]
fn the_rest_is_taken_again_when_it_is_asked_for() {
    let (_board, port) = board(&[]);
    let door = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = door.local_addr().unwrap().to_string();
    drop(door);
    let listening = listen(&port, &["--every", "20", "--serve", &address]);
    listening.json();
    let mut client = TcpStream::connect(&address).unwrap();
    let mut served = BufReader::new(client.try_clone().unwrap()).lines();
    let mut line = move || served.next().unwrap().unwrap();
    assert!(line().starts_with("{\"t_us\""));
    for order in ["tare\n", "{\"command\":\"tare\"}\n"] {
        client.write_all(order.as_bytes()).unwrap();
        listening.says("the rest is taken again");
    }
    client.write_all(b"tear\n").unwrap();
    let refused = (0..100).map(|_| line()).find(|l| l.contains("error"));
    assert!(refused.unwrap().contains("no order: write"));
}

/// Nobody is left to believe that all is there: a full disk ends with a message, a closed pipe quietly.
#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_written_ends_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rest.hapdrec");
    std::fs::write(&file, recording(2000)).unwrap();
    let file = file.to_str().unwrap();
    let args = ["listen", file, "--fast", "--quality", "draft"];
    let full = std::fs::File::options()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let no_room = |(code, said): (Option<i32>, String)| {
        assert!(
            code == Some(1) && said.contains("No space left"),
            "{code:?} {said}"
        );
    };
    no_room(ended(&args, full.into()));
    let csv = [&args[..], &["--csv", "/dev/full"]].concat();
    no_room(ended(&csv, Stdio::null()));
    no_room(ended(
        &["board", "--simulate", "--truth", "/dev/full"],
        Stdio::null(),
    ));
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let (code, said) = ended(&args, writer.into());
    assert!(
        code == Some(0) && !said.contains("panicked"),
        "{code:?} {said}"
    );
}

/// A board that cannot be understood is not waited for without a word.
#[test]
fn why_a_board_is_not_understood_is_said() {
    let address = other_board(|stream| {
        let mut greeting = vec![0];
        encode(&hello(9), 0, 0, 12, &mut greeting);
        loop {
            stream.write_all(&greeting)?;
            std::thread::sleep(Duration::from_millis(50));
        }
    });
    let args = ["listen", &address, "--quality", "draft", "--seconds", "2"];
    let (code, said) = ended(&args, Stdio::null());
    let reasons = said.lines().filter(|l| l.contains("version 9")).count();
    assert!(code == Some(0) && reasons == 1, "{code:?} {said}");
}
