//! Boards, streams and whole programs in real time.
//!
//! Apart from the others, so that nothing heavy runs beside them.

#[cfg(feature = "studio")]
#[path = "../window/mod.rs"]
mod window;

mod board;
mod by_hand;
mod by_hand_window;
mod calibrate;
mod display;
mod ends;
mod firmware;
mod foxglove;
mod live;
mod promise;
mod rows;
mod stranger;
