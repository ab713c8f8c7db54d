//! The lift application profile, CiA 417: lift 1.
//!
//! A device consists of several virtual devices: here up to four car position units ([`position`]), a load measuring
//! unit ([`load`]), and a panel with two buttons and two lamps ([`panel`]). [`catalogue`] describes the PDOs that the
//! virtual devices of a lift exchange.

pub mod catalogue;
pub mod devices;
pub mod load;
pub mod objects;
pub mod panel;
pub mod position;
pub mod word;

pub use objects::{FAULTS, Objects, ROWS, fields, handles};

use crate::board::{Inputs, PositionInputs, PowerOn, RETAINED_WORDS};
use crate::encoder::Start;
use crate::profile::Chain;
use devices::Devices;

/// All parameters of the virtual devices.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parameters {
    /// Parameters of the car position units.
    pub position: position::Parameters,
    /// Parameters of the load measuring unit.
    pub load: load::Parameters,
    /// The virtual devices of the node.
    pub devices: Devices,
}

/// Output of the virtual devices for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Output of the car position units.
    pub position: position::Snapshot,
    /// Output of the load measuring unit.
    pub load: load::Snapshot,
    /// The virtual devices of the node; the outputs of other virtual devices are ignored.
    pub devices: Devices,
    /// Which buttons are pressed.
    pub buttons: [bool; panel::BUTTONS],
}

/// All virtual devices with their state.
#[derive(Clone, Debug)]
pub struct Lift {
    position: position::PositionUnits,
    load: load::LoadUnit,
    devices: Devices,
}

impl Chain for Lift {
    type Parameters = Parameters;
    type Snapshot = Snapshot;

    // Not inlined: inlined into its caller, the code is three times as long.
    #[inline(never)]
    fn new(power_on: &PowerOn) -> Lift {
        Lift {
            position: position::PositionUnits::new(Start::of(power_on.retained, power_on.stored)),
            load: load::LoadUnit::new(power_on.thermometer, &load::Parameters::default()),
            devices: Devices::default(),
        }
    }

    fn apply(&mut self, parameters: &Parameters) {
        self.position.apply(&parameters.position);
        self.load.apply(&parameters.load);
        self.devices = parameters.devices;
    }

    // Not inlined: its caller would need the room of these values for every personality.
    #[inline(never)]
    fn update(&mut self, inputs: &Inputs, snapshot: &mut Snapshot) {
        *snapshot = Snapshot {
            position: self.position.sample(&inputs.position),
            load: self.load.sample(&inputs.analogue),
            devices: self.devices,
            buttons: inputs.digital,
        };
    }

    fn position_inputs(parameters: &Parameters) -> PositionInputs {
        parameters.position.sensors.inputs()
    }

    fn retain(&self, words: &mut [u32; RETAINED_WORDS]) -> bool {
        self.position.retain(words);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{RawEncoder, RawSample, Retained};

    /// 5 bar.
    const PRESSURE: RawSample = RawSample {
        pressure: 32_000,
        supply: 64_000,
        temperature: 0,
        reference: 0,
        thermistor: 0,
        count: 16,
    };

    fn inputs(counter: u16) -> Inputs {
        let position = RawEncoder { counter, ..RawEncoder::default() };
        Inputs { analogue: PRESSURE, position, digital: [true, false] }
    }

    fn sample(lift: &mut Lift, counter: u16) -> Snapshot {
        let mut snapshot = Snapshot::default();
        lift.update(&inputs(counter), &mut snapshot);
        snapshot
    }

    #[test]
    fn every_virtual_device_measures_with_its_own_parameters() {
        let mut parameters = Parameters::default();
        parameters.load.offset = 7.0;
        let mut lift = Lift::new(&PowerOn::default());
        lift.apply(&parameters);
        sample(&mut lift, 0);
        let snapshot = sample(&mut lift, 4096);
        assert_eq!(snapshot.position.units[0].position, 200, "a turn of 200 mm");
        assert_eq!(snapshot.load.load, 507);
        assert_eq!(snapshot.buttons, [true, false]);
    }

    #[test]
    fn the_position_outlives_a_loss_of_power() {
        let mut lift = Lift::new(&PowerOn::default());
        lift.apply(&Parameters::default());
        sample(&mut lift, 0);
        sample(&mut lift, 4096);
        let mut words = [0; RETAINED_WORDS];
        assert!(lift.retain(&mut words));
        let retained = Retained::Words(words);
        let mut lift = Lift::new(&PowerOn { retained, ..PowerOn::default() });
        lift.apply(&Parameters::default());
        assert_eq!(sample(&mut lift, 0).position.units[0].position, 200);
    }
}
