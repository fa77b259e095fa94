//! Ports: serial lines, sockets and recordings behind one small trait, and the thread that listens.

mod benching;
mod counted_line;
#[cfg(feature = "foxglove")]
mod foxglove;
mod held;
mod host;
#[cfg(feature = "mcap")]
mod mcap_log;
#[cfg(not(all(feature = "mcap", feature = "foxglove")))]
mod not_built;
mod port;
mod ports;
mod pressed;
mod recorded;
mod recording;
mod replay;
mod rewritten;
mod serial;
mod session;
mod socket;
mod table;
#[cfg(any(feature = "mcap", feature = "foxglove"))]
mod touch_messages;
mod truths;

use std::fmt;
use std::path::{Path, PathBuf};

pub use benching::{BY_HAND, BenchOrder, press_at_ports, press_simulated};
#[cfg(feature = "foxglove")]
pub use foxglove::FoxgloveServer;
pub use held::HeldConnection;
pub use host::{Doorway, Entrance, Hosted, host};
#[cfg(feature = "mcap")]
pub use mcap_log::McapLog;
#[cfg(not(feature = "foxglove"))]
pub use not_built::FoxgloveServer;
#[cfg(not(feature = "mcap"))]
pub use not_built::McapLog;
pub use port::{Got, Pace, Port};
pub use ports::{PortInfo, ports};
pub use pressed::{BenchPress, bench_presses};
pub use recorded::{check_length, record};
pub use recording::{Recorder, old_note};
pub use replay::RecordingExtent;
pub use rewritten::{write_messages, write_table};
pub use session::{Connection, ConnectionState, Listener, ListenerCommand, SessionEvent, Timing};
pub use table::SampleTable;
pub use truths::Truths;

/// Where a board is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    Serial {
        path: String,
        baud: u32,
    },
    /// host:port
    Socket(String),
    Recording {
        path: PathBuf,
        pace: Pace,
    },
}

/// What native USB ports and most sketches are opened with; USB itself does not care.
pub const BAUD: u32 = 115_200;
/// The ending of recordings.
pub const ENDING: &str = "hapdrec";

impl Address {
    /// Understands what a person writes: a file of the recordings' ending, host:port, or the name of a port.
    #[must_use]
    pub fn parse(text: &str, baud: u32, pace: Pace) -> Self {
        if Path::new(text).extension().is_some_and(|e| e == ENDING) {
            return Self::Recording {
                path: text.into(),
                pace,
            };
        }
        let is_socket = text.rsplit_once(':').is_some_and(|(host, port)| {
            !host.is_empty() && !host.starts_with('/') && port.parse::<u16>().is_ok()
        });
        if is_socket {
            Self::Socket(text.to_owned())
        } else {
            Self::Serial {
                path: text.to_owned(),
                baud,
            }
        }
    }

    fn open(&self) -> Result<Box<dyn Port>, String> {
        match self {
            Self::Serial { path, baud } => serial::open(path, *baud),
            Self::Socket(address) => socket::open(address),
            Self::Recording { path, pace } => replay::open(path, *pace),
        }
    }

    /// Whether there is anything to listen to, before time is spent on anything else.
    ///
    /// # Errors
    /// A message that says what is wrong with the port, the host or the recording.
    pub fn check(&self) -> Result<(), String> {
        self.open().map(drop)
    }

    /// As [`Self::check`]; a socket stays open, for [`Listener::holding`] to go on with.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn hold(&self) -> Result<Option<HeldConnection>, String> {
        match self {
            Self::Socket(address) => HeldConnection::new(socket::connect(address)?).map(Some),
            Self::Serial { .. } | Self::Recording { .. } => self.check().map(|()| None),
        }
    }

    /// Whether it has an end.
    #[must_use]
    pub fn is_recording(&self) -> bool {
        matches!(self, Self::Recording { .. })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial { path, .. } => write!(f, "{path}"),
            Self::Socket(address) => write!(f, "{address}"),
            Self::Recording { path, .. } => write!(f, "{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_write_is_understood() {
        let parse = |text: &str| Address::parse(text, 9600, Pace::Real);
        let serial = |path: &str| Address::Serial {
            path: path.into(),
            baud: 9600,
        };
        assert_eq!(parse("/dev/ttyACM0"), serial("/dev/ttyACM0"));
        assert_eq!(parse("COM3"), serial("COM3"));
        assert_eq!(
            parse("/dev/serial/by-path/pci-0:1"),
            serial("/dev/serial/by-path/pci-0:1")
        );
        assert_eq!(
            parse("robot.local:5000"),
            Address::Socket("robot.local:5000".into())
        );
        assert_eq!(parse("[::1]:5000"), Address::Socket("[::1]:5000".into()));
        assert!(parse("/tmp/a:1.hapdrec").is_recording());
    }
}
