//! `cargo sim`: emulated boards and a CAN bus in virtual time, for programs that communicate with the boards.
//!
//! [`world`] is the simulation: deterministic, whatever the number of its threads, without sockets and without the host's clock. The
//! [`gateway`] serves clients, the [`display`] shows the state, and [`app`] connects all of them. Tests build a
//! [`world::World`] with [`setup`] and run it as fast as possible.

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

mod bad_reads;
mod crew;
mod figures;
mod greeting;
mod keeper;
mod pace;
mod page;
mod retuning;
