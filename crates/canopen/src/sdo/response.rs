//! Responses of an SDO server.

use super::{BlockEnd, BlockSize, Bytes, Multiplexer, Segment, tail};

/// A response of an SDO server. An abort message has its code as a number, because a client may receive any code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Response {
    /// Write: done, or ready for segments.
    Downloaded(Multiplexer),
    /// Write: a segment is accepted.
    DownloadedSegment {
        /// Toggle bit of the segment.
        toggle: bool,
    },
    /// Read: all data, one to four bytes. Four bytes if the server does not tell the size.
    Uploaded(Multiplexer, Bytes<4>),
    /// Read: segments follow. The total number of bytes, if the server announces it.
    UploadSegmented(Multiplexer, Option<u32>),
    /// Read: the next segment.
    UploadedSegment(Segment),
    /// The server refuses or aborts the transfer.
    Abort(Multiplexer, u32),
    /// Write in blocks: ready for a first block of this size. Some servers do not check the CRC; the client sends it
    /// anyway.
    BlockDownload(Multiplexer, BlockSize),
    /// Write in blocks: acknowledges a block up to this segment (0 for none), with the size of the next block.
    BlockAcknowledge(u8, BlockSize),
    /// Write in blocks: done.
    BlockDownloaded,
    /// Read in blocks: ready to send.
    BlockUpload {
        /// The object to read.
        at: Multiplexer,
        /// Whether the server will send a CRC at the end.
        crc: bool,
        /// Total number of bytes, if the server announces it.
        size: Option<u32>,
    },
    /// Read in blocks: the end. (Each segment is a [`BlockSegment`](super::BlockSegment).)
    BlockUploadEnd(BlockEnd),
}

/// Command specifier of the response that begins a block download with CRC.
const BLOCK_DOWNLOAD: u8 = 0xA4;

impl Response {
    /// `None` for an unknown command specifier.
    #[must_use]
    pub fn parse(frame: [u8; 8]) -> Option<Response> {
        let multiplexer = Multiplexer::parse(&frame);
        match frame[0] >> 5 {
            0 => Some(Response::UploadedSegment(Segment::parse(&frame))),
            1 => Some(Response::DownloadedSegment { toggle: frame[0] & 0x10 != 0 }),
            2 => Some(Response::parse_upload(multiplexer, &frame)),
            3 => Some(Response::Downloaded(multiplexer)),
            4 => Some(Response::Abort(multiplexer, u32::from_le_bytes(tail(&frame)))),
            5 => Response::parse_block_download(multiplexer, &frame),
            6 if frame[0] & 1 != 0 => Some(Response::BlockUploadEnd(BlockEnd::parse(&frame))),
            6 => {
                let size = (frame[0] & 2 != 0).then(|| u32::from_le_bytes(tail(&frame)));
                Some(Response::BlockUpload { at: multiplexer, crc: frame[0] & 4 != 0, size })
            }
            _ => None,
        }
    }

    fn parse_block_download(multiplexer: Multiplexer, frame: &[u8; 8]) -> Option<Response> {
        match frame[0] & 0x07 {
            0b000 | 0b100 => Some(Response::BlockDownload(multiplexer, BlockSize::new(frame[4])?)),
            0b010 => Some(Response::BlockAcknowledge(frame[1], BlockSize::new(frame[2])?)),
            0b001 => Some(Response::BlockDownloaded),
            _ => None,
        }
    }

    fn parse_upload(multiplexer: Multiplexer, frame: &[u8; 8]) -> Response {
        match frame[0] & 0x03 {
            0b11 => Response::Uploaded(multiplexer, Bytes::new(tail(frame), 4 - (frame[0] >> 2 & 3))),
            0b10 => Response::Uploaded(multiplexer, Bytes::new(tail(frame), 4)),
            0b01 => Response::UploadSegmented(multiplexer, Some(u32::from_le_bytes(tail(frame)))),
            _ => Response::UploadSegmented(multiplexer, None),
        }
    }

    /// Whether a frame of this server is the response that begins a block download.
    pub(super) fn begins_block_download(frame: &[u8; 8]) -> bool {
        frame[0] == BLOCK_DOWNLOAD
    }

    /// The data of the frame.
    #[must_use]
    #[inline(always)]
    #[allow(clippy::inline_always)] // The server knows the variant, so only one arm of the match remains.
    pub fn encode(self) -> [u8; 8] {
        match self {
            Response::Downloaded(multiplexer) => multiplexer.frame(0x60, [0; 4]),
            Response::DownloadedSegment { toggle } => [0x20 | u8::from(toggle) << 4, 0, 0, 0, 0, 0, 0, 0],
            Response::Uploaded(multiplexer, bytes) => {
                multiplexer.frame(0x43 | (4 - bytes.len().max(1)) << 2, bytes.padded())
            }
            Response::UploadSegmented(multiplexer, size) => {
                let command = 0x40 | u8::from(size.is_some());
                multiplexer.frame(command, size.unwrap_or(0).to_le_bytes())
            }
            Response::UploadedSegment(segment) => segment.encode(),
            Response::Abort(multiplexer, code) => multiplexer.frame(0x80, code.to_le_bytes()),
            Response::BlockDownload(multiplexer, size) => {
                multiplexer.frame(BLOCK_DOWNLOAD, [size.get(), 0, 0, 0])
            }
            Response::BlockAcknowledge(sequence, size) => [0xA2, sequence, size.get(), 0, 0, 0, 0, 0],
            Response::BlockDownloaded => [0xA1, 0, 0, 0, 0, 0, 0, 0],
            Response::BlockUpload { at, crc, size } => {
                let command = 0xC0 | u8::from(crc) << 2 | u8::from(size.is_some()) << 1;
                at.frame(command, size.unwrap_or(0).to_le_bytes())
            }
            Response::BlockUploadEnd(end) => end.encode(0xC1),
        }
    }
}
