//! The rows of PDOs: whole PDOs, and single rows for PDOs with other properties.

use super::{list, parameter};
use crate::dictionary::{DefaultValue, MappedObject, Object, Rule, Type, fail};

/// The default COB-ID of PDO `number`, from 1. `base` is 180h for a TPDO and 200h for an RPDO. The PDOs 1 to 4 have a
/// CAN-ID in the pre-defined connection set (CiA 301, 7.3.5); any other PDO is switched off.
#[must_use]
pub const fn default_id(base: u32, number: u16, is_on: bool) -> DefaultValue {
    let off = if is_on { 0 } else { 1 << 31 };
    match number {
        1..=4 => DefaultValue::NodeId(off + base + 0x100 * (number as u32 - 1)),
        _ => DefaultValue::Integer(1 << 31),
    }
}

/// COB-ID, sub-index 1.
#[must_use]
pub const fn cob_id(index: u16, default: DefaultValue) -> Object {
    parameter(index, 1, "COB-ID", Type::Unsigned32).default(default)
}

/// Transmission type, sub-index 2.
#[must_use]
pub const fn transmission_type(index: u16, default: i64) -> Object {
    parameter(index, 2, "Transmission type", Type::Unsigned8).value(default)
}

/// Inhibit time of a TPDO in 100 us, sub-index 3.
#[must_use]
pub const fn inhibit_time(index: u16) -> Object {
    parameter(index, 3, "Inhibit time", Type::Unsigned16).unit("100 us")
}

/// Event timer in ms, sub-index 5.
#[must_use]
pub const fn event_timer(index: u16, milliseconds: i64) -> Object {
    parameter(index, 5, "Event timer", Type::Unsigned16).value(milliseconds).unit("ms")
}

/// SYNC start value of a TPDO, sub-index 6.
#[must_use]
pub const fn sync_start(index: u16) -> Object {
    parameter(index, 6, "SYNC start value", Type::Unsigned8).limits(0, 240)
}

/// The number of mapped objects, at most eight. The rule of the entry checks the number against the mapping entries.
/// [`multiplexed`] allows 254 and 255 as well.
#[must_use]
pub const fn count(index: u16, name: &'static str, used: i64) -> Object {
    let row = parameter(index, 0, name, Type::Unsigned8).value(used);
    if used > 8 { row } else { row.limits(0, 8) }
}

/// Allows a PDO to be a multiplexed one: its number of mapped objects can be 254 or 255 (CiA 301, 7.2.2.6). Takes the
/// rows of PDOs or of mapping parameters. A device links multiplexed PDOs only if one of its PDOs allows them.
///
/// ```
/// use canopen::objects;
/// const ROWS: [canopen::dictionary::Object; 15] = objects::multiplexed(objects::tpdo(2, &[]));
/// ```
#[must_use]
pub const fn multiplexed<const N: usize>(mut rows: [Object; N]) -> [Object; N] {
    let mut i = 0;
    while i < N {
        if matches!(rows[i].rule, Rule::PdoCount) {
            rows[i].limits = None;
        }
        i += 1;
    }
    rows
}

/// Makes TPDOs ignore remote frames: bit 30 of the default COB-ID is set. A device links the answers to remote frames only
/// if one of its TPDOs allows them; otherwise, a client cannot switch them on. CiA recommends to do without them.
///
/// ```
/// use canopen::objects;
/// const ROWS: [canopen::dictionary::Object; 15] = objects::without_remote(objects::tpdo(2, &[]));
/// ```
#[must_use]
pub const fn without_remote<const N: usize>(mut rows: [Object; N]) -> [Object; N] {
    let mut i = 0;
    while i < N {
        if matches!(rows[i].rule, Rule::PdoCobId | Rule::PdoPredefined) && rows[i].index & 0xFE00 == 0x1800 {
            rows[i].default = match rows[i].default {
                DefaultValue::NodeId(base) => DefaultValue::NodeId(base | 1 << 30),
                DefaultValue::Integer(value) => DefaultValue::Integer(value | 1 << 30),
                other => other,
            };
        }
        i += 1;
    }
    rows
}

