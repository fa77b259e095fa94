//! Carries a simulated board: a pseudo-terminal where there are any, or a socket.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::board::{SimulatedBoard, Truth};

/// How often the board is looked after.
const TURN: Duration = Duration::from_micros(800);
/// Bytes that may wait for somebody to take them; more are lost.
const WAITING: usize = 16 * 1024;

/// What a simulated board can be reached by.
pub enum Doorway {
    /// A pseudo-terminal.
    #[cfg(unix)]
    Terminal,
    /// An address to listen at; port 0 takes any that is free.
    Socket(String),
}

/// A simulated board that runs on a thread of its own until this is dropped.
pub struct Hosted {
    pub port: String,
    pub board: Arc<Mutex<SimulatedBoard>>,
    begun: Instant,
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Hosted {
    /// Seconds on the board's clock.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }
}

impl Drop for Hosted {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// One way in and out of the board.
trait Door: Send {
    /// Takes what fits; nothing where nobody is there.
    fn write(&mut self, bytes: &[u8]) -> usize;
    fn read(&mut self, buffer: &mut [u8]) -> usize;
    fn unplug(&mut self);
    fn plug(&mut self);
}

/// A doorway that is open, before there is a board behind it.
pub struct Entrance {
    door: Box<dyn Door>,
    port: String,
}

impl Doorway {
    /// Opens it.
    ///
    /// # Errors
    /// When there is no such port, or it is taken.
    pub fn open(&self) -> Result<Entrance, String> {
        let (door, port): (Box<dyn Door>, String) = match self {
            #[cfg(unix)]
            Self::Terminal => terminal::open()?,
            Self::Socket(address) => {
                let door = SocketDoor::open(address)?;
                let port = door.name.clone();
                (Box::new(door), port)
            }
        };
        Ok(Entrance { door, port })
    }
}

/// Starts a board behind an entrance. `tell` hears what really happened at every sample.
///
/// # Errors
/// When no thread can be had.
pub fn host(
    board: SimulatedBoard,
    entrance: Entrance,
    mut tell: impl FnMut(Truth) + Send + 'static,
) -> Result<Hosted, String> {
    let Entrance { mut door, port } = entrance;
    let board = Arc::new(Mutex::new(board));
    let stop = Arc::new(AtomicBool::new(false));
    let begun = Instant::now();
    let (shared, stopping) = (Arc::clone(&board), Arc::clone(&stop));
    let run = move || {
        let mut waiting = Vec::new();
        let mut plugged = true;
        let mut buffer = [0_u8; 1024];
        while !stopping.load(Ordering::Relaxed) {
            let now = begun.elapsed().as_micros() as u64;
            if let Ok(mut board) = shared.lock() {
                let unplugged = board.is_unplugged(now);
                if unplugged == plugged {
                    plugged = !unplugged;
                    waiting.clear();
                    if plugged {
                        door.plug();
                        board.restart(now);
                    } else {
                        door.unplug();
                    }
                }
                if plugged {
                    let count = door.read(&mut buffer);
                    board.receive(&buffer[..count], now, &mut waiting);
                    board.say(now, &mut waiting, &mut tell);
                    let taken = door.write(&waiting);
                    waiting.drain(..taken);
                    if waiting.len() > WAITING {
                        board.overruns += 1;
                        waiting.clear();
                    }
                }
            }
            std::thread::sleep(TURN);
        }
    };
    let thread = std::thread::Builder::new()
        .name("simulated board".into())
        .spawn(run)
        .map_err(|e| format!("the simulated board cannot be started ({e})"))?;
    Ok(Hosted {
        port,
        board,
        begun,
        stop,
        thread: Some(thread),
    })
}

struct SocketDoor {
    name: String,
    listener: Option<TcpListener>,
    client: Option<TcpStream>,
}

impl SocketDoor {
    fn open(address: &str) -> Result<Self, String> {
        let failed = |e: std::io::Error| {
            format!("{address}: nothing can be listened to there ({e}). Choose another address")
        };
        let listener = TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let name = listener.local_addr().map_err(failed)?.to_string();
        Ok(Self {
            name,
            listener: Some(listener),
            client: None,
        })
    }

    fn accept(&mut self) {
        if let Some(Ok((stream, _))) = self.listener.as_ref().map(TcpListener::accept) {
            let _ = stream.set_nonblocking(true);
            let _ = stream.set_nodelay(true);
            self.client = Some(stream);
        }
    }
}

impl Door for SocketDoor {
    fn write(&mut self, bytes: &[u8]) -> usize {
        self.accept();
        let Some(client) = &mut self.client else {
            return bytes.len();
        };
        match client.write(bytes) {
            Ok(count) => count,
            Err(e) if e.kind() == ErrorKind::WouldBlock => 0,
            Err(_) => {
                self.client = None;
                bytes.len()
            }
        }
    }

