//! What is there besides the bus: the shaft with the car, its doors, who is in it and who presses a button.

use canopen::Instant;
use profiles::board::{RawEncoder, RawSample};

use host_tests::bench;

/// Marks on the tape along the shaft, in mm.
const TAPE: f64 = 0.1;

/// The world.
#[derive(Debug, Default)]
pub(crate) struct World {
    /// Where the car is, in mm above the bottom of the shaft.
    pub(crate) car: f64,
    /// Who and what is in it, in kg.
    pub(crate) load: f64,
    /// How far each door is open, in mm.
    pub(crate) doors: [f64; 2],
    /// Somebody stands in the door.
    pub(crate) is_blocked: [bool; 2],
    /// Somebody presses the button in the car.
    pub(crate) is_pressed: bool,
    /// When the position unit has measured, and where the car was.
    pub(crate) measured: Vec<(Instant, f64)>,
}

impl World {
    /// What the position sensor reads of a tape in the shaft.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub(crate) fn tape(&self) -> RawEncoder {
        let counter = (self.car / TAPE).floor() as i64 as u16;
        RawEncoder { counter, ..RawEncoder::default() }
    }

    /// What the input for the pressure in the cylinder reads.
    /// 2 bar carry the empty car, 1 bar more 200 kg.
    pub(crate) fn pressure(&self) -> RawSample {
        bench::raw(2.0e5 + self.load * 500.0, 298.15)
    }
}
