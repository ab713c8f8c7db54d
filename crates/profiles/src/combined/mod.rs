//! Encoder and pressure transmitter in one node: a module of two devices (CiA 301, 7.5.2.1). The encoder is the first
//! device and keeps the indexes of its profile; the transmitter is the second device, with 800h added to its indexes.
//!
//! This module has no code of its own for the profiles: it combines the rows of both and makes a [`Pair`] of both
//! profiles.

mod pdos;
mod shift;

use canopen::dictionary::{Access, Dictionary, Object, Type};

use crate::communication::{self, RPDOS, device_name, error_behaviour, tpdo_mappings, tpdos};
use crate::fault::Fault;
use crate::pair::Pair;
use crate::{encoder, pressure};

/// Added to the indexes of a device profile for the second device.
const SHIFT: u16 = 0x800;

/// The profile of the first device; the high word means several devices.
const DEVICE_TYPE: i64 = 0xFFFF_0196;

/// The device type of one of the two devices.
const fn device_type(index: u16, name: &'static str, code: i64) -> Object {
    Object::new(index, 0, name, Type::Unsigned32, Access::ReadOnly).value(code)
}

const ENCODER_TYPE: Object = device_type(
    0x67FF,
    "Device type 1",
    encoder::objects::device_type(encoder::objects::DEFAULT_TYPE) as i64,
);
const PRESSURE_TYPE: Object = device_type(0x6FFF, "Device type 2", pressure::objects::DEVICE_TYPE);

static REAL: [Object; pressure::objects::REAL.len()] = shift::shifted(pressure::objects::REAL);
static ALARM_BLOCK: [Object; pressure::objects::ALARM_BLOCK.len()] =
    shift::shifted(pressure::objects::ALARM_BLOCK);
static INTEGER: [Object; pressure::objects::INTEGER.len()] = shift::shifted(pressure::objects::INTEGER);

/// The rows of both devices, without the rows that all devices have.
pub const ROWS: &[&[Object]] = &[
    &[communication::device_type(DEVICE_TYPE)],
    pressure::objects::STATUS_REGISTER,
    &[device_name("STM32F4 encoder and transmitter")],
    &error_behaviour(0),
    &RPDOS,
    tpdos(&pdos::TPDOS).as_flattened(),
    tpdo_mappings(&pdos::TPDOS).as_flattened(),
    encoder::objects::SENSORS,
    pressure::objects::CALIBRATION,
    pressure::objects::EXTREMES,
    pressure::objects::STATUS_AND_USER,
    &encoder::objects::PROFILE,
    &[ENCODER_TYPE],
    &REAL,
    &ALARM_BLOCK,
    &[PRESSURE_TYPE],
    &INTEGER,
];

/// None: both profiles list their own faults.
pub const FAULTS: &[Fault] = &[];

/// Whether one of the profiles decides on a write to this object.
///
/// # Panics
/// During compilation, if both do.
#[must_use]
pub const fn handles(index: u16, sub: u8) -> bool {
    let first = encoder::objects::handles(index, sub);
    let second = pressure::objects::handles_shifted(index, sub, SHIFT);
    assert!(!(first && second), "both profiles handle one object");
    first || second
}

/// Both profiles.
pub type Objects = Pair<encoder::objects::Objects, pressure::objects::Objects>;

/// The places of both devices' values in the image.
#[must_use]
pub const fn fields(dictionary: &Dictionary) -> (encoder::objects::Fields, pressure::objects::Fields) {
    (
        encoder::objects::Fields::new(dictionary, ENCODER_TYPE.index),
        pressure::objects::Fields::new(dictionary, SHIFT),
    )
}
