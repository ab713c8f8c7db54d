//! Common parts of the tests that use several crates.

pub mod asked;
pub mod bench;
#[cfg(feature = "board")]
pub mod boards;
pub mod calls;
pub mod domain;
pub mod lift417;
pub mod lss;
pub mod matrix;
pub mod network;
pub mod sdo;
pub mod station;
pub mod tables;
pub mod thorough;
pub mod watch;
