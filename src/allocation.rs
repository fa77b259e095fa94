//! The last line of defence where memory ends: sizes are known before they are taken, but other programs take
//! memory too, and then an allocation that fails is a message and not an abort.
#![allow(
    unsafe_code,
    reason = "an allocator cannot be written without; every call is handed on as it is"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write as _;

/// The system's allocator, which says so where it has nothing left.
pub struct Spoken;

// SAFETY: every call goes to the system's allocator with the arguments it came with, and what that returns is
// returned; where that is nothing, the program ends.
unsafe impl GlobalAlloc for Spoken {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        had(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        had(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as the caller promises.
        had(unsafe { System.realloc(block, layout, size) }, size)
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(block, layout) }
    }
}

fn had(block: *mut u8, bytes: usize) -> *mut u8 {
    if block.is_null() {
        // Formatting integers into stderr, which has no buffer, takes no memory.
        let _ = writeln!(
            std::io::stderr(),
            "hapdef: the machine has no {} MB of memory left. Lower the quality, ask for fewer touches or sites, or end other programs",
            bytes.div_ceil(1_000_000)
        );
        std::process::exit(1);
    }
    block
}
