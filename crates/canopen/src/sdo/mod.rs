//! SDO: access to the dictionary (CiA 301, 7.2.4). The messages, and the server that answers them.

// A request is passed by reference: by value it would take two registers, and each access to a byte a shift.
#![allow(clippy::trivially_copy_pass_by_ref)]

mod abort;
mod block;
mod block_download;
mod block_upload;
mod bytes;
mod channel;
mod cob_id;
pub(crate) mod crc;
mod objects;
mod request;
mod response;
mod segmented;
mod server;

pub use abort::Abort;
pub use block::{BlockEnd, BlockSegment, BlockSize};
pub use bytes::Bytes;
pub use channel::Channel;
pub use objects::Part;
pub(crate) use objects::{BUFFER, Objects, Writable};
pub use request::{Initiate, Request};
pub use response::Response;
use server::Server;

/// The object of a transfer: index and sub-index, bytes 1 to 3 of the frames that initiate a transfer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Multiplexer {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
}

impl Multiplexer {
    pub(crate) const fn parse(frame: &[u8; 8]) -> Multiplexer {
        Multiplexer { index: u16::from_le_bytes([frame[1], frame[2]]), sub: frame[3] }
    }

    /// The data of a frame: command specifier, this multiplexer and four bytes.
    pub(crate) const fn frame(self, command: u8, data: [u8; 4]) -> [u8; 8] {
        let head = command as u32 | (self.index as u32) << 8 | (self.sub as u32) << 24;
        let [command, low, high, sub] = head.to_le_bytes();
        [command, low, high, sub, data[0], data[1], data[2], data[3]]
    }
}

/// The bit of the command byte that alternates from segment to segment.
const TOGGLE: u8 = 0x10;

/// One segment of a segmented transfer, the same in both directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Alternates from segment to segment, starting with 0.
    pub toggle: bool,
    /// No segment follows.
    pub last: bool,
    /// The data of the segment.
    pub data: Bytes<7>,
}

impl Segment {
    fn parse(frame: &[u8; 8]) -> Segment {
        let [command, data @ ..] = frame;
        let unused = command >> 1 & 7;
        Segment { toggle: command & TOGGLE != 0, last: command & 1 != 0, data: Bytes::new(*data, 7 - unused) }
    }

    fn encode(self, command: u8) -> [u8; 8] {
        let unused = 7 - self.data.len();
        let mut frame = [command | u8::from(self.toggle) << 4 | unused << 1 | u8::from(self.last); 8];
        let [_, data @ ..] = &mut frame;
        *data = self.data.padded();
        frame
    }
}

/// Data bytes 4 to 7 of a frame.
const fn tail(frame: &[u8; 8]) -> [u8; 4] {
    [frame[4], frame[5], frame[6], frame[7]]
}
