//! Compiles rows to run-time tables. All of this runs during compilation: a panic here is a compile error.
#![allow(clippy::indexing_slicing, clippy::expect_used, reason = "evaluated by the compiler")]

use super::builder::{TableBuilder, is_alike, larger};
use super::{Access, Dictionary, Object, Services, Tables, Type};

/// The number of rows in all parts of a table.
#[must_use]
pub const fn count(parts: &[&[Object]]) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < parts.len() {
        total += parts[i].len();
        i += 1;
    }
    total
}

/// Joins the parts of a table. `N` is the result of [`count`].
///
/// # Panics
/// During compilation, when `N` is not the number of rows.
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

/// The run-time dictionary of a table of rows. The macro runs [`check`](crate::dictionary::check()) and
/// [`check_301`](crate::dictionary::check_301()) first: a wrong table does not compile, and the error names index and
/// sub-index of the row.
///
/// ```compile_fail
/// use canopen::dictionary::{Access, Dictionary, Mapping, Object, Type};
/// use canopen::objects;
///
/// const INPUT: Object =
///     Object::new(0x6000, 0, "Input", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo);
///
/// // evaluation panicked: 1A00h:1: the mapped object is not in the table
/// static DICTIONARY: Dictionary = canopen::dictionary!(&objects::tpdo(1, &[INPUT]));
/// ```
#[macro_export]
macro_rules! dictionary {
    ($rows:expr) => {{
        let [dictionary] = $crate::dictionaries!([$rows]);
        dictionary
    }};
}

/// The run-time dictionaries of several tables of rows, as an array. Equal parts of the dictionaries are stored once.
#[macro_export]
macro_rules! dictionaries {
    ($all:expr) => {{
        use $crate::dictionary as make;
        // The expression `$all` must not use any of these names.
        const ROWS_OF_ALL: &[&[make::Object]] = &$all;
        #[allow(long_running_const_eval)]
        const BUILT: make::TableBuilder = make::TableBuilder::conforming(ROWS_OF_ALL);
        static COMPILED_TABLES: make::Tables<
            { ROWS_OF_ALL.len() },
            { BUILT.counts().series },
            { BUILT.counts().places },
            { BUILT.counts().attributes },
            { BUILT.counts().defaults },
        > = make::compile(&BUILT);
        COMPILED_TABLES.dictionaries()
    }};
}

/// The sizes of the run-time tables of some dictionaries.
#[derive(Clone, Copy, Debug)]
pub struct Counts {
    /// Series of objects.
    pub series: usize,
    /// Entries of all different shapes of objects.
    pub places: usize,
    /// Different attributes.
    pub attributes: usize,
    /// Bytes of default values.
    pub defaults: usize,
}

/// The run-time tables of several tables of rows. The parameters are the number of tables and the fields of [`Counts`].
///
/// # Panics
/// During compilation, when a parameter is too large.
#[must_use]
pub const fn compile<const D: usize, const S: usize, const P: usize, const A: usize, const V: usize>(
    built: &TableBuilder,
) -> Tables<D, S, P, A, V> {
    Tables {
        series: beginning(&built.series),
        places: beginning(&built.places),
        attributes: beginning(&built.attributes),
        defaults: beginning(&built.defaults),
        ends: beginning(&built.ends),
    }
}

const fn beginning<T: Copy, const N: usize>(all: &[T]) -> [T; N] {
    *all.first_chunk().expect("too many for the tables")
}

impl<const D: usize, const S: usize, const P: usize, const A: usize, const V: usize> Tables<D, S, P, A, V> {
    /// One dictionary for each compiled table of rows, in the same order.
    #[must_use]
    pub const fn dictionaries(&'static self) -> [Dictionary; D] {
        let Tables { series, places, attributes, defaults, ends } = self;
        let mut dictionaries = [Dictionary { series, places, attributes, defaults }; D];
        let (mut i, mut begin) = (0, 0);
        while i < D {
            let (before, _) = series.split_at(ends[i] as usize);
            dictionaries[i].series = before.split_at(begin).1;
            begin = ends[i] as usize;
            i += 1;
        }
        dictionaries
    }
}

