//! Requests of an SDO client, and the object of a transfer.

use super::{BlockEnd, Bytes, Segment, tail};

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
        Multiplexer::of_head(u32::from_le_bytes([frame[0], frame[1], frame[2], frame[3]]))
    }

    /// The same as [`parse`](Multiplexer::parse), with one load of a word: fewer instructions, but more code where several
    /// requests are distinguished.
    pub(super) const fn parse_word(frame: &[u8; 8]) -> Multiplexer {
        match frame.first_chunk() {
            Some(head) => Multiplexer::of_head(u32::from_le_bytes(*head)),
            None => Multiplexer { index: 0, sub: 0 },
        }
    }

    /// From the first word of a frame: a response takes the same three bytes back.
    #[allow(clippy::cast_possible_truncation)] // The two parts of the word.
    const fn of_head(head: u32) -> Multiplexer {
        Multiplexer { index: (head >> 8) as u16, sub: (head >> 24) as u8 }
    }

    /// The data of a frame: command specifier, this multiplexer and four bytes.
    pub(crate) const fn frame(self, command: u8, data: [u8; 4]) -> [u8; 8] {
        let head = command as u32 | (self.index as u32) << 8 | (self.sub as u32) << 24;
        let [command, low, high, sub] = head.to_le_bytes();
        [command, low, high, sub, data[0], data[1], data[2], data[3]]
    }
}

/// A request of an SDO client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Write: the first or only frame.
    Download(Multiplexer, Initiate),
    /// Write: a segment.
    DownloadSegment(Segment),
    /// Read: the first frame.
    Upload(Multiplexer),
    /// Read: asks for the next segment.
    UploadSegment {
        /// Alternates, starting with 0.
        toggle: bool,
    },
    /// The client aborts the transfer.
    Abort(Multiplexer, u32),
    /// Write in blocks: the first frame.
    BlockDownload {
        /// The object to write.
        at: Multiplexer,
        /// Whether the client will send a CRC at the end.
        crc: bool,
        /// Total number of bytes, if the client announces it.
        size: Option<u32>,
    },
    /// Write in blocks: the end. (Each segment is a [`BlockSegment`](super::BlockSegment).)
    BlockDownloadEnd(BlockEnd),
    /// Read in blocks: the first frame.
    BlockUpload {
        /// The object to read.
        at: Multiplexer,
        /// Whether the client can check a CRC.
        crc: bool,
        /// Segments in a block. The server refuses a number outside 1 to 127.
        block_size: u8,
        /// For an object of at most this many bytes, the server may choose another kind of transfer; 0 for never.
        threshold: u8,
    },
    /// Read in blocks: asks for the first block.
    BlockUploadStart,
    /// Read in blocks: acknowledges a block and asks for the next one.
    BlockAcknowledge {
        /// Number of the last segment received in sequence; 0 for none.
        sequence: u8,
        /// Segments in the next block. The server refuses a number outside 1 to 127.
        block_size: u8,
    },
    /// Read in blocks: confirms the end of the transfer.
    BlockUploadEnded,
}

/// The content of the first frame of a download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Initiate {
    /// All data, one to four bytes.
    Expedited(Bytes<4>),
    /// All data, without its size. The data type of the object tells how many of the four bytes are used.
    Unsized([u8; 4]),
    /// Segments follow. The total number of bytes, if the client announces it.
    Segmented(Option<u32>),
}

impl Request {
    /// `None` for an unknown command specifier.
    #[must_use]
    pub fn parse(frame: &[u8; 8]) -> Option<Request> {
        let multiplexer = Multiplexer::parse(frame);
        match frame[0] >> 5 {
            0 => Some(Request::DownloadSegment(Segment::parse(frame))),
            1 => Some(Request::Download(multiplexer, Initiate::parse(frame))),
            2 => Some(Request::Upload(multiplexer)),
            3 => Some(Request::UploadSegment { toggle: frame[0] & 0x10 != 0 }),
            4 => Some(Request::Abort(multiplexer, u32::from_le_bytes(tail(frame)))),
            5 => Some(Request::parse_block_upload(frame)),
            6 if frame[0] & 1 != 0 => Some(Request::BlockDownloadEnd(BlockEnd::parse(frame))),
            6 => {
                let size = (frame[0] & 2 != 0).then(|| u32::from_le_bytes(tail(frame)));
                Some(Request::BlockDownload { at: multiplexer, crc: frame[0] & 4 != 0, size })
            }
            _ => None,
        }
    }

