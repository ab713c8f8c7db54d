//! Manufacturer-specific objects of the encoder, 2100h to 2115h: description of the sensors, and functions that CiA 406
//! leaves open.

use crate::encoder::AUTOMATIC;
use canopen::dictionary::{Access, Group, Mapping, Object, Type};

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Application)
}

/// A parameter that describes a sensor.
const fn sensor(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    parameter(index, sub, name, kind).handled()
}

/// The codes 1 to 9 of object 1000h. The type decides whether the SSI input or the timer is read.
const fn sensor_type(sub: u8, name: &'static str, lowest: i64, default: i64) -> Object {
    sensor(0x2100, sub, name, Type::Unsigned8).limits(lowest, 9).value(default)
}

const fn resolution(sub: u8, name: &'static str) -> Object {
    sensor(0x2101, sub, name, Type::Unsigned32).limits(1, 0xFFFF_FFFF).value(4096)
}

const fn counted(sub: u8, name: &'static str) -> Object {
    sensor(0x2102, sub, name, Type::Unsigned16).limits(1, 0xFFFF).value(4096)
}

const fn fastest(sub: u8, name: &'static str) -> Object {
    parameter(0x2104, sub, name, Type::Unsigned32).value(AUTOMATIC as i64).unit("steps/ms")
}

const fn module(sub: u8, name: &'static str, default: i64) -> Object {
    parameter(0x2107, sub, name, Type::Integer32).value(default).unit("steps").handled()
}

const fn state(index: u16, sub: u8, name: &'static str) -> Object {
    Object::new(index, sub, name, Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const fn speed(sub: u8, name: &'static str) -> Object {
    Object::new(0x2110, sub, name, Type::Integer32, Access::ReadOnly).mappable(Mapping::Tpdo).unit("2111h:1")
}

const fn commands(sub: u8, name: &'static str) -> Object {
    Object::new(0x210A, sub, name, Type::Unsigned8, Access::ReadOnly)
}

pub(crate) const SENSORS: &[Object] = &[
    Object::highest(0x2100, 2, "Sensor type"),
    sensor_type(1, "Sensor type channel 1", 1, 5),
    // 0: there is no second sensor.
    sensor_type(2, "Sensor type channel 2", 0, 0),
    // Incremental: steps per revolution, four a line. Linear: nm a step. Absolute rotary: taken from the SSI frame
    // instead.
    Object::highest(0x2101, 2, "Sensor resolution"),
    resolution(1, "Sensor resolution channel 1"),
    resolution(2, "Sensor resolution channel 2"),
    // Revolutions of types 3 and 5; periods of the code of type 9.
    Object::highest(0x2102, 2, "Electronically counted revolutions"),
    counted(1, "Counted revolutions channel 1"),
    counted(2, "Counted revolutions channel 2"),
    Object::highest(0x2103, 5, "SSI frame"),
    sensor(0x2103, 1, "Bits of revolutions", Type::Unsigned8).limits(0, 16).value(12),
    sensor(0x2103, 2, "Bits of steps", Type::Unsigned8).limits(1, 31).value(13),
    // 0 binary, 1 Gray.
    sensor(0x2103, 3, "Coding", Type::Unsigned8).limits(0, 1).value(1),
    sensor(0x2103, 4, "Alarm bits", Type::Unsigned8).limits(0, 1),
    // 0 none, 1 even, 2 odd.
    sensor(0x2103, 5, "Parity", Type::Unsigned8).limits(0, 2),
    // 0: no limit; FFFF FFFFh: from the resolution. Beyond it an SSI reading is rejected, and a count is in doubt.
    Object::highest(0x2104, 2, "Fastest movement"),
    fastest(1, "Fastest movement channel 1"),
    fastest(2, "Fastest movement channel 2"),
    parameter(0x2105, 0, "Index input used", Type::Unsigned8).limits(0, 1).value(1),
    Object::highest(0x2106, 5, "Limits"),
    parameter(0x2106, 1, "Lowest sensor supply", Type::Unsigned16).value(4500).unit("mV"),
    parameter(0x2106, 2, "Highest sensor supply", Type::Unsigned16).value(5500).unit("mV"),
    parameter(0x2106, 3, "Highest sensor current", Type::Unsigned16).value(200).unit("mA"),
    parameter(0x2106, 4, "Lowest battery voltage", Type::Unsigned16).value(2400).unit("mV"),
    // 0: no limit.
    parameter(0x2106, 5, "Operating time limit", Type::Unsigned32).unit("0.1 h"),
    // The source of 650Ah. Locked by 2108h.
    Object::highest(0x2107, 3, "Factory data of the sensors"),
    module(1, "Factory offset", 0),
    module(2, "Factory lowest position", -0x8000_0000),
    module(3, "Factory highest position", 0x7FFF_FFFF),
    // "fact" opens 2107h until the next reset or the next write of another value.
    Object::new(0x2108, 0, "Factory key", Type::Unsigned32, Access::WriteOnly),
    // Mask of the alarms (6503h) to clear.
    Object::new(0x2109, 0, "Alarm acknowledgement", Type::Unsigned16, Access::WriteOnly).handled(),
    Object::highest(0x210A, 3, "Accepted commands"),
    commands(1, "Presets channel 1"),
    commands(2, "Presets channel 2"),
    commands(3, "Acknowledgements"),
    Object::highest(0x210B, 2, "Sensor state"),
    state(0x210B, 1, "Sensor state channel 1"),
    state(0x210B, 2, "Sensor state channel 2"),
    Object::highest(0x210C, 2, "Commissioning diagnostic"),
    state(0x210C, 1, "Commissioning diagnostic channel 1"),
    state(0x210C, 2, "Commissioning diagnostic channel 2"),
    Object::highest(0x2110, 2, "Long speed values"),
    speed(1, "Long speed value channel 1"),
    speed(2, "Long speed value channel 2"),
    Object::highest(0x2111, 2, "Long speed settings"),
    // 0: the unit of 6030h; 1: 0.01 rpm of a shaft, um/s of a linear encoder.
    parameter(0x2111, 1, "Unit of long speed values", Type::Unsigned8).limits(0, 1),
    parameter(0x2111, 2, "Averaging of long speed values", Type::Unsigned16)
        .limits(1, 1000)
        .value(1)
        .unit("ms"),
    // A TPDO of type 255 is sent when the position has moved by so much; 0: with each change.
    Object::highest(0x2112, 2, "Change thresholds of positions"),
    parameter(0x2112, 1, "Change threshold channel 1", Type::Unsigned32).unit("units"),
    parameter(0x2112, 2, "Change threshold channel 2", Type::Unsigned32).unit("units"),
    // The cams see the position of so much later; negative: of so much earlier.
    Object::highest(0x2113, 2, "Cam delay compensations"),
    parameter(0x2113, 1, "Cam delay compensation channel 1", Type::Integer16).unit("0.1 ms"),
    parameter(0x2113, 2, "Cam delay compensation channel 2", Type::Integer16).unit("0.1 ms"),
    // 6001h units are this number of revolutions of the sensor.
    sensor(0x2114, 0, "Gear factor", Type::Unsigned16).limits(1, 0xFFFF).value(1),
    // The digital input that makes a preset; 0: none.
    Object::highest(0x2115, 2, "Preset inputs"),
    parameter(0x2115, 1, "Preset input channel 1", Type::Unsigned8).limits(0, 2),
    parameter(0x2115, 2, "Preset input channel 2", Type::Unsigned8).limits(0, 2),
];
