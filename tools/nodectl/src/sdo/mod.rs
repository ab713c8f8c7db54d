//! The SDO client of crate `canopen` on an open bus (CiA 301, 7.2.4).

mod channel;
mod client;
mod command;
mod error;
mod memory;

pub use canopen::client::sdo::{AbortCode, Options};
pub use channel::Channel;
pub use client::Client;
pub use error::{Cause, Error};

/// The greatest size of a value in bytes. A larger size is a fault of the server.
pub const LARGEST: usize = 16 << 20;
