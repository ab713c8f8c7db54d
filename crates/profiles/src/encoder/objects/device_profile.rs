//! Device profile objects, 6000h to 65FFh (CiA 406, classes C1 and C2). Sub-index n is channel n.

use crate::encoder::{SUPPORTED_ALARMS, SUPPORTED_WARNINGS};
use canopen::dictionary::{Access, Group, Mapping, Object, Type};

/// Version of CiA 406: 3.0.
const PROFILE_VERSION: u16 = 0x0300;

const fn parameter(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Application)
}

const fn handled(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    parameter(index, sub, name, kind).handled()
}

const fn fixed(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadOnly)
}

const fn measured(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    fixed(index, sub, name, kind).mappable(Mapping::Tpdo)
}

/// The offset that a preset has found, stored with the parameters.
const fn stored_offset(sub: u8, name: &'static str) -> Object {
    fixed(0x650C, sub, name, Type::Integer32).unit("units").stored(Group::Application)
}

/// Both channels of a measured value. `names`: the object, then its channels.
const fn values(index: u16, names: [&'static str; 3], kind: Type) -> [Object; 3] {
    let [name, one, two] = names;
    [Object::highest(index, 2, name), measured(index, 1, one, kind), measured(index, 2, two, kind)]
}

/// Both channels of a parameter.
const fn settings(index: u16, names: [&'static str; 3], kind: Type, default: i64) -> [Object; 3] {
    let [name, one, two] = names;
    [
        Object::highest(index, 2, name),
        parameter(index, 1, one, kind).value(default),
        parameter(index, 2, two, kind).value(default),
    ]
}

/// A parameter that PDOs carry both ways.
const fn mapped([highest, one, two]: [Object; 3]) -> [Object; 3] {
    [highest, one.mappable(Mapping::Both), two.mappable(Mapping::Both)]
}

const PARAMETERS: &[Object] = &[
    handled(0x6000, 0, "Operating parameters", Type::Unsigned16),
    handled(0x6001, 0, "Measuring units per revolution", Type::Unsigned32).value(4096).unit("units"),
    handled(0x6002, 0, "Total measuring range", Type::Unsigned32).value(4096 * 4096).unit("units"),
    handled(0x6003, 0, "Preset value", Type::Unsigned32).unit("units").acts(),
    measured(0x6004, 0, "Position value", Type::Unsigned32).unit("units"),
    Object::highest(0x6005, 2, "Linear measuring steps"),
    handled(0x6005, 1, "Position measuring step", Type::Unsigned32).value(10_000).unit("nm"),
    parameter(0x6005, 2, "Speed measuring step", Type::Unsigned32)
        .limits(1, 0xFFFF_FFFF)
        .value(100)
        .unit("0.01 mm/s"),
    Object::highest(0x6010, 2, "Preset values by channel"),
    handled(0x6010, 1, "Preset value channel 1", Type::Integer32).unit("units").acts(),
    handled(0x6010, 2, "Preset value channel 2", Type::Integer32).unit("units").acts(),
];

const POSITION: [Object; 3] = values(
    0x6020,
    ["Position values by channel", "Position value channel 1", "Position value channel 2"],
    Type::Integer32,
);
const SPEED: [Object; 3] =
    values(0x6030, ["Speed values", "Speed value channel 1", "Speed value channel 2"], Type::Integer16);

/// Hard-wired to 1800h:5, and saved there.
const TIMER: &[Object] = &[Object::new(0x6200, 0, "Cyclic timer", Type::Unsigned16, Access::ReadWrite)
    .unit("ms")
    .event_timer_of(0)];

const CAM_STATE: [Object; 3] =
    values(0x6300, ["Cam states", "Cam states channel 1", "Cam states channel 2"], Type::Unsigned8);
const CAM_ENABLE: [Object; 3] = mapped(settings(
    0x6301,
    ["Cam enables", "Cam enables channel 1", "Cam enables channel 2"],
    Type::Unsigned8,
    0,
));
const CAM_POLARITY: [Object; 3] = mapped(settings(
    0x6302,
    ["Cam polarities", "Cam polarities channel 1", "Cam polarities channel 2"],
    Type::Unsigned8,
    0,
));

/// One of the three limits of a cam.
macro_rules! cam_limits {
    ($base:expr, $what:literal, $kind:expr, [$($cam:literal),*]) => {
        [$(settings(
            $base + $cam - 1,
            [
                concat!("Cam ", $cam, " ", $what),
                concat!("Cam ", $cam, " ", $what, " channel 1"),
                concat!("Cam ", $cam, " ", $what, " channel 2"),
            ],
            $kind,
            0,
        )),*]
    };
}

const CAM_LOW: [[Object; 3]; 8] = cam_limits!(0x6310, "low limit", Type::Integer32, [1, 2, 3, 4, 5, 6, 7, 8]);
const CAM_HIGH: [[Object; 3]; 8] =
    cam_limits!(0x6320, "high limit", Type::Integer32, [1, 2, 3, 4, 5, 6, 7, 8]);
const CAM_HYSTERESIS: [[Object; 3]; 8] =
    cam_limits!(0x6330, "hysteresis", Type::Unsigned16, [1, 2, 3, 4, 5, 6, 7, 8]);

const AREA_STATE: [Object; 3] = values(
    0x6400,
    ["Area states", "Work area state channel 1", "Work area state channel 2"],
    Type::Unsigned8,
);
const AREA_LOW: [Object; 3] = settings(
    0x6401,
    ["Work area low limits", "Work area low limit channel 1", "Work area low limit channel 2"],
    Type::Integer32,
    0,
);
const AREA_HIGH: [Object; 3] = settings(
    0x6402,
    ["Work area high limits", "Work area high limit channel 1", "Work area high limit channel 2"],
    Type::Integer32,
    0x7FFF_FFFF,
);

const DIAGNOSTICS: &[Object] = &[
    fixed(0x6500, 0, "Operating status", Type::Unsigned16),
    fixed(0x6501, 0, "Single-turn resolution or measuring step", Type::Unsigned32).unit("steps or nm"),
    fixed(0x6502, 0, "Number of distinguishable revolutions", Type::Unsigned16),
    measured(0x6503, 0, "Alarms", Type::Unsigned16),
    fixed(0x6504, 0, "Supported alarms", Type::Unsigned16).value(SUPPORTED_ALARMS as i64),
    measured(0x6505, 0, "Warnings", Type::Unsigned16),
    fixed(0x6506, 0, "Supported warnings", Type::Unsigned16).value(SUPPORTED_WARNINGS as i64),
    fixed(0x6507, 0, "Profile and software version", Type::Unsigned32).value(versions()),
    fixed(0x6508, 0, "Operating time", Type::Unsigned32).unit("0.1 h"),
    fixed(0x6509, 0, "Offset value", Type::Integer32).unit("units"),
    Object::highest(0x650A, 3, "Module identification"),
    fixed(0x650A, 1, "Manufacturer's offset", Type::Integer32).unit("steps"),
    fixed(0x650A, 2, "Manufacturer's lowest position", Type::Integer32).value(-0x8000_0000).unit("steps"),
    fixed(0x650A, 3, "Manufacturer's highest position", Type::Integer32).value(0x7FFF_FFFF).unit("steps"),
    fixed(0x650B, 0, "Serial number", Type::Unsigned32),
    Object::highest(0x650C, 2, "Offset values by channel"),
    stored_offset(1, "Offset value channel 1"),
    stored_offset(2, "Offset value channel 2"),
];

/// 6507h: the profile version in the low word, the software version (that of 100Ah) in the high word. Each number is a
/// digit in four bits: version 1.40 is 0140h, and so is 1.4.0.
const fn versions() -> i64 {
    let major = digit(env!("CARGO_PKG_VERSION_MAJOR"));
    let minor = digit(env!("CARGO_PKG_VERSION_MINOR"));
    let patch = digit(env!("CARGO_PKG_VERSION_PATCH"));
    (major << 8 | minor << 4 | patch) << 16 | PROFILE_VERSION as i64
}

/// A number of one digit; a larger one does not compile.
#[allow(clippy::panic, reason = "evaluated by the compiler")]
const fn digit(text: &str) -> i64 {
    match text.as_bytes() {
        [digit @ b'0'..=b'9'] => (*digit - b'0') as i64,
        _ => panic!("6507h has one digit for each number of the version"),
    }
}

/// All parts, in the order of the table.
pub(super) const PARTS: &[&[Object]] = &[
    PARAMETERS,
    &POSITION,
    &SPEED,
    TIMER,
    &CAM_STATE,
    &CAM_ENABLE,
    &CAM_POLARITY,
    CAM_LOW.as_flattened(),
    CAM_HIGH.as_flattened(),
    CAM_HYSTERESIS.as_flattened(),
    &AREA_STATE,
    &AREA_LOW,
    &AREA_HIGH,
    DIAGNOSTICS,
];
