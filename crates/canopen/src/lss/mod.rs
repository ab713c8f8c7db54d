//! LSS, layer setting services (CiA 305): set node-ID and bit rate of a device that is known by its identity only.
//!
//! The master sends with CAN-ID 7E5h, all slaves answer with 7E4h; every message has eight bytes. A slave is addressed
//! by its identity (object 1018h), which must be unique on the bus.

mod bit_rate;
mod fastscan;
mod request;
mod response;
mod slave;

pub use bit_rate::BitRate;
pub use request::{Bound, Request};
pub use response::Response;
pub use slave::Configuration;
pub(crate) use slave::{Outcome, Slave, Switch};

use crate::CanId;

/// CAN-ID of the requests.
pub(crate) const REQUEST: CanId = CanId::of_lss(1);
/// CAN-ID of the responses.
pub(crate) const RESPONSE: CanId = CanId::of_lss(0);

/// A part of the identity: a sub-index of 1018h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// 1018h:1
    Vendor,
    /// 1018h:2
    Product,
    /// 1018h:3
    Revision,
    /// 1018h:4
    Serial,
}

impl Part {
    /// All parts, in the order of the select requests.
    pub const ALL: [Part; 4] = [Part::Vendor, Part::Product, Part::Revision, Part::Serial];

    pub(crate) fn numbered(number: u8) -> Option<Part> {
        Part::ALL.get(usize::from(number)).copied()
    }

    pub(crate) const fn number(self) -> u8 {
        self as u8
    }
}

/// The identity of a device, object 1018h.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// Vendor-ID.
    pub vendor: u32,
    /// Product code.
    pub product: u32,
    /// Revision number.
    pub revision: u32,
    /// Serial number.
    pub serial: u32,
}

impl Identity {
    /// The value of one part.
    #[must_use]
    pub const fn part(&self, part: Part) -> u32 {
        match part {
            Part::Vendor => self.vendor,
            Part::Product => self.product,
            Part::Revision => self.revision,
            Part::Serial => self.serial,
        }
    }
}

/// Bytes 1 to 4 of a frame as a number.
const fn word(frame: [u8; 8]) -> u32 {
    u32::from_le_bytes([frame[1], frame[2], frame[3], frame[4]])
}

/// The data of a frame with a command specifier and a number.
pub(crate) const fn frame_of_word(command: u8, value: u32) -> [u8; 8] {
    let [a, b, c, d] = value.to_le_bytes();
    [command, a, b, c, d, 0, 0, 0]
}