/// The position of a row in a sorted table.
pub(super) const fn find(rows: &[Object], index: u16, sub: u8) -> Option<usize> {
    let key = (index as u32) << 8 | sub as u32;
    let (mut low, mut high) = (0, rows.len());
    while low < high {
        let middle = low.midpoint(high);
        if rows[middle].key() < key {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    if low < rows.len() && rows[low].key() == key { Some(low) } else { None }
}

/// The row of the event timer of a TPDO. `check` has verified that there is one.
pub(super) const fn event_timer(rows: &[Object], number: u8) -> usize {
    find(rows, 0x1800 | number as u16, 5).expect("the TPDO has no event timer")
}

/// The number of rows of the object that begins at `first`.
pub(super) const fn object_len(rows: &[Object], first: usize) -> usize {
    let mut end = first + 1;
    while end < rows.len() && rows[end].index == rows[first].index {
        end += 1;
    }
    end - first
}

/// The number of objects in the series that begins at `first`.
pub(super) const fn series_len(rows: &[Object], first: usize) -> usize {
    let len = object_len(rows, first);
    let mut objects = 1;
    while objects < u8::MAX as usize && continues(rows, first, len, objects) {
        objects += 1;
    }
    objects
}

/// Whether the object after the first `objects` objects of a series belongs to the series too.
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
        if a.sub != b.sub || !a.rule.has_place() || !is_alike(a, b) {
            return false;
        }
        i += 1;
    }
    true
}

pub(super) const fn effective_limits(row: &Object) -> (i64, i64) {
    match (row.limits, row.kind.range()) {
        (Some(limits), _) | (None, Some(limits)) => limits,
        (None, None) => (0, 0),
    }
}

/// Size of the image of all values in bytes.
#[must_use]
pub const fn image_size(rows: &[Object]) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < rows.len() {
        total += rows[i].stored_size();
        i += 1;
    }
    total
}

/// The room that a device needs for a table of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Size of the image of all values in bytes.
    pub image: usize,
    /// Number of TPDOs.
    pub tpdos: usize,
    /// Number of RPDOs.
    pub rpdos: usize,
    /// Number of heartbeats that can be monitored: entries of 1016h.
    pub watches: usize,
    /// Number of objects that a multiplexed TPDO can send; 0 if no TPDO can be multiplexed.
    pub scanned: usize,
    /// Number of SDO servers beside the default one: objects 1201h and up.
    pub servers: usize,
    /// The services that the rows ask for.
    pub services: Services,
}

impl Sizes {
    /// The room that these rows need.
    #[must_use]
    pub const fn of(rows: &[Object]) -> Sizes {
        Sizes {
            image: image_size(rows),
            tpdos: pdos(rows, 0x1800),
            rpdos: pdos(rows, 0x1400),
            watches: watches(rows),
            scanned: scanned(rows),
            servers: servers(rows),
            services: Services::of(rows),
        }
    }

    /// The room that is enough for each of several tables.
    #[must_use]
    pub const fn of_any(all: &[&[Object]]) -> Sizes {
        let mut sizes = Sizes::of(&[]);
        let mut i = 0;
        while i < all.len() {
            let own = Sizes::of(all[i]);
            sizes = Sizes {
                image: larger(sizes.image, own.image),
                tpdos: larger(sizes.tpdos, own.tpdos),
                rpdos: larger(sizes.rpdos, own.rpdos),
                watches: larger(sizes.watches, own.watches),
                scanned: larger(sizes.scanned, own.scanned),
                servers: larger(sizes.servers, own.servers),
                services: sizes.services.with(own.services),
            };
            i += 1;
        }
        sizes
    }

    /// Whether a device with `room` is large enough for these sizes.
    #[must_use]
    pub const fn fits(self, room: Sizes) -> bool {
        self.image <= room.image
            && self.tpdos <= room.tpdos
            && self.rpdos <= room.rpdos
            && self.watches <= room.watches
            && self.scanned <= room.scanned
            && self.servers <= room.servers
            && room.services.contains(self.services)
    }
}

/// The positions of the rows with indexes from `first` to `last`.
const fn within(rows: &[Object], first: u16, last: u16) -> (usize, usize) {
    (before(rows, first), before(rows, last.saturating_add(1)))
}

