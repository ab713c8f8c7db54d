//! What the encoder means on the bus: its objects, and how measured values and parameters come in and out of them.
//!
//! The objects of the device profile (CiA 406, 6000h to 67FFh) and those of the manufacturer that it needs (21xxh).

mod faults;
mod manufacturer;
mod pdos;
mod profile;
mod rules;
mod sensors;
mod values;

pub use faults::FAULTS;
pub(crate) use manufacturer::SENSORS;
pub(crate) use pdos::{BY_EVENT, BY_SYNC};
pub(crate) use sensors::Sensors;
pub use values::Fields;
pub(crate) use values::device_type;

use canopen::dictionary::{self, Dictionary, Entry, Object};
use canopen::sdo::Abort;

use super::{Encoder, Parameters, Snapshot};
use crate::communication::{self, RPDOS, device_name, error_behaviour, tpdo_mappings, tpdos};
use crate::fault::Fault;
use crate::profile::Profile;

/// The type of the encoder that the parameters describe by default.
pub(crate) const DEFAULT_TYPE: u8 = 5;

/// The device profile.
pub(crate) static PROFILE: [Object; dictionary::count(profile::PARTS)] = dictionary::gather(profile::PARTS);

/// The rows of the encoder as a device of its own, but for those that all devices have.
pub const ROWS: &[&[Object]] = &[
    &[communication::device_type(device_type(DEFAULT_TYPE) as i64)],
    &[device_name("STM32F4 encoder")],
    &error_behaviour(0),
    &RPDOS,
    tpdos(&pdos::TPDOS).as_flattened(),
    tpdo_mappings(&pdos::TPDOS).as_flattened(),
    SENSORS,
    &PROFILE,
];

/// Where the values are in the image of that device.
#[must_use]
pub const fn fields(dictionary: &Dictionary) -> Fields {
    Fields::new(dictionary, 0x1000)
}

/// Whether a write to this object is decided on here.
#[must_use]
pub const fn handles(index: u16, sub: u8) -> bool {
    rules::Rule::of(index, sub).is_some()
}

/// The protocol half of the encoder.
#[derive(Debug)]
pub struct Objects {
    fields: &'static Fields,
}

impl Profile for Objects {
    type Chain = Encoder;
    type Fields = Fields;

    fn new(fields: &'static Fields) -> Objects {
        Objects { fields }
    }

    fn initialise(&mut self, image: &mut [u8]) {
        self.fields.initialise(image);
    }

    fn parameters(&self, image: &[u8]) -> Parameters {
        self.fields.parameters(image)
    }

    fn publish(&mut self, snapshot: &Snapshot, image: &mut [u8]) {
        self.fields.publish(snapshot, image);
    }

    fn handles(&self, index: u16, sub: u8) -> bool {
        handles(index, sub)
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        self.fields.write(entry, bytes, image)
    }

    fn faults(snapshot: &Snapshot, each: &mut impl FnMut(&'static Fault, bool)) {
        snapshot.conditions.faults(each);
    }
}

#[cfg(test)]
mod tests;
