//! Objects of the lift devices, and the transfer of measured values and parameters between them and the measurement.
//!
//! The pre-defined PDOs (CiA 417-3-1), the objects of the application profile (6000h to 64FFh), and the
//! manufacturer-specific objects that they need (21xxh to 23xxh).

mod application_profile;
mod choice;
mod manufacturer;
mod panel;
pub mod pdos;
mod rules;
mod sensors;
mod values;

pub use choice::UNKNOWN_CHOICES;
pub use manufacturer::SWITCHED_OFF;
pub use values::Fields;

use canopen::dictionary::{self, Dictionary, Entry, Groups, Object};
use canopen::sdo::{Abort, Multiplexer};

use super::devices::{Devices, PROFILE as NUMBER};
use super::panel::Calls;
use super::{Lift, Parameters, Snapshot};
use crate::board::Outputs;
use crate::communication::{device_name, device_type, error_behaviour};
use crate::fault::Fault;
use crate::older_samples::OlderSamples;
use crate::pressure;
use crate::profile::Profile;

static PROFILE: [Object; dictionary::count(application_profile::PARTS)] =
    dictionary::gather(application_profile::PARTS);

/// Error behaviour: no change of the NMT state. Other devices of the lift depend on the PDOs, which also report the
/// fault, so a fault must not stop them.
const NO_CHANGE: i64 = 1;

/// The rows of the lift devices, without the rows that all devices have.
pub const ROWS: &[&[Object]] = &[
    &[device_type(NUMBER as i64)],
    &[device_name("STM32F4 lift unit")],
    &error_behaviour(NO_CHANGE),
    &pdos::ROWS,
    sensors::OBJECTS,
    pressure::objects::CALIBRATION,
    manufacturer::OBJECTS,
    &PROFILE,
];

/// The places of the values in the image of that device.
#[must_use]
pub const fn fields(dictionary: &Dictionary) -> Fields {
    Fields::new(dictionary)
}

/// None: every fault of a lift device is a fault of a sensor that other profiles have too.
pub const FAULTS: &[Fault] = &[];

/// Whether one of the lift's rules decides on a write to this object.
#[must_use]
pub const fn handles(index: u16, sub: u8) -> bool {
    rules::Rule::of(index, sub).is_some()
}

/// The protocol half of the lift devices.
#[derive(Debug)]
pub struct Objects {
    fields: &'static Fields,
    calls: Calls,
    lamps: panel::LampStates,
    /// Samples from before the last write to a parameter of the positions, and to one of the load.
    older_positions: OlderSamples,
    older_loads: OlderSamples,
}

/// TPDO of the virtual inputs; `OUTPUTS` is the RPDO of the virtual outputs.
const INPUTS: u16 = 130;
const OUTPUTS: u16 = 257;
/// The RPDO that receives the multiplexed PDOs of all nodes that have no RPDO of their own.
const MULTIPLEXED: u16 = 2;

impl Profile for Objects {
    type Chain = Lift;
    type Fields = Fields;

    fn new(fields: &'static Fields) -> Objects {
        Objects {
            fields,
            calls: Calls::default(),
            lamps: panel::LampStates::default(),
            older_positions: OlderSamples::NONE,
            older_loads: OlderSamples::NONE,
        }
    }

    fn initialise(&mut self, image: &mut [u8], _defaults: Groups) {
        self.fields.initialise(image);
    }

    fn parameters(&self, image: &[u8]) -> Parameters {
        self.fields.parameters(image)
    }

    fn publish(&mut self, snapshot: &Snapshot, image: &mut [u8]) {
        self.fields.publish(snapshot, image);
        self.calls.observe(snapshot.buttons);
        self.lamps.milliseconds = self.lamps.milliseconds.wrapping_add(1);
        self.older_positions.take();
        self.older_loads.take();
    }

    fn handles(&self, index: u16, sub: u8) -> bool {
        handles(index, sub)
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        let older = match entry.index() {
            0x6380 if bytes != entry.field().get(image) => self.older_positions,
            0x6382 => self.older_positions,
            0x6486 => self.older_loads,
            _ => OlderSamples::NONE,
        };
        if older.are_left() {
            return Err(Abort::DeviceState);
        }
        self.fields.write(entry, bytes, image)
    }

    /// A preset is stored, as in CiA 406.
    fn stores(&self, index: u16, sub: u8) -> bool {
        index == 0x6382 && sub > 0
    }

    /// The load measuring unit uses the pressure input, the position units use the inputs of the encoder. A virtual
    /// device that is not chosen reports no faults, because it may have no sensor.
    fn faults(snapshot: &Snapshot, each: &mut impl FnMut(&'static Fault, bool)) {
        let Snapshot { devices, load, position, .. } = snapshot;
        each(&pressure::objects::SENSOR_BREAK, devices.has(Devices::LOAD) && load.is_broken);
        let has_position = devices.has(Devices::POSITION);
        let conditions =
            if has_position { position.conditions } else { crate::encoder::Conditions::default() };
        conditions.faults(each);
    }

    fn received(&mut self, rpdo: u16, image: &mut [u8]) {
        if rpdo == OUTPUTS {
            self.follow_output(image);
        }
    }

    fn written(&mut self, entry: &Entry, image: &mut [u8]) {
        match entry.index() {
            0x2100..=0x2103 | 0x2300..=0x2302 | 0x6384 => self.older_positions = OlderSamples::BEGIN,
            0x2200..=0x2202 | 0x2310..=0x2312 => self.older_loads = OlderSamples::BEGIN,
            _ => {}
        }
        match (entry.index(), entry.sub()) {
            (0x6011, 0) => self.follow_output(image),
            // Old presses are no calls of a panel that has just been chosen.
            (0x2305, 0) => self.calls.begin(),
            (0x6120, sub @ 1..) => self.calls.ask(usize::from(sub) - 1),
            (0x2320, sub @ 1..) => self.fields.panel.replace_word(usize::from(sub - 1) / 2, image),
            (0x2322, sub @ 1..) => self.lamps.forget(usize::from(sub) - 1),
            (index @ 0x1901..=0x1981, 1) => self.fields.note_switch(index, image),
            _ => {}
        }
    }

    /// The virtual devices and their sensors decide which TPDOs exist, and what is broadcast.
    fn switches_pdos(&self, index: u16) -> bool {
        matches!(index, 0x2301 | 0x2305)
    }

    fn sends_events(&self, tpdo: u16) -> bool {
        tpdo == INPUTS
    }

    fn begin_events(&mut self, _: u16, _: &mut [u8]) {
        self.calls.begin();
    }

    fn next_event(&mut self, _: u16, image: &mut [u8]) -> bool {
        self.fields.devices(image).has(Devices::INPUT_PANEL)
            && self.fields.panel.next_call(&mut self.calls, image)
    }

    fn takes_all_nodes(&self, rpdo: u16) -> bool {
        rpdo == MULTIPLEXED
    }

    fn broadcasts(&self, at: Multiplexer, image: &[u8]) -> bool {
        self.fields.is_there(at, image)
    }

    fn outputs(&self, image: &[u8]) -> Outputs {
        Outputs { digital: self.fields.panel.lit(&self.lamps, image) }
    }
}

impl Objects {
    fn follow_output(&mut self, image: &mut [u8]) {
        let devices = self.fields.devices(image);
        if devices.has(Devices::INPUT_PANEL) {
            self.fields.panel.answer(&mut self.calls, image);
        }
        if devices.has(Devices::OUTPUT_PANEL) {
            self.fields.panel.follow_output(&mut self.lamps, image);
        }
    }
}

#[cfg(test)]
mod tests;
