//! Manufacturer-specific objects of the lift, 2300h to 2322h: choice of the virtual devices, their sensors, and
//! functions that CiA 417 leaves open. Position sensors are described as in the encoder (2100h to 2106h).

use crate::lift::devices::Devices;
use crate::lift::position::UNKNOWN;
use canopen::dictionary::{Access, Group, Mapping, Object, Type};

/// Index of the object with the TPDOs that a client has switched off.
pub const SWITCHED_OFF: u16 = 0x2307;

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Application)
}

/// The encoder channel of a position unit; 0 for an unused unit.
const fn source(sub: u8, name: &'static str, default: i64) -> Object {
    parameter(0x2301, sub, name, Type::Unsigned8).limits(0, 2).value(default).handled()
}

/// The offset that results from a preset or a change of direction.
const fn offset(sub: u8, name: &'static str) -> Object {
    parameter(0x2302, sub, name, Type::Integer32).unit("6384h:1")
}

const fn state(sub: u8, name: &'static str) -> Object {
    Object::new(0x2303, sub, name, Type::Unsigned8, Access::ReadOnly)
        .value(UNKNOWN as i64)
        .mappable(Mapping::Tpdo)
}

/// The position by the readings of the sensor, including rejected ones: a preset accepts them.
const fn reading(sub: u8, name: &'static str) -> Object {
    Object::new(0x2304, sub, name, Type::Unsigned32, Access::ReadOnly).unit("6384h:1")
}

/// Number of presets of a unit: 0 before the first one, 255 when the offset has lost its meaning.
const fn references(sub: u8, name: &'static str) -> Object {
    Object::new(0x2306, sub, name, Type::Unsigned8, Access::ReadOnly).stored(Group::Application)
}

const fn lamp(sub: u8, name: &'static str) -> Object {
    Object::new(0x2322, sub, name, Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Rpdo)
}

pub(super) const OBJECTS: &[Object] = &[
    parameter(0x2300, 0, "Travel of the car per revolution", Type::Unsigned32)
        .limits(1, 0xFFFF_FFFF)
        .value(200_000)
        .unit("um")
        .handled(),
    Object::highest(0x2301, 4, "Position unit sources"),
    source(1, "Position unit 1 source", 1),
    source(2, "Position unit 2 source", 0),
    source(3, "Position unit 3 source", 0),
    source(4, "Position unit 4 source", 0),
    Object::highest(0x2302, 4, "Position unit offsets"),
    offset(1, "Position unit 1 offset"),
    offset(2, "Position unit 2 offset"),
    offset(3, "Position unit 3 offset"),
    offset(4, "Position unit 4 offset"),
    Object::highest(0x2303, 4, "Position unit states"),
    state(1, "Position unit 1 state"),
    state(2, "Position unit 2 state"),
    state(3, "Position unit 3 state"),
    state(4, "Position unit 4 state"),
    Object::highest(0x2304, 4, "Position unit readings"),
    reading(1, "Position unit 1 reading"),
    reading(2, "Position unit 2 reading"),
    reading(3, "Position unit 3 reading"),
    reading(4, "Position unit 4 reading"),
    // One bit for each: 0 car position units, 1 load measuring unit, 2 input panel unit, 3 output panel unit.
    parameter(0x2305, 0, "Selection of virtual devices", Type::Unsigned8)
        .limits(0, Devices::ALL.0 as i64)
        .handled(),
    Object::highest(0x2306, 4, "Position unit references"),
    references(1, "Position unit 1 references"),
    references(2, "Position unit 2 references"),
    references(3, "Position unit 3 references"),
    references(4, "Position unit 4 references"),
    // One bit for each: 0 for 1901h, 1 to 4 for 1906h, 1907h, 1980h and 1981h. Part of the communication parameters, like
    // the COB-IDs themselves.
    Object::new(SWITCHED_OFF, 0, "TPDOs switched off by a client", Type::Unsigned8, Access::ReadOnly)
        .stored(Group::Communication),
    Object::highest(0x2310, 3, "Load filter"),
    // Codes as in 61A0h and 61A1h of CiA 404.
    parameter(0x2310, 1, "Load filter type", Type::Unsigned8).limits(0, 2).value(2),
    parameter(0x2310, 2, "Load filter constant", Type::Unsigned8).limits(1, 255).value(100),
    parameter(0x2310, 3, "Load hysteresis", Type::Unsigned16).value(10).unit("kg"),
    // With two equal pressures no load is measured, as with a broken sensor.
    Object::highest(0x2311, 4, "Load calibration"),
    parameter(0x2311, 1, "Pressure at point 1", Type::Real32).unit("Pa"),
    parameter(0x2311, 2, "Load at point 1", Type::Real32).unit("kg"),
    parameter(0x2311, 3, "Pressure at point 2", Type::Real32).real(1.0e6).unit("Pa"),
    parameter(0x2311, 4, "Load at point 2", Type::Real32).real(1000.0).unit("kg"),
    // The offset that results from 6486h.
    parameter(0x2312, 0, "Load offset", Type::Real32).unit("kg"),
    Object::highest(0x2313, 2, "Load measurement"),
    Object::new(0x2313, 1, "Load as measured", Type::Real32, Access::ReadOnly).unit("kg"),
    // 1: the sensor or its wiring is broken.
    Object::new(0x2313, 2, "Load sensor state", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo),
    // Two equal words: the button is not used. Without a used button the input panel unit does nothing.
    Object::highest(0x2320, 4, "Button words"),
    parameter(0x2320, 1, "Virtual input of button 1 released", Type::Unsigned48),
    parameter(0x2320, 2, "Virtual input of button 1 pressed", Type::Unsigned48),
    parameter(0x2320, 3, "Virtual input of button 2 released", Type::Unsigned48),
    parameter(0x2320, 4, "Virtual input of button 2 pressed", Type::Unsigned48),
    // Two equal words: the lamp is not used. Without a used lamp the output panel unit does nothing.
    Object::highest(0x2321, 4, "Lamp words"),
    parameter(0x2321, 1, "Virtual output that switches lamp 1 off", Type::Unsigned48),
    parameter(0x2321, 2, "Virtual output that lights lamp 1", Type::Unsigned48),
    parameter(0x2321, 3, "Virtual output that switches lamp 2 off", Type::Unsigned48),
    parameter(0x2321, 4, "Virtual output that lights lamp 2", Type::Unsigned48),
    // 0: off; 10h to 17h: flashing; other values: lit. Written by a multiplexed PDO or by an SDO client.
    Object::highest(0x2322, 2, "Lamps"),
    lamp(1, "Lamp 1"),
    lamp(2, "Lamp 2"),
];
