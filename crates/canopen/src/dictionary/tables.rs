//! The dictionary at run time: tables without text, searched by binary search.
//!
//! ```text
//! series of objects              places of entries           attributes
//! ┌────────────────────────┐     ┌───────────────────┐       ┌────────────────────┐
//! │ 1400h, 4 objects       │ ──► │ sub 0, at 0       │ ────► │ UNSIGNED8, ro      │
//! │ of 4 entries, from 512 │     │ sub 1, at 1       │ ──┐   ├────────────────────┤
//! └────────────────────────┘     │ ...               │   └─► │ UNSIGNED32, rw ... │
//!      └─► default values        └───────────────────┘       └────────────────────┘
//! ```
//!
//! Consecutive objects that differ in nothing but their values, such as the parameters of PDOs, form one series. Series
//! of the same shape share their places, and entries share equal attributes. A sequence of default values is stored
//! once. All dictionaries that are compiled together share these tables.

use super::entry::{Attributes, Kind, little_endian};
use super::fail::fail;
use super::{Direction, Entry, Field};
use crate::NodeId;
use crate::copy::copy;
use crate::sdo::Abort;

/// Consecutive objects of the same shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Series {
    /// Index of the first object.
    pub(crate) index: u16,
    /// Offset of the first object in the image.
    pub(crate) offset: u16,
    /// Number of the first place in the table of places.
    pub(crate) first: u16,
    /// Number of the first default byte, and how many bytes are stored. All further bytes are 0.
    pub(crate) defaults: u16,
    pub(crate) defaults_len: u16,
    pub(crate) objects: u8,
    /// Number of entries of an object.
    pub(crate) entries: u8,
}

/// An entry in the shape of an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) sub: u8,
    /// Number of its attributes in the table of attributes.
    pub(crate) attributes: u8,
    /// Offset from the start of the object, modulo 2^16: for another name of an event timer, the location is before the
    /// object.
    pub(crate) offset: u16,
}

/// The output of [`compile`](super::compile) for `D` tables of rows: `S` series, `P` places, `A` attributes and `V`
/// bytes of default values.
#[derive(Clone, Copy, Debug)]
pub struct Tables<const D: usize, const S: usize, const P: usize, const A: usize, const V: usize> {
    /// The series of all dictionaries, one dictionary after the other.
    pub(crate) series: [Series; S],
    pub(crate) places: [Place; P],
    pub(crate) attributes: [Attributes; A],
    pub(crate) defaults: [u8; V],
    /// The end of the series of each dictionary.
    pub(crate) ends: [u16; D],
}

/// One dictionary.
#[derive(Clone, Copy, Debug)]
pub struct Dictionary {
    pub(super) series: &'static [Series],
    pub(super) places: &'static [Place],
    pub(super) attributes: &'static [Attributes],
    pub(super) defaults: &'static [u8],
}

impl Dictionary {
    /// All entries, sorted by index and sub-index.
    #[must_use]
    pub fn entries(&self) -> Entries {
        Entries { dictionary: *self, series: 0, object: 0, place: 0 }
    }

    /// Size of the image of all values in bytes.
    #[must_use]
    pub fn image_size(&self) -> usize {
        let stored = self.entries().filter(|entry| !entry.rule().is_computed());
        stored.map(|entry| entry.field.end()).max().map_or(0, usize::from)
    }

    /// Sets all values of an image to their defaults. A default that is relative to the node-ID is set without the
    /// node-ID.
    pub fn load_defaults(&self, image: &mut [u8]) {
        image.fill(0);
        for series in self.series {
            let values = image.get_mut(usize::from(series.offset)..).unwrap_or_default();
            copy(values, self.defaults_of(series));
        }
    }

