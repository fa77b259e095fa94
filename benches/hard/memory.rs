//! Bytes that this process holds, counted as they are taken.
#![allow(
    unsafe_code,
    reason = "an allocator is unsafe by its trait; this one counts and passes on"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::ptr::null_mut;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);
static CEILING: AtomicUsize = AtomicUsize::new(usize::MAX);

/// The system's allocator, counted.
pub struct Counting;

/// Begins to look for the most anew, and says what is held now.
pub fn forget() -> usize {
    let held = HELD.load(Relaxed);
    MOST.store(held, Relaxed);
    held
}

/// The most that was held since.
pub fn most() -> usize {
    MOST.load(Relaxed)
}

/// More than this is not given: the process ends then, and not the machine.
pub fn bound(bytes: usize) {
    CEILING.store(bytes, Relaxed);
}

/// Whether so many bytes more may be taken; they are counted then.
fn take(bytes: usize) -> bool {
    let held = HELD.fetch_add(bytes, Relaxed).saturating_add(bytes);
    if held > CEILING.load(Relaxed) {
        give(bytes);
        return false;
    }
    MOST.fetch_max(held, Relaxed);
    true
}

fn give(bytes: usize) {
    HELD.fetch_sub(bytes, Relaxed);
}

/// What the allocator answered, taken back where it had nothing.
fn counted(bytes: usize, answer: *mut u8) -> *mut u8 {
    if answer.is_null() {
        give(bytes);
    }
    answer
}

// SAFETY: every call goes to the system's allocator as it came, or is answered with “nothing”.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !take(layout.size()) {
            return null_mut();
        }
        counted(layout.size(), unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if !take(layout.size()) {
            return null_mut();
        }
        counted(layout.size(), unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) };
        give(layout.size());
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let more = size.saturating_sub(layout.size());
        if !take(more) {
            return null_mut();
        }
        let answer = counted(more, unsafe { System.realloc(pointer, layout, size) });
        if !answer.is_null() {
            give(layout.size().saturating_sub(size));
        }
        answer
    }
}
