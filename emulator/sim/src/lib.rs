//! `cargo sim`: emulated boards, a CAN bus in virtual time, and the programs that talk to them.
//!
//! [`world`] is the simulation: deterministic, in one thread, without a socket or a clock of the host. Around it
//! lie the [`gateway`] for clients, the [`display`], and [`app`], which ties them together. Tests build a
//! [`world::World`] with [`setup`] and let it run as fast as it can.

pub mod app;
pub mod board;
pub mod cli;
pub mod console;
pub mod control;
pub mod display;
pub mod flash;
pub mod gateway;
pub mod host_time;
pub mod image;
pub mod log;
pub mod oscillator;
pub mod personality;
pub mod port;
pub mod setup;
pub mod status;
pub mod stimuli;
pub mod summary;
pub mod traffic;
pub mod world;

mod figures;
mod greeting;
mod keeper;
mod pace;
mod page;
mod retuning;
