//! The messages of block transfers: block size, segment, end.

/// Number of segments in a block, 1 to 127.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BlockSize(u8);

impl BlockSize {
    /// The largest block size of the protocol.
    pub const MAX: BlockSize = BlockSize(127);

    /// `None` for 0 and above 127.
    #[must_use]
    pub const fn new(segments: u8) -> Option<BlockSize> {
        if matches!(segments, 1..=127) { Some(BlockSize(segments)) } else { None }
    }

    /// The number of segments.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }
}

/// One segment of a block. The end of the transfer tells how many bytes of the last segment are data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSegment {
    /// No segment follows.
    pub last: bool,
    /// Number of the segment in the block, from 1.
    pub sequence: BlockSize,
    /// The data of the segment.
    pub data: [u8; 7],
}

impl BlockSegment {
    /// `None` for the sequence number 0, which marks an abort message.
    #[must_use]
    pub fn parse(frame: [u8; 8]) -> Option<BlockSegment> {
        let [first, data @ ..] = frame;
        let sequence = BlockSize::new(first & 0x7F)?;
        Some(BlockSegment { last: first & 0x80 != 0, sequence, data })
    }

    /// The data of the frame.
    #[must_use]
    pub fn encode(self) -> [u8; 8] {
        let mut frame = [self.sequence.get() | u8::from(self.last) << 7; 8];
        let [_, data @ ..] = &mut frame;
        *data = self.data;
        frame
    }
}

/// The end of a block transfer, the same in both directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockEnd {
    /// Bytes of the last segment that are not data, 0 to 7.
    pub unused: u8,
    /// CRC of all data.
    pub crc: u16,
}

impl BlockEnd {
    pub(super) fn parse(frame: &[u8; 8]) -> BlockEnd {
        BlockEnd { unused: frame[0] >> 2 & 7, crc: u16::from_le_bytes([frame[1], frame[2]]) }
    }

    pub(super) fn encode(self, command: u8) -> [u8; 8] {
        let [low, high] = self.crc.to_le_bytes();
        [command | (self.unused & 7) << 2, low, high, 0, 0, 0, 0, 0]
    }

    /// The end of a transfer of `len` bytes.
    #[must_use]
    pub fn of(len: usize, crc: u16) -> BlockEnd {
        let tail = if len == 0 { 0 } else { (len - 1) % 7 + 1 };
        BlockEnd { unused: u8::try_from(7 - tail).unwrap_or(0), crc }
    }
}
