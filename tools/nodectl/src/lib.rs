//! The host side of a CANopen bus.
//!
//! [`bus`] opens a bus over SocketCAN, socketcand or slcan. [`Network`] is the shared base of the services [`sdo`],
//! [`nmt`], [`heartbeat`] and [`lss`]. [`update`] (CiA 302-3) and the command line tool of this crate use these
//! services.
//!
//! ```no_run
//! use nodectl::{Network, object, sdo};
//!
//! let address: nodectl::bus::Address = "socketcand://127.0.0.1:29536/vcan0".parse()?;
//! let mut network = Network::open(move || address.open(250))?;
//! let node = canopen::NodeId::new(1).ok_or("a node-ID")?;
//! let mut client = sdo::Client::new(&mut network, node, sdo::Options::default());
//! let device_type = client.upload(object::at(0x1000, 0))?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

pub mod acquisition;
pub mod bus;
mod catalogue;
pub mod check;
pub mod cli;
pub mod configuration;
pub mod explain;
pub mod heartbeat;
pub mod lift;
pub mod lss;
pub mod meaning;
pub mod net;
mod network;
pub mod nmt;
pub mod object;
mod other_clients;
pub mod page;
mod pdo_parameters;
pub mod quantity;
pub mod rules;
pub mod scan;
pub mod sdo;
pub mod simulate;
mod steadiness;
pub mod text;
pub mod tpdo;
pub mod trace;
pub mod update;
pub mod value;

pub use catalogue::Catalogue;
pub use network::{Gate, Heard, Logged, Network};
pub use wire::unit;
