//! The values of the PDO objects: a mapped object, and the addressing mode of a multiplexed PDO.

/// A mapping entry (1600h.., 1A00h..): index, sub-index and length in bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MappedObject {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
    /// Length in bits.
    pub bits: u8,
}

impl MappedObject {
    /// Decodes a mapping entry. Any 32 bits are valid; the object may not exist.
    #[must_use]
    pub const fn parse(value: u32) -> MappedObject {
        let [bits, sub, low, high] = value.to_le_bytes();
        MappedObject { index: u16::from_le_bytes([low, high]), sub, bits }
    }

    /// The value as the dictionary stores it.
    #[must_use]
    pub const fn encode(self) -> u32 {
        let [low, high] = self.index.to_le_bytes();
        u32::from_le_bytes([self.bits, self.sub, low, high])
    }

    /// Size of a dummy entry in bytes. Its index is a data type (0002h to 0007h), and the node skips these bytes of an
    /// RPDO (CiA 301, 7.4.7.1).
    pub(crate) const fn dummy_size(self) -> Option<u8> {
        match (self.index, self.sub) {
            (0x0002 | 0x0005, 0) => Some(1),
            (0x0003 | 0x0006, 0) => Some(2),
            (0x0004 | 0x0007, 0) => Some(4),
            _ => None,
        }
    }
}

/// The direction of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Transmit,
    Receive,
}

impl Direction {
    pub(crate) const BOTH: [Direction; 2] = [Direction::Transmit, Direction::Receive];
}

/// The addressing mode of a multiplexed PDO: a special number of mapped objects (1600h.., 1A00h..:0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Addressing {
    /// 254, source address mode: the frame names an object of the sender.
    Source,
    /// 255, destination address mode: the frame names an object of the receiver.
    Destination,
}

impl Addressing {
    /// `None` for an ordinary number of mapped objects.
    #[must_use]
    pub const fn from_count(count: u8) -> Option<Addressing> {
        match count {
            0xFE => Some(Addressing::Source),
            0xFF => Some(Addressing::Destination),
            _ => None,
        }
    }
}
