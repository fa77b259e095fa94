//! A socket that is opened before anybody can listen. Programs that play a board often take one visitor and go when he
//! does: he stays, and nothing of what is said to him meanwhile is lost.

use std::collections::VecDeque;
use std::io::Read as _;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Instant;

use super::port::{Got, Port};
use super::socket::{Socket, WAIT};

/// The most bytes that are kept; then the other side has to wait.
const MOST: usize = 32 << 20;

/// What came at once, and when.
struct Chunk {
    bytes: Vec<u8>,
    came: Instant,
}

/// A connection whose bytes are kept until it is listened to.
pub struct HeldConnection {
    reading: Option<JoinHandle<(TcpStream, VecDeque<Chunk>)>>,
    stop: Arc<AtomicBool>,
    /// When it was opened.
    pub(super) since: Instant,
}

impl HeldConnection {
    /// Begins to keep what comes.
    ///
    /// # Errors
    /// When no thread can be had.
    pub(super) fn new(stream: TcpStream) -> Result<Self, String> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopping = Arc::clone(&stop);
        let reading = std::thread::Builder::new()
            .name("held".into())
            .spawn(move || keep(stream, &stopping))
            .map_err(|e| format!("the connection cannot be kept open ({e})"))?;
        Ok(Self {
            reading: Some(reading),
            stop,
            since: Instant::now(),
        })
    }

    /// What was kept, and then what comes.
    pub(super) fn port(mut self) -> Option<Box<dyn Port>> {
        self.stop.store(true, Ordering::Relaxed);
        let (stream, kept) = self.reading.take()?.join().ok()?;
        Some(Box::new(KeptBytes {
            chunks: kept,
            read: 0,
            came: None,
            rest: Socket::new(stream),
        }))
    }
}

impl Drop for HeldConnection {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

fn keep(mut stream: TcpStream, stop: &AtomicBool) -> (TcpStream, VecDeque<Chunk>) {
    let (mut kept, mut count, mut buffer) = (VecDeque::new(), 0, vec![0; 1 << 16]);
    while !stop.load(Ordering::Relaxed) {
        if count >= MOST {
            std::thread::sleep(WAIT);
            continue;
        }
        match Got::of(stream.read(&mut buffer)) {
            Got::Bytes(more) => {
                count += more;
                kept.push_back(Chunk {
                    bytes: buffer[..more].to_vec(),
                    came: Instant::now(),
                });
            }
            Got::Nothing => {}
            // Whoever listens finds that out by himself.
            Got::Gone => break,
        }
    }
    (stream, kept)
}

struct KeptBytes {
    chunks: VecDeque<Chunk>,
    /// How many bytes of the first were read.
    read: usize,
    /// When those came that were read last; nothing where all were read that were kept.
    came: Option<Instant>,
    rest: Socket,
}

impl Port for KeptBytes {
    fn read(&mut self, buffer: &mut [u8]) -> Got {
        let Some(first) = self.chunks.front() else {
            self.came = None;
            return self.rest.read(buffer);
        };
        self.came = Some(first.came);
        let left = &first.bytes[self.read..];
        let count = left.len().min(buffer.len());
        buffer[..count].copy_from_slice(&left[..count]);
        self.read += count;
        if self.read == first.bytes.len() {
            self.chunks.pop_front();
            self.read = 0;
        }
        Got::Bytes(count)
    }

    fn came(&self) -> Instant {
        self.came.unwrap_or_else(Instant::now)
    }

    fn write(&mut self, bytes: &[u8]) {
        self.rest.write(bytes);
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::net::TcpListener;
    use std::time::{Duration, Instant};

    use super::super::{Address, Pace};
    use super::*;

    /// Reads until so many bytes were there, or it is gone.
    fn all(port: &mut dyn Port, count: usize) -> Vec<u8> {
        let (mut found, mut buffer, begun) = (Vec::new(), [0; 1000], Instant::now());
        while found.len() < count && begun.elapsed() < Duration::from_secs(10) {
            let wanted = buffer.len().min(count - found.len());
            match port.read(&mut buffer[..wanted]) {
                Got::Bytes(count) => found.extend_from_slice(&buffer[..count]),
                Got::Nothing => {}
                Got::Gone => break,
            }
        }
        found
    }

    #[test]
    fn one_visitor_hears_all_and_is_heard() {
        let door = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = door.local_addr().unwrap().to_string();
        let said: Vec<u8> = (0..300_000_u32).map(|k| k as u8).collect();
        let (whole, more) = (said.clone(), said.clone());
        let board = std::thread::spawn(move || {
            let (mut visitor, _) = door.accept().unwrap();
            // There is no other one.
            drop(door);
            visitor.write_all(&whole).unwrap();
            let mut asked = [0; 3];
            visitor.read_exact(&mut asked).unwrap();
            visitor.write_all(&more).unwrap();
            asked
        });
        let held = Address::parse(&address, 9600, Pace::Real).hold().unwrap();
        std::thread::sleep(Duration::from_millis(200));
        let begun = Instant::now();
        let mut port = held.unwrap().port().unwrap();
        assert!(all(&mut *port, 1000) == said[..1000]);
        assert!(port.came() < begun, "it had come before");
        assert!(all(&mut *port, said.len() - 1000) == said[1000..]);
        port.write(b"ask");
        assert!(all(&mut *port, said.len()) == said);
        assert_eq!(board.join().unwrap(), *b"ask");
        assert!(all(&mut *port, 1).is_empty());
    }

    #[test]
    fn nobody_there_is_said() {
        let refused = Address::parse("127.0.0.1:1", 9600, Pace::Real).hold();
        assert!(refused.is_err_and(|why| why.contains("does not answer")));
    }
}
