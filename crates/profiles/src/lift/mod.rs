//! The lift application profile, CiA 417: lift 1.
//!
//! A device is several virtual devices in one: here up to four car position units ([`position`]), a load measuring unit
//! ([`load`]), and a panel with two buttons and two lamps ([`panel`]). [`catalogue`] knows what all virtual devices of a
//! lift send each other.

pub mod catalogue;
pub mod load;
pub mod panel;
pub mod position;

use crate::encoder::{Kept, RawEncoder, Start};
use crate::pressure::RawSample;

/// All parameters of the virtual devices.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parameters {
    /// Of the car position units.
    pub position: position::Parameters,
    /// Of the load measuring unit.
    pub load: load::Parameters,
}

/// What was read in one millisecond.
#[derive(Clone, Copy, Debug)]
pub struct RawLift {
    /// Position sensors.
    pub encoder: RawEncoder,
    /// Pressure input.
    pub pressure: RawSample,
    /// Which buttons are pressed, debounced.
    pub buttons: [bool; panel::BUTTONS],
}

/// What the virtual devices give for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Of the car position units.
    pub position: position::Snapshot,
    /// Of the load measuring unit.
    pub load: load::Snapshot,
    /// The button that has changed last.
    pub button: panel::Contact,
}

/// All virtual devices with their state.
#[derive(Clone, Debug, Default)]
pub struct Lift {
    position: position::PositionUnits,
    load: load::LoadUnit,
    buttons: panel::Buttons,
}

impl Lift {
    /// The devices after power-on. Positions are measured from the first parameters on.
    #[must_use]
    pub fn new(start: Start) -> Lift {
        Lift { position: position::PositionUnits::new(start), ..Lift::default() }
    }

    /// Takes over parameters, from the next sample on.
    pub fn apply(&mut self, parameters: &Parameters) {
        self.position.apply(&parameters.position);
        self.load.apply(&parameters.load);
    }

    /// Processes what was read in one millisecond.
    pub fn sample(&mut self, raw: &RawLift) -> Snapshot {
        Snapshot {
            position: self.position.sample(&raw.encoder),
            load: self.load.sample(&raw.pressure),
            button: self.buttons.sample(raw.buttons),
        }
    }

    /// What is to outlive a loss of power.
    #[must_use]
    pub fn kept(&self) -> Kept {
        self.position.kept()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pressure::FactoryCalibration;

    const FACTORY: FactoryCalibration = FactoryCalibration { ts_cal1: 940, ts_cal2: 1210, vrefint_cal: 1500 };
    /// 5 bar.
    const PRESSURE: RawSample = RawSample {
        pressure: 32_000,
        supply: 64_000,
        temperature: 0,
        vrefint: 0,
        thermistor: 0,
        count: 16,
        factory: FACTORY,
    };

    fn raw(counter: u16) -> RawLift {
        let encoder = RawEncoder { counter, ..RawEncoder::default() };
        RawLift { encoder, pressure: PRESSURE, buttons: [true, false] }
    }

    #[test]
    fn every_virtual_device_measures_with_its_own_parameters() {
        let mut parameters = Parameters::default();
        parameters.load.offset = 7.0;
        let mut lift = Lift::default();
        lift.apply(&parameters);
        lift.sample(&raw(0));
        let snapshot = lift.sample(&raw(4096));
        assert_eq!(snapshot.position.units[0].position, 200, "a turn of 200 mm");
        assert_eq!(snapshot.load.load, 507);
        assert_eq!(snapshot.button, panel::Contact { button: 0, is_pressed: true });
    }

    #[test]
    fn the_position_outlives_a_loss_of_power() {
        let mut lift = Lift::default();
        lift.apply(&Parameters::default());
        lift.sample(&raw(0));
        lift.sample(&raw(4096));
        let mut lift = Lift::new(Start::Kept(lift.kept()));
        lift.apply(&Parameters::default());
        assert_eq!(lift.sample(&raw(0)).position.units[0].position, 200);
    }
}
