//! Touches as they come, to viewers that speak Foxglove's WebSocket protocol.
#![cfg(feature = "foxglove")]

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

#[cfg(feature = "studio")]
use egui_kittest::kittest::Queryable as _;
use glam::DVec3;
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket};

use crate::board::{board, listen, start};

/// How long anything may take (s).
const SECONDS: u64 = 60;

/// Where it is served.
fn served(listener: &crate::board::Running) -> String {
    let said = listener.says("Foxglove finds touches at ws://");
    said.rsplit("ws://").next().unwrap().trim().to_owned()
}

fn viewer(address: &str, protocol: &str) -> Result<WebSocket<TcpStream>, String> {
    let mut asked = format!("ws://{address}/").into_client_request().unwrap();
    let protocol = HeaderValue::from_str(protocol).unwrap();
    let headers = asked.headers_mut();
    headers.insert("sec-websocket-protocol", protocol);
    let stream = TcpStream::connect(address).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(SECONDS)))
        .unwrap();
    let entered = tungstenite::client(asked, stream);
    entered.map(|(socket, _)| socket).map_err(|e| e.to_string())
}

fn said(socket: &mut WebSocket<TcpStream>) -> Value {
    loop {
        if let Message::Text(text) = socket.read().unwrap() {
            return serde_json::from_str(text.as_str()).unwrap();
        }
    }
}

/// A message: what it was asked for by, when it was (ns since 1970), and what it says.
fn data(socket: &mut WebSocket<TcpStream>) -> (u32, u64, Value) {
    loop {
        if let Message::Binary(bytes) = socket.read().unwrap() {
            assert_eq!(bytes[0], 1);
            let id = u32::from_le_bytes(bytes[1..5].try_into().unwrap());
            let at = u64::from_le_bytes(bytes[5..13].try_into().unwrap());
            return (id, at, serde_json::from_slice(&bytes[13..]).unwrap());
        }
    }
}

#[test]
fn a_viewer_sees_touches_as_they_come() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("s.csv");
    let mut text = String::from("start_s,duration_s,x_mm,y_mm,z_mm,force_n\n");
    for k in 0..40 {
        let _ = writeln!(text, "{},2.0,22.5,22.5,60,15", 6 + 4 * k);
    }
    std::fs::write(&script, text).unwrap();
    let (_board, port) = board(&["--rate", "200", "--script", script.to_str().unwrap()]);
    let listener = listen(&port, &["--foxglove", "127.0.0.1:0"]);
    let address = served(&listener);

    // Nobody who speaks something else, or nothing, keeps others from it.
    assert!(viewer(&address, "mqtt").is_err());
    let mut mute = TcpStream::connect(&address).unwrap();
    let mut noise = TcpStream::connect(&address).unwrap();
    noise.write_all(&[0xff; 4096]).unwrap();

    let mut socket = viewer(&address, "foxglove.websocket.v1, foxglove.sdk.v1").unwrap();
    let info = said(&mut socket);
    assert_eq!(
        (&info["op"], &info["name"]),
        (&json!("serverInfo"), &json!("HapDef Studio"))
    );
    let advertised = said(&mut socket);
    let mut numbers = HashMap::new();
    for channel in advertised["channels"].as_array().unwrap() {
        assert_eq!(channel["encoding"], "json");
        let schema: Value = serde_json::from_str(channel["schema"].as_str().unwrap()).unwrap();
        assert_eq!(schema["type"], "object");
        numbers.insert(
            channel["topic"].as_str().unwrap().to_owned(),
            channel["id"].clone(),
        );
    }
    let say = |socket: &mut WebSocket<TcpStream>, what: Value| {
        socket.send(Message::text(what.to_string())).unwrap();
    };
    say(
        &mut socket,
        json!({ "op": "getParameters", "parameterNames": [] }),
    );
    say(
        &mut socket,
        json!({ "op": "subscribe", "subscriptions": [{ "id": 9, "channelId": 77 }] }),
    );
    let refused = said(&mut socket);
    assert_eq!(
        (&refused["op"], &refused["level"]),
        (&json!("status"), &json!(2))
    );
    say(
        &mut socket,
        json!({ "op": "subscribe", "subscriptions": [
        { "id": 70, "channelId": numbers["/touch/contacts"] },
        { "id": 71, "channelId": numbers["/tf"] },
    ] }),
    );

    let begun = Instant::now();
    let (mut last, mut placed) = (0, 0);
    while placed < 50 {
        assert!(
            begun.elapsed() < Duration::from_secs(SECONDS),
            "no touch was seen"
        );
        let (id, at, value) = data(&mut socket);
        assert!(at >= last, "{at} after {last}");
        last = at;
        match id {
            70 => assert!(value["contacts"].is_array()),
            71 => {
                assert_eq!(value["parent_frame_id"], "limb");
                let at = ["x", "y", "z"].map(|k| value["translation"][k].as_f64().unwrap());
                let off = DVec3::from_array(at).distance(DVec3::new(0.0225, 0.0225, 0.06));
                placed += u32::from(off < 5e-3);
            }
            other => panic!("{other} was never asked for"),
        }
    }
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let off_s = now.unwrap().as_secs_f64() - last as f64 * 1e-9;
    assert!(off_s.abs() < 30.0, "{off_s} s");

    // What is not asked for any more does not come.
    say(
        &mut socket,
        json!({ "op": "unsubscribe", "subscriptionIds": [70] }),
    );
    let mut after = 0;
    while after < 20 {
        after = if data(&mut socket).0 == 70 {
            0
        } else {
            after + 1
        };
        assert!(begun.elapsed() < Duration::from_secs(2 * SECONDS));
    }
    // One who never said what it wanted is let go.
    mute.set_read_timeout(Some(Duration::from_secs(SECONDS)))
        .unwrap();
    assert_eq!(mute.read(&mut [0; 16]).unwrap(), 0);
}

