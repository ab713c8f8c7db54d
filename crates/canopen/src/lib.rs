//! Sans-IO CANopen (CiA 301, 305): frame and time in, frames and the next deadline out.
//!
//! [`Device`] is a whole CANopen device. It owns its protocols and the values of its object dictionary; what the
//! dictionary contains is a table ([`dictionary`](mod@dictionary)), and what the device does beyond CANopen is its [`Application`].
//! Each message of the protocol has a type that can only be valid, with `parse` and `encode`.
//!
//! Nothing here reads a clock, blocks, allocates or panics, whatever arrives from the bus.
//!
//! `#[inline(never)]` is there for the size: on what many places call, and on what most frames do not need. What it is
//! worth, `cargo xtask bench` counts.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]

mod can_id;
pub mod client;
mod copy;
mod device;
pub mod dictionary;
pub mod eds;
#[cfg(feature = "embedded-can")]
pub mod embedded_can;
pub mod emcy;
mod frame;
mod heartbeat;
pub mod lss;
pub mod nmt;
mod node_id;
pub mod objects;
pub mod pdo;
pub mod sdo;
mod sync;
mod time;
mod transmit;

pub use can_id::{CanId, CobId};
pub use device::{Action, Application, BusEvent, Device, ErrorClass, Job, Next, Part, Stored};
pub use emcy::{Condition, Fault};
pub use frame::Frame;
pub use node_id::NodeId;
pub use time::{Duration, Instant};
pub use transmit::{QueueFull, Transmit};
