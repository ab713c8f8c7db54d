//! The position after a loss of power, restored from the battery-backed memory.

use core::mem::MaybeUninit;

use bsp::battery::Battery;
use bsp::kept::Found;
use bsp::reset_cause::ResetCause;
use node::{Measurement, Personality};
use profiles::board::{LASTING_WORDS, PowerOn, Retained};

use crate::configuration;

/// Makes the measurement in its place. Not inlined, so that the stack on which the value is made is free again
/// afterwards.
#[inline(never)]
pub(crate) fn make(
    place: &'static mut MaybeUninit<Measurement>,
    personality: Personality,
    cause: ResetCause,
    found: &Found,
    stored: Option<[u32; LASTING_WORDS]>,
) -> &'static mut Measurement {
    place.write(Measurement::new(personality, &power_on(cause, found, stored)))
}

/// Whether the battery has failed; the state of the battery is also logged.
fn battery_failed(cause: ResetCause, found: &Found) -> bool {
    let battery = Battery::after(cause, found);
    match battery {
        Battery::Unknown => {}
        Battery::Holds => defmt::info!("the battery has kept the backup SRAM"),
        Battery::Lost => {
            defmt::warn!("no battery has kept the backup SRAM: it is empty or missing, or the board is new")
        }
    }
    battery == Battery::Lost
}

/// State of the board at power-on.
///
/// An empty backup SRAM means a new board or, after a loss of power, a board with no battery or an empty one. The
/// parameter store distinguishes the two: a new board has no record of the positions.
fn power_on(cause: ResetCause, found: &Found, stored: Option<[u32; LASTING_WORDS]>) -> PowerOn {
    let retained = match found {
        Found::Nothing => Retained::Nothing,
        Found::Kept(words) => Retained::Words(*words),
        Found::Damaged => {
            defmt::error!("what was kept of the encoder is damaged");
            Retained::Damaged
        }
    };
    let battery_failed = battery_failed(cause, found);
    PowerOn { thermometer: configuration::thermometer(), retained, stored, battery_failed }
}
