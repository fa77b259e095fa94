//! Serial ports: opened by serial2, listed by serialport.

use std::io::ErrorKind;
use std::time::Duration;

use serial2::{SerialPort, Settings};
use serialport::SerialPortType;

use super::{Got, Port};

/// A port that is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortInfo {
    /// What it is opened by.
    pub path: String,
    /// Product and maker, where it says them.
    pub product: String,
    /// Whether it looks like a board.
    pub likely: bool,
}

/// Makers of boards and of their USB chips: Arduino (twice), Teensy, Adafruit, Raspberry Pi, Espressif, WCH,
/// Silicon Labs, FTDI, `SparkFun`, Seeed.
const BOARDS: [u16; 11] = [
    0x2341, 0x2a03, 0x16c0, 0x239a, 0x2e8a, 0x303a, 0x1a86, 0x10c4, 0x0403, 0x1b4f, 0x2886,
];
/// How long one look waits.
const WAIT: Duration = Duration::from_millis(5);
/// At this rate an Arduino Due erases its program.
const ERASES: u32 = 1200;

/// All ports, the likeliest board first; simulated boards on this machine too.
#[must_use]
pub fn ports() -> Vec<PortInfo> {
    let mut all: Vec<PortInfo> = serialport::available_ports()
        .unwrap_or_default()
        .into_iter()
        .map(|port| match port.port_type {
            SerialPortType::UsbPort(usb) => {
                let words = [usb.product, usb.manufacturer];
                let words: Vec<String> = words.into_iter().flatten().collect();
                PortInfo {
                    path: port.port_name,
                    product: words.join(", "),
                    likely: BOARDS.contains(&usb.vid),
                }
            }
            _ => PortInfo {
                path: port.port_name,
                product: String::new(),
                likely: false,
            },
        })
        .collect();
    all.extend(super::host::simulated());
    all.sort_by(|a, b| b.likely.cmp(&a.likely).then_with(|| a.path.cmp(&b.path)));
    all
}

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
