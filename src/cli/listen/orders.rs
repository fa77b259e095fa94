//! What a listener is told while it listens: lines on standard input, and lines of whoever is served.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::sync::mpsc::Sender;

use serde::Deserialize;

use crate::link::ListenerCommand;
use crate::plain;

/// The longest line that may be an order.
const MOST: usize = 4096;

/// As JSON: `{"command":"tare"}`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Json {
    command: String,
}

/// What a line asks for; nothing where it is empty.
///
/// # Errors
/// Why it is no order, with what is one.
pub fn order(line: &str) -> Result<Option<ListenerCommand>, String> {
    let line = line.trim();
    let json = serde_json::from_str::<Json>(line).ok();
    match json.as_ref().map_or(line, |json| json.command.as_str()) {
        "" => Ok(None),
        "t" | "tare" => Ok(Some(ListenerCommand::Tare)),
        _ => Err(format!(
            "{} is no order: write “tare” to take the rest again",
            plain::quote(line)
        )),
    }
}

/// Cuts what comes into lines.
#[derive(Default)]
struct OrderLines {
    open: Vec<u8>,
}

impl OrderLines {
    /// The lines that these bytes end. What is too long for an order is none.
    fn push(&mut self, bytes: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        for &byte in bytes {
            if byte == b'\n' {
                lines.push(String::from_utf8_lossy(&self.open).into_owned());
                self.open.clear();
            } else if self.open.len() < MOST {
                self.open.push(byte);
            }
        }
        lines
    }
}

/// Somebody who is served, and may give orders.
pub struct Client {
    stream: TcpStream,
    lines: OrderLines,
}

impl Client {
    /// One who has just come.
    ///
    /// # Errors
    /// Where the connection cannot be read without waiting.
    pub fn new(stream: TcpStream) -> std::io::Result<Self> {
        stream.set_nonblocking(true)?;
        Ok(Self {
            stream,
            lines: OrderLines::default(),
        })
    }

    /// Whether a line could be sent: one who does not keep up is let go rather than waited for.
    pub fn tell(&mut self, line: &str) -> bool {
        self.stream
            .write_all(format!("{line}\n").as_bytes())
            .is_ok()
    }

    /// Lines that have come.
    pub fn hear(&mut self) -> Vec<String> {
        let mut lines = Vec::new();
        let mut buffer = [0; 1024];
        loop {
            match self.stream.read(&mut buffer) {
                // Gone: that shows when something is told.
                Ok(0) => return lines,
                Ok(count) => lines.extend(self.lines.push(&buffer[..count])),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(_) => return lines,
            }
        }
    }
}

/// Takes orders from standard input as long as there is one.
pub fn from_stdin(commands: Sender<ListenerCommand>, say: fn(&str)) {
    let listen = move || {
        let mut lines = OrderLines::default();
        let mut buffer = [0; 1024];
        loop {
            if !may_read() {
                std::thread::sleep(std::time::Duration::from_millis(200));
                continue;
            }
            let Ok(count @ 1..) = std::io::stdin().lock().read(&mut buffer) else {
                return;
            };
            for line in lines.push(&buffer[..count]) {
                match order(&line) {
                    Ok(None) => {}
                    // A listener that has ended hears nothing any more.
                    Ok(Some(command)) => drop(commands.send(command)),
                    Err(why) => say(&why),
                }
            }
        }
    };
    // Without a thread there are no orders, and all else works.
    let _ = std::thread::Builder::new()
        .name("orders".into())
        .spawn(listen);
}

/// Whether reading from standard input does no harm: a terminal stops whoever reads from it in the background.
#[cfg(unix)]
fn may_read() -> bool {
    use std::io::IsTerminal as _;
    let stdin = std::io::stdin();
    if !stdin.is_terminal() {
        return true;
    }
    let waits = rustix::event::PollFd::new(&stdin, rustix::event::PollFlags::IN);
    let soon = rustix::event::Timespec {
        tv_sec: 0,
        tv_nsec: 200_000_000,
    };
    let ready = rustix::event::poll(&mut [waits], Some(&soon)).is_ok_and(|count| count > 0);
    let owner = rustix::termios::tcgetpgrp(&stdin);
    ready && owner.is_ok_and(|group| group == rustix::process::getpgrp())
}

#[cfg(not(unix))]
fn may_read() -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_few_and_the_rest_is_refused_with_what_is_one() {
        for text in ["t", " tare ", r#"{"command":"tare"}"#] {
            assert!(
                matches!(order(text), Ok(Some(ListenerCommand::Tare))),
                "{text}"
            );
        }
        assert!(matches!(order("  "), Ok(None)));
        for text in [
            "tear",
            r#"{"command":"tare","x":1}"#,
            r#"{"command":1}"#,
            "\u{1b}[2J",
        ] {
            let why = order(text).err().unwrap();
            assert!(why.contains("“tare”") && !why.contains('\u{1b}'), "{why}");
        }
    }

    #[test]
    fn lines_come_in_pieces() {
        let mut lines = OrderLines::default();
        assert!(lines.push(b"ta").is_empty());
        assert_eq!(lines.push(b"re\nt\nrest"), ["tare", "t"]);
        assert!(lines.push(&vec![b'x'; 3 * MOST]).is_empty());
        assert_eq!(lines.push(b"\nt\n")[1], "t");
    }
}
