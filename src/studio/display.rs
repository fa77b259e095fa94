//! The display that the window is on: which it is, whether it still answers, and what to say where it does not.

use std::io::Write as _;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// What a window needs that a bare system lacks.
const NEEDS: &str =
    "Debian: apt-get install mesa-vulkan-drivers libxcursor1 libxi6 libxkbcommon-x11-0";
const HEADLESS: &str = "run `hapdef design --out DIR`, which needs no display";
/// How long a server elsewhere may take to answer.
const PATIENCE: Duration = Duration::from_secs(2);

/// The display of a window that is open, for the last words.
static OPEN: Mutex<Option<Display>> = Mutex::new(None);

/// Says why the window is gone, where the program ends while one is open on a display that has gone: Xlib ends it on
/// the spot, with words of its own. To be called at the program's end, whoever ends it.
pub fn last_words() {
    if let Some(display) = taken()
        && display.has_gone()
    {
        say(&format!("hapdef: {}", display.farewell()));
    }
}

/// Prints a remark on stderr. Where that is closed nobody reads it.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// The display of the window that was open; from now on none is.
fn taken() -> Option<Display> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// Where windows go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Display {
    /// Nobody has named one.
    None,
    /// The system's own, which is always there.
    System,
    /// A socket on this machine, by what the environment calls it.
    Socket { name: String, path: PathBuf },
    /// An X server at HOST:PORT.
    Remote { name: String, address: String },
}

impl Display {
    /// The one that the environment names.
    pub fn named() -> Self {
        if cfg!(all(unix, not(target_os = "macos"))) {
            Self::among(|key| std::env::var(key).ok().filter(|value| !value.is_empty()))
        } else {
            Self::System
        }
    }

    /// As the window's library looks for one: Wayland first.
    fn among(variable: impl Fn(&str) -> Option<String>) -> Self {
        if let Some(name) = variable("WAYLAND_DISPLAY") {
            let folder = PathBuf::from(variable("XDG_RUNTIME_DIR").unwrap_or_default());
            return Self::Socket {
                path: folder.join(&name),
                name: format!("WAYLAND_DISPLAY={name}"),
            };
        }
        if variable("WAYLAND_SOCKET").is_some() {
            // Open already, and not to be looked up.
            return Self::System;
        }
        variable("DISPLAY").map_or(Self::None, |name| Self::x(&name))
    }

    /// An X display, HOST:NUMBER.SCREEN; without a host it is on this machine.
    fn x(display: &str) -> Self {
        let name = format!("DISPLAY={display}");
        let (host, number) = display.rsplit_once(':').unwrap_or((display, ""));
        let number = number.split('.').next().unwrap_or_default();
        if matches!(host, "" | "unix") {
            return Self::Socket {
                path: PathBuf::from(format!("/tmp/.X11-unix/X{number}")),
                name,
            };
        }
        let port = 6000_u16.saturating_add(number.parse().unwrap_or(0));
        Self::Remote {
            address: format!("{host}:{port}"),
            name,
        }
    }

    /// Whether somebody is there.
    pub fn answers(&self) -> bool {
        match self {
            Self::None => false,
            Self::System => true,
            #[cfg(unix)]
            Self::Socket { path, .. } => std::os::unix::net::UnixStream::connect(path).is_ok(),
            #[cfg(not(unix))]
            Self::Socket { .. } => true,
            Self::Remote { address, .. } => {
                use std::net::{TcpStream, ToSocketAddrs as _};
                let found = address.to_socket_addrs().into_iter().flatten();
                let mut tried = found.map(|at| TcpStream::connect_timeout(&at, PATIENCE));
                tried.any(|connected| connected.is_ok())
            }
        }
    }

    /// Whether nobody is there any more. A server that ends lets go of its windows a little before it stops to answer:
    /// it is looked for some times.
    fn has_gone(&self) -> bool {
        const LOOKS: u32 = 10;
        const PAUSE: Duration = Duration::from_millis(20);
        (0..LOOKS).any(|look| {
            if look > 0 {
                std::thread::sleep(PAUSE);
            }
            !self.answers()
        })
    }

    /// Why no window could be opened, and what to do.
    pub fn refusal(&self, error: &eframe::Error) -> String {
        match (self, error) {
            (_, eframe::Error::AppCreation(message)) => message.to_string(),
            (Self::None, _) => format!(
                "the window needs a display, and neither DISPLAY nor WAYLAND_DISPLAY names one. Set one of them, or {HEADLESS}"
            ),
            (Self::Socket { name, .. } | Self::Remote { name, .. }, _) if !self.answers() => {
                format!(
                    "the window cannot be opened: nothing answers at {name}. Start the display or name another, or {HEADLESS}"
                )
            }
            (Self::Socket { name, .. } | Self::Remote { name, .. }, _)
                if is_turned_away(&error.to_string()) =>
            {
                format!(
                    "the window cannot be opened: {name} does not let it in ({}), most likely for want of its key. Give it that (XAUTHORITY names the file, `xauth list` shows what it holds), or {HEADLESS}",
                    cause(&error.to_string())
                )
            }
            _ => format!(
                "the window cannot be opened: {}. It needs a Vulkan driver and the libraries of a display ({NEEDS}). Or {HEADLESS}",
                cause(&error.to_string())
            ),
        }
    }

