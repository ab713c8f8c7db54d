//! The encoder: its dictionary, and how measured values and parameters come in and out of it.
//!
//! The objects of the device profile (CiA 406, 6000h to 67FFh) and those of the manufacturer that it needs (21xxh).

mod manufacturer;
mod pdos;
mod profile;
mod rules;
mod sensors;
mod values;

pub(crate) use manufacturer::SENSORS;
pub(crate) use pdos::{BY_EVENT, BY_SYNC};
pub(crate) use sensors::Sensors;
pub(crate) use values::{Fields, device_type};

use crate::manufacturer::{TRANSFER_BUFFER, personality};
use crate::personality::Definition;
use crate::{Personality, communication, dictionaries, lost_events};
use canopen::dictionary::{self, Object};

/// The table: everything there is to say about every object, sorted.
pub static OBJECTS: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);

/// The type of the encoder that the parameters describe by default.
pub(crate) const DEFAULT_TYPE: u8 = 5;

/// The device profile.
pub(crate) static PROFILE: [Object; dictionary::count(profile::PARTS)] = dictionary::gather(profile::PARTS);

const PARTS: &[&[Object]] = &[
    &[communication::device_type(device_type(DEFAULT_TYPE) as i64), communication::ERROR_REGISTER],
    communication::ERRORS_AND_SYNC,
    &[communication::device_name("STM32F4 encoder")],
    communication::SERVICES,
    &communication::error_behaviour(0),
    &communication::RPDOS,
    communication::tpdos(&pdos::TPDOS).as_flattened(),
    communication::tpdo_mappings(&pdos::TPDOS).as_flattened(),
    communication::START_UP,
    &[personality(Personality::Encoder)],
    lost_events::OBJECTS,
    SENSORS,
    &[TRANSFER_BUFFER],
    &PROFILE,
];

/// Bytes of the image of all values.
pub(crate) const IMAGE_SIZE: usize = dictionary::image_size(&OBJECTS);

static FIELDS: Fields = Fields::new(dictionaries::ENCODER, 0x1000);

pub(crate) static DEFINITION: Definition = Definition {
    dictionary: dictionaries::ENCODER,
    flags: None,
    pressure: None,
    encoder: Some(&FIELDS),
    lift: None,
};

#[cfg(test)]
mod tests;