/// The number of rows before an index.
const fn before(rows: &[Object], index: u16) -> usize {
    let (mut low, mut high) = (0, rows.len());
    while low < high {
        let middle = low.midpoint(high);
        if rows[middle].index < index {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}

/// The number of objects with indexes from `first` to `last`.
const fn objects(rows: &[Object], first: u16, last: u16) -> usize {
    let ((mut i, end), mut objects) = (within(rows, first, last), 0);
    while i < end {
        objects += (rows[i].sub == 0) as usize;
        i += 1;
    }
    objects
}

/// The number of TPDOs (1800h) or RPDOs (1400h).
#[doc(hidden)]
#[must_use]
pub const fn pdos(rows: &[Object], first: u16) -> usize {
    objects(rows, first, first + 0x1FF)
}

/// The number of heartbeats that can be monitored.
#[doc(hidden)]
#[must_use]
pub const fn watches(rows: &[Object]) -> usize {
    let (begin, end) = within(rows, 0x1016, 0x1016);
    (end - begin).saturating_sub(1)
}

/// The number of SDO servers beside the default one.
#[doc(hidden)]
#[must_use]
pub const fn servers(rows: &[Object]) -> usize {
    objects(rows, 0x1201, 0x127F)
}

/// The number of objects that a multiplexed TPDO can send; 0 if no TPDO can be multiplexed.
#[doc(hidden)]
#[must_use]
pub const fn scanned(rows: &[Object]) -> usize {
    let ((mut i, end), mut is_multiplexed) = (within(rows, 0x1A00, 0x1BFF), false);
    while i < end {
        is_multiplexed |= rows[i].sub == 0 && can_be_multiplexed(&rows[i]);
        i += 1;
    }
    let mut scanned = 0;
    i = 0;
    while is_multiplexed && i < rows.len() {
        scanned += (rows[i].mapping.allows_tpdo() && rows[i].kind.size() <= 4) as usize;
        i += 1;
    }
    scanned
}

/// Whether the number of mapped objects can be 254 or 255.
pub(super) const fn can_be_multiplexed(count: &Object) -> bool {
    let (_, high) = effective_limits(count);
    match count.default {
        _ if count.access.is_writable() => high >= 0xFE,
        super::DefaultValue::Integer(value) => value >= 0xFE,
        _ => false,
    }
}

/// The type of a device with exactly the room for a table of rows. After `room:` stands a [`Sizes`] instead of the
/// rows, for a device that serves several tables, or a table that is not known yet.
///
/// ```
/// use canopen::dictionary::{Access, Object, Sizes, Type};
///
/// const ROWS: &[Object] = &[Object::new(0x1000, 0, "Device type", Type::Unsigned32, Access::ReadOnly)];
/// type Node = canopen::device!((), ROWS);
///
/// const ROOM: Sizes = Sizes { tpdos: 4, ..Sizes::of(ROWS) };
/// type Larger = canopen::device!((), room: ROOM);
/// ```
#[macro_export]
macro_rules! device {
    ($application:ty, room: $sizes:expr) => {
        $crate::Device<$crate::definition!($application, room: $sizes)>
    };
    ($application:ty, $rows:expr) => {
        $crate::Device<$crate::definition!($application, $rows)>
    };
}

/// The [`Definition`](crate::Definition) of [`device!`](crate::device!), for code that is generic over devices.
#[macro_export]
macro_rules! definition {
    ($application:ty, room: $sizes:expr) => {
        $crate::plumbing::Rows<
            $application,
            { $sizes.image },
            { $sizes.tpdos },
            { $sizes.rpdos },
            { $sizes.watches },
            { $sizes.scanned },
            { $sizes.servers },
            { $sizes.services.bits() },
        >
    };
    ($application:ty, $rows:expr) => {
        $crate::plumbing::Rows<
            $application,
            { $crate::dictionary::image_size($rows) },
            { $crate::dictionary::pdos($rows, 0x1800) },
            { $crate::dictionary::pdos($rows, 0x1400) },
            { $crate::dictionary::watches($rows) },
            { $crate::dictionary::scanned($rows) },
            { $crate::dictionary::servers($rows) },
            { $crate::dictionary::Services::of($rows).bits() },
        >
    };
}

/// The type of a [`ServiceDevice`](crate::ServiceDevice) with exactly the room for a table of rows.
///
/// ```
/// use canopen::{NodeId, ServiceDevice, objects};
///
/// const ROWS: &[canopen::dictionary::Object] =
///     canopen::rows!([objects::device_type(0)], objects::identity(0, 1, 1));
/// static DICTIONARY: canopen::dictionary::Dictionary = canopen::dictionary!(ROWS);
///
/// let loader: canopen::service_device!((), ROWS) = ServiceDevice::new(&DICTIONARY, NodeId::new(126), ());
/// ```
#[macro_export]
macro_rules! service_device {
    ($application:ty, $rows:expr) => {
        $crate::ServiceDevice<$application, { $crate::dictionary::Sizes::of($rows).image }>
    };
}
