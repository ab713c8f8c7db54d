//! The content of the flash of a board on a bench, and the calls of probe-rs that write it. `cargo xtask flash` runs
//! the program of this crate; a test compares [`Content`] with the flash of the emulated board.

mod content;
pub mod probe_rs;

pub use content::{Content, Part};
