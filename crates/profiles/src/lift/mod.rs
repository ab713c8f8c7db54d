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
