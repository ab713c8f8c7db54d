//! The encoder: its part of a dictionary, and how measured values and parameters come in and out of it.
//!
//! The objects of the device profile (CiA 406, 6000h to 67FFh) and those of the manufacturer that it needs (21xxh).

mod manufacturer;
mod profile;
mod rules;
mod values;

pub(crate) use manufacturer::SENSORS;
pub use rules::CYCLIC_TIMER;
pub use values::Fields;

use canopen::dictionary::{self, Dictionary, Entry, Object};
use canopen::sdo::Abort;
use profiles::encoder::{Parameters, Snapshot};

/// The table: everything there is to say about every object, sorted.
pub static OBJECTS: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);

const PARTS: &[&[Object]] = &[SENSORS, &PROFILE];
static PROFILE: [Object; dictionary::count(profile::PARTS)] = dictionary::gather(profile::PARTS);
const ENTRIES: [Entry; OBJECTS.len()] = dictionary::compile(&OBJECTS);
const DEFAULTS: [u8; IMAGE_SIZE] = dictionary::default_image(&OBJECTS);
const _: () = dictionary::check(&OBJECTS);

/// Bytes of the image of all values.
pub const IMAGE_SIZE: usize = dictionary::image_size(&OBJECTS);

/// The dictionary as the node runs it.
pub const DICTIONARY: Dictionary = Dictionary::new(&ENTRIES, &DEFAULTS);

/// Where the values of [`DICTIONARY`] are. Another dictionary that has the encoder's objects has its own.
pub static FIELDS: Fields = Fields::new(&DICTIONARY);

/// Takes a snapshot into the image.
pub fn publish(snapshot: &Snapshot, image: &mut [u8]) {
    FIELDS.publish(snapshot, image);
}

/// The parameters in the image.
#[must_use]
pub fn parameters(image: &[u8]) -> Parameters {
    FIELDS.parameters(image)
}

/// Decides on a write to an object with one of the encoder's rules.
///
/// # Errors
/// The reason to refuse it.
pub fn write(rule: u8, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
    FIELDS.write(rule, entry, bytes, image)
}

#[cfg(test)]
mod tests;
