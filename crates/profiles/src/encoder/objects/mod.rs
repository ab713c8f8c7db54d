//! Objects of the encoder, and the transfer of measured values and parameters between them and the measurement.
//!
//! The objects of the device profile (CiA 406, 6000h to 67FFh) and the manufacturer-specific objects (21xxh) that it
//! needs.

mod device_profile;
mod faults;
mod manufacturer;
mod pdos;
mod rules;
mod sensors;
mod values;

pub use faults::FAULTS;
pub(crate) use manufacturer::SENSORS;
pub(crate) use pdos::{BY_EVENT, BY_SYNC};
pub(crate) use sensors::Sensors;
pub use values::Fields;
use values::Reports;
pub(crate) use values::device_type;

use canopen::dictionary::{self, Dictionary, Entry, Group, Groups, Object};
use canopen::sdo::{Abort, Multiplexer};

use super::{Encoder, Parameters, Snapshot};
use crate::communication::{self, RPDOS, device_name, error_behaviour, tpdo_mappings, tpdos};
use crate::fault::Fault;
use crate::older_samples::OlderSamples;
use crate::profile::Profile;

/// The encoder type that the default parameters describe.
pub(crate) const DEFAULT_TYPE: u8 = 5;

/// Objects of the device profile.
pub(crate) static PROFILE: [Object; dictionary::count(device_profile::PARTS)] =
    dictionary::gather(device_profile::PARTS);

/// The rows of a stand-alone encoder, without the rows that all devices have.
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

/// The places of the encoder's values in the image of that device.
#[must_use]
pub const fn fields(dictionary: &Dictionary) -> Fields {
    Fields::new(dictionary, 0x1000)
}

/// Whether one of the encoder's rules decides on a write to this object.
#[must_use]
pub const fn handles(index: u16, sub: u8) -> bool {
    rules::Rule::of(index, sub).is_some()
}

/// The protocol half of the encoder.
#[derive(Debug)]
pub struct Objects {
    fields: &'static Fields,
    reports: [Reports; 2],
    /// Samples from before the last write to a description of the sensors. The channels share one SSI word.
    older: OlderSamples,
}

impl Profile for Objects {
    type Chain = Encoder;
    type Fields = Fields;

    fn new(fields: &'static Fields) -> Objects {
        Objects { fields, reports: [Reports::NEW; 2], older: OlderSamples::NONE }
    }

    fn initialise(&mut self, image: &mut [u8], defaults: Groups) {
        self.fields.initialise(image, defaults.contains(Group::Communication));
    }

    fn parameters(&self, image: &[u8]) -> Parameters {
        self.fields.parameters(image)
    }

    fn publish(&mut self, snapshot: &Snapshot, image: &mut [u8]) {
        self.older.take();
        self.fields.publish(snapshot, image);
        for (channel, reports) in self.fields.channels.iter().zip(&mut self.reports) {
            channel.report(snapshot.digital, reports, image);
        }
    }

    fn is_quiet(&self, tpdo: usize, place: usize, image: &[u8]) -> bool {
        self.fields.is_quiet(&self.reports, tpdo, place, image)
    }

    // Not inlined: two personalities have an encoder.
    #[inline(never)]
    fn sent(&mut self, tpdo: usize, image: &[u8]) {
        for (channel, reports) in self.fields.channels.iter().zip(&mut self.reports) {
            reports.sent.take(tpdo, channel.position, image);
        }
    }

    fn take_preset(&mut self, _: &[u8]) -> Option<Multiplexer> {
        let (sub, reports) = (1..).zip(&mut self.reports).find(|(_, reports)| reports.has_preset)?;
        reports.has_preset = false;
        Some(Multiplexer { index: 0x6010, sub })
    }

    fn handles(&self, index: u16, sub: u8) -> bool {
        handles(index, sub)
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        match entry.index() {
            0x2100..=0x2103 => self.older = OlderSamples::BEGIN,
            0x6003 | 0x6010 if self.older.are_left() => return Err(Abort::DeviceState),
            _ => {}
        }
        self.fields.write(entry, bytes, image)
    }

    /// A preset is "calculated and stored in the encoder" (CiA 406, 7.2.4).
    fn stores(&self, index: u16, sub: u8) -> bool {
        matches!((index, sub), (0x6003, 0) | (0x6010, 1..))
    }

    fn faults(snapshot: &Snapshot, each: &mut impl FnMut(&'static Fault, bool)) {
        snapshot.conditions.faults(each);
    }
}

#[cfg(test)]
mod tests;
