//! The last word at the program's end, where a library ends it: Xlib does so when its server has gone.
#![allow(
    unsafe_code,
    reason = "the standard library has no function that is called at the program's end"
)]

use std::ffi::c_int;

use hapdef::studio::last_words;

unsafe extern "C" {
    /// Of the C library: calls a function when the program ends by `exit`, whoever calls that.
    fn atexit(last: extern "C" fn()) -> c_int;
}

/// Has the window say why it is gone, where it does not end by itself.
pub fn explain_at_exit() {
    extern "C" fn explain() {
        last_words();
    }
    // SAFETY: the function is there as long as the program, and neither panics nor ends it again. Where there is no
    // room for it in the list, the library's own words stand alone.
    let _ = unsafe { atexit(explain) };
}
