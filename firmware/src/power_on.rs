//! The position after a loss of power, restored from the battery-backed memory.

use core::mem::MaybeUninit;

use bsp::power::backup_copies::BackupState;
use bsp::power::battery::Battery;
use bsp::power::reset_cause::ResetCause;
use node::{Measurement, Personality};
use profiles::board::{POSITION_RECORD_WORDS, PowerOn, Retained};

use crate::configuration;

/// Makes the measurement in its place. Not inlined, so that the stack on which the value is made is free again
/// afterwards.
#[inline(never)]
pub(crate) fn make(
    place: &'static mut MaybeUninit<Measurement>,
    personality: Personality,
    cause: ResetCause,
    backup: &BackupState,
    stored: Option<[u32; POSITION_RECORD_WORDS]>,
) -> &'static mut Measurement {
    place.write(Measurement::new(personality, &power_on(cause, backup, stored)))
}

/// Whether the battery has failed; the state of the battery is also logged.
fn battery_failed(cause: ResetCause, backup: &BackupState) -> bool {
    let battery = Battery::after(cause, backup);
    match battery {
        Battery::Unknown => {}
        Battery::Holds => defmt::info!("the battery has kept the backup SRAM"),
        Battery::Lost => {
            defmt::warn!("no battery has kept the backup SRAM: it is empty or missing, or the board is new");
        }
    }
    battery == Battery::Lost
}

/// State of the board at power-on.
///
/// An empty backup SRAM means a new board or, after a loss of power, a board with no battery or an empty one. The
/// parameter store distinguishes the two: a new board has no record of the positions.
fn power_on(
    cause: ResetCause,
    backup: &BackupState,
    stored: Option<[u32; POSITION_RECORD_WORDS]>,
) -> PowerOn {
    let retained = match backup.after(cause) {
        BackupState::Nothing => Retained::Nothing,
        BackupState::Intact(words) => Retained::Words(words),
        BackupState::Damaged => {
            defmt::error!("what was kept of the encoder is damaged");
            Retained::Damaged
        }
    };
    let battery_failed = battery_failed(cause, backup);
    PowerOn { thermometer: configuration::thermometer(), retained, stored, battery_failed }
}