#[test]
fn one_who_never_reads_holds_nobody_up() {
    let (_board, port) = board(&["--rate", "1000"]);
    let listener = listen(&port, &["--foxglove", "127.0.0.1:0"]);
    let address = served(&listener);
    let enter = |times: u32| {
        let all: Vec<Value> = (0..times)
            .map(|id| json!({ "id": id, "channelId": 0 }))
            .collect();
        let subscribe = json!({ "op": "subscribe", "subscriptions": all });
        let mut socket = viewer(&address, "foxglove.sdk.v1").unwrap();
        socket.send(Message::text(subscribe.to_string())).unwrap();
        socket
    };
    // They ask for so much that no buffer between holds it.
    let idle: Vec<WebSocket<TcpStream>> = (0..2).map(|_| enter(32)).collect();
    let mut reads = enter(1);
    // Its reads would time out.
    for _ in 0..25_000 {
        assert_eq!(data(&mut reads).0, 0);
    }
    // Those who read nothing for long were let go: what was on its way ends.
    for mut socket in idle {
        let ended = loop {
            if let Err(e) = socket.read() {
                break e;
            }
        };
        let is_kept =
            matches!(&ended, tungstenite::Error::Io(e) if e.kind() == ErrorKind::WouldBlock);
        assert!(!is_kept, "{ended}");
    }
}

#[test]
fn where_nothing_can_be_served_is_said_before_the_model_is_computed() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let (_board, port) = board(&[]);
    for address in [address.as_str(), "nowhere"] {
        let listener = start(&["listen", &port, "--quality", "draft", "--foxglove", address]);
        let said = listener.says("nothing can be served there");
        assert!(said.contains(&format!("--foxglove {address}: ")), "{said}");
    }
}

#[cfg(all(feature = "studio", feature = "mcap"))]
#[test]
fn the_window_serves_touches_and_writes_a_recording_as_messages() {
    let folder = tempfile::tempdir().unwrap();
    let mut w = crate::window::Window::open();
    w.stage("Live");
    w.press("Start a simulated board");
    w.wait("the board", 120, |s| {
        s.session.live.look(|feed| feed.tared) == Some(true)
    });
    w.session_mut().serve_touches("127.0.0.1:0");
    w.wait("the server", 30, |s| s.session.live.served_at.is_some());
    let address = w.session().live.served_at.unwrap().to_string();
    let mut socket = viewer(&address, "foxglove.sdk.v1").unwrap();
    assert_eq!(said(&mut socket)["op"], "serverInfo");
    let subscribe = json!({ "op": "subscribe", "subscriptions": [{ "id": 3, "channelId": 0 }] });
    socket.send(Message::text(subscribe.to_string())).unwrap();
    assert_eq!(data(&mut socket).0, 3);
    w.harness.run_ok();
    w.click_label("Messages for robots");
    w.assert_named("touches that are served");
    w.show("live-served");
    // Below what is seen of the form.
    let click = |w: &mut crate::window::Window, name: &str| {
        w.harness.get_by_label(name).click_accesskit();
        w.harness.run_ok();
    };
    click(&mut w, "Stop serving");
    assert_eq!(w.session().live.served_at, None);
    assert!(
        (0..100_000).any(|_| socket.read().is_err()),
        "the connection ends"
    );

    let recording = folder.path().join("r.hapdrec");
    w.session_mut().record(&recording);
    w.wait("samples", 60, |s| {
        let samples = s
            .session
            .live
            .look(|f| f.recording.as_ref().map(|r| r.samples));
        samples.flatten().is_some_and(|samples| samples > 500)
    });
    w.press("Stop recording");
    let now = std::time::SystemTime::now();
    let recorded = now
        .duration_since(std::time::UNIX_EPOCH)
        .unwrap()
        .as_secs_f64();
    let file = std::fs::File::options()
        .append(true)
        .open(&recording)
        .unwrap();
    file.set_modified(now - Duration::from_hours(24)).unwrap();
    click(&mut w, "Write messages");
    let path = recording.with_extension("mcap");
    w.wait("the messages", 60, |s| !s.session.busy() && path.is_file());
    let bytes = std::fs::read(&path).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap();
    let times: Vec<u64> = messages.map(|m| m.unwrap().log_time).collect();
    assert!(times.len() > 500);
    // Their time is when they were recorded: a recording that is copied tells it still.
    let ago = recorded - 1e-9 * times[times.len() - 1] as f64;
    assert!(ago.abs() < 5.0, "{ago}");
}
