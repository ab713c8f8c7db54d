//! Application profile objects, 6000h to 64FFh (CiA 417). In objects of the position unit, sub-index n is unit n.

use crate::encoder::SUPPORTED_WARNINGS;
use canopen::dictionary::{Access, Group, Mapping, Object, Type};

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Application)
}

const fn handled(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    parameter(index, sub, name, kind).handled()
}

const fn measured(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadOnly)
}

/// An object that another device of the lift may write by a multiplexed PDO.
const fn taken(row: Object) -> Object {
    row.mappable(Mapping::Rpdo)
}

/// Process data, sent in a PDO of its own or in the multiplexed PDO.
const fn sent(row: Object) -> Object {
    row.mappable(Mapping::Tpdo)
}

/// The same row for each of the four units. A macro, because names are made of literals.
macro_rules! units {
    ($index:literal, $what:literal, $names:literal, $row:expr) => {
        [
            Object::highest($index, 4, $names),
            $row(1, concat!("Position unit 1 ", $what)),
            $row(2, concat!("Position unit 2 ", $what)),
            $row(3, concat!("Position unit 3 ", $what)),
            $row(4, concat!("Position unit 4 ", $what)),
        ]
    };
}

/// The same object for each of the four units, at one index each, with the channel as its sub-index.
macro_rules! indexes {
    ($first:literal, $what:literal, $names:literal, $row:expr) => {
        [
            Object::highest($first, 1, concat!("Position unit 1 ", $names)),
            $row($first, concat!("Position unit 1 ", $what)),
            Object::highest($first + 1, 1, concat!("Position unit 2 ", $names)),
            $row($first + 1, concat!("Position unit 2 ", $what)),
            Object::highest($first + 2, 1, concat!("Position unit 3 ", $names)),
            $row($first + 2, concat!("Position unit 3 ", $what)),
            Object::highest($first + 3, 1, concat!("Position unit 4 ", $names)),
            $row($first + 3, concat!("Position unit 4 ", $what)),
        ]
    };
}

/// Unit of positions, defined by 6384h:1.
const POSITION: &str = "6384h:1";

const fn operating(sub: u8, name: &'static str) -> Object {
    taken(handled(0x6380, sub, name, Type::Unsigned16))
}

const fn preset(sub: u8, name: &'static str) -> Object {
    taken(handled(0x6382, sub, name, Type::Unsigned32)).unit(POSITION).acts()
}

const fn position(sub: u8, name: &'static str) -> Object {
    sent(measured(0x6383, sub, name, Type::Unsigned32)).unit(POSITION)
}

/// For the spare TPDOs. The multiplexed PDO does not send it: each change would be a frame, a thousand a second.
const fn speed(sub: u8, name: &'static str) -> Object {
    sent(measured(0x6390, sub, name, Type::Integer16)).unit("6384h:2")
}

const fn area_state(index: u16, name: &'static str) -> Object {
    sent(measured(index, 1, name, Type::Unsigned8))
}

const fn low_limit(index: u16, name: &'static str) -> Object {
    taken(parameter(index, 1, name, Type::Integer32)).unit(POSITION)
}

const fn high_limit(index: u16, name: &'static str) -> Object {
    taken(parameter(index, 1, name, Type::Integer32)).value(0x7FFF_FFFF).unit(POSITION)
}

const fn operating_status(sub: u8, name: &'static str) -> Object {
    sent(measured(0x63C0, sub, name, Type::Unsigned16))
}

const fn resolution(sub: u8, name: &'static str) -> Object {
    measured(0x63C1, sub, name, Type::Unsigned32).unit("steps or nm")
}

const fn revolutions(sub: u8, name: &'static str) -> Object {
    measured(0x63C2, sub, name, Type::Unsigned16)
}

const fn supported_warnings(sub: u8, name: &'static str) -> Object {
    measured(0x63C4, sub, name, Type::Unsigned16).value(SUPPORTED_WARNINGS as i64)
}

