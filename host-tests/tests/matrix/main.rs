//! Tests that are not about one personality, node-ID or bit rate, in process and on the emulated board.

#[cfg(feature = "board")]
mod boards;
mod bus;
mod in_process;
mod services;
#[cfg(feature = "board")]
#[path = "../board/support.rs"]
#[allow(dead_code)] // The tests of single boards use the other functions.
mod support;