    /// What is said where the display has gone.
    fn farewell(&self) -> String {
        let name = match self {
            Self::Socket { name, .. } | Self::Remote { name, .. } => name,
            Self::None | Self::System => "the system's",
        };
        format!(
            "the display ({name}) has gone, and the window with it. Changes that were not saved are offered when the studio is opened again"
        )
    }

    /// A window is open on it: from now on its end is told.
    pub fn opened(&self) {
        let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
        *open = Some(self.clone());
    }

    /// The window was closed: there is nothing to tell.
    pub fn closed() {
        drop(taken());
    }

    /// Why an open window ended by itself.
    pub fn ending(&self, error: &eframe::Error) -> String {
        if self.has_gone() {
            self.farewell()
        } else {
            format!("the window ended: {}", cause(&error.to_string()))
        }
    }

    /// From now on a panic that comes of a display that has gone is a message and exit code 1: the window's libraries
    /// know no other way to say it. The program ends on the spot, because on the way out they would ask the display
    /// again to close what is open, and a second panic aborts.
    pub fn end_with_it(self) {
        let others = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !self.has_gone() {
                others(panic);
                return;
            }
            Self::closed();
            say(&format!("hapdef: {}", self.farewell()));
            std::process::exit(1);
        }));
    }
}

/// What an error of the window's library says, without where in its source it was noticed, and without the full stop.
fn cause(error: &str) -> &str {
    let reason = match error.split_once("os error at ") {
        Some((_, place)) => place.split_once(": ").map_or(place, |(_, reason)| reason),
        None => error,
    };
    reason.trim().trim_end_matches('.')
}

/// Whether an X server that is there did not let us in, in the words of the window's library.
fn is_turned_away(error: &str) -> bool {
    error.contains("open connection to X server")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn display(variables: &[(&str, &str)]) -> Display {
        Display::among(|key| {
            let found = variables.iter().find(|(name, _)| *name == key);
            found.map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn displays_are_found_where_the_environment_says() {
        assert_eq!(display(&[]), Display::None);
        let path = |variables: &[(&str, &str)]| match display(variables) {
            Display::Socket { path, .. } => path.display().to_string(),
            Display::Remote { address, .. } => address,
            other => format!("{other:?}"),
        };
        assert_eq!(path(&[("DISPLAY", ":7")]), "/tmp/.X11-unix/X7");
        assert_eq!(path(&[("DISPLAY", "unix:0.1")]), "/tmp/.X11-unix/X0");
        assert_eq!(path(&[("DISPLAY", "far.away:10.0")]), "far.away:6010");
        let both = [
            ("DISPLAY", ":7"),
            ("WAYLAND_DISPLAY", "wayland-1"),
            ("XDG_RUNTIME_DIR", "/run/user/1000"),
        ];
        assert_eq!(path(&both), "/run/user/1000/wayland-1");
    }

    #[cfg(unix)]
    #[test]
    fn a_display_answers_until_its_server_ends() {
        let folder = tempfile::tempdir().unwrap();
        let folder_name = folder.path().to_str().unwrap();
        let variables = [("WAYLAND_DISPLAY", "w"), ("XDG_RUNTIME_DIR", folder_name)];
        let there = display(&variables);
        assert!(!there.answers());
        let server = std::os::unix::net::UnixListener::bind(folder.path().join("w")).unwrap();
        assert!(there.answers());
        drop(server);
        assert!(!there.answers(), "its socket still lies there");
        let said = there.farewell();
        assert!(
            said.contains("WAYLAND_DISPLAY=w") && said.contains("not saved"),
            "{said}"
        );
    }

    #[test]
    fn a_window_that_was_closed_leaves_no_last_words() {
        Display::System.opened();
        assert_eq!(taken(), Some(Display::System));
        Display::System.opened();
        Display::closed();
        assert_eq!(taken(), None);
    }

    #[test]
    fn what_a_library_says_is_told_without_its_source() {
        let raw = "winit EventLoopError: os error at /x/winit-0.30.13/src/linux/mod.rs:765: neither is set.";
        assert_eq!(cause(raw), "neither is set");
        assert_eq!(cause("WGPU error: no adapter"), "WGPU error: no adapter");
        let error = eframe::Error::AppCreation("no graphics adapter was found".into());
        assert_eq!(
            Display::None.refusal(&error),
            "no graphics adapter was found"
        );
    }
}
