//! The objects of CiA 301 and 302 as rows, ready for a table.
//!
//! Each function returns one row or the rows of one object; [`rows!`](crate::rows!) sorts them. The rule of an object
//! follows from its index, so no row can lack its rule. The functions define the default values.
//!
//! ```
//! use canopen::dictionary::{Access, Dictionary, Mapping, Object, Type};
//! use canopen::objects;
//!
//! const INPUTS: Object =
//!     Object::new(0x6000, 1, "Inputs 1 to 8", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo);
//!
//! const ROWS: &[Object] = canopen::rows!(
//!     [objects::device_type(0x0001_0191), objects::error_register()],
//!     objects::identity(0, 1, 0x0001_0000),
//!     [objects::heartbeat_producer(1000)],
//!     objects::tpdo(1, &[INPUTS]),
//!     [Object::highest(0x6000, 1, "Read inputs"), INPUTS],
//! );
//! static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
//!
//! assert_eq!(DICTIONARY.find(0x1A00, 1).map(|entry| entry.index()), Ok(0x1A00));
//! ```

// An object has at most 255 rows.
#![allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)]
#![allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]

pub mod pdo;
mod program;
mod sdo;
mod storing;

use crate::dictionary::{Access, DefaultValue, Group, Object, Rule, Type, fail};

pub use pdo::{multiplexed, rpdo, rpdos, tpdo, tpdos, without_remote};
pub use program::{flash_status, program_control, program_data, program_identification};
pub use sdo::{default_sdo_server, sdo_client, sdo_server};
pub use storing::{restore_parameters, restore_parameters_with, store_parameters, store_parameters_with};

/// A read-only value of the device.
const fn fixed(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadOnly)
}

/// A communication parameter, stored with its group.
const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Communication)
}

/// A command entry whose value reads as 1.
const fn command(index: u16, sub: u8, name: &'static str) -> Object {
    Object::new(index, sub, name, Type::Unsigned32, Access::ReadWrite).value(1)
}

/// An object of `N` rows: sub-index 0, and `N` - 1 equal entries.
const fn list<const N: usize>(number: Object, entry: Object) -> [Object; N] {
    let mut rows = [entry; N];
    rows[0] = number;
    let mut sub = 1;
    while sub < N {
        rows[sub].sub = sub as u8;
        sub += 1;
    }
    rows
}

/// 1000h: the device profile in the low word, additional information of the profile in the high word.
#[must_use]
pub const fn device_type(code: u32) -> Object {
    fixed(0x1000, 0, "Device type", Type::Unsigned32).value(code as i64)
}

/// 1001h, error register.
#[must_use]
pub const fn error_register() -> Object {
    fixed(0x1001, 0, "Error register", Type::Unsigned8)
}

/// 1003h with room for `N` - 1 errors, at most ten.
///
/// # Panics
/// During compilation, for more than ten errors, or for none.
#[must_use]
pub const fn error_field<const N: usize>() -> [Object; N] {
    assert!(N >= 2 && N <= 11, "the list has one to ten errors");
    let number = Object::new(0x1003, 0, "Pre-defined error field", Type::Unsigned8, Access::ReadWrite);
    list(number, fixed(0x1003, 1, "Standard error field", Type::Unsigned32))
}

/// 1005h, 1006h, 1007h and 1019h: the SYNC with CAN-ID 80h and without counter, period and window.
#[must_use]
pub const fn sync_consumer() -> [Object; 4] {
    [
        parameter(0x1005, 0, "COB-ID SYNC", Type::Unsigned32).value(0x80),
        parameter(0x1006, 0, "Communication cycle period", Type::Unsigned32).unit("us"),
        parameter(0x1007, 0, "Synchronous window length", Type::Unsigned32).unit("us"),
        parameter(0x1019, 0, "Synchronous counter overflow value", Type::Unsigned8).limits(0, 240),
    ]
}

/// The rows of [`sync_consumer`] for a device that can also produce SYNC, every `period` us: bit 30 of 1005h switches the
/// production on, and is set by default unless the period is 0.
#[must_use]
pub const fn sync_producer(period: u32) -> [Object; 4] {
    let mut rows = sync_consumer();
    rows[0] = rows[0].value(if period == 0 { 0x80 } else { 0x4000_0080 });
    rows[0].rule = Rule::SyncProducer;
    rows[1] = rows[1].value(period as i64);
    rows
}

/// 1012h, the time stamp with CAN-ID 100h. Bit 31: the application gets it, by default. Bit 30: the application can send
/// it.
#[must_use]
pub const fn time_stamp() -> Object {
    parameter(0x1012, 0, "COB-ID time stamp", Type::Unsigned32).value(0x8000_0100)
}