    fn parse_block_upload(frame: &[u8; 8]) -> Request {
        match frame[0] & 3 {
            0 => Request::BlockUpload {
                at: Multiplexer::parse(frame),
                crc: frame[0] & 4 != 0,
                block_size: frame[4],
                threshold: frame[5],
            },
            1 => Request::BlockUploadEnded,
            2 => Request::BlockAcknowledge { sequence: frame[1], block_size: frame[2] },
            _ => Request::BlockUploadStart,
        }
    }

    /// The data of the frame.
    #[must_use]
    pub fn encode(self) -> [u8; 8] {
        match self {
            Request::Download(multiplexer, initiate) => initiate.encode(multiplexer),
            Request::DownloadSegment(segment) => segment.encode(),
            Request::Upload(multiplexer) => multiplexer.frame(0x40, [0; 4]),
            Request::UploadSegment { toggle } => [0x60 | u8::from(toggle) << 4, 0, 0, 0, 0, 0, 0, 0],
            Request::Abort(multiplexer, code) => multiplexer.frame(0x80, code.to_le_bytes()),
            Request::BlockDownload { at, crc, size } => {
                let command = 0xC0 | u8::from(crc) << 2 | u8::from(size.is_some()) << 1;
                at.frame(command, size.unwrap_or(0).to_le_bytes())
            }
            Request::BlockDownloadEnd(end) => end.encode(0xC1),
            Request::BlockUpload { at, crc, block_size, threshold } => {
                at.frame(0xA0 | u8::from(crc) << 2, [block_size, threshold, 0, 0])
            }
            Request::BlockUploadStart => [0xA3, 0, 0, 0, 0, 0, 0, 0],
            Request::BlockAcknowledge { sequence, block_size } => [0xA2, sequence, block_size, 0, 0, 0, 0, 0],
            Request::BlockUploadEnded => [0xA1, 0, 0, 0, 0, 0, 0, 0],
        }
    }
}

impl Initiate {
    /// The data in the frame of an expedited download with a size; `None` for any other download.
    pub(super) fn expedited(frame: &[u8; 8]) -> Option<&[u8]> {
        let [command, _, _, _, data @ ..] = frame;
        let unused = usize::from(command >> 2 & 3);
        if command & 0x03 == 0b11 { data.get(..data.len() - unused) } else { None }
    }

    pub(super) fn parse(frame: &[u8; 8]) -> Initiate {
        let data = tail(frame);
        match frame[0] & 0x03 {
            0b11 => Initiate::Expedited(Bytes::from_slice(Initiate::expedited(frame).unwrap_or(&data))),
            0b10 => Initiate::Unsized(data),
            0b01 => Initiate::Segmented(Some(u32::from_le_bytes(data))),
            _ => Initiate::Segmented(None),
        }
    }

    fn encode(self, multiplexer: Multiplexer) -> [u8; 8] {
        match self {
            // Expedited data cannot be empty: empty data is sent as one zero byte.
            Initiate::Expedited(bytes) => {
                multiplexer.frame(0x23 | (4 - bytes.len().max(1)) << 2, bytes.padded())
            }
            Initiate::Unsized(data) => multiplexer.frame(0x22, data),
            Initiate::Segmented(Some(size)) => multiplexer.frame(0x21, size.to_le_bytes()),
            Initiate::Segmented(None) => multiplexer.frame(0x20, [0; 4]),
        }
    }
}
