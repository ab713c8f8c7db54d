//! The values of a storage group as a sequence of bytes that describes its own content.
//!
//! ```text
//! run                                      values of consecutive sub-indexes of the same size
//! ┌─────────┬─────┬───────┬──────┬───────────┐
//! │ index   │ sub │ count │ size │ values    │
//! │ 2 bytes │ 1   │ 1     │ 1    │ count × size
//! └─────────┴─────┴───────┴──────┴───────────┘
//! ```
//!
//! A COB-ID with the pre-defined CAN-ID of the node follows the node-ID. It is stored with bit 29 set, which no COB-ID of
//! a base frame has, and without the node-ID; if its flags have their defaults, it is left out. Any other COB-ID is
//! stored as a number.
//!
//! Every value has its index, so a set that an older firmware has stored fits a newer dictionary: new objects keep
//! their defaults. A set is refused as a whole if one of its objects no longer exists, has another size or does not
//! accept the value.

use super::entry::little_endian;
use super::{DefaultValue, Dictionary, Entry, Group, Object};
use crate::NodeId;
use crate::copy::copy;
use crate::sdo::Abort;

/// Size of the head of a run in bytes.
const HEAD: usize = 5;

/// Mark of a stored COB-ID that follows the node-ID: bit 29, extended frame.
const FOLLOWS: u32 = 1 << 29;
/// The flags of a COB-ID, bits 30 and 31.
const FLAGS: u32 = 0b11 << 30;

/// The buffer had no room for all values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferFull;

impl core::fmt::Display for BufferFull {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the buffer has no room for all values of the group")
    }
}

impl core::error::Error for BufferFull {}

/// The maximum size of the packed group of a table, in bytes.
#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
#[must_use]
pub const fn packed_size(rows: &[Object], group: Group) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < rows.len() {
        let row = &rows[i];
        if is_of(row, group) {
            let continues = i > 0 && is_of(&rows[i - 1], group) && is_next(&rows[i - 1], row);
            total += row.kind.size() as usize + if continues { 0 } else { HEAD };
        }
        i += 1;
    }
    total
}

const fn is_of(row: &Object, group: Group) -> bool {
    matches!(row.group, Some(own) if own as u8 == group as u8)
}

const fn is_next(a: &Object, b: &Object) -> bool {
    let follows = b.key() == a.key() + 1 && b.index == a.index && a.kind.size() == b.kind.size();
    follows && !matches!(a.default, DefaultValue::NodeId(_)) && !matches!(b.default, DefaultValue::NodeId(_))
}

/// Whether a packed group has a value for an entry. An older firmware may not have had the entry.
#[must_use]
pub fn is_packed(mut packed: &[u8], index: u16, sub: u8) -> bool {
    while let Some((run, rest)) = Run::parse(packed) {
        if run.index == index && usize::from(sub.wrapping_sub(run.sub)) * run.size < run.bytes.len() {
            return true;
        }
        packed = rest;
    }
    false
}

impl Dictionary {
    /// Writes the values of a group to the beginning of `out`. Returns the number of bytes. A COB-ID with the
    /// pre-defined CAN-ID of this node-ID follows the node-ID with which it is loaded. Instead of a value beyond its
    /// limits, which only the application itself can set, the default is stored: the value would make the set useless.
    ///
    /// # Errors
    /// `BufferFull`; the content of `out` is then useless.
    pub fn pack(
        &self,
        group: Group,
        node_id: Option<NodeId>,
        image: &[u8],
        out: &mut [u8],
    ) -> Result<usize, BufferFull> {
        let is_kept = |entry: &Entry| {
            let is_default = || entry.field.u32(image) == self.default_number(entry, node_id);
            entry.attributes.group == Some(group) && !(entry.attributes.node_relative && is_default())
        };
        let mut writer = Writer { out, len: 0 };
        let mut last: Option<(Entry, usize)> = None;
        for entry in self.entries().filter(is_kept) {
            let head = match last.filter(|(last, _)| last.is_followed_by(&entry)) {
                Some((_, head)) => head,
                None => writer.begin(&entry)?,
            };
            // The count is the fourth byte of the head. A run has at most one value for each sub-index, so the count
            // does not wrap.
            if let Some(count) = writer.out.get_mut(head + 3) {
                *count = count.wrapping_add(1);
            }
            let (word, mut value) = (self.number_to_store(&entry, node_id, image), entry.field.get(image));
            if let Some(word) = &word {
                value = word.get(..value.len()).unwrap_or(value);
            }
            writer.append(value)?;
            last = Some((entry, head));
        }
        Ok(writer.len)
    }

