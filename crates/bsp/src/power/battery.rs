//! State of the backup SRAM's battery, as found at a start. The voltage of the battery is not measured.

use crate::power::backup_copies::BackupState;
use crate::power::reset_cause::ResetCause;

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
    pub fn after(cause: ResetCause, found: &BackupState) -> Battery {
        match found {
            _ if !cause.is_power_loss() => Battery::Unknown,
            BackupState::Intact(_) => Battery::Holds,
            BackupState::Nothing | BackupState::Damaged => Battery::Lost,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::power::backup_copies::CAPACITY;

    #[test]
    fn a_report_is_made_after_a_loss_of_power_only() {
        let kept = BackupState::Intact([0; CAPACITY]);
        for cause in [ResetCause::PowerOn, ResetCause::BrownOut] {
            assert_eq!(Battery::after(cause, &kept), Battery::Holds);
            assert_eq!(Battery::after(cause, &BackupState::Nothing), Battery::Lost);
            assert_eq!(Battery::after(cause, &BackupState::Damaged), Battery::Lost);
        }
        for cause in [ResetCause::Software, ResetCause::IndependentWatchdog, ResetCause::Pin] {
            assert_eq!(Battery::after(cause, &kept), Battery::Unknown);
            assert_eq!(Battery::after(cause, &BackupState::Nothing), Battery::Unknown);
        }
    }
}