    /// The default value of an entry. Zeros at its end may be missing.
    #[inline(never)]
    pub(crate) fn default(&self, entry: &Entry) -> &'static [u8] {
        let series = entry.series;
        let start = entry.field.offset.wrapping_sub(series.offset);
        let defaults = self.defaults_of(series).get(usize::from(start)..).unwrap_or_default();
        defaults.get(..usize::from(entry.field.size)).unwrap_or(defaults)
    }

    fn defaults_of(&self, series: &Series) -> &'static [u8] {
        let first = usize::from(series.defaults);
        self.defaults.get(first..first + usize::from(series.defaults_len)).unwrap_or_default()
    }

    /// The index of the communication object of a PDO. `place` is the rank of the PDO among those of the dictionary in
    /// this direction, by ascending number.
    #[inline(never)]
    pub(crate) fn pdo(&self, direction: Direction, place: u16) -> Option<u16> {
        let first = match direction {
            Direction::Transmit => 0x1800,
            Direction::Receive => 0x1400,
        };
        let mut rest = place;
        for series in self.series.iter().filter(|series| series.index & 0xFE00 == first) {
            match rest.checked_sub(series.objects.into()) {
                None => return Some(series.index.wrapping_add(rest)),
                Some(less) => rest = less,
            }
        }
        None
    }

    /// The rank of a PDO, by the index of its communication object: the opposite of [`pdo`](Dictionary::pdo).
    pub(crate) fn pdo_place(&self, index: u16) -> Option<u16> {
        let mut before = 0;
        for series in self.series.iter().filter(|series| (series.index ^ index) & 0xFE00 == 0) {
            let number = index.wrapping_sub(series.index);
            if number < series.objects.into() {
                return Some(before + number);
            }
            before += u16::from(series.objects);
        }
        None
    }

    /// The default value of an integer of at most 32 bits, including the node-ID where the default is relative to it.
    pub(crate) fn default_number(&self, entry: &Entry, node_id: Option<NodeId>) -> u32 {
        let node_id = node_id.filter(|_| entry.attributes.node_relative).map_or(0, NodeId::get);
        little_endian(self.default(entry)).wrapping_add(node_id.into())
    }

    /// The entry with this index and sub-index.
    ///
    /// # Errors
    /// `NoObject` for an unknown index, `NoSubIndex` for an unknown sub-index of a known object.
    pub fn find(&self, index: u16, sub: u8) -> Result<Entry, Abort> {
        let (series, number) = self.series_of(index, sub)?;
        let places = self.places_of(series);
        // Most objects have the sub-indexes 0, 1, 2 and so on.
        let place = match places.get(usize::from(sub)) {
            Some(place) if place.sub == sub => Some(place),
            _ => places.iter().find(|place| place.sub == sub),
        };
        place.and_then(|place| self.entry(series, number, *place)).ok_or(Abort::NoSubIndex)
    }

    /// The entries of an object; none for an unknown index.
    pub(crate) fn object(&self, index: u16) -> impl Iterator<Item = Entry> {
        let places = self.find(index, 0).map_or(&[][..], |entry| self.places_of(entry.series));
        places.iter().filter_map(move |place| self.find(index, place.sub).ok())
    }

    /// The indexes of the objects from `first` on that are below `end`.
    pub(crate) fn indexes(&self, first: u16, end: u16) -> impl Iterator<Item = u16> {
        let all =
            self.series.iter().flat_map(|series| (0..series.objects).map(|n| series.index + u16::from(n)));
        all.filter(move |index| (first..end).contains(index))
    }

    /// The series that contains an object, and the number of the object in the series.
    #[inline]
    fn series_of(&self, index: u16, sub: u8) -> Result<(&'static Series, u16), Abort> {
        // Computed as in `Object::key`. If only the index were compared, every step would have to extend it to a word.
        let key = u32::from(index) << 8 | u32::from(sub);
        let after = self.series.partition_point(|series| u32::from(series.index) << 8 <= key);
        let series = self.series.get(after.wrapping_sub(1)).ok_or(Abort::NoObject)?;
        let number = index.wrapping_sub(series.index);
        if number < series.objects.into() { Ok((series, number)) } else { Err(Abort::NoObject) }
    }

    fn places_of(&self, series: &Series) -> &'static [Place] {
        let first = usize::from(series.first);
        self.places.get(first..first + usize::from(series.entries)).unwrap_or(&[])
    }

    /// The entry at a place of an object of a series.
    #[inline]
    fn entry(&self, series: &'static Series, number: u16, place: Place) -> Option<Entry> {
        let attributes = self.attributes.get(usize::from(place.attributes))?;
        let before = if number == 0 { 0 } else { number.wrapping_mul(self.stride(series)) };
        let offset = series.offset.wrapping_add(before).wrapping_add(place.offset);
        let field = Field { offset, size: attributes.size };
        Some(Entry { attributes, series, field, sub: place.sub, index: series.index.wrapping_add(number) })
    }

    /// Size of an object in the image in bytes.
    const fn stride(&self, series: &Series) -> u16 {
        let end = series.first as usize + series.entries as usize;
        let Some((_, [last, ..])) = self.places.split_at_checked(end.wrapping_sub(1)) else { return 0 };
        let Some((_, [attributes, ..])) = self.attributes.split_at_checked(last.attributes as usize) else {
            return 0;
        };
        last.offset.wrapping_add(attributes.size as u16)
    }

    /// The location of a value, for use at compile time.
    ///
    /// # Panics
    /// During compilation, when there is no such entry.
    #[must_use]
    pub const fn field(&self, index: u16, sub: u8) -> Field {
        self.location(index, sub).0
    }

    /// The location of a value and its kind, for use at compile time.
    #[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
    pub(super) const fn location(&self, index: u16, sub: u8) -> (Field, Kind) {
        let (mut low, mut high) = (0, self.series.len());
        while low < high {
            let middle = low.midpoint(high);
            if self.series[middle].index <= index {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        if low == 0 || index - self.series[low - 1].index >= self.series[low - 1].objects as u16 {
            fail(index, sub, "no such object in the dictionary");
        }
        let series = &self.series[low - 1];
        let (mut place, end) = (series.first as usize, series.first as usize + series.entries as usize);
        while place < end && self.places[place].sub != sub {
            place += 1;
        }
        if place == end {
            fail(index, sub, "no such sub-index in the dictionary");
        }
        let Place { offset, attributes, .. } = self.places[place];
        let Attributes { kind, size, .. } = self.attributes[attributes as usize];
        let object = series.offset + (index - series.index) * self.stride(series);
        (Field { offset: object.wrapping_add(offset), size }, kind)
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

    // Not inlined: many callers, none of them time-critical.
    #[inline(never)]
    fn next(&mut self) -> Option<Entry> {
        let series = self.dictionary.series.get(self.series)?;
        let place = self.dictionary.places_of(series).get(self.place)?;
        let entry = self.dictionary.find(series.index.wrapping_add(self.object), place.sub);
        self.place += 1;
        if self.place == series.entries.into() {
            (self.object, self.place) = (self.object + 1, 0);
        }
        if self.object == series.objects.into() {
            (self.series, self.object) = (self.series + 1, 0);
        }
        entry.ok()
    }
}
