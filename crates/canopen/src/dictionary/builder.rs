//! Builds the run-time tables without duplicates: objects of the same shape share their places, entries share equal
//! attributes, and a sequence of default values is stored once.
#![allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]

use super::compile::{effective_limits, event_timer, object_len, series_len};
use super::entry::{Attributes, Kind, Limits};
use super::fail::require;
use super::tables::{Place, Series};
use super::{Counts, DefaultValue, Group, Object, Rule, check, check_301, image_size};

/// Tables of maximum size, and the number of used elements. The compiler evaluates it once for all dictionaries of a
/// program, and it is in no image.
#[derive(Debug)]
pub struct TableBuilder {
    pub(super) series: [Series; MAX],
    // With room for an object, a row and a series that are equal to stored ones.
    pub(super) places: [Place; MAX + 255],
    pub(super) attributes: [Attributes; MAX_ATTRIBUTES + 1],
    pub(super) defaults: [u8; 2 * MAX_DEFAULTS],
    /// The end of the series of each dictionary.
    pub(super) ends: [u16; MAX_DICTIONARIES],
    pub(super) used: Counts,
}

/// The maximum number of series and of places. A larger table does not compile.
const MAX: usize = 1024;
/// The maximum number of default bytes: the size of the largest image.
const MAX_DEFAULTS: usize = 1 << 16;
/// The maximum number of dictionaries.
const MAX_DICTIONARIES: usize = 64;
/// The maximum number of attributes: a place refers to its attributes by one byte.
const MAX_ATTRIBUTES: usize = 256;

#[allow(clippy::cast_possible_truncation)] // `check` has verified the ranges, and the tables limit all numbers.
#[allow(clippy::large_stack_arrays)] // Evaluated during compilation only.
impl TableBuilder {
    /// Checked tables ([`checked`](TableBuilder::checked)) that also conform to CiA 301.
    ///
    /// # Panics
    /// During compilation, when a table is wrong: see [`check`] and [`check_301`].
    #[must_use]
    pub const fn conforming(all: &[&[Object]]) -> TableBuilder {
        let (builder, mut i) = (TableBuilder::checked(all), 0);
        while i < all.len() {
            check_301(all[i]);
            i += 1;
        }
        builder
    }

    /// As [`of`](TableBuilder::of), with a check of all tables.
    ///
    /// # Panics
    /// During compilation, when a table is wrong: see [`check`].
    #[must_use]
    pub const fn checked(all: &[&[Object]]) -> TableBuilder {
        let mut i = 0;
        while i < all.len() {
            check(all[i]);
            i += 1;
        }
        TableBuilder::of(all)
    }

    /// The tables of these tables of rows, which must be right.
    ///
    /// # Panics
    /// During compilation, when the tables are too large.
    #[must_use]
    pub const fn of(all: &[&[Object]]) -> TableBuilder {
        assert!(all.len() <= MAX_DICTIONARIES, "more than 64 dictionaries are compiled together");
        let (mut builder, mut i) = (TableBuilder::new(&all[0][0]), 0);
        while i < all.len() {
            builder.add(all[i]);
            builder.ends[i] = builder.used.series as u16;
            i += 1;
        }
        builder
    }

