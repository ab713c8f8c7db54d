//! Encoder and pressure transmitter in one node: a module of two devices (CiA 301, 7.5.2.1). The encoder is the first and
//! has the indexes of its profile; the transmitter is the second and has them 800h higher.

mod pdos;
mod shift;

use crate::manufacturer::{TRANSFER_BUFFER, personality};
use crate::personality::Definition;
use crate::{Personality, communication, dictionaries, encoder, flags, lost_events, pressure};
use canopen::dictionary::{self, Access, Object, Type};

/// From the indexes of a device profile to those of the second device.
const SHIFT: u16 = 0x800;

/// The profile of the first device; the high word says that there are several.
const DEVICE_TYPE: i64 = 0xFFFF_0196;

/// The device type of one of the devices.
const fn device_type(index: u16, name: &'static str, code: i64) -> Object {
    Object::new(index, 0, name, Type::Unsigned32, Access::ReadOnly).value(code)
}

const ENCODER_TYPE: Object =
    device_type(0x67FF, "Device type 1", encoder::device_type(encoder::DEFAULT_TYPE) as i64);
const PRESSURE_TYPE: Object = device_type(0x6FFF, "Device type 2", pressure::DEVICE_TYPE);

/// The table: everything there is to say about every object, sorted.
pub static OBJECTS: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);

static REAL: [Object; pressure::REAL.len()] = shift::shifted(pressure::REAL);
static INTEGER: [Object; pressure::INTEGER.len()] = shift::shifted(pressure::INTEGER);

const PARTS: &[&[Object]] = &[
    &[communication::device_type(DEVICE_TYPE), communication::ERROR_REGISTER, communication::STATUS_REGISTER],
    communication::ERRORS_AND_SYNC,
    &[communication::device_name("STM32F4 encoder and transmitter")],
    communication::SERVICES,
    &communication::error_behaviour(0),
    &communication::RPDOS,
    communication::tpdos(&pdos::TPDOS).as_flattened(),
    communication::tpdo_mappings(&pdos::TPDOS).as_flattened(),
    communication::START_UP,
    &[personality(Personality::Combined)],
    lost_events::OBJECTS,
    encoder::SENSORS,
    pressure::CALIBRATION,
    &[TRANSFER_BUFFER],
    pressure::STATUS_AND_USER,
    &encoder::PROFILE,
    &[ENCODER_TYPE],
    &REAL,
    &[PRESSURE_TYPE],
    &INTEGER,
];

/// Bytes of the image of all values.
pub(crate) const IMAGE_SIZE: usize = dictionary::image_size(&OBJECTS);

static FLAGS: flags::Fields = flags::Fields::new(dictionaries::COMBINED);
static PRESSURE: pressure::Fields = pressure::Fields::new(dictionaries::COMBINED, SHIFT);
static ENCODER: encoder::Fields = encoder::Fields::new(dictionaries::COMBINED, ENCODER_TYPE.index);

pub(crate) static DEFINITION: Definition = Definition {
    dictionary: dictionaries::COMBINED,
    flags: Some(&FLAGS),
    pressure: Some(&PRESSURE),
    encoder: Some(&ENCODER),
    lift: None,
};
