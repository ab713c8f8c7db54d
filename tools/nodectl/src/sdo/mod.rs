//! The SDO client (CiA 301, 7.2.4): expedited, segmented and block transfers, with the messages of crate `canopen`.

mod abort_code;
mod block_download;
mod block_upload;
mod channel;
mod client;
mod error;
mod segmented;

pub use abort_code::AbortCode;
pub use client::{Client, Options};
pub use error::{Cause, Error};

use crc::{CRC_16_XMODEM, Crc};

/// The CRC of block transfers (CiA 301, 7.2.4.3.16).
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_XMODEM);

/// More than this is no value but a fault of the server.
const LARGEST: usize = 64 << 20;
