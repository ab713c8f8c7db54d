//! PDO mapping: mapping entries are resolved to locations in the image once, when the mapping is enabled. Linked lists of
//! PDOs, so that SYNC, reception and polling visit only the PDOs concerned, of up to 512.

use crate::dictionary::{Addressing, Dictionary, Direction, Entry, Field, MappedObject};
use crate::sdo::Abort;

/// An offset outside every image: a read gives zero, a write has no effect.
const NOWHERE: u16 = u16::MAX;

/// The location of a mapped object, and whether the object accepts any value without a check.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Located {
    pub(crate) field: Field,
    pub(crate) takes_any: bool,
}

/// Finds the location of a mapped object. `is_stored` tells whether a write to it stores values at once.
///
/// `NoObject` if there is no such object; `NotMappable` if the object cannot be mapped in this direction, or if the
/// length is not the length of the object.
pub(crate) fn locate(
    dictionary: &Dictionary,
    mapped: MappedObject,
    direction: Direction,
    is_stored: impl Fn(&Entry) -> bool,
) -> Result<Located, Abort> {
    let (located, fits) = match mapped.dummy_size() {
        Some(size) if direction == Direction::Receive => {
            (Located { field: Field { offset: NOWHERE, size }, takes_any: true }, true)
        }
        _ => {
            let entry = dictionary.find(mapped.index, mapped.sub).map_err(|_| Abort::NoObject)?;
            let mapping = entry.attributes.mapping;
            let fits = match direction {
                Direction::Transmit => mapping.allows_tpdo(),
                Direction::Receive => mapping.allows_rpdo(),
            };
            // A new value of a parameter must be reported to the application, so it does not skip the check.
            let takes_any = entry.takes_any() && !entry.is_parameter() && !is_stored(&entry);
            (Located { field: entry.field, takes_any }, fits)
        }
    };
    let same_length = u16::from(mapped.bits) == u16::from(located.field.size) * 8;
    if fits && same_length { Ok(located) } else { Err(Abort::NotMappable) }
}

/// Content of a PDO.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Content {
    /// Mapped objects.
    Objects(Layout),
    /// A single object, which the frame names.
    Multiplexed(Addressing),
}

/// The locations of the mapped values in the image, in the order of the PDO data. Adjacent values, such as those of one
/// object, are merged to one location.
// Whole words are copied without a call of `memcpy`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(align(4))]
pub(crate) struct Layout {
    /// Length of the PDO in bytes.
    len: u8,
    count: u8,
    /// Whether received values must be checked, because an object has limits or a rule or is a parameter.
    is_checked: bool,
    places: [Field; 8],
}

impl Layout {
    /// The layout of a PDO without objects.
    pub(crate) const EMPTY: Layout =
        Layout { len: 0, count: 0, is_checked: false, places: [Field { offset: 0, size: 0 }; 8] };

    /// Appends a mapped object; `PdoLength` when the PDO would grow beyond eight bytes.
    #[allow(clippy::indexing_slicing, reason = "eight bytes are eight places at most")]
    pub(crate) fn push(&mut self, Located { field, takes_any }: Located) -> Result<(), Abort> {
        self.is_checked |= !takes_any;
        let len = self.len.saturating_add(field.size);
        if len > 8 {
            return Err(Abort::PdoLength);
        }
        let count = usize::from(self.count);
        let last = &mut self.places[count.wrapping_sub(1) & 7];
        if count != 0 && last.end() == field.offset {
            last.size += field.size;
        } else {
            self.places[count & 7] = field;
            self.count += 1;
        }
        self.len = len;
        Ok(())
    }

    /// Whether received values must be checked before they are written.
    pub(crate) fn is_checked(&self) -> bool {
        self.is_checked
    }

    fn places(&self) -> &[Field] {
        self.places.get(..usize::from(self.count)).unwrap_or(&self.places)
    }

    /// Whether the PDO carries a value.
    pub(crate) fn contains(&self, field: Field) -> bool {
        self.places().iter().any(|place| (place.offset..place.end()).contains(&field.offset))
    }

    /// The place in the image of each byte of the PDO.
    pub(crate) fn offsets(&self) -> impl Iterator<Item = usize> {
        self.places().iter().flat_map(|place| usize::from(place.offset)..usize::from(place.end()))
    }

    /// Length of the PDO in bytes.
    pub(crate) fn len(&self) -> u8 {
        self.len
    }

    /// Reads the data of the PDO from the image.
    pub(crate) fn gather(&self, image: &[u8]) -> [u8; 8] {
        // Each value is read as eight bytes. The next value overwrites the surplus bytes, or the mask at the end clears
        // them.
        let data = match self.places() {
            [place] => place.eight(image),
            places => join(places, image),
        };
        if self.len == 8 {
            return data;
        }
        let mask = (1_u64 << (self.len * 8)).wrapping_sub(1);
        (u64::from_le_bytes(data) & mask).to_le_bytes()
    }

    /// Writes the data of the PDO to the image.
    pub(crate) fn scatter(&self, data: [u8; 8], image: &mut [u8]) {
        let mut rest = data.as_slice();
        for place in self.places() {
            place.set(image, rest);
            rest = rest.get(usize::from(place.size)..).unwrap_or_default();
        }
    }
}

/// The first eight bytes of the concatenated values.
#[inline(never)]
fn join(places: &[Field], image: &[u8]) -> [u8; 8] {
    let (mut data, mut at) = ([0; 16], 0);
    for place in places {
        if let Some(to) = data.get_mut(at..).and_then(|rest| rest.first_chunk_mut()) {
            *to = place.eight(image);
        }
        at += usize::from(place.size);
    }
    data.first_chunk().copied().unwrap_or_default()
}

/// A linked list of PDOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Chain {
    /// All valid PDOs.
    Valid,
    /// The valid PDOs that a SYNC affects: RPDOs whose data waits for the SYNC, and TPDOs whose values are sent or
    /// sampled with the SYNC.
    Synchronous,
}

/// The positions of the next PDO in each chain, or of the first PDO of each chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Links {
    valid: u16,
    synchronous: u16,
}

impl Links {
    /// The position after the last PDO of a chain: no PDO has this position.
    const NOWHERE: u16 = u16::MAX;
    /// In no chain.
    pub(crate) const NONE: Links = Links { valid: 0, synchronous: 0 };
    /// The end of both chains.
    pub(crate) const END: Links = Links { valid: Links::NOWHERE, synchronous: Links::NOWHERE };

    /// The position of the next PDO. At the end of the chain, no PDO has this position.
    #[inline]
    pub(crate) fn next(self, chain: Chain) -> usize {
        usize::from(match chain {
            Chain::Valid => self.valid,
            Chain::Synchronous => self.synchronous,
        })
    }

    /// Puts the PDO at position `place` before the others of the chain.
    #[allow(clippy::cast_possible_truncation)] // There are at most 512 in each direction.
    pub(crate) fn prepend(&mut self, chain: Chain, place: usize) {
        let place = place as u16;
        match chain {
            Chain::Valid => self.valid = place,
            Chain::Synchronous => self.synchronous = place,
        }
    }
}
