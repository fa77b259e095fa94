//! Serial ports: opened by serial2, listed by serialport.

use std::io::ErrorKind;
use std::path::Path;
use std::time::Duration;

use serial2::{SerialPort, Settings};

use super::port::{Got, Port};

/// How long one look waits.
const WAIT: Duration = Duration::from_millis(5);
/// At this rate an Arduino Due erases its program.
const ERASES: u32 = 1200;

struct Serial(SerialPort);

pub(super) fn open(path: &str, baud: u32) -> Result<Box<dyn Port>, String> {
    if baud == ERASES {
        return Err(format!(
            "{path}: at 1200 baud an Arduino Due erases its program; choose another rate"
        ));
    }
    let configure = |mut settings: Settings| {
        settings.set_raw();
        settings.set_baud_rate(baud)?;
        Ok(settings)
    };
    let mut port = SerialPort::open(path, configure).map_err(|e| {
        let remedy = match e.kind() {
            ErrorKind::NotFound => {
                "there is no such port: plug the board in, or look at the list of ports"
            }
            ErrorKind::PermissionDenied => {
                "this account may not open it: on Linux, add it to the group dialout"
            }
            _ if Path::new(path).is_dir() => "that is a folder: name a port or a recording",
            _ if Path::new(path).is_file() => {
                "that is a file: name a port, or a recording, whose name ends in .hapdrec"
            }
            _ => "check the cable, and that no other program holds the port",
        };
        format!("{path} cannot be opened ({e}): {remedy}")
    })?;
    let _ = port.set_read_timeout(WAIT);
    let _ = port.set_write_timeout(Duration::from_millis(100));
    // What is old says nothing about now.
    let _ = port.discard_input_buffer();
    // Boards with native USB send nothing before the computer says it is ready.
    let _ = port.set_dtr(true);
    Ok(Box::new(Serial(port)))
}

impl Port for Serial {
    fn read(&mut self, buffer: &mut [u8]) -> Got {
        Got::of(self.0.read(buffer))
    }

    fn write(&mut self, bytes: &[u8]) {
        let _ = self.0.write_all(bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_port_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |path: &Path| open(&path.to_string_lossy(), 115_200).err().unwrap();
        assert!(refused(folder.path()).contains("that is a folder"));
        let file = folder.path().join("a.txt");
        std::fs::write(&file, "1,2,3\n").unwrap();
        assert!(refused(&file).contains("that is a file: name a port, or a recording"));
        assert!(refused(&folder.path().join("none")).contains("there is no such port"));
    }
}