/// A string of at most `capacity` characters. If `text` is empty, the application writes the string to the image.
const fn text(index: u16, name: &'static str, capacity: u8, text: &'static str) -> Object {
    Object::new(index, 0, name, Type::VisibleString(capacity), Access::Const)
        .default(DefaultValue::Text(text))
}

/// 1008h, manufacturer device name, at most 32 characters.
#[must_use]
pub const fn device_name(name: &'static str) -> Object {
    text(0x1008, "Manufacturer device name", 32, name)
}

/// 1009h, manufacturer hardware version, at most 32 characters. If it is empty, the application writes the string.
#[must_use]
pub const fn hardware_version(version: &'static str) -> Object {
    text(0x1009, "Manufacturer hardware version", 32, version)
}

/// 100Ah, manufacturer software version, at most 50 characters. If it is empty, the application writes the string.
#[must_use]
pub const fn software_version(version: &'static str) -> Object {
    text(0x100A, "Manufacturer software version", 50, version)
}

/// 100Ch and 100Dh: node guarding without life guarding. A master that guards the device switches the heartbeat (1017h)
/// off.
#[must_use]
pub const fn node_guarding() -> [Object; 2] {
    [
        parameter(0x100C, 0, "Guard time", Type::Unsigned16).unit("ms"),
        parameter(0x100D, 0, "Life time factor", Type::Unsigned8),
    ]
}

/// 1014h and 1015h: EMCY with CAN-ID 80h plus the node-ID, and no inhibit time.
#[must_use]
pub const fn emergency() -> [Object; 2] {
    [
        parameter(0x1014, 0, "COB-ID EMCY", Type::Unsigned32).default(DefaultValue::NodeId(0x80)),
        parameter(0x1015, 0, "Inhibit time EMCY", Type::Unsigned16).unit("100 us"),
    ]
}

/// 1016h for `N` - 1 nodes, at most 127.
///
/// # Panics
/// During compilation, for more than 127 nodes, or for none.
#[must_use]
pub const fn heartbeat_consumer<const N: usize>() -> [Object; N] {
    assert!(N >= 2 && N <= 128, "one to 127 nodes are watched");
    let number = Object::highest(0x1016, (N - 1) as u8, "Consumer heartbeat time");
    list(number, parameter(0x1016, 1, "Monitored node and time", Type::Unsigned32))
}

/// 1028h for the nodes 1 to `N` - 1, at most 127: the sub-index is the node-ID, the value the COB-ID of the EMCY of the node.
/// Bit 31 disables an entry, and is set by default.
///
/// # Panics
/// During compilation, for more than 127 nodes, or for none.
#[must_use]
pub const fn emcy_consumer<const N: usize>() -> [Object; N] {
    assert!(N >= 2 && N <= 128, "the EMCYs of one to 127 nodes are consumed");
    let number = Object::highest(0x1028, (N - 1) as u8, "Emergency consumer");
    list(number, parameter(0x1028, 1, "Emergency consumer of node", Type::Unsigned32).value(0x8000_0000))
}

/// 1017h, producer heartbeat time in ms; 0 for no heartbeat.
#[must_use]
pub const fn heartbeat_producer(period: u16) -> Object {
    parameter(0x1017, 0, "Producer heartbeat time", Type::Unsigned16).value(period as i64).unit("ms")
}

/// 1018h, identity. The application writes the serial number, sub-index 4.
#[must_use]
pub const fn identity(vendor: u32, product: u32, revision: u32) -> [Object; 5] {
    [
        Object::highest(0x1018, 4, "Identity"),
        fixed(0x1018, 1, "Vendor-ID", Type::Unsigned32).value(vendor as i64),
        fixed(0x1018, 2, "Product code", Type::Unsigned32).value(product as i64),
        fixed(0x1018, 3, "Revision number", Type::Unsigned32).value(revision as i64),
        fixed(0x1018, 4, "Serial number", Type::Unsigned32),
    ]
}

/// 1029h, for communication errors (sub-index 1) and device errors (2): 0 leads to Pre-operational, 1 changes nothing,
/// 2 leads to Stopped. The default is 0 for communication errors and `device_error` for device errors.
#[must_use]
pub const fn error_behaviour(device_error: u8) -> [Object; 3] {
    [
        Object::highest(0x1029, 2, "Error behaviour"),
        // 255 is refused. 3 to 254 are accepted and change nothing.
        parameter(0x1029, 1, "Communication error", Type::Unsigned8).limits(0, 254),
        parameter(0x1029, 2, "Device error", Type::Unsigned8).limits(0, 2).value(device_error as i64),
    ]
}

