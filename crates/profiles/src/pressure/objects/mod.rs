//! Objects of the transmitter, and the transfer of measured values and parameters between them and the measurement.

pub(crate) mod calibration;
mod device_profile;
mod faults;
mod functions;
mod manufacturer;
mod pdos;
mod rules;
mod values;

pub(crate) use calibration::{CALIBRATION, Places};
pub(crate) use device_profile::{INTEGER, REAL};
pub use faults::FAULTS;
pub(crate) use faults::SENSOR_BREAK;
use functions::States;
pub(crate) use functions::{ALARM_BLOCK, EXTREMES};
pub(crate) use manufacturer::{STATUS_AND_USER, STATUS_REGISTER};
pub use values::Fields;

use canopen::dictionary::{self, Dictionary, Entry, Group, Groups, Object};
use canopen::sdo::Abort;

use super::{Parameters, Snapshot, Transmitter};
use crate::communication::{device_name, device_type, error_behaviour};
use crate::fault::{Fault, Flags};
use crate::older_samples::OlderSamples;
use crate::profile::Profile;

/// Device type: CiA 404, two analogue input blocks.
pub(crate) const DEVICE_TYPE: i64 = 0x0002_0194;

static PDOS: [Object; dictionary::count(pdos::PARTS)] = dictionary::gather(pdos::PARTS);

/// The rows of a stand-alone transmitter, without the rows that all devices have.
pub const ROWS: &[&[Object]] = &[
    &[device_type(DEVICE_TYPE)],
    STATUS_REGISTER,
    &[device_name("STM32F4 pressure transmitter")],
    &error_behaviour(0),
    &PDOS,
    CALIBRATION,
    EXTREMES,
    STATUS_AND_USER,
    REAL,
    ALARM_BLOCK,
    INTEGER,
];

/// The places of the values in the image of that device.
#[must_use]
pub const fn fields(dictionary: &Dictionary) -> Fields {
    Fields::new(dictionary, 0)
}

/// Whether one of the transmitter's rules decides on a write to this object.
#[must_use]
pub const fn handles(index: u16, sub: u8) -> bool {
    handles_shifted(index, sub, 0)
}

/// Like [`handles`], for a device in which `shift` is added to the indexes of the device profile.
pub(crate) const fn handles_shifted(index: u16, sub: u8, shift: u16) -> bool {
    rules::Rule::shifted(index, sub, shift).is_some()
}

/// The protocol half of the transmitter.
#[derive(Debug)]
pub struct Objects {
    fields: &'static Fields,
    /// The process value of each channel without its offset, from an intact sensor.
    measured: [Option<f32>; 2],
    /// Samples from before the last write to a parameter of the process values.
    older: OlderSamples,
    states: States,
}

impl Profile for Objects {
    type Chain = Transmitter;
    type Fields = Fields;

    /// Bit 0 is set for every fault. The other bits are always 0 in a transmitter (CMP 8271, object 1001h).
    const REGISTER_BITS: u8 = 1;

    fn new(fields: &'static Fields) -> Objects {
        Objects { fields, measured: [None; 2], older: OlderSamples::NONE, states: States::NEW }
    }

    fn initialise(&mut self, image: &mut [u8], defaults: Groups) {
        if defaults.contains(Group::Application) {
            self.fields.default_spans(image);
        }
    }

    fn parameters(&self, image: &[u8]) -> Parameters {
        self.fields.parameters(image)
    }

    fn publish(&mut self, snapshot: &Snapshot, image: &mut [u8]) {
        let measured = [snapshot.pressure.measured, snapshot.temperature.measured];
        self.measured = if self.older.are_left() { [None; 2] } else { measured };
        self.older.take();
        self.fields.publish(snapshot, image);
        let values = [&snapshot.pressure, &snapshot.temperature];
        self.fields.functions.follow(values, &mut self.states, image);
    }

    fn written(&mut self, entry: &Entry, image: &mut [u8]) {
        let index = entry.index();
        let index = if index < 0x6000 { index } else { index.wrapping_sub(self.fields.shift) };
        if matches!(index, 0x6110..=0x6123 | 0x6126..=0x6131 | 0x61A0..=0x61A1 | 0x2200..=0x2202) {
            (self.measured, self.older) = ([None; 2], OlderSamples::BEGIN);
        }
        let value = entry.field().u8(image);
        self.states.written(index, entry.sub(), value);
    }

    fn is_quiet(&self, tpdo: usize, place: usize, image: &[u8]) -> bool {
        self.fields.is_quiet(&self.states, tpdo, place, image)
    }

    fn sent(&mut self, tpdo: usize, image: &[u8]) {
        self.fields.sent(&mut self.states, tpdo, image);
    }

    fn handles(&self, index: u16, sub: u8) -> bool {
        handles_shifted(index, sub, self.fields.shift)
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        self.fields.write(entry, bytes, self.measured, image)
    }

    fn faults(snapshot: &Snapshot, each: &mut impl FnMut(&'static Fault, bool)) {
        snapshot.conditions.faults(each);
    }

    fn show_flags(&self, flags: Flags, image: &mut [u8]) {
        self.fields.flags.show(flags, image);
    }
}