    /// The sizes of the tables.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        self.used
    }

    /// The tables of no rows yet. `any` is a row to fill the unused elements with.
    const fn new(any: &Object) -> TableBuilder {
        TableBuilder {
            series: [Series {
                index: 0,
                offset: 0,
                first: 0,
                defaults: 0,
                defaults_len: 0,
                objects: 0,
                entries: 0,
            }; MAX],
            places: [Place { sub: 0, attributes: 0, offset: 0 }; MAX + 255],
            attributes: [attributes(any); MAX_ATTRIBUTES + 1],
            defaults: [0; 2 * MAX_DEFAULTS],
            ends: [0; MAX_DICTIONARIES],
            used: Counts { series: 0, places: 0, attributes: 0, defaults: 0 },
        }
    }

    /// Adds a table of rows.
    const fn add(&mut self, rows: &[Object]) {
        let (mut row, mut offset) = (0, 0);
        while row < rows.len() {
            let entries = object_len(rows, row);
            let series = rows.split_at(row).1.split_at(entries * series_len(rows, row)).0;
            self.add_series(rows, series, entries, offset as u16);
            (row, offset) = (row + series.len(), offset + image_size(series));
        }
    }

    /// Adds a series. `rows` are the rows of its objects, `entries` the number of rows per object, `offset` the offset
    /// of the first object in the image. `all` is the whole table, for the event timers that other entries refer to.
    const fn add_series(&mut self, all: &[Object], rows: &[Object], entries: usize, offset: u16) {
        let head = &rows[0];
        require!(
            self.used.series < MAX,
            head,
            "the tables have more than 1024 series of objects that differ in their index only",
        );
        let defaults_len = self.write_defaults(rows);
        self.series[self.used.series] = Series {
            index: rows[0].index,
            offset,
            first: self.add_places(all, rows.split_at(entries).0, offset) as u16,
            defaults: self.add_defaults(defaults_len) as u16,
            defaults_len: defaults_len as u16,
            objects: (rows.len() / entries) as u8,
            entries: entries as u8,
        };
        self.used.series += 1;
        require!(
            self.used.defaults <= MAX_DEFAULTS,
            head,
            "the default values of the tables take more than 65536 bytes",
        );
    }

    /// Adds the places of an object. Returns the number of the first one, which may be an equal sequence already
    /// stored.
    const fn add_places(&mut self, all: &[Object], object: &[Object], start_of_object: u16) -> usize {
        let (start, mut row, mut next) = (self.used.places, 0, 0);
        while row < object.len() {
            let number = self.add_attributes(attributes(&object[row]));
            require!(
                number < MAX_ATTRIBUTES,
                &object[row],
                "the entries have more than 256 combinations of type, access, limits and other attributes",
            );
            let offset = match object[row].rule {
                Rule::EventTimerOf(number) => {
                    let timer = image_size(all.split_at(event_timer(all, number)).0);
                    (timer as u16).wrapping_sub(start_of_object)
                }
                _ => next,
            };
            self.places[start + row] = Place { sub: object[row].sub, attributes: number as u8, offset };
            (row, next) = (row + 1, next + object[row].stored_size() as u16);
        }
        let (mut first, head) = (0, self.places[start]);
        // Most places differ in the attributes.
        while self.places[first].attributes != head.attributes || !self.has_places(first, start, object.len())
        {
            first += 1;
        }
        self.used.places = larger(start, first + object.len());
        require!(
            self.used.places <= MAX,
            &object[0],
            "the objects have more than 1024 entries, those of equal objects counted once",
        );
        first
    }

    /// Whether the `len` places from `first` on are equal to the places from `start` on.
    const fn has_places(&self, first: usize, start: usize, len: usize) -> bool {
        let mut i = 0;
        while i < len {
            let (a, b) = (&self.places[first + i], &self.places[start + i]);
            if a.sub != b.sub || a.attributes != b.attributes || a.offset != b.offset {
                return false;
            }
            i += 1;
        }
        true
    }

    const fn add_attributes(&mut self, attributes: Attributes) -> usize {
        let (mut number, kind, size) = (0, attributes.kind as u8, attributes.size);
        while number < self.used.attributes {
            let other = &self.attributes[number];
            // Most differ in the type or its size.
            if other.kind as u8 == kind && other.size == size && is_same(other, &attributes) {
                break;
            }
            number += 1;
        }
        self.attributes[number] = attributes;
        self.used.attributes = larger(self.used.attributes, number + 1);
        number
    }

    /// Writes default values after all stored ones. Returns their number without the zeros at the end.
    const fn write_defaults(&mut self, rows: &[Object]) -> usize {
        let (mut at, mut defaults_len, mut row) = (0, 0, 0);
        while row < rows.len() {
            let (default, size, mut i) = (rows[row].default, rows[row].stored_size(), 0);
            let word = default_word(default);
            while i < size {
                let byte = match default {
                    DefaultValue::Text(text) if i < text.len() => text.as_bytes()[i],
                    DefaultValue::Text(_) | DefaultValue::None => 0,
                    _ => word[i],
                };
                self.defaults[self.used.defaults + at] = byte;
                (at, i) = (at + 1, i + 1);
                defaults_len = if byte == 0 { defaults_len } else { at };
            }
            row += 1;
        }
        defaults_len
    }

    /// Stores the `defaults_len` default values just written. Returns the number of the first one, which may be an
    /// equal sequence already stored.
    const fn add_defaults(&mut self, defaults_len: usize) -> usize {
        let (start, mut first) = (self.used.defaults, 0);
        // Most positions differ in the first byte.
        let byte = self.defaults[start];
        while self.defaults[first] != byte || !self.has_defaults(first, start, defaults_len) {
            if defaults_len == 0 {
                break;
            }
            first += 1;
        }
        self.used.defaults = larger(start, first + defaults_len);
        first
    }

    /// Whether the `len` values from `first` on are equal to the values from `start` on.
    const fn has_defaults(&self, first: usize, start: usize, len: usize) -> bool {
        let mut i = 0;
        while i < len && self.defaults[first + i] == self.defaults[start + i] {
            i += 1;
        }
        i == len
    }
}

