//! What a start tells of the battery behind the backup SRAM. The voltage of the battery is not measured.

use crate::kept::Found;
use crate::reset_cause::ResetCause;

/// State of the battery as a start can tell it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Battery {
    /// The main supply never went: nothing can be said.
    #[default]
    Unknown,
    /// The main supply was gone, and the memory has outlived that.
    Holds,
    /// The main supply was gone, and the memory with it: there is no battery, or it is empty, or the board is new.
    Lost,
}

impl Battery {
    /// From the cause of the reset and what the memory had.
    #[must_use]
    pub fn after(cause: ResetCause, found: &Found) -> Battery {
        match found {
            _ if !cause.is_power_loss() => Battery::Unknown,
            Found::Kept(_) => Battery::Holds,
            Found::Nothing | Found::Damaged => Battery::Lost,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kept::CAPACITY;

    #[test]
    fn only_a_loss_of_power_tells_something() {
        let kept = Found::Kept([0; CAPACITY]);
        for cause in [ResetCause::PowerOn, ResetCause::BrownOut] {
            assert_eq!(Battery::after(cause, &kept), Battery::Holds);
            assert_eq!(Battery::after(cause, &Found::Nothing), Battery::Lost);
            assert_eq!(Battery::after(cause, &Found::Damaged), Battery::Lost);
        }
        for cause in [ResetCause::Software, ResetCause::IndependentWatchdog, ResetCause::Pin] {
            assert_eq!(Battery::after(cause, &kept), Battery::Unknown);
            assert_eq!(Battery::after(cause, &Found::Nothing), Battery::Unknown);
        }
    }
}
