//! The window, driven by the names of its controls on a real adapter.

#[cfg(feature = "studio")]
#[path = "../window/mod.rs"]
mod window;

mod axis_window;
mod barrel;
mod bench;
mod session;
mod solid_window;
mod studio;
mod study;
mod trade;
mod work;