    /// Writes the values of a packed group to the image of a node with this node-ID.
    ///
    /// # Errors
    /// The reason why the set does not fit this dictionary. The image then contains a part of the set and must be
    /// loaded again.
    pub(crate) fn unpack(
        &self,
        group: Group,
        node_id: Option<NodeId>,
        mut packed: &[u8],
        image: &mut [u8],
    ) -> Result<(), Abort> {
        while !packed.is_empty() {
            let (run, rest) = Run::parse(packed).ok_or(Abort::General)?;
            for (sub, value) in run.values() {
                let entry = self.find(run.index, sub)?;
                if entry.attributes.group != Some(group) {
                    return Err(Abort::Length);
                }
                self.unpack_value(&entry, node_id, value, image)?;
            }
            packed = rest;
        }
        Ok(())
    }

    fn unpack_value(
        &self,
        entry: &Entry,
        node_id: Option<NodeId>,
        value: &[u8],
        image: &mut [u8],
    ) -> Result<(), Abort> {
        if value.len() != usize::from(entry.field.size) {
            return Err(Abort::Length);
        }
        let number = little_endian(value);
        entry.check_value(number)?;
        if entry.attributes.node_relative && number & FOLLOWS != 0 {
            let id = self.default_number(entry, node_id) & !FLAGS;
            entry.field.store(image, (id | number & FLAGS).to_le_bytes());
        } else {
            entry.field.set(image, value);
        }
        Ok(())
    }

    /// The value to store instead of a value; `None` for the value itself.
    fn number_to_store(&self, entry: &Entry, node_id: Option<NodeId>, image: &[u8]) -> Option<[u8; 4]> {
        let number = match self.relative(entry, node_id, image) {
            Some(number) => number,
            None if entry.check_value(little_endian(entry.field.get(image))).is_ok() => return None,
            None => self.default_number(entry, node_id),
        };
        Some(number.to_le_bytes())
    }

    /// The stored form of a COB-ID that follows the node-ID; `None` for any other value.
    fn relative(&self, entry: &Entry, node_id: Option<NodeId>, image: &[u8]) -> Option<u32> {
        let value = entry.field.u32(image);
        let follows =
            entry.attributes.node_relative && (value ^ self.default_number(entry, node_id)) & !FLAGS == 0;
        follows.then(|| value & FLAGS | FOLLOWS | self.default_number(entry, None) & !FLAGS)
    }
}

impl Entry {
    fn is_followed_by(&self, next: &Entry) -> bool {
        let adjacent = next.index == self.index && next.sub.checked_sub(self.sub) == Some(1);
        let is_relative = self.attributes.node_relative || next.attributes.node_relative;
        adjacent && next.field.size == self.field.size && !is_relative
    }
}

/// The buffer, and the number of bytes written.
struct Writer<'a> {
    out: &'a mut [u8],
    len: usize,
}

impl Writer<'_> {
    /// Begins a run without values. Returns the offset of its head.
    fn begin(&mut self, entry: &Entry) -> Result<usize, BufferFull> {
        let at = self.len;
        let [low, high] = entry.index().to_le_bytes();
        self.append(&[low, high, entry.sub(), 0, entry.field.size])?;
        Ok(at)
    }

    fn append(&mut self, bytes: &[u8]) -> Result<(), BufferFull> {
        let end = self.len + bytes.len();
        copy(self.out.get_mut(self.len..end).ok_or(BufferFull)?, bytes);
        self.len = end;
        Ok(())
    }
}

struct Run<'a> {
    index: u16,
    sub: u8,
    size: usize,
    bytes: &'a [u8],
}

impl<'a> Run<'a> {
    fn parse(packed: &'a [u8]) -> Option<(Run<'a>, &'a [u8])> {
        let (&[low, high, sub, count, size], rest) = packed.split_first_chunk::<HEAD>()?;
        let size = usize::from(size);
        let (bytes, rest) = rest.split_at_checked(usize::from(count) * size)?;
        // An empty run is invalid.
        (!bytes.is_empty())
            .then_some((Run { index: u16::from_le_bytes([low, high]), sub, size, bytes }, rest))
    }

    /// The values with their sub-indexes. Beyond sub-index 255, the sub-index wraps to entries that do not fit the
    /// values.
    fn values(&self) -> impl Iterator<Item = (u8, &'a [u8])> {
        let subs = (0..=u8::MAX).map(|i| self.sub.wrapping_add(i));
        subs.zip(self.bytes.chunks_exact(self.size.max(1)))
    }
}
