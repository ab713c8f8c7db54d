//! The lift: its dictionary, and how measured values and parameters come in and out of it.
//!
//! The pre-defined PDOs (CiA 417-3-1), the objects of the application profile (6000h to 64FFh), and those of the
//! manufacturer that they need (21xxh to 23xxh).

mod manufacturer;
pub mod pdos;
mod profile;
mod rules;
mod sensors;
mod values;

pub(crate) use values::Fields;

use crate::manufacturer::{TRANSFER_BUFFER, personality};
use crate::personality::Definition;
use crate::pressure::CALIBRATION;
use crate::{Personality, communication, dictionaries, lost_events};
use canopen::dictionary::{self, Object};

/// The table: everything there is to say about every object, sorted.
pub static OBJECTS: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);

static PROFILE: [Object; dictionary::count(profile::PARTS)] = dictionary::gather(profile::PARTS);

/// Other devices of the lift do what its PDOs say: a fault is in them, so it must not end them.
const NO_CHANGE: i64 = 1;

const PARTS: &[&[Object]] = &[
    &[communication::device_type(values::PROFILE as i64), communication::ERROR_REGISTER],
    communication::ERRORS_AND_SYNC,
    &[communication::device_name("STM32F4 lift unit")],
    communication::SERVICES,
    &communication::error_behaviour(NO_CHANGE),
    &pdos::ROWS,
    communication::START_UP,
    &[personality(Personality::Lift)],
    lost_events::OBJECTS,
    sensors::OBJECTS,
    CALIBRATION,
    manufacturer::OBJECTS,
    &[TRANSFER_BUFFER],
    &PROFILE,
];

/// Bytes of the image of all values.
pub(crate) const IMAGE_SIZE: usize = dictionary::image_size(&OBJECTS);

static FIELDS: Fields = Fields::new(dictionaries::LIFT);

pub(crate) static DEFINITION: Definition = Definition {
    dictionary: dictionaries::LIFT,
    flags: None,
    pressure: None,
    encoder: None,
    lift: Some(&FIELDS),
};

#[cfg(test)]
mod tests;
