//! The ports of this machine, listed by serialport, and the simulated boards on it.

use serialport::SerialPortType;

use super::host;

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
    all.extend(host::simulated().into_iter().map(|path| PortInfo {
        path,
        product: "Simulated board".into(),
        likely: true,
    }));
    all.sort_by(|a, b| b.likely.cmp(&a.likely).then_with(|| a.path.cmp(&b.path)));
    all
}