/// 1F80h, NMT start-up: the value 8 makes the device start by itself.
#[must_use]
pub const fn start_up() -> Object {
    parameter(0x1F80, 0, "NMT start-up", Type::Unsigned32)
}

/// 1FA0h, object scanner list of `N` - 1 lines: the objects of the multiplexed TPDO in source address mode.
///
/// # Panics
/// During compilation, for more than 254 lines, or for none.
#[must_use]
pub const fn scanner_list<const N: usize>() -> [Object; N] {
    assert!(N >= 2 && N <= 255, "one to 254 objects are scanned");
    let number = parameter(0x1FA0, 0, "Object scanner list", Type::Unsigned8).limits(0, N as i64 - 1);
    list(number, parameter(0x1FA0, 1, "Scanned objects", Type::Unsigned32))
}

/// 1FD0h, object dispatching list of `N` - 1 lines: destinations of objects from multiplexed PDOs in source address
/// mode.
///
/// # Panics
/// During compilation, for more than 254 lines, or for none.
#[must_use]
pub const fn dispatching_list<const N: usize>() -> [Object; N] {
    assert!(N >= 2 && N <= 255, "the list has one to 254 lines");
    let number = parameter(0x1FD0, 0, "Object dispatching list", Type::Unsigned8).limits(0, N as i64 - 1);
    list(number, parameter(0x1FD0, 1, "Dispatched objects", Type::Unsigned64))
}

/// Replaces the default of a row of the first object in `rows`. For a PDO, `sub` is 2 for the transmission type, 3 for
/// the inhibit time (TPDO only) and 5 for the event timer.
///
/// # Panics
/// During compilation, when there is no such row.
#[must_use]
pub const fn with<const N: usize>(mut rows: [Object; N], sub: u8, value: i64) -> [Object; N] {
    let mut i = 0;
    while i < N && (rows[i].sub != sub || rows[i].index != rows[0].index) {
        i += 1;
    }
    if i == N {
        fail(rows[0].index, sub, "the object has no such row");
    }
    rows[i] = rows[i].value(value);
    rows
}

/// Sorts rows by index and sub-index. A merge sort of their positions that begins with the runs which are in order: the
/// parts of a table.
#[must_use]
pub const fn sorted<const N: usize>(rows: [Object; N]) -> [Object; N] {
    let (mut keys, mut order, mut i) = ([0; N], [0; N], 0);
    while i < N {
        (keys[i], order[i]) = (rows[i].key(), i);
        i += 1;
    }
    let (mut runs, mut sorted) = (2, rows);
    while runs > 1 {
        (order, runs) = merged(&keys, &order);
    }
    i = 0;
    while i < N {
        if order[i] != i {
            sorted[i] = rows[order[i]];
        }
        i += 1;
    }
    sorted
}

/// Merges each two neighbouring runs. Returns the number of runs that are left.
const fn merged<const N: usize>(keys: &[u32; N], order: &[usize; N]) -> ([usize; N], usize) {
    let (mut merged, mut at, mut runs) = (*order, 0, 0);
    while at < N {
        let (mut a, middle) = (at, end_of_run(keys, order, at));
        let (mut b, end) = (middle, end_of_run(keys, order, middle));
        while at < end && b < end {
            let is_first = a < middle && keys[order[a]] <= keys[order[b]];
            let from = if is_first { &mut a } else { &mut b };
            merged[at] = order[*from];
            *from += 1;
            at += 1;
        }
        while a < middle {
            merged[at] = order[a];
            (a, at) = (a + 1, at + 1);
        }
        (at, runs) = (end, runs + 1);
    }
    (merged, runs)
}

/// The end of the run that begins at a position.
const fn end_of_run<const N: usize>(keys: &[u32; N], order: &[usize; N], start: usize) -> usize {
    let mut end = start + 1;
    while end < N && keys[order[end - 1]] <= keys[order[end]] {
        end += 1;
    }
    if end < N { end } else { N }
}

/// Builds a sorted table of rows from parts in any order: arrays and slices of
/// [`Object`](crate::dictionary::Object).
#[macro_export]
macro_rules! rows {
    ($($part:expr),+ $(,)?) => {{
        const PARTS: &[&[$crate::dictionary::Object]] = &[$(&$part),+];
        const SORTED: [$crate::dictionary::Object; $crate::dictionary::count(PARTS)] =
            $crate::objects::sorted($crate::dictionary::gather(PARTS));
        &SORTED as &[$crate::dictionary::Object]
    }};
}
