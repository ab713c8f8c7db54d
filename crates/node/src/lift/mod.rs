//! The lift: its part of a dictionary, and how measured values and parameters come in and out of it.
//!
//! The pre-defined PDOs (CiA 417-3-1), the objects of the application profile (6000h to 64FFh), and those of the
//! manufacturer that they need (21xxh to 23xxh). What else a node has, 1000h to 1FFFh, is common to all personalities.

mod manufacturer;
pub mod pdos;
mod profile;
mod rules;
mod sensors;
mod values;

pub use values::Fields;

use crate::pressure::CALIBRATION;
use canopen::dictionary::{self, Dictionary, Entry, Object};

/// The PDO objects, sorted: 1400h to 1BFFh.
pub static PDOS: &[Object] = &pdos::ROWS;

/// All other objects, sorted: 2100h to 64FFh.
pub static OBJECTS: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);

static PARTS: &[&[Object]] = &[&sensors::OBJECTS, CALIBRATION, manufacturer::OBJECTS, &PROFILE];
static PROFILE: [Object; dictionary::count(profile::PARTS)] = dictionary::gather(profile::PARTS);

/// Both, as the smallest dictionary that a lift device can run.
static TABLE: [Object; dictionary::count(&[&pdos::ROWS, &OBJECTS])] =
    dictionary::gather(&[&pdos::ROWS, &OBJECTS]);
static ENTRIES: [Entry; TABLE.len()] = dictionary::compile(&TABLE);
static DEFAULTS: [u8; IMAGE_SIZE] = dictionary::default_image(&TABLE);
const _: () = dictionary::check(&TABLE);

/// Bytes of the image of all values.
pub const IMAGE_SIZE: usize = dictionary::image_size(&TABLE);

/// The dictionary with nothing but the lift in it.
pub static DICTIONARY: Dictionary = Dictionary::new(&ENTRIES, &DEFAULTS);

/// Where the values of [`DICTIONARY`] are. Another dictionary that has the lift's objects has its own.
pub static FIELDS: Fields = Fields::new(&DICTIONARY);

#[cfg(test)]
mod tests;
