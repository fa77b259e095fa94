//! One session through a real X server: the program itself, with real pointer and key events.
#![cfg(all(feature = "studio", target_os = "linux"))]

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use x11rb::connection::Connection as _;
use x11rb::protocol::xproto::{
    BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ConnectionExt as _, ImageFormat, InputFocus,
    KEY_PRESS_EVENT, KEY_RELEASE_EVENT, MOTION_NOTIFY_EVENT, MapState, Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

const SIZE: (u16, u16) = (1440, 900);
const CONTROL: u32 = 0xffe3;
const ENTER: u32 = 0xff0d;

/// Ended with the test, however that ends.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A virtual X server and its display.
fn server() -> (Ended, String) {
    let screen = format!("{}x{}x24", SIZE.0, SIZE.1);
    let started = Command::new("Xvfb")
        .args([
            "-displayfd",
            "1",
            "-nolisten",
            "tcp",
            "-screen",
            "0",
            &screen,
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut child = started.expect("no X server: tests/run.sh installs xvfb");
    let mut number = String::new();
    let out = child.stdout.take().unwrap();
    BufReader::new(out).read_line(&mut number).unwrap();
    (Ended(child), format!(":{}", number.trim()))
}

struct Hand {
    x: RustConnection,
    root: Window,
    /// The keys' symbols, by rows of `per_key`, from `first` on.
    symbols: Vec<u32>,
    per_key: usize,
    first: u8,
}

impl Hand {
    fn on(display: &str) -> Self {
        let (x, screen) = x11rb::connect(Some(display)).unwrap();
        let setup = x.setup();
        let root = setup.roots[screen].root;
        let (first, last) = (setup.min_keycode, setup.max_keycode);
        let map = x
            .get_keyboard_mapping(first, last - first + 1)
            .unwrap()
            .reply()
            .unwrap();
        Self {
            symbols: map.keysyms,
            per_key: usize::from(map.keysyms_per_keycode),
            first,
            x,
            root,
        }
    }

    /// The program's window, once it is shown.
    fn window(&self) -> Option<Window> {
        let tree = self.x.query_tree(self.root).ok()?.reply().ok()?;
        tree.children.into_iter().find(|&window| {
            let shown = self
                .x
                .get_window_attributes(window)
                .ok()
                .and_then(|a| a.reply().ok());
            let size = self
                .x
                .get_geometry(window)
                .ok()
                .and_then(|g| g.reply().ok());
            shown.is_some_and(|a| a.map_state == MapState::VIEWABLE)
                && size.is_some_and(|g| g.width > 600)
        })
    }

    fn send(&self, kind: u8, detail: u8, x: i16, y: i16) {
        self.x
            .xtest_fake_input(kind, detail, 0, self.root, x, y, 0)
            .unwrap();
        self.x.flush().unwrap();
        std::thread::sleep(Duration::from_millis(25));
    }

    fn code(&self, symbol: u32) -> u8 {
        let place = self.symbols.iter().position(|&s| s == symbol).unwrap();
        self.first + (place / self.per_key) as u8
    }

    fn key(&self, held: Option<u32>, symbol: u32) {
        let (held, code) = (held.map(|h| self.code(h)), self.code(symbol));
        for code in held.into_iter().chain([code]) {
            self.send(KEY_PRESS_EVENT, code, 0, 0);
        }
        for code in [code].into_iter().chain(held) {
            self.send(KEY_RELEASE_EVENT, code, 0, 0);
        }
    }

    fn drag(&self, path: impl Iterator<Item = (i16, i16)>) {
        let mut last = (0, 0);
        for (k, (x, y)) in path.enumerate() {
            self.send(MOTION_NOTIFY_EVENT, 0, x, y);
            if k == 0 {
                self.send(BUTTON_PRESS_EVENT, 1, x, y);
            }
            last = (x, y);
        }
        self.send(BUTTON_RELEASE_EVENT, 1, last.0, last.1);
    }

    /// Colours (blue, green, red) of a square of the screen.
    fn colours(&self, x: i16, y: i16, side: u16) -> Vec<[u8; 3]> {
        let all = u32::MAX;
        let image = self
            .x
            .get_image(ImageFormat::Z_PIXMAP, self.root, x, y, side, side, all);
        let data = image.unwrap().reply().unwrap().data;
        data.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect()
    }
}

fn wait<T>(what: &str, seconds: u64, mut found: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(
            start.elapsed().as_secs() < seconds,
            "timed out waiting for {what}"
        );
        std::thread::sleep(Duration::from_millis(40));
    }
}

fn studio(display: &str, home: &Path) -> Ended {
    let child = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .current_dir(home)
        .env("DISPLAY", display)
        .env("HOME", home)
        .env("XDG_DATA_HOME", home.join("data"))
        .env("XDG_RUNTIME_DIR", home)
        .env_remove("WAYLAND_DISPLAY")
        .spawn()
        .unwrap();
    Ended(child)
}

#[test]
fn painted_with_a_real_pointer_and_saved_with_real_keys() {
    let (_server, display) = server();
    let home = tempfile::tempdir().unwrap();
    let mut studio = studio(&display, home.path());
    let hand = Hand::on(&display);
    let window = wait("the window", 60, || {
        assert!(studio.0.try_wait().unwrap().is_none(), "the program ended");
        hand.window()
    });
    // Nobody manages windows here: the keys must be told where to go.
    hand.x
        .set_input_focus(InputFocus::PARENT, window, x11rb::CURRENT_TIME)
        .unwrap();
    // The limb is the brightest thing on the screen.
    wait("the limb", 60, || {
        let bright = |c: &&[u8; 3]| c.iter().all(|&c| c > 150);
        let seen = hand.colours(600, 150, 200).iter().filter(bright).count();
        (seen > 1500).then_some(())
    });
    let letter = |c: char| u32::from(c);
    hand.key(None, letter('b'));
    hand.drag((0..12).map(|k| (690, 260 + 14 * k)));
    // The region is sea-green.
    wait("the painted region", 20, || {
        let green = |c: &&[u8; 3]| c[1] > c[2].saturating_add(25) && c[1] > 80;
        let seen = hand.colours(660, 240, 80).iter().filter(green).count();
        (seen > 400).then_some(())
    });
    hand.key(Some(CONTROL), letter('s'));
    std::thread::sleep(Duration::from_millis(400));
    // The path is typed already.
    hand.key(None, ENTER);
    let path = home.path().join("limb.hapdef.toml");
    wait("the project", 20, || path.exists().then_some(()));
    hand.key(Some(CONTROL), letter('q'));
    let ended = wait("the end", 30, || studio.0.try_wait().unwrap());
    assert!(ended.success(), "{ended}");
    let loaded = hapdef::io::project_file::load(&path).unwrap();
    let painted = loaded.inputs.painted.expect("the stroke is saved");
    let count = painted.iter().filter(|&&m| m).count();
    assert!((20..1500).contains(&count), "{count}");
}

/// A display that goes away takes the window with it, with a message and not with a panic.
#[test]
fn an_x_server_that_ends_is_a_message() {
    let (server, display) = server();
    let home = tempfile::tempdir().unwrap();
    let said = home.path().join("stderr");
    let child = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .current_dir(home.path())
        .env("DISPLAY", &display)
        .env("HOME", home.path())
        .env("XDG_DATA_HOME", home.path().join("data"))
        .env("XDG_RUNTIME_DIR", home.path())
        .env_remove("WAYLAND_DISPLAY")
        .stderr(std::fs::File::create(&said).unwrap())
        .spawn();
    let mut studio = Ended(child.unwrap());
    let hand = Hand::on(&display);
    wait("the window", 60, || {
        assert!(studio.0.try_wait().unwrap().is_none(), "the program ended");
        hand.window()
    });
    drop(server);
    let ended = wait("the end", 30, || studio.0.try_wait().unwrap());
    let said = std::fs::read_to_string(said).unwrap();
    assert_eq!(ended.code(), Some(1), "{said}");
    assert!(!said.contains("panicked"), "{said}");
    // Whoever noticed it first, and whatever that one said.
    assert!(
        said.contains("has gone, and the window with it") && said.contains("not saved"),
        "{said}"
    );
    assert!(said.contains(&format!("DISPLAY={display}")), "{said}");
}
