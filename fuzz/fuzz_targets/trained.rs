#![no_main]

use hapdef_fuzz::{Reader, hold};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| hold(Reader::Trained, bytes));
