//! Common parts of the tests that use several crates.

pub mod asked;
pub mod bench;
pub mod calls;
pub mod domain;
pub mod lift417;
pub mod lss;
pub mod network;
pub mod sdo;
pub mod station;
pub mod tables;
pub mod thorough;
pub mod watch;
