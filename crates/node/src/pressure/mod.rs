//! The pressure transmitter: its dictionary, and how measured values and parameters come in and out of it.

mod calibration;
mod manufacturer;
mod pdos;
mod profile;
mod rules;
mod values;

pub(crate) use calibration::{CALIBRATION, Places};
pub(crate) use manufacturer::STATUS_AND_USER;
pub(crate) use profile::{INTEGER, REAL};
pub(crate) use values::Fields;

use crate::manufacturer::{TRANSFER_BUFFER, personality};
use crate::personality::Definition;
use crate::{Personality, communication, dictionaries, flags, lost_events};
use canopen::dictionary::{self, Object};

/// CiA 404, two analogue input blocks.
pub(crate) const DEVICE_TYPE: i64 = 0x0002_0194;

/// The table: everything there is to say about every object, sorted.
pub static OBJECTS: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);

static PDOS: [Object; dictionary::count(pdos::PARTS)] = dictionary::gather(pdos::PARTS);
const PARTS: &[&[Object]] = &[
    &[communication::device_type(DEVICE_TYPE), communication::ERROR_REGISTER, communication::STATUS_REGISTER],
    communication::ERRORS_AND_SYNC,
    &[communication::device_name("STM32F4 pressure transmitter")],
    communication::SERVICES,
    &communication::error_behaviour(0),
    &PDOS,
    communication::START_UP,
    &[personality(Personality::Pressure)],
    lost_events::OBJECTS,
    CALIBRATION,
    &[TRANSFER_BUFFER],
    STATUS_AND_USER,
    REAL,
    INTEGER,
];

/// Bytes of the image of all values.
pub(crate) const IMAGE_SIZE: usize = dictionary::image_size(&OBJECTS);

static FLAGS: flags::Fields = flags::Fields::new(dictionaries::PRESSURE);
static FIELDS: Fields = Fields::new(dictionaries::PRESSURE, 0);

pub(crate) static DEFINITION: Definition = Definition {
    dictionary: dictionaries::PRESSURE,
    flags: Some(&FLAGS),
    pressure: Some(&FIELDS),
    encoder: None,
    lift: None,
};
