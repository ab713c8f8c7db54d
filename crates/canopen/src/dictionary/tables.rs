//! The dictionary at run time: tables without text, found by binary search.
//!
//! ```text
//! series of objects             places of entries           attributes
//! ┌───────────────────────┐     ┌───────────────────┐       ┌────────────────────┐
//! │ 1400h, 4 objects      │ ──► │ sub 0, at 512     │ ────► │ UNSIGNED8, ro      │
//! │ of 4 entries, 8 bytes │     │ sub 1, at 513     │ ──┐   ├────────────────────┤
//! └───────────────────────┘     │ ...               │   └─► │ UNSIGNED32, rw ... │
//! ```
//!
//! Objects that follow each other and differ in nothing but their values, as the parameters of PDOs do, are one series:
//! the places are those of its first object, and those of the next are a constant number of bytes further on. Entries
//! of equal attributes share them.

use super::entry::{Attributes, little_endian};
use super::{Entry, Field};
use crate::NodeId;
use crate::device::PDOS;
use crate::pdo::Direction;
use crate::sdo::Abort;

/// Objects of one shape with indexes that follow each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Series {
    /// Index of the first object.
    pub(crate) index: u16,
    pub(crate) objects: u8,
    /// Entries of an object.
    pub(crate) entries: u8,
    /// Number of the first place.
    pub(crate) first: u16,
    /// Bytes of an object in the image.
    pub(crate) stride: u16,
}

/// An entry of the first object of a series.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) sub: u8,
    /// Number of its attributes.
    pub(crate) attributes: u8,
    pub(crate) offset: u16,
}

/// The communication objects of the PDOs of a dictionary one way, ascending.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pdos {
    pub(crate) count: u8,
    pub(crate) indexes: [u16; PDOS],
}

impl Pdos {
    fn as_slice(&self) -> &[u16] {
        self.indexes.get(..usize::from(self.count)).unwrap_or(&self.indexes)
    }
}

/// What [`compile`](super::compile) makes of a table: room for `S` series, `P` places and `A` attributes.
#[derive(Clone, Copy, Debug)]
pub struct Tables<const S: usize, const P: usize, const A: usize> {
    pub(crate) series: [Series; S],
    pub(crate) places: [Place; P],
    pub(crate) attributes: [Attributes; A],
    pub(crate) tpdos: Pdos,
    pub(crate) rpdos: Pdos,
}

/// The dictionary of one personality.
#[derive(Clone, Copy, Debug)]
pub struct Dictionary {
    series: &'static [Series],
    places: &'static [Place],
    attributes: &'static [Attributes],
    tpdos: &'static Pdos,
    rpdos: &'static Pdos,
    defaults: &'static [u8],
}

impl Dictionary {
    /// From what [`compile`](super::compile) and [`default_image`](super::default_image) made of the same rows;
    /// [`dictionary!`](crate::dictionary!) does all of it.
    #[must_use]
    pub const fn new<const S: usize, const P: usize, const A: usize>(
        tables: &'static Tables<S, P, A>,
        defaults: &'static [u8],
    ) -> Dictionary {
        let Tables { series, places, attributes, tpdos, rpdos } = tables;
        Dictionary { series, places, attributes, tpdos, rpdos, defaults }
    }

    /// All entries, sorted.
    #[must_use]
    pub fn entries(&self) -> Entries {
        Entries { dictionary: *self, series: 0, object: 0, place: 0 }
    }

    /// The image of all default values; what counts from the node-ID holds the rest.
    #[must_use]
    pub const fn defaults(&self) -> &'static [u8] {
        self.defaults
    }

    /// The indexes of the communication objects of its PDOs one way.
    pub(crate) fn pdos(&self, direction: Direction) -> &'static [u16] {
        match direction {
            Direction::Transmit => self.tpdos.as_slice(),
            Direction::Receive => self.rpdos.as_slice(),
        }
    }

    /// The default value of an integer of at most 32 bits, with the node-ID where it counts from that.
    pub(crate) fn default_number(&self, entry: &Entry, node_id: Option<NodeId>) -> u32 {
        let node_id = node_id.filter(|_| entry.attributes.node_relative).map_or(0, NodeId::get);
        little_endian(entry.field.get(self.defaults)).wrapping_add(node_id.into())
    }

    /// The entry of an index and a sub-index.
    ///
    /// # Errors
    /// `NoObject` where the index is unknown, `NoSubIndex` where only the sub-index is.
    pub fn find(&self, index: u16, sub: u8) -> Result<Entry, Abort> {
        let after = self.series.partition_point(|series| series.index <= index);
        let series = *self.series.get(after.wrapping_sub(1)).ok_or(Abort::NoObject)?;
        let number = index.wrapping_sub(series.index);
        if number >= series.objects.into() {
            return Err(Abort::NoObject);
        }
        // Most objects have the sub-indexes 0, 1, 2 and so on.
        let places = self.places_of(series);
        let direct = places.get(usize::from(sub)).filter(|place| place.sub == sub);
        let place = direct.or_else(|| places.iter().find(|place| place.sub == sub));
        place.and_then(|place| self.entry(series, number, *place)).ok_or(Abort::NoSubIndex)
    }

    fn places_of(&self, series: Series) -> &'static [Place] {
        let first = usize::from(series.first);
        self.places.get(first..first + usize::from(series.entries)).unwrap_or(&[])
    }

    /// The entry at a place in an object of a series.
    #[inline]
    fn entry(&self, series: Series, number: u16, place: Place) -> Option<Entry> {
        let attributes = self.attributes.get(usize::from(place.attributes))?;
        let offset = place.offset.wrapping_add(number.wrapping_mul(series.stride));
        let field = Field { offset, size: attributes.kind.size() };
        Some(Entry { attributes, field, sub: place.sub, index: series.index.wrapping_add(number) })
    }

    /// The place of a value, known at compile time.
    ///
    /// # Panics
    /// During compilation, when there is no such entry.
    #[must_use]
    pub const fn field(&self, index: u16, sub: u8) -> Field {
        let mut i = 0;
        while index < self.series[i].index || index - self.series[i].index >= self.series[i].objects as u16 {
            i += 1;
        }
        let series = &self.series[i];
        let mut place = series.first as usize;
        while self.places[place].sub != sub {
            place += 1;
        }
        assert!(place < series.first as usize + series.entries as usize, "no such entry");
        let Place { offset, attributes, .. } = self.places[place];
        let size = self.attributes[attributes as usize].kind.size();
        Field { offset: offset + (index - series.index) * series.stride, size }
    }
}

/// The entries of a dictionary, one after the other.
#[derive(Clone, Debug)]
pub struct Entries {
    dictionary: Dictionary,
    series: usize,
    object: u16,
    place: usize,
}

impl Iterator for Entries {
    type Item = Entry;

    // Called from many places that are in no hurry.
    #[inline(never)]
    fn next(&mut self) -> Option<Entry> {
        let series = *self.dictionary.series.get(self.series)?;
        let place = *self.dictionary.places_of(series).get(self.place)?;
        let entry = self.dictionary.entry(series, self.object, place);
        self.place += 1;
        if self.place == series.entries.into() {
            (self.object, self.place) = (self.object + 1, 0);
        }
        if self.object == series.objects.into() {
            (self.series, self.object) = (self.series + 1, 0);
        }
        entry
    }
}