const fn warnings(sub: u8, name: &'static str) -> Object {
    sent(measured(0x63C5, sub, name, Type::Unsigned16))
}

const fn limit(sub: u8, name: &'static str) -> Object {
    taken(parameter(0x6483, sub, name, Type::Unsigned16)).unit("kg")
}

/// A type in the list of virtual devices; 0 after the last one.
const fn listed(sub: u8, name: &'static str) -> Object {
    measured(0x6000, sub, name, Type::Unsigned16)
}

/// All parts, in the order of the table.
pub(super) const PARTS: &[&[Object]] = &[
    &[
        Object::new(0x6000, 0, "Virtual devices", Type::Unsigned8, Access::ReadOnly),
        listed(1, "Type of virtual device 1"),
        listed(2, "Type of virtual device 2"),
        listed(3, "Type of virtual device 3"),
        listed(4, "Type of virtual device 4"),
        // One bit for each lift. The PDOs are those of lift 1.
        parameter(0x6001, 0, "Lift number", Type::Unsigned8).limits(1, 1).value(1),
        sent(measured(0x6010, 0, "Virtual input", Type::Unsigned48)),
        Object::new(0x6011, 0, "Virtual output", Type::Unsigned48, Access::ReadWrite).mappable(Mapping::Rpdo),
        Object::highest(0x6100, 2, "Input group"),
        handled(0x6100, 1, "Input 1", Type::Unsigned48),
        handled(0x6100, 2, "Input 2", Type::Unsigned48),
        // Bit 0: the input is used.
        Object::highest(0x6120, 2, "Input group parameter 1"),
        parameter(0x6120, 1, "Input 1 parameter 1", Type::Unsigned32).limits(0, 1).value(1),
        parameter(0x6120, 2, "Input 2 parameter 1", Type::Unsigned32).limits(0, 1).value(1),
        Object::highest(0x6200, 2, "Output group"),
        parameter(0x6200, 1, "Output 1", Type::Unsigned48),
        parameter(0x6200, 2, "Output 2", Type::Unsigned48),
    ],
    &units!(0x6380, "operating parameters", "Position unit operating parameters", operating),
    &units!(0x6382, "preset", "Position unit presets", preset),
    &units!(0x6383, "position", "Positions", position),
    &[
        Object::highest(0x6384, 2, "Position unit measuring steps"),
        handled(0x6384, 1, "Position measuring step", Type::Unsigned16)
            .limits(1, 0xFFFF)
            .value(100)
            .unit("10 um"),
        parameter(0x6384, 2, "Speed measuring step", Type::Unsigned16)
            .limits(1, 0xFFFF)
            .value(10)
            .unit("0.1 mm/s"),
    ],
    &units!(0x6390, "speed", "Speeds", speed),
    &indexes!(0x63B0, "area state", "area states", area_state),
    &indexes!(0x63B4, "low limit", "low limits", low_limit),
    &indexes!(0x63B8, "high limit", "high limits", high_limit),
    &units!(0x63C0, "operating status", "Position unit operating status", operating_status),
    &units!(0x63C1, "resolution", "Position unit resolutions", resolution),
    &units!(0x63C2, "revolutions", "Position unit revolutions", revolutions),
    &units!(0x63C4, "supported warnings", "Position unit supported warnings", supported_warnings),
    &units!(0x63C5, "warnings", "Position unit warnings", warnings),
    &[
        Object::highest(0x6480, 1, "Load values"),
        sent(measured(0x6480, 1, "Load value", Type::Unsigned16)).unit("kg"),
        Object::highest(0x6482, 1, "Load signals"),
        sent(measured(0x6482, 1, "Load signal", Type::Unsigned8)),
        // A limit of 0 switches its signal off.
        Object::highest(0x6483, 4, "Load signalling limits"),
        limit(1, "Zero load limit"),
        limit(2, "Half load limit"),
        limit(3, "Full load limit"),
        limit(4, "Overload limit"),
        taken(handled(0x6486, 0, "Car reference weight", Type::Unsigned16)).unit("kg").acts(),
    ],
];
