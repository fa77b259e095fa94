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
    /// What its USB device says that no other device does: maker, product and serial number. Absent where it says nothing
    /// of the kind, as of ports that are no USB.
    pub identity: Option<String>,
}

/// Makers of boards and of their USB chips: Arduino (twice), Teensy, Adafruit, Raspberry Pi, Espressif, WCH,
/// Silicon Labs, FTDI, `SparkFun`, Seeed.
const BOARDS: [u16; 11] = [
    0x2341, 0x2a03, 0x16c0, 0x239a, 0x2e8a, 0x303a, 0x1a86, 0x10c4, 0x0403, 0x1b4f, 0x2886,
];

/// What simulated boards of this machine have in common: to open one of them does no harm.
const SIMULATED: &str = "simulated";

/// Of a USB device with a serial number of its own.
fn identity(vendor: u16, product: u16, serial: Option<&str>) -> Option<String> {
    let serial = serial.map(str::trim).filter(|s| !s.is_empty())?;
    Some(format!("{vendor:04x}:{product:04x}:{serial}"))
}

/// All ports, the likeliest board first; simulated boards on this machine too.
#[must_use]
pub fn ports() -> Vec<PortInfo> {
    let mut all: Vec<PortInfo> = serialport::available_ports()
        .unwrap_or_default()
        .into_iter()
        .map(|port| match port.port_type {
            SerialPortType::UsbPort(usb) => {
                let identity = identity(usb.vid, usb.pid, usb.serial_number.as_deref());
                let words = [usb.product, usb.manufacturer];
                let words: Vec<String> = words.into_iter().flatten().collect();
                PortInfo {
                    path: port.port_name,
                    product: words.join(", "),
                    likely: BOARDS.contains(&usb.vid),
                    identity,
                }
            }
            _ => PortInfo {
                path: port.port_name,
                product: String::new(),
                likely: false,
                identity: None,
            },
        })
        .collect();
    all.extend(host::simulated().into_iter().map(|path| PortInfo {
        path,
        product: "Simulated board".into(),
        likely: true,
        identity: Some(SIMULATED.into()),
    }));
    all.sort_by(|a, b| b.likely.cmp(&a.likely).then_with(|| a.path.cmp(&b.path)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Another device of the same make is another one, and one that says nothing of itself is nobody's.
    #[test]
    fn only_a_serial_number_names_a_device() {
        let board = identity(0x2341, 0x43, Some("A1B2"));
        assert_eq!(board.as_deref(), Some("2341:0043:A1B2"));
        assert_ne!(board, identity(0x2341, 0x43, Some("A1B3")));
        assert_eq!(identity(0x2341, 0x43, None), None);
        assert_eq!(identity(0x2341, 0x43, Some(" ")), None);
    }
}
