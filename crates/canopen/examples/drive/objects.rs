//! The objects of the drive: the communication objects, and those of CiA 402 for two modes.

use canopen::dictionary::{Access, Dictionary, Mapping, Object, Type};
use canopen::objects;

const fn own(index: u16, name: &'static str, kind: Type, access: Access) -> Object {
    Object::new(index, 0, name, kind, access)
}

const fn parameter(index: u16, name: &'static str, kind: Type, default: i64) -> Object {
    own(index, name, kind, Access::ReadWrite).value(default)
}

const fn actual(index: u16, name: &'static str, kind: Type) -> Object {
    own(index, name, kind, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const fn demand(index: u16, name: &'static str, kind: Type) -> Object {
    own(index, name, kind, Access::ReadWrite).mappable(Mapping::Rpdo)
}

const CONTROLWORD: Object = demand(0x6040, "Controlword", Type::Unsigned16).handled();
const STATUSWORD: Object = actual(0x6041, "Statusword", Type::Unsigned16);
const MODE: Object = demand(0x6060, "Modes of operation", Type::Integer8).value(1).handled();
const MODE_DISPLAY: Object = actual(0x6061, "Modes of operation display", Type::Integer8);
const POSITION: Object = actual(0x6064, "Position actual value", Type::Integer32);
const VELOCITY: Object = actual(0x606C, "Velocity actual value", Type::Integer32);
const TARGET_POSITION: Object = demand(0x607A, "Target position", Type::Integer32);
const TARGET_VELOCITY: Object = demand(0x60FF, "Target velocity", Type::Integer32);

const fn limit(sub: u8, name: &'static str, default: i64) -> Object {
    Object::new(0x607D, sub, name, Type::Integer32, Access::ReadWrite).value(default)
}

/// CiA 402: a servo drive.
pub(crate) const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0x0002_0192), objects::error_register(), objects::device_name("Drive")],
    objects::error_field::<5>(),
    objects::sync_consumer(),
    objects::emergency(),
    objects::heartbeat_consumer::<2>(),
    [objects::heartbeat_producer(200)],
    objects::identity(0, 0x402, 0x0001_0000),
    objects::error_behaviour(1),
    objects::rpdo(1, &[CONTROLWORD]),
    objects::rpdo(2, &[CONTROLWORD, MODE]),
    objects::rpdo(3, &[CONTROLWORD, TARGET_POSITION]),
    objects::rpdo(4, &[CONTROLWORD, TARGET_VELOCITY]),
    objects::tpdo(1, &[STATUSWORD]),
    objects::tpdo(2, &[STATUSWORD, MODE_DISPLAY]),
    objects::with(objects::tpdo(3, &[STATUSWORD, POSITION]), 2, 1),
    objects::with(objects::tpdo(4, &[STATUSWORD, VELOCITY]), 2, 1),
    [
        // 1: fault, 2: disable voltage, 3: quick stop.
        parameter(0x6007, "Abort connection option code", Type::Integer16, 1).limits(0, 3),
        own(0x603F, "Error code", Type::Unsigned16, Access::ReadOnly).mappable(Mapping::Tpdo),
        CONTROLWORD,
        STATUSWORD,
        // 2: Switch on disabled after the quick stop, 6: the drive stays in Quick stop active.
        parameter(0x605A, "Quick stop option code", Type::Integer16, 2).limits(2, 6),
        MODE,
        MODE_DISPLAY,
        POSITION,
        VELOCITY,
        TARGET_POSITION,
        Object::highest(0x607D, 2, "Software position limit"),
        limit(1, "Min position limit", i32::MIN as i64),
        limit(2, "Max position limit", i32::MAX as i64),
        parameter(0x6081, "Profile velocity", Type::Unsigned32, 10_000),
        parameter(0x6083, "Profile acceleration", Type::Unsigned32, 100_000),
        parameter(0x6084, "Profile deceleration", Type::Unsigned32, 100_000),
        parameter(0x6085, "Quick stop deceleration", Type::Unsigned32, 500_000),
        TARGET_VELOCITY,
        // Bits 0 and 2: profile position, profile velocity.
        own(0x6502, "Supported drive modes", Type::Unsigned32, Access::ReadOnly).value(0b101),
    ],
);
pub(crate) static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The locations of the values.
pub(crate) mod at {
    use super::DICTIONARY;
    use canopen::dictionary::Field;

    pub(crate) const ABORT_CONNECTION: Field = DICTIONARY.field(0x6007, 0);
    pub(crate) const ERROR_CODE: Field = DICTIONARY.field(0x603F, 0);
    pub(crate) const CONTROLWORD: Field = DICTIONARY.field(0x6040, 0);
    pub(crate) const STATUSWORD: Field = DICTIONARY.field(0x6041, 0);
    pub(crate) const QUICK_STOP_OPTION: Field = DICTIONARY.field(0x605A, 0);
    pub(crate) const MODE: Field = DICTIONARY.field(0x6060, 0);
    pub(crate) const MODE_DISPLAY: Field = DICTIONARY.field(0x6061, 0);
    pub(crate) const POSITION: Field = DICTIONARY.field(0x6064, 0);
    pub(crate) const VELOCITY: Field = DICTIONARY.field(0x606C, 0);
    pub(crate) const TARGET_POSITION: Field = DICTIONARY.field(0x607A, 0);
    pub(crate) const LIMITS: [Field; 2] = [DICTIONARY.field(0x607D, 1), DICTIONARY.field(0x607D, 2)];
    pub(crate) const PROFILE_VELOCITY: Field = DICTIONARY.field(0x6081, 0);
    pub(crate) const ACCELERATION: Field = DICTIONARY.field(0x6083, 0);
    pub(crate) const DECELERATION: Field = DICTIONARY.field(0x6084, 0);
    pub(crate) const QUICK_STOP_DECELERATION: Field = DICTIONARY.field(0x6085, 0);
    pub(crate) const TARGET_VELOCITY: Field = DICTIONARY.field(0x60FF, 0);
}
