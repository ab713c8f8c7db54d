//! The pressure transmitter: its dictionary, and how measured values and parameters come in and out of it.

mod manufacturer;
mod pdos;
mod profile;
mod rules;
mod values;

pub(crate) use rules::write;
pub(crate) use values::{parameters, publish};

use crate::communication;
use canopen::dictionary::{self, Dictionary, Entry, Object};

/// CiA 404, two analogue input blocks.
const DEVICE_TYPE: i64 = 0x0002_0194;

/// The table: everything there is to say about every object, sorted.
pub static OBJECTS: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);

static PDOS: [Object; dictionary::count(pdos::PARTS)] = dictionary::gather(pdos::PARTS);
const PARTS: &[&[Object]] = &[
    &[communication::device_type(DEVICE_TYPE), communication::ERROR_REGISTER, communication::STATUS_REGISTER],
    communication::ERRORS_AND_SYNC,
    &[communication::device_name("STM32F4 pressure transmitter")],
    communication::SERVICES,
    &PDOS,
    communication::START_UP,
    manufacturer::OBJECTS,
    profile::OBJECTS,
];
const ENTRIES: [Entry; OBJECTS.len()] = dictionary::compile(&OBJECTS);
const DEFAULTS: [u8; IMAGE_SIZE] = dictionary::default_image(&OBJECTS);
const _: () = dictionary::check(&OBJECTS);

/// Bytes of the image of all values.
pub(crate) const IMAGE_SIZE: usize = dictionary::image_size(&OBJECTS);

/// The dictionary as the node runs it.
pub(crate) const DICTIONARY: Dictionary = Dictionary::new(&ENTRIES, &DEFAULTS);
