//! State of the backup SRAM's battery, as found at a start. The voltage of the battery is not measured.

use crate::kept::Found;
use crate::reset_cause::ResetCause;

/// State of the battery at a start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Battery {
    /// The main supply was never off, so the battery is not tested.
    #[default]
    Unknown,
    /// The main supply was off, and the battery has kept the memory.
    Holds,
    /// The main supply was off, and the memory was lost: there is no battery, the battery is empty, or the board is
    /// new.
    Lost,
}

impl Battery {
    /// The state that follows from the cause of the reset and the content of the memory.
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
