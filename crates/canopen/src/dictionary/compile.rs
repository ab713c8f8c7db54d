//! From rows to run-time tables, all of it during compilation: the panics here are compile errors.

use super::entry::Attributes;
use super::tables::{Pdos, Place, Series};
use super::{Access, DefaultValue, Object, Rule, Tables, Type};
use crate::device::PDOS;

/// How many rows the parts of a table have together.
#[must_use]
pub const fn count(parts: &[&[Object]]) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < parts.len() {
        total += parts[i].len();
        i += 1;
    }
    total
}

/// Joins the parts of a table. `N` is what [`count`] says.
///
/// # Panics
/// During compilation, when `N` does not fit.
#[must_use]
pub const fn gather<const N: usize>(parts: &[&[Object]]) -> [Object; N] {
    let mut rows = [Object::new(0, 0, "", Type::Unsigned8, Access::Const); N];
    let (mut part, mut row, mut at) = (0, 0, 0);
    while part < parts.len() {
        if row == parts[part].len() {
            (part, row) = (part + 1, 0);
            continue;
        }
        rows[at] = parts[part][row];
        (row, at) = (row + 1, at + 1);
    }
    assert!(at == N, "N is not the number of rows");
    rows
}

/// The run-time dictionary of a table of rows: its tables, the image of its defaults, and its [`check`](crate::dictionary::check).
#[macro_export]
macro_rules! dictionary {
    ($rows:expr) => {{
        use $crate::dictionary as make;
        const _: () = make::check($rows);
        static TABLES: make::Tables<
            { make::series_count($rows) },
            { make::place_count($rows) },
            { make::attributes_count($rows) },
        > = make::compile($rows);
        static DEFAULTS: [u8; make::image_size($rows)] = make::default_image($rows);
        make::Dictionary::new(&TABLES, &DEFAULTS)
    }};
}

/// The run-time tables of a sorted table of rows. The parameters are what [`series_count`], [`place_count`] and
/// [`attributes_count`] say, or more.
///
/// # Panics
/// During compilation, when they are less.
#[must_use]
pub const fn compile<const S: usize, const P: usize, const A: usize>(rows: &[Object]) -> Tables<S, P, A> {
    let tables = Tables {
        series: [UNUSED; S],
        places: [NO_PLACE; P],
        attributes: [attributes(&rows[0]); A],
        tpdos: pdos(rows, 0x1800),
        rpdos: pdos(rows, 0x1400),
    };
    let mut filling = Filling { tables, series: 0, places: 0, attributes: 0, offset: 0 };
    let mut row = 0;
    while row < rows.len() {
        let object = rows.split_at(row).1.split_at(object_len(rows, row)).0;
        let objects = series_len(rows, row);
        filling.add_series(rows, object, objects);
        row += object.len() * objects;
    }
    filling.tables
}

/// Tables, how much of them is filled, and the place in the image that comes next.
struct Filling<const S: usize, const P: usize, const A: usize> {
    tables: Tables<S, P, A>,
    series: usize,
    places: usize,
    attributes: usize,
    offset: usize,
}

#[allow(clippy::cast_possible_truncation)] // `check` has seen the ranges.
impl<const S: usize, const P: usize, const A: usize> Filling<S, P, A> {
    /// So many objects of all `rows` like this one.
    const fn add_series(&mut self, rows: &[Object], object: &[Object], objects: usize) {
        let stride = image_size(object);
        self.tables.series[self.series] = Series {
            index: object[0].index,
            objects: objects as u8,
            entries: object.len() as u8,
            first: self.places as u16,
            stride: stride as u16,
        };
        let (mut row, mut offset) = (0, self.offset);
        while row < object.len() {
            let place = match object[row].rule {
                Rule::EventTimerOf(number) => image_size(rows.split_at(event_timer(rows, number)).0),
                _ => offset,
            };
            self.add_place(&object[row], place);
            (row, offset) = (row + 1, offset + object[row].stored_size());
        }
        (self.series, self.offset) = (self.series + 1, self.offset + stride * objects);
    }

    const fn add_place(&mut self, row: &Object, offset: usize) {
        let attributes = attributes(row);
        let number = position(&self.tables.attributes, self.attributes, &attributes);
        if number == self.attributes {
            self.tables.attributes[number] = attributes;
            self.attributes += 1;
        }
        self.tables.places[self.places] =
            Place { sub: row.sub, attributes: number as u8, offset: offset as u16 };
        self.places += 1;
    }
}

/// Of the PDOs whose communication objects are among the 512 indexes from `first` on.
const fn pdos(rows: &[Object], first: u16) -> Pdos {
    let mut pdos = Pdos { count: 0, indexes: [0; PDOS] };
    let mut row = 0;
    while row < rows.len() {
        if rows[row].index & 0xFE00 == first && rows[row].sub == 0 {
            pdos.indexes[pdos.count as usize] = rows[row].index;
            pdos.count += 1;
        }
        row += 1;
    }
    pdos
}

/// The row of the event timer of a TPDO.
///
/// # Panics
/// During compilation, when there is none.
pub(super) const fn event_timer(rows: &[Object], number: u8) -> usize {
    let mut row = 0;
    while rows[row].key() != (0x1800 | number as u32) << 8 | 5 {
        row += 1;
    }
    row
}

