//! SDO: access to the dictionary (CiA 301, 7.2.4). The messages, and the server that answers them.

// A request is passed by reference: by value it would take two registers, and each access to a byte a shift.
#![allow(clippy::trivially_copy_pass_by_ref)]

mod abort;
mod block;
mod block_download;
mod block_upload;
mod bytes;
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
pub use objects::Part;
pub(crate) use objects::{BUFFER, Objects, Writable};
pub use request::{Initiate, Multiplexer, Request};
pub use response::Response;
pub use server::Channel;

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

    /// The frame, in either direction.
    fn encode(self) -> [u8; 8] {
        let unused = 7 - self.data.len();
        let mut frame = [u8::from(self.toggle) << 4 | unused << 1 | u8::from(self.last); 8];
        let [_, data @ ..] = &mut frame;
        *data = self.data.padded();
        frame
    }
}

/// Data bytes 4 to 7 of a frame.
const fn tail(frame: &[u8; 8]) -> [u8; 4] {
    [frame[4], frame[5], frame[6], frame[7]]
}
