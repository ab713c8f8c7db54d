//! The position through a loss of power: back from the memory that a battery keeps.

use core::mem::MaybeUninit;

use bsp::battery::Battery;
use bsp::kept::Found;
use bsp::reset_cause::ResetCause;
use node::{Measurement, Personality};
use profiles::board::{LASTING_WORDS, PowerOn, Retained};

use crate::configuration;

/// Makes the measurement in its place. Not inlined: the stack on which the value is made is free again after it.
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

/// Whether the battery has failed; what the start tells of the battery is in the log as well.
fn battery_failed(cause: ResetCause, found: &Found) -> bool {
    let battery = Battery::after(cause, found);
    match battery {
        Battery::Unknown => {}
        Battery::Holds => defmt::info!("the battery has kept the backup SRAM"),
        Battery::Lost => {
            defmt::warn!("no battery has kept the backup SRAM: it is empty or missing, or the board is new");
        }
    }
    battery == Battery::Lost
}

/// What the board knows when the power comes.
///
/// Memory without a trace of a copy is that of a new board, and after a loss of power that of one without a battery, or with
/// an empty one. The parameter store tells the two apart: a new board has no record of the positions.
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
