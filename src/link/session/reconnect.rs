//! A board that was unplugged is looked for again: at its port, and where the same USB device comes back at another one. No
//! other device of the machine is opened: that may reset it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver as Inbox;
use std::time::{Duration, Instant};

use super::listener::{Listener, ListenerCommand, SessionEvent};
use crate::link::{Address, Got, Port, PortInfo, ports};
use crate::live::{Input, Receiver};
use crate::wire::WireMessage;

/// Between two tries.
const AGAIN: Duration = Duration::from_millis(150);
/// How long another port has to say which board it is.
const WHO: Duration = Duration::from_millis(400);

impl Listener {
    /// The same board at the same port, or at another one. Nothing when it is no longer wanted.
    pub(super) fn find_again(
        &mut self,
        stop: &AtomicBool,
        inbox: &Inbox<ListenerCommand>,
        tell: &mut impl FnMut(SessionEvent),
    ) -> Option<Box<dyn Port>> {
        while !stop.load(Ordering::Relaxed) {
            if let Ok(port) = self.address.open() {
                self.remember_device();
                return Some(port);
            }
            if let Some(port) = self.at_another_port() {
                return Some(port);
            }
            while let Ok(command) = inbox.try_recv() {
                self.obey(command, &mut Nowhere, tell);
            }
            self.turn(tell);
            std::thread::sleep(AGAIN);
        }
        None
    }

    /// Which USB device is at the port.
    pub(super) fn remember_device(&mut self) {
        let Address::Serial { path, .. } = &self.address else {
            return;
        };
        // A name below /dev/serial/by-id stands for another one.
        let own = std::fs::canonicalize(path).unwrap_or_else(|_| path.into());
        let here = |p: &PortInfo| p.path == *path || own == std::path::Path::new(&p.path);
        let port = ports().into_iter().find(here);
        self.device = port.and_then(|p| p.identity);
    }

    fn at_another_port(&mut self) -> Option<Box<dyn Port>> {
        let (Address::Serial { path, baud }, Some(board)) =
            (&self.address, self.hello.as_ref().map(|h| h.board))
        else {
            return None;
        };
        let (path, baud, device) = (path.clone(), *baud, self.device.clone()?);
        let same = |p: &PortInfo| p.path != path && p.identity.as_ref() == Some(&device);
        for other in ports().into_iter().filter(same) {
            let address = Address::Serial {
                path: other.path,
                baud,
            };
            let Ok(mut port) = address.open() else {
                continue;
            };
            if self.asks(&mut *port) == Some(board) {
                self.address = address;
                return Some(port);
            }
        }
        None
    }

    /// Which board it is.
    fn asks(&mut self, port: &mut dyn Port) -> Option<u32> {
        self.say(port, &WireMessage::AskHello);
        let (begun, mut receiver, mut buffer) = (Instant::now(), Receiver::default(), [0; 4096]);
        let mut found = None;
        while found.is_none() && begun.elapsed() < WHO {
            match port.read(&mut buffer) {
                Got::Gone => return None,
                Got::Nothing => {}
                Got::Bytes(count) => receiver.push(&buffer[..count], 0, |input| {
                    if let Input::Hello(hello) = input {
                        found = Some(hello.board);
                    }
                }),
            }
        }
        found
    }
}

/// For what is asked while there is no port.
struct Nowhere;

impl Port for Nowhere {
    fn read(&mut self, _: &mut [u8]) -> Got {
        Got::Gone
    }
    fn write(&mut self, _: &[u8]) {}
}
