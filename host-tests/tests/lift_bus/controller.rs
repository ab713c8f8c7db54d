//! The call controller: accepts a call, closes the doors, drives, opens the doors. It knows only the values that the
//! bus carries.

use profiles::lift::load::OVERLOAD;

use crate::car::{CLOSE, OPEN, PROFILE_VELOCITY, RUN};
use crate::device::{Behaviour, Values};
use crate::world::World;

/// Positions of the landings in measuring steps of 1 mm.
pub(crate) const LANDINGS: [u32; 5] = [10_000, 12_500, 15_000, 17_500, 20_000];
/// Speed of the car in mm/s.
pub(crate) const FAST: i32 = 2500;
const SLOW: i32 = 30;
/// A deceleration below the limit of the drive, in mm/s2, so that the car reaches a landing slowly.
const DECELERATION: f64 = 1500.0;

/// The words of the panel's calls and of its lamp; the installer defines their meaning.
pub(crate) const fn call(landing: u8) -> u64 {
    0x0100_0000_00CA | (landing as u64) << 24
}
pub(crate) const LAMP_ON: u64 = 0x0101_0000_00AC;
pub(crate) const LAMP_OFF: u64 = 0x0100_0000_00AC;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Waiting,
    Closing,
    Driving,
    Stopping,
}

/// The controller.
#[derive(Default)]
pub(crate) struct Controller {
    state: State,
    /// The landing to drive to.
    target: u32,
    last_input: u64,
}

impl Behaviour for Controller {
    fn tick(&mut self, values: &mut Values, _: &mut World) {
        self.take_call(values);
        let is_overload = values.get(0x6482, 1) & u64::from(OVERLOAD) != 0;
        let is_blocked = (1..=2).any(|door| values.get(0x6310, door) != 0);
        let all_doors = |status| (1..=2).all(|door| values.get(0x6301, door) == status);
        self.state = match self.state {
            State::Waiting if self.target != 0 && all_doors(OPEN) && !is_overload && !is_blocked => {
                State::Closing
            }
            State::Closing if is_overload || is_blocked => State::Waiting,
            State::Closing if all_doors(CLOSE) => State::Driving,
            State::Driving if self.velocity(values) == 0 => State::Stopping,
            State::Stopping if values.get(0x6401, 0) == 0 => self.arrive(),
            state => state,
        };
        self.command(values);
    }
}

impl Controller {
    fn take_call(&mut self, values: &Values) {
        let input = values.get(0x6010, 0);
        if input != core::mem::replace(&mut self.last_input, input) {
            let called = (0..).zip(LANDINGS).find(|(landing, _)| call(*landing) == input);
            self.target = called.map_or(self.target, |(_, position)| position);
        }
    }

    fn arrive(&mut self) -> State {
        self.target = 0;
        State::Waiting
    }

    /// The highest velocity that still lets the car stop at the landing, in mm/s; 0 at the landing.
    #[allow(clippy::cast_possible_truncation)]
    fn velocity(&self, values: &Values) -> i32 {
        let way = i64::from(self.target) - values.get(0x6383, 1).cast_signed();
        if way == 0 {
            return 0;
        }
        let way = way as f64;
        let fastest = (2.0 * DECELERATION * way.abs()).sqrt() as i32;
        fastest.clamp(SLOW, FAST) * way.signum() as i32
    }

    fn command(&self, values: &mut Values) {
        let door = if self.state == State::Waiting { OPEN } else { CLOSE };
        (1..=4).for_each(|number| values.set(0x6300, number, door));
        let velocity = if self.state == State::Driving { self.velocity(values) } else { 0 };
        values.set(0x6400, 0, if self.state == State::Driving { RUN } else { 0 });
        values.set(0x6403, 0, PROFILE_VELOCITY);
        values.set_signed(0x6430, 0, velocity);
        values.set(0x6011, 0, if self.target == 0 { LAMP_OFF } else { LAMP_ON });
    }
}