/// A series of no object, after all others: no search ends in it.
const UNUSED: Series = Series { index: u16::MAX, objects: 0, entries: 0, first: 0, stride: 0 };
const NO_PLACE: Place = Place { sub: 0, attributes: 0, offset: 0 };

/// How many series the objects of a table form.
#[must_use]
pub const fn series_count(rows: &[Object]) -> usize {
    let (mut total, mut row) = (0, 0);
    while row < rows.len() {
        row += object_len(rows, row) * series_len(rows, row);
        total += 1;
    }
    total
}

/// How many entries the first objects of all series have.
#[must_use]
pub const fn place_count(rows: &[Object]) -> usize {
    let (mut total, mut row) = (0, 0);
    while row < rows.len() {
        total += object_len(rows, row);
        row += object_len(rows, row) * series_len(rows, row);
    }
    total
}

/// How many different attributes the entries of a table have.
#[must_use]
pub const fn attributes_count(rows: &[Object]) -> usize {
    let mut different = [attributes(&rows[0]); MOST_ATTRIBUTES];
    let (mut known, mut row) = (0, 0);
    while row < rows.len() {
        let attributes = attributes(&rows[row]);
        if position(&different, known, &attributes) == known {
            different[known] = attributes;
            known += 1;
        }
        row += 1;
    }
    known
}

/// A place names its attributes in a byte. More than these do not compile.
const MOST_ATTRIBUTES: usize = 256;

/// Where the attributes are among the first `known`; `known` when they are not.
const fn position(all: &[Attributes], known: usize, attributes: &Attributes) -> usize {
    let mut i = 0;
    while i < known && !is_same(&all[i], attributes) {
        i += 1;
    }
    i
}

const fn is_same(a: &Attributes, b: &Attributes) -> bool {
    a.kind.code() == b.kind.code()
        && a.kind.size() == b.kind.size()
        && a.low == b.low
        && a.high == b.high
        && a.rule.code() == b.rule.code()
        && a.access as u8 == b.access as u8
        && a.mapping as u8 == b.mapping as u8
        && a.group as u8 == b.group as u8
        && a.node_relative == b.node_relative
}

/// The rows of the object that begins here.
const fn object_len(rows: &[Object], first: usize) -> usize {
    let mut end = first + 1;
    while end < rows.len() && rows[end].index == rows[first].index {
        end += 1;
    }
    end - first
}

/// The objects of the series that begins here.
const fn series_len(rows: &[Object], first: usize) -> usize {
    let len = object_len(rows, first);
    let mut objects = 1;
    while objects < u8::MAX as usize && continues(rows, first, len, objects) {
        objects += 1;
    }
    objects
}

/// Whether the object after so many of a series is one of it too.
const fn continues(rows: &[Object], first: usize, len: usize, objects: usize) -> bool {
    let start = first + len * objects;
    if start + len > rows.len() || object_len(rows, start) != len {
        return false;
    }
    if rows[start].index as usize != rows[first].index as usize + objects {
        return false;
    }
    let mut i = 0;
    while i < len {
        let (a, b) = (&rows[first + i], &rows[start + i]);
        if a.sub != b.sub || !is_same(&attributes(a), &attributes(b)) {
            return false;
        }
        i += 1;
    }
    true
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // `check` has seen the ranges.
const fn attributes(row: &Object) -> Attributes {
    let (low, high) = effective_limits(row);
    Attributes {
        low: row.kind.ordered(low as u32),
        high: row.kind.ordered(high as u32),
        kind: row.kind,
        access: row.access,
        mapping: row.mapping,
        group: row.group,
        rule: row.rule,
        node_relative: matches!(row.default, DefaultValue::NodeId(_)),
    }
}

pub(super) const fn effective_limits(row: &Object) -> (i64, i64) {
    match (row.limits, row.kind.range()) {
        (Some(limits), _) | (None, Some(limits)) => limits,
        (None, None) => (0, 0),
    }
}

/// Bytes of the image of all values.
#[must_use]
pub const fn image_size(rows: &[Object]) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < rows.len() {
        total += rows[i].stored_size();
        i += 1;
    }
    total
}

/// The image of all default values. `S` is what [`image_size`] says.
#[must_use]
pub const fn default_image<const S: usize>(rows: &[Object]) -> [u8; S] {
    let mut image = [0; S];
    let (mut row, mut offset) = (0, 0);
    while row < rows.len() {
        let mut i = 0;
        while i < rows[row].stored_size() {
            image[offset + i] = default_byte(rows[row].default, i);
            i += 1;
        }
        offset += rows[row].stored_size();
        row += 1;
    }
    image
}

const fn default_byte(value: DefaultValue, i: usize) -> u8 {
    match value {
        DefaultValue::Integer(value) => value.to_le_bytes()[i],
        DefaultValue::Real(value) => value.to_le_bytes()[i],
        DefaultValue::NodeId(base) => base.to_le_bytes()[i],
        DefaultValue::Text(text) if i < text.len() => text.as_bytes()[i],
        DefaultValue::Text(_) | DefaultValue::None => 0,
    }
}
