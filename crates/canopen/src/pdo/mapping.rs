//! PDO mapping: from mapping entries to places in the image, resolved once, when the mapping is enabled.

use crate::dictionary::{self, Dictionary, Entry};
use crate::sdo::Abort;

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
    /// Any 32 bits are a mapping entry; whether the object exists is another question.
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
}

/// Which way the data goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Transmit,
}

/// The entry that a mapping entry names.
///
/// `NoObject` where there is none, `NotMappable` where it cannot go into such a PDO or the length is not its own.
pub(crate) fn locate(
    dictionary: &Dictionary,
    mapped: MappedObject,
    direction: Direction,
) -> Result<&'static Entry, Abort> {
    let entry = dictionary.find(mapped.index, mapped.sub).map_err(|_| Abort::NoObject)?;
    let fits = match direction {
        Direction::Transmit => entry.mapping == dictionary::Mapping::Tpdo,
    };
    let same_length = u16::from(mapped.bits) == u16::from(entry.field.size) * 8;
    if fits && same_length { Ok(entry) } else { Err(Abort::NotMappable) }
}

/// For each byte of the PDO the place in the image. Byte by byte, as nothing in the dictionary is shorter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Layout {
    len: u8,
    places: [u16; 8],
}

impl Layout {
    /// Appends a mapped object; `PdoLength` when the PDO would grow beyond eight bytes.
    pub(crate) fn push(&mut self, entry: &Entry) -> Result<(), Abort> {
        let start = usize::from(self.len);
        let end = start + usize::from(entry.field.size);
        let places = self.places.get_mut(start..end).ok_or(Abort::PdoLength)?;
        for (place, offset) in places.iter_mut().zip(entry.field.offset..) {
            *place = offset;
        }
        self.len += entry.field.size;
        Ok(())
    }

    /// Bytes of the PDO.
    pub(crate) fn len(&self) -> u8 {
        self.len
    }

    /// The PDO's data from the image.
    pub(crate) fn gather(&self, image: &[u8]) -> [u8; 8] {
        let mut data = [0; 8];
        for (byte, &place) in data.iter_mut().zip(&self.places).take(usize::from(self.len)) {
            *byte = image.get(usize::from(place)).copied().unwrap_or(0);
        }
        data
    }
}
