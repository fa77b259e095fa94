//! Boards behind TCP: a network bridge, or a simulated board.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use super::port::{Got, Port};

pub(super) struct Socket(TcpStream);

/// How long a read waits.
pub(super) const WAIT: Duration = Duration::from_millis(5);
const CONNECT: Duration = Duration::from_millis(800);

impl Socket {
    pub(super) fn new(stream: TcpStream) -> Self {
        Self(stream)
    }
}

pub(super) fn open(address: &str) -> Result<Box<dyn Port>, String> {
    Ok(Box::new(Socket(connect(address)?)))
}

/// A connection that a read waits a moment at.
pub(super) fn connect(address: &str) -> Result<TcpStream, String> {
    let all = address
        .to_socket_addrs()
        .map_err(|e| format!("{address}: no such host ({e}). Write host:port"))?;
    let mut last = String::from("no address");
    for one in all {
        match TcpStream::connect_timeout(&one, CONNECT) {
            Ok(stream) => {
                let _ = stream.set_nodelay(true);
                let _ = stream.set_read_timeout(Some(WAIT));
                let _ = stream.set_write_timeout(Some(Duration::from_millis(100)));
                return Ok(stream);
            }
            Err(e) => last = e.to_string(),
        }
    }
    Err(format!(
        "{address} does not answer ({last}): is the board's program running?"
    ))
}

impl Port for Socket {
    fn read(&mut self, buffer: &mut [u8]) -> Got {
        Got::of(self.0.read(buffer))
    }

    fn write(&mut self, bytes: &[u8]) {
        let _ = self.0.write_all(bytes);
    }
}
