//! The dictionary at run time: entries without text, found by binary search.

use super::{Access, Field, Group, Mapping, Rule, Type};
use crate::NodeId;
use crate::sdo::Abort;

/// One entry as the node needs it.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub(crate) key: u32,
    /// Limits of an integer of at most 32 bits: the smallest value fits a signed word and the largest an unsigned one.
    /// Longer ones take any value.
    pub(crate) low: i32,
    pub(crate) high: u32,
    pub(crate) field: Field,
    pub(crate) kind: Type,
    pub(crate) access: Access,
    pub(crate) mapping: Mapping,
    pub(crate) group: Group,
    pub(crate) rule: Rule,
    /// The default value counts from the node-ID.
    pub(crate) node_relative: bool,
}

impl Entry {
    /// Index.
    #[must_use]
    pub const fn index(&self) -> u16 {
        let [_, low, high, _] = self.key.to_le_bytes();
        u16::from_le_bytes([low, high])
    }

    /// Sub-index.
    #[must_use]
    pub const fn sub(&self) -> u8 {
        self.key.to_le_bytes()[0]
    }

    /// Place of its value in the image.
    #[must_use]
    pub const fn field(&self) -> Field {
        self.field
    }

    /// Checks the length of a value to be written. A string may be shorter than its place.
    pub(crate) fn check_length(&self, len: usize) -> Result<(), Abort> {
        let size = usize::from(self.field.size);
        if len > size {
            return Err(Abort::TooLong);
        }
        if len < size && !matches!(self.kind, Type::VisibleString(_)) { Err(Abort::TooShort) } else { Ok(()) }
    }

    /// Checks a value of the right length that is to be written.
    pub(crate) fn check_value(&self, bytes: &[u8]) -> Result<(), Abort> {
        match self.kind {
            Type::VisibleString(_) | Type::Domain | Type::Unsigned48 | Type::Unsigned64 => Ok(()),
            Type::Real32 => check_real(f32::from_bits(little_endian(bytes))),
            _ => self.check_limits(self.kind.integer(little_endian(bytes))),
        }
    }

    fn check_limits(&self, value: i64) -> Result<(), Abort> {
        if value > i64::from(self.high) {
            return Err(Abort::ValueTooHigh);
        }
        if value < i64::from(self.low) { Err(Abort::ValueTooLow) } else { Ok(()) }
    }
}

/// The number in the first four bytes.
pub(crate) fn little_endian(bytes: &[u8]) -> u32 {
    if let Some(bytes) = bytes.first_chunk() {
        return u32::from_le_bytes(*bytes);
    }
    bytes.iter().take(4).rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}

/// A parameter that is not a number would turn every measured value into one that is not.
fn check_real(value: f32) -> Result<(), Abort> {
    if value.is_finite() { Ok(()) } else { Err(Abort::InvalidValue) }
}

/// The dictionary of one personality.
#[derive(Clone, Copy, Debug)]
pub struct Dictionary {
    entries: &'static [Entry],
    defaults: &'static [u8],
}

impl Dictionary {
    /// From what [`compile`](super::compile) and [`default_image`](super::default_image) made of the same rows.
    #[must_use]
    pub const fn new(entries: &'static [Entry], defaults: &'static [u8]) -> Dictionary {
        Dictionary { entries, defaults }
    }

    /// All entries, sorted.
    #[must_use]
    pub const fn entries(&self) -> &'static [Entry] {
        self.entries
    }

    /// The image of all default values; what counts from the node-ID holds the rest.
    #[must_use]
    pub const fn defaults(&self) -> &'static [u8] {
        self.defaults
    }

    /// The entries of the indexes from `first` up to the one before `end`.
    pub(crate) fn between(&self, first: u16, end: u16) -> &'static [Entry] {
        let place = |index| self.entries.partition_point(|entry| entry.index() < index);
        self.entries.get(place(first)..place(end)).unwrap_or(&[])
    }

    /// The default value of an integer of at most 32 bits, with the node-ID where it counts from that.
    pub(crate) fn default_number(&self, entry: &Entry, node_id: Option<NodeId>) -> u32 {
        let node_id = node_id.filter(|_| entry.node_relative).map_or(0, NodeId::get);
        little_endian(entry.field.get(self.defaults)).wrapping_add(node_id.into())
    }

    /// The entry of an index and a sub-index.
    ///
    /// # Errors
    /// `NoObject` where the index is unknown, `NoSubIndex` where only the sub-index is.
    pub fn find(&self, index: u16, sub: u8) -> Result<&'static Entry, Abort> {
        let key = u32::from(index) << 8 | u32::from(sub);
        match self.entries.binary_search_by_key(&key, |entry| entry.key) {
            Ok(at) => self.entries.get(at).ok_or(Abort::NoObject),
            Err(at) => Err(self.missing(index, at)),
        }
    }

    /// An index that exists has a neighbour of the place where the missing entry would be.
    fn missing(&self, index: u16, at: usize) -> Abort {
        let is_sibling = |at: usize| self.entries.get(at).is_some_and(|entry| entry.index() == index);
        if is_sibling(at) || is_sibling(at.wrapping_sub(1)) { Abort::NoSubIndex } else { Abort::NoObject }
    }

    /// The place of a value, known at compile time.
    ///
    /// # Panics
    /// During compilation, when there is no such entry.
    #[must_use]
    pub const fn field(&self, index: u16, sub: u8) -> Field {
        let key = (index as u32) << 8 | sub as u32;
        let mut i = 0;
        while i < self.entries.len() {
            if self.entries[i].key == key {
                return self.entries[i].field;
            }
            i += 1;
        }
        panic!("no such entry")
    }
}