/// A mapped object: index, sub-index and length in bits.
#[must_use]
pub const fn slot(index: u16, sub: u8, mapped: i64) -> Object {
    parameter(index, sub, "Mapped object", Type::Unsigned32).value(mapped)
}

/// A mapping parameter with eight entries. The first entries map the objects in `mapped`.
///
/// # Panics
/// During compilation, for more than eight objects.
#[must_use]
pub const fn mapping(index: u16, name: &'static str, mapped: &[i64]) -> [Object; 9] {
    if mapped.len() > 8 {
        fail(index, 0, "a PDO of these functions maps at most eight objects");
    }
    let mut rows: [Object; 9] = list(count(index, name, mapped.len() as i64), slot(index, 1, 0));
    let mut i = 0;
    while i < mapped.len() {
        rows[i + 1] = rows[i + 1].value(mapped[i]);
        i += 1;
    }
    rows
}

/// The communication parameter of an RPDO.
#[must_use]
pub const fn rpdo_parameter(index: u16, name: &'static str, id: DefaultValue) -> [Object; 4] {
    [Object::highest(index, 5, name), cob_id(index, id), transmission_type(index, 255), event_timer(index, 0)]
}

/// The communication parameter of a TPDO.
#[must_use]
pub const fn tpdo_parameter(index: u16, name: &'static str, id: DefaultValue) -> [Object; 6] {
    [
        Object::highest(index, 6, name),
        cob_id(index, id),
        transmission_type(index, 255),
        inhibit_time(index),
        event_timer(index, 0),
        sync_start(index),
    ]
}

/// RPDO 1 to 512: 1400h + `number` - 1 and 1600h + `number` - 1. Its data is taken on reception. The RPDO maps
/// `objects` and has eight mapping entries; without objects it is switched off.
///
/// # Panics
/// During compilation, for a number outside 1 to 512, and for objects that do not fit.
#[must_use]
pub const fn rpdo(number: u16, objects: &[Object]) -> [Object; 13] {
    assert!(number >= 1 && number <= 512, "an RPDO has a number from 1 to 512");
    let (index, id) = (0x1400 + number - 1, default_id(0x200, number, !objects.is_empty()));
    let mut rows = [count(index, "", 0); 13];
    copy(&rpdo_parameter(index, "RPDO communication parameter", id), &mut rows, 0);
    copy(&mapping_of(index + 0x200, "RPDO mapping parameter", objects, false), &mut rows, 4);
    rows
}

/// TPDO 1 to 512: 1800h + `number` - 1 and 1A00h + `number` - 1. It is sent on every change of `objects`. The TPDO has
/// eight mapping entries; without objects it is switched off.
///
/// # Panics
/// During compilation, for a number outside 1 to 512, and for objects that do not fit.
#[must_use]
pub const fn tpdo(number: u16, objects: &[Object]) -> [Object; 15] {
    assert!(number >= 1 && number <= 512, "a TPDO has a number from 1 to 512");
    let (index, id) = (0x1800 + number - 1, default_id(0x180, number, !objects.is_empty()));
    let mut rows = [count(index, "", 0); 15];
    copy(&tpdo_parameter(index, "TPDO communication parameter", id), &mut rows, 0);
    copy(&mapping_of(index + 0x200, "TPDO mapping parameter", objects, true), &mut rows, 6);
    rows
}

/// `N` RPDOs, from number `first` on. Each maps the `K` objects of its element. `as_flattened` makes them a part for
/// [`rows!`](crate::rows!).
///
/// ```
/// use canopen::dictionary::{Access, Mapping, Object, Type};
/// use canopen::objects;
///
/// const fn value(sub: u8) -> [Object; 1] {
///     [Object::new(0x2000, sub, "Value", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Both)]
/// }
/// const PDOS: [[Object; 13]; 2] = objects::rpdos(1, &[value(1), value(2)]);
/// const ROWS: &[Object] = canopen::rows!(PDOS.as_flattened(), [Object::highest(0x2000, 2, ""), value(1)[0], value(2)[0]]);
/// ```
///
/// # Panics
/// During compilation, as [`rpdo`].
#[must_use]
pub const fn rpdos<const N: usize, const K: usize>(
    first: u16,
    objects: &[[Object; K]; N],
) -> [[Object; 13]; N] {
    assert!(first >= 1 && first as usize + N <= 513, "an RPDO has a number from 1 to 512");
    numbered(rpdo(first, &objects[0]), 4, first, objects)
}

