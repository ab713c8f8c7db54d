//! What the lift devices mean on the bus: their objects, and how measured values and parameters come in and out of them.
//!
//! The pre-defined PDOs (CiA 417-3-1), the objects of the application profile (6000h to 64FFh), and those of the
//! manufacturer that they need (21xxh to 23xxh).

mod manufacturer;
pub mod pdos;
mod profile;
mod rules;
mod sensors;
mod values;

pub use values::Fields;

use canopen::dictionary::{self, Dictionary, Entry, Object};
use canopen::sdo::Abort;

use super::panel::Lamp;
use super::{Lift, Parameters, Snapshot};
use crate::board::{DIGITAL_OUTPUTS, Outputs};
use crate::communication::{device_name, device_type, error_behaviour};
use crate::fault::Fault;
use crate::pressure;
use crate::profile::Profile;

static PROFILE: [Object; dictionary::count(profile::PARTS)] = dictionary::gather(profile::PARTS);

/// Other devices of the lift do what its PDOs say: a fault is in them, so it must not end them.
const NO_CHANGE: i64 = 1;

/// The rows of the lift devices, but for those that all devices have.
pub const ROWS: &[&[Object]] = &[
    &[device_type(values::PROFILE as i64)],
    &[device_name("STM32F4 lift unit")],
    &error_behaviour(NO_CHANGE),
    &pdos::ROWS,
    sensors::OBJECTS,
    pressure::objects::CALIBRATION,
    manufacturer::OBJECTS,
    &PROFILE,
];

/// Where the values are in the image of that device.
#[must_use]
pub const fn fields(dictionary: &Dictionary) -> Fields {
    Fields::new(dictionary)
}

/// Every fault that a lift device finds is one of the sensors that it shares with the other profiles.
pub const FAULTS: &[Fault] = &[];

/// Whether a write to this object is decided on here.
#[must_use]
pub const fn handles(index: u16, sub: u8) -> bool {
    rules::Rule::of(index, sub).is_some()
}

/// The protocol half of the lift devices.
#[derive(Debug)]
pub struct Objects {
    fields: &'static Fields,
    lamps: [Lamp; DIGITAL_OUTPUTS],
}

impl Profile for Objects {
    type Chain = Lift;
    type Fields = Fields;

    fn new(fields: &'static Fields) -> Objects {
        Objects { fields, lamps: [Lamp::default(); DIGITAL_OUTPUTS] }
    }

    fn initialise(&mut self, image: &mut [u8]) {
        self.fields.initialise(image);
    }

    fn parameters(&self, image: &[u8]) -> Parameters {
        self.fields.parameters(image)
    }

    fn publish(&self, snapshot: &Snapshot, image: &mut [u8]) {
        self.fields.publish(snapshot, image);
    }

    fn handles(&self, index: u16, sub: u8) -> bool {
        handles(index, sub)
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        self.fields.write(entry, bytes, image)
    }

    /// A preset is kept, as that of CiA 406 is.
    fn stores(&self, index: u16, sub: u8) -> bool {
        index == 0x6382 && sub > 0
    }

    /// The load measuring unit is on the pressure input, the position units are on those of the encoder.
    fn faults(snapshot: &Snapshot, each: &mut impl FnMut(&'static Fault, bool)) {
        each(&pressure::objects::SENSOR_BREAK, snapshot.load.is_broken);
        snapshot.position.conditions.faults(each);
    }

    fn received(&mut self, image: &mut [u8]) {
        self.fields.follow_output(&mut self.lamps, image);
    }

    fn outputs(&self, image: &[u8]) -> Outputs {
        Outputs { digital: self.fields.lit(image) }
    }
}

#[cfg(test)]
mod tests;
