//! What a client asks. Eight bytes are one of these or no request at all.

use super::{Bytes, Multiplexer, Segment, tail};

/// A request of an SDO client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Write: the first or only frame.
    Download(Multiplexer, Initiate),
    /// Write: the next segment.
    DownloadSegment(Segment),
    /// Read: the first frame.
    Upload(Multiplexer),
    /// Read: the next segment, please.
    UploadSegment {
        /// Alternates, starting with 0.
        toggle: bool,
    },
    /// The client gives up.
    Abort(Multiplexer, u32),
}

/// How a download begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Initiate {
    /// All the data, one to four bytes.
    Expedited(Bytes<4>),
    /// All the data; the type says how many of the four bytes it is.
    Unsized([u8; 4]),
    /// Segments follow, of this many bytes in all where the client says so.
    Segmented(Option<u32>),
}

impl Request {
    /// `None` for an unknown command specifier.
    #[must_use]
    pub fn parse(frame: [u8; 8]) -> Option<Request> {
        let multiplexer = Multiplexer::parse(frame);
        match frame[0] >> 5 {
            0 => Some(Request::DownloadSegment(Segment::parse(frame))),
            1 => Some(Request::Download(multiplexer, Initiate::parse(frame))),
            2 => Some(Request::Upload(multiplexer)),
            3 => Some(Request::UploadSegment { toggle: frame[0] & 0x10 != 0 }),
            4 => Some(Request::Abort(multiplexer, u32::from_le_bytes(tail(frame)))),
            _ => None,
        }
    }

    /// The frame's data.
    #[must_use]
    pub fn encode(self) -> [u8; 8] {
        match self {
            Request::Download(multiplexer, initiate) => initiate.encode(multiplexer),
            Request::DownloadSegment(segment) => segment.encode(0x00),
            Request::Upload(multiplexer) => multiplexer.frame(0x40, [0; 4]),
            Request::UploadSegment { toggle } => [0x60 | u8::from(toggle) << 4, 0, 0, 0, 0, 0, 0, 0],
            Request::Abort(multiplexer, code) => multiplexer.frame(0x80, code.to_le_bytes()),
        }
    }
}

impl Initiate {
    fn parse(frame: [u8; 8]) -> Initiate {
        let (data, unused) = (tail(frame), frame[0] >> 2 & 3);
        match frame[0] & 0x03 {
            0b11 => Initiate::Expedited(Bytes::new(data, 4 - unused)),
            0b10 => Initiate::Unsized(data),
            0b01 => Initiate::Segmented(Some(u32::from_le_bytes(data))),
            _ => Initiate::Segmented(None),
        }
    }

    fn encode(self, multiplexer: Multiplexer) -> [u8; 8] {
        match self {
            // An empty payload has no encoding: it goes out as one zero byte.
            Initiate::Expedited(bytes) => {
                multiplexer.frame(0x23 | (4 - bytes.len().max(1)) << 2, bytes.padded())
            }
            Initiate::Unsized(data) => multiplexer.frame(0x22, data),
            Initiate::Segmented(Some(size)) => multiplexer.frame(0x21, size.to_le_bytes()),
            Initiate::Segmented(None) => multiplexer.frame(0x20, [0; 4]),
        }
    }
}
