//! Device profile objects, 6000h to 9FFFh (CiA 404). Sub-index 1 is the pressure, sub-index 2 the temperature.

use canopen::dictionary::{Access, Group, Mapping, Object, Type};

const fn both(index: u16, name: &'static str) -> Object {
    Object::highest(index, 2, name)
}

const fn measured(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Application)
}

const fn sensor_type(sub: u8, name: &'static str, code: i64) -> Object {
    Object::new(0x6110, sub, name, Type::Unsigned16, Access::Const).value(code)
}

/// 1: normal operation, the only mode.
const fn operating_mode(sub: u8, name: &'static str) -> Object {
    parameter(0x6112, sub, name, Type::Unsigned8).limits(1, 1).value(1)
}

/// A new value each millisecond.
const fn sample_rate(sub: u8, name: &'static str) -> Object {
    Object::new(0x6114, sub, name, Type::Unsigned32, Access::ReadOnly).value(1000).unit("us")
}

const fn autotare(sub: u8, name: &'static str) -> Object {
    Object::new(0x6139, sub, name, Type::Unsigned32, Access::WriteOnly).handled()
}

const fn autozero(sub: u8, name: &'static str) -> Object {
    Object::new(0x6125, sub, name, Type::Unsigned32, Access::WriteOnly).handled()
}

const fn unit(sub: u8, name: &'static str, code: i64) -> Object {
    parameter(0x6131, sub, name, Type::Unsigned32).value(code).handled()
}

/// 10^38 is the largest power of ten that a REAL32 can hold.
const fn digits(sub: u8, name: &'static str) -> Object {
    parameter(0x6132, sub, name, Type::Unsigned8).limits(0, 38)
}

const fn filter_constant(sub: u8, name: &'static str) -> Object {
    parameter(0x61A1, sub, name, Type::Unsigned8).limits(1, 255).value(1)
}

/// Unit of a process value, selected by 6131h.
const PV: &str = "6131h";

/// Objects in REAL32, and objects for all formats: 6000h to 6FFFh.
pub(crate) const REAL: &[Object] = &[
    both(0x6100, "AI input field value"),
    measured(0x6100, 1, "Pressure field value", Type::Real32).unit("Pa"),
    measured(0x6100, 2, "Temperature field value", Type::Real32).unit("K"),
    both(0x6110, "AI sensor type"),
    sensor_type(1, "Pressure sensor type", 90),
    sensor_type(2, "Temperature sensor type", 100),
    both(0x6112, "AI operating mode"),
    operating_mode(1, "Pressure operating mode"),
    operating_mode(2, "Temperature operating mode"),
    both(0x6114, "AI ADC sample rate"),
    sample_rate(1, "Pressure ADC sample rate"),
    sample_rate(2, "Temperature ADC sample rate"),
    both(0x6124, "AI input offset"),
    parameter(0x6124, 1, "Pressure offset", Type::Real32).unit(PV),
    parameter(0x6124, 2, "Temperature offset", Type::Real32).unit(PV),
    both(0x6125, "AI autozero"),
    autozero(1, "Pressure autozero"),
    autozero(2, "Temperature autozero"),
    both(0x6126, "AI scaling factor"),
    parameter(0x6126, 1, "Pressure scaling factor", Type::Real32).real(1.0),
    parameter(0x6126, 2, "Temperature scaling factor", Type::Real32).real(1.0),
    both(0x6127, "AI scaling offset"),
    parameter(0x6127, 1, "Pressure scaling offset", Type::Real32).unit("Pa"),
    parameter(0x6127, 2, "Temperature scaling offset", Type::Real32).unit("K"),
    both(0x6130, "AI input process value"),
    measured(0x6130, 1, "Pressure process value", Type::Real32).unit(PV),
    measured(0x6130, 2, "Temperature process value", Type::Real32).unit(PV),
    both(0x6131, "AI physical unit process value"),
    unit(1, "Pressure physical unit", 0x004E_0000),
    unit(2, "Temperature physical unit", 0x002D_0000),
    both(0x6132, "AI decimal digits process value"),
    digits(1, "Pressure decimal digits"),
    digits(2, "Temperature decimal digits"),
    // A TPDO of type 255 is sent when the process value has changed by so much; 0: with each change.
    both(0x6133, "AI interrupt delta input process value"),
    parameter(0x6133, 1, "Pressure interrupt delta", Type::Real32).unit(PV).handled(),
    parameter(0x6133, 2, "Temperature interrupt delta", Type::Real32).unit(PV).handled(),
    both(0x6139, "AI autotare"),
    autotare(1, "Pressure autotare"),
    autotare(2, "Temperature autotare"),
    both(0x6148, "AI span start"),
    parameter(0x6148, 1, "Pressure span start", Type::Real32).unit(PV),
    parameter(0x6148, 2, "Temperature span start", Type::Real32).unit(PV).real(-40.0),
    both(0x6149, "AI span end"),
    parameter(0x6149, 1, "Pressure span end", Type::Real32).unit(PV).real(10.0),
    parameter(0x6149, 2, "Temperature span end", Type::Real32).unit(PV).real(125.0),
    both(0x6150, "AI status"),
    measured(0x6150, 1, "Pressure status", Type::Unsigned8),
    measured(0x6150, 2, "Temperature status", Type::Unsigned8),
    both(0x61A0, "AI filter type"),
    parameter(0x61A0, 1, "Pressure filter type", Type::Unsigned8),
    parameter(0x61A0, 2, "Temperature filter type", Type::Unsigned8),
    both(0x61A1, "AI filter constant"),
    filter_constant(1, "Pressure filter constant"),
    filter_constant(2, "Temperature filter constant"),
];

/// Objects in integer formats: 7000h to 9FFFh.
pub(crate) const INTEGER: &[Object] = &[
    both(0x7130, "AI input process value INTEGER16"),
    measured(0x7130, 1, "Pressure process value INTEGER16", Type::Integer16).unit(PV),
    measured(0x7130, 2, "Temperature process value INTEGER16", Type::Integer16).unit(PV),
    both(0x7148, "AI span start INTEGER16"),
    parameter(0x7148, 1, "Pressure span start INTEGER16", Type::Integer16).unit(PV).value(-0x8000),
    parameter(0x7148, 2, "Temperature span start INTEGER16", Type::Integer16).unit(PV).value(-0x8000),
    both(0x7149, "AI span end INTEGER16"),
    parameter(0x7149, 1, "Pressure span end INTEGER16", Type::Integer16).unit(PV).value(0x7FFF),
    parameter(0x7149, 2, "Temperature span end INTEGER16", Type::Integer16).unit(PV).value(0x7FFF),
    both(0x9130, "AI input process value INTEGER32"),
    measured(0x9130, 1, "Pressure process value INTEGER32", Type::Integer32).unit(PV),
    measured(0x9130, 2, "Temperature process value INTEGER32", Type::Integer32).unit(PV),
    both(0x9148, "AI span start INTEGER32"),
    parameter(0x9148, 1, "Pressure span start INTEGER32", Type::Integer32).unit(PV).value(-0x8000_0000),
    parameter(0x9148, 2, "Temperature span start INTEGER32", Type::Integer32).unit(PV).value(-0x8000_0000),
    both(0x9149, "AI span end INTEGER32"),
    parameter(0x9149, 1, "Pressure span end INTEGER32", Type::Integer32).unit(PV).value(0x7FFF_FFFF),
    parameter(0x9149, 2, "Temperature span end INTEGER32", Type::Integer32).unit(PV).value(0x7FFF_FFFF),
];
