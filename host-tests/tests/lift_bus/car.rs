//! Virtual devices at the car: drive, door units, light barriers, a display. The bits of control and status words are
//! made up for the test, which is only about their transmission.

use crate::device::{Behaviour, Values};
use crate::world::World;

/// Control word of the drive: run.
pub(crate) const RUN: u64 = 0x000F;
/// Mode of operation: profile velocity.
pub(crate) const PROFILE_VELOCITY: u64 = 3;
/// Control and status words of a door.
pub(crate) const OPEN: u64 = 1;
pub(crate) const CLOSE: u64 = 2;
/// Width of a door in mm.
pub(crate) const WIDTH: f64 = 900.0;
/// Limits of the drive in mm/s per millisecond, and of the doors in mm per millisecond.
const ACCELERATION: i32 = 2;
const DOOR_SPEED: f64 = 1.5;

/// Moves the car at the commanded velocity in mm/s.
#[derive(Default)]
pub(crate) struct Drive {
    velocity: i32,
}

impl Behaviour for Drive {
    fn tick(&mut self, values: &mut Values, world: &mut World) {
        let target = if values.get(0x6400, 0) == RUN { values.signed(0x6430, 0) } else { 0 };
        self.velocity += (target - self.velocity).clamp(-ACCELERATION, ACCELERATION);
        world.car += f64::from(self.velocity) / 1000.0;
        values.set(0x6401, 0, u64::from(self.velocity != 0));
        let mode = values.get(0x6403, 0);
        values.set(0x6404, 0, mode);
        values.set_signed(0x6433, 0, self.velocity);
    }
}

/// Opens and closes one door, numbered from 1.
pub(crate) struct Door(pub(crate) u8);

impl Behaviour for Door {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn tick(&mut self, values: &mut Values, world: &mut World) {
        let width = &mut world.doors[usize::from(self.0) - 1];
        match values.get(0x6300, self.0) {
            OPEN => *width = (*width + DOOR_SPEED).min(WIDTH),
            CLOSE => *width = (*width - DOOR_SPEED).max(0.0),
            _ => (),
        }
        let status = match *width {
            WIDTH => OPEN,
            0.0 => CLOSE,
            _ => 0,
        };
        values.set(0x6301, self.0, status);
        values.set(0x6302, self.0, *width as u64);
    }
}

/// The light barrier of one door.
pub(crate) struct Barrier(pub(crate) u8);

impl Behaviour for Barrier {
    fn tick(&mut self, values: &mut Values, world: &mut World) {
        values.set(0x6310, self.0, world.is_blocked[usize::from(self.0) - 1].into());
    }
}

/// Sends a value of its own now and then.
#[derive(Default)]
pub(crate) struct Display {
    millis: u64,
}

impl Behaviour for Display {
    fn tick(&mut self, values: &mut Values, _: &mut World) {
        self.millis += 1;
        values.set(0x5000, 0, self.millis / 250);
    }
}
