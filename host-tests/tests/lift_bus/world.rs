//! The world around the bus: the shaft with the car, its doors, its load, and the button.

use canopen::Instant;
use profiles::board::{RawEncoder, RawSample};

use host_tests::bench;

/// Marks on the tape along the shaft, in mm.
const TAPE: f64 = 0.1;

/// The state of the world.
#[derive(Debug, Default)]
pub(crate) struct World {
    /// Position of the car, in mm above the bottom of the shaft.
    pub(crate) car: f64,
    /// Load of the car, in kg.
    pub(crate) load: f64,
    /// Opening of each door, in mm.
    pub(crate) doors: [f64; 2],
    /// Whether a person stands in each door.
    pub(crate) is_blocked: [bool; 2],
    /// Whether the button in the car is pressed.
    pub(crate) is_pressed: bool,
    /// The instants of the position measurements, with the position of the car.
    pub(crate) measured: Vec<(Instant, f64)>,
}

impl World {
    /// Reading of the position sensor at a tape in the shaft.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub(crate) fn tape(&self) -> RawEncoder {
        let counter = (self.car / TAPE).floor() as i64 as u16;
        RawEncoder { counter, ..RawEncoder::default() }
    }

    /// Reading of the input for the pressure in the cylinder. The empty car needs 2 bar, and every 200 kg another bar.
    pub(crate) fn pressure(&self) -> RawSample {
        bench::raw(2.0e5 + self.load * 500.0, 298.15)
    }
}
