//! `cargo xtask bringup`: the first hour of a board, in fifteen steps that stop at the first failure.
//!
//! [`steps`] has the steps. Each one uses a [`Desk`]: a debug probe, a CAN adapter, and the hands of the user. [`real`] is
//! the desk with a board; the emulated one is in `emulator/workbench`. [`report`] keeps what was seen, so that a run can be
//! continued.
#![forbid(unsafe_code)]

mod bench;
pub mod chip;
mod desk;
pub mod real;
pub mod report;
pub mod run;
pub mod steps;
pub mod values;

pub use bench::Bench;
pub use desk::{Action, Desk};