    fn read(&mut self, buffer: &mut [u8]) -> usize {
        match self.client.as_mut().map(|c| c.read(buffer)) {
            Some(Ok(0)) => {
                self.client = None;
                0
            }
            Some(Ok(count)) => count,
            _ => 0,
        }
    }

    fn unplug(&mut self) {
        // The listener first: one who comes back at once must not be let in by what is about to go.
        self.listener = None;
        self.client = None;
    }

    fn plug(&mut self) {
        // Just after an unplug the address may still be taken for a moment; it is tried again.
        for _ in 0..50 {
            if let Ok(again) = Self::open(&self.name) {
                self.listener = again.listener;
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

/// Where simulated boards on this machine are found that have a pseudo-terminal.
#[cfg(unix)]
pub(super) fn simulated() -> Vec<String> {
    terminal::all()
}

#[cfg(not(unix))]
pub(super) fn simulated() -> Vec<String> {
    Vec::new()
}

#[cfg(unix)]
mod terminal {
    use std::fs::{File, OpenOptions};
    use std::io::{Read, Write};
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::{OpenOptionsExt, symlink};
    use std::path::{Path, PathBuf};
    use std::sync::atomic::{AtomicU32, Ordering};

    use rustix::fs::{OFlags, fcntl_setfl};
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

    use super::Door;

    const NAME: &str = "hapdef-board-";

    /// Both ends: ours, and the other's, which is held open so that one who leaves does not hang up on the next.
    struct PseudoTerminal {
        ours: File,
        _theirs: File,
    }

    struct Terminal {
        ends: Option<PseudoTerminal>,
        /// A name that stays the same when the board is plugged in again.
        link: PathBuf,
    }

    pub fn open() -> Result<(Box<dyn Door>, String), String> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let suffix = if number == 0 {
            String::new()
        } else {
            format!("-{number}")
        };
        let link = std::env::temp_dir().join(format!("{NAME}{}{suffix}", std::process::id()));
        let mut terminal = Terminal { ends: None, link };
        terminal
            .make()
            .map_err(|e| format!("no pseudo-terminal can be opened ({e}): use --tcp"))?;
        let name = terminal.link.display().to_string();
        Ok((Box::new(terminal), name))
    }

    /// Names whose terminal is still there.
    pub fn all() -> Vec<String> {
        let entries = std::fs::read_dir(std::env::temp_dir());
        let paths = entries.into_iter().flatten().flatten().map(|e| e.path());
        paths
            .filter(|p| {
                p.file_name()
                    .is_some_and(|n| n.as_bytes().starts_with(NAME.as_bytes()))
            })
            .filter(|p| p.exists())
            .map(|p| p.display().to_string())
            .collect()
    }

    impl Terminal {
        fn make(&mut self) -> std::io::Result<()> {
            let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
            grantpt(&ours)?;
            unlockpt(&ours)?;
            let name = ptsname(&ours, Vec::new())?;
            let path = Path::new(std::ffi::OsStr::from_bytes(name.to_bytes())).to_owned();
            let theirs = OpenOptions::new()
                .read(true)
                .write(true)
                .custom_flags(OFlags::NOCTTY.bits().cast_signed())
                .open(&path)?;
            let mut attributes = tcgetattr(&theirs)?;
            attributes.make_raw();
            tcsetattr(&theirs, OptionalActions::Now, &attributes)?;
            fcntl_setfl(&ours, OFlags::NONBLOCK)?;
            let _ = std::fs::remove_file(&self.link);
            symlink(&path, &self.link)?;
            self.ends = Some(PseudoTerminal {
                ours: File::from(ours),
                _theirs: theirs,
            });
            Ok(())
        }
    }

    impl Door for Terminal {
        fn write(&mut self, bytes: &[u8]) -> usize {
            let Some(ends) = &mut self.ends else {
                return bytes.len();
            };
            ends.ours.write(bytes).unwrap_or(0)
        }

        fn read(&mut self, buffer: &mut [u8]) -> usize {
            self.ends
                .as_mut()
                .map_or(0, |ends| ends.ours.read(buffer).unwrap_or(0))
        }

        fn unplug(&mut self) {
            let _ = std::fs::remove_file(&self.link);
            self.ends = None;
        }

        fn plug(&mut self) {
            // Without a terminal nobody can be reached; the next unplug and plug tries again.
            let _ = self.make();
        }
    }

    impl Drop for Terminal {
        fn drop(&mut self) {
            let _ = std::fs::remove_file(&self.link);
        }
    }
}