/// `N` TPDOs, from number `first` on. Each maps the `K` objects of its element. `as_flattened` makes them a part for
/// [`rows!`](crate::rows!).
///
/// ```
/// use canopen::dictionary::{Access, Mapping, Object, Type};
/// use canopen::objects;
///
/// const fn value(sub: u8) -> [Object; 1] {
///     [Object::new(0x2000, sub, "Value", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Both)]
/// }
/// const PDOS: [[Object; 15]; 2] = objects::tpdos(1, &[value(1), value(2)]);
/// const ROWS: &[Object] = canopen::rows!(PDOS.as_flattened(), [Object::highest(0x2000, 2, ""), value(1)[0], value(2)[0]]);
/// ```
///
/// # Panics
/// During compilation, as [`tpdo`].
#[must_use]
pub const fn tpdos<const N: usize, const K: usize>(
    first: u16,
    objects: &[[Object; K]; N],
) -> [[Object; 15]; N] {
    assert!(first >= 1 && first as usize + N <= 513, "a TPDO has a number from 1 to 512");
    numbered(tpdo(first, &objects[0]), 6, first, objects)
}

/// PDOs with ascending numbers from the rows of the first one, of which `parameters` are those of the communication
/// parameter. The compiler takes a fraction of the time that new rows take.
const fn numbered<const R: usize, const N: usize, const K: usize>(
    pdo: [Object; R],
    parameters: usize,
    first: u16,
    objects: &[[Object; K]; N],
) -> [[Object; R]; N] {
    let is_sent = pdo[0].index & 0x0800 != 0;
    let base = if is_sent { 0x180 } else { 0x200 };
    let (mut rows, mut n) = ([pdo; N], 1);
    while n < N {
        let (own, number) = (&mut rows[n], first + n as u16);
        let mut i = 0;
        while i < R {
            own[i].index += n as u16;
            i += 1;
        }
        own[1].default = default_id(base, number, K > 0);
        let mapped = mapped_of(own[parameters].index, &objects[n], is_sent);
        i = 0;
        while i < K {
            own[parameters + 1 + i].default = DefaultValue::Integer(mapped[i]);
            i += 1;
        }
        n += 1;
    }
    rows
}

/// A mapping parameter for `objects`, which must be mappable in this direction.
const fn mapping_of(index: u16, name: &'static str, objects: &[Object], is_sent: bool) -> [Object; 9] {
    let mapped = mapped_of(index, objects, is_sent);
    mapping(index, name, mapped.split_at(objects.len()).0)
}

/// The mapping entries for `objects`, which must be mappable in this direction and fit a PDO.
const fn mapped_of(index: u16, objects: &[Object], is_sent: bool) -> [i64; 8] {
    if objects.len() > 8 {
        fail(index, 0, "a PDO of these functions maps at most eight objects");
    }
    let (mut i, mut len, mut mapped) = (0, 0, [0; 8]);
    while i < objects.len() {
        let object = &objects[i];
        let allows = if is_sent { object.mapping.allows_tpdo() } else { object.mapping.allows_rpdo() };
        if !allows {
            fail(object.index, object.sub, "the object cannot be mapped in this direction");
        }
        len += object.kind.size();
        let object = MappedObject { index: object.index, sub: object.sub, bits: object.kind.size() * 8 };
        mapped[i] = object.encode() as i64;
        i += 1;
    }
    if len > 8 {
        fail(index, 0, "the mapped objects have more than eight bytes");
    }
    mapped
}

const fn copy(from: &[Object], to: &mut [Object], first: usize) {
    let mut i = 0;
    while i < from.len() {
        to[first + i] = from[i];
        i += 1;
    }
}
