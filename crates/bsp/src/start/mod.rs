//! The start of an image: clock, peripherals, tests of the board, and the handlers of faults.

pub mod board;
pub(crate) mod clock_tree;
pub(crate) mod fault;
pub mod loader;
pub mod self_test;

#[cfg(feature = "development")]
mod start_tests;