pub(super) const fn larger(a: usize, b: usize) -> usize {
    if a > b { a } else { b }
}

pub(super) const fn is_same(a: &Attributes, b: &Attributes) -> bool {
    a.kind as u8 == b.kind as u8
        && a.size == b.size
        && a.access as u8 == b.access as u8
        && a.mapping as u8 == b.mapping as u8
        && a.node_relative == b.node_relative
        && group_code(a.group) == group_code(b.group)
        && a.rule.code() == b.rule.code()
        && a.limits.is_same(b.limits)
}

/// Whether two rows have the same attributes. Equal rows, as in a series, need no computation.
pub(super) const fn is_alike(a: &Object, b: &Object) -> bool {
    let same_limits = match (a.limits, b.limits) {
        (None, None) => true,
        (Some((low, high)), Some((other_low, other_high))) => low == other_low && high == other_high,
        _ => false,
    };
    let is_equal = same_limits
        && a.kind.code() == b.kind.code()
        && a.kind.size() == b.kind.size()
        && a.rule.code() == b.rule.code()
        && a.access as u8 == b.access as u8
        && a.mapping as u8 == b.mapping as u8
        && group_code(a.group) == group_code(b.group)
        && matches!(a.default, DefaultValue::NodeId(_)) == matches!(b.default, DefaultValue::NodeId(_));
    is_equal || is_same(&attributes(a), &attributes(b))
}

/// A number for each group: constant functions cannot compare groups.
pub(super) const fn group_code(group: Option<Group>) -> u8 {
    match group {
        None => u8::MAX,
        Some(group) => group as u8,
    }
}

pub(super) const fn attributes(row: &Object) -> Attributes {
    let (low, high) = effective_limits(row);
    Attributes {
        limits: Limits::new(row.kind, low, high),
        kind: Kind::of(row.kind),
        size: row.kind.size(),
        access: row.access,
        mapping: row.mapping,
        group: row.group,
        rule: row.rule,
        node_relative: matches!(row.default, DefaultValue::NodeId(_)),
    }
}

/// The bytes of a default of at most eight bytes; zeros for another one.
const fn default_word(value: DefaultValue) -> [u8; 8] {
    match value {
        DefaultValue::Integer(value) => value.to_le_bytes(),
        DefaultValue::Real(value) => (value.to_bits() as u64).to_le_bytes(),
        DefaultValue::NodeId(base) => (base as u64).to_le_bytes(),
        DefaultValue::Text(_) | DefaultValue::None => [0; 8],
    }
}
