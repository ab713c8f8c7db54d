//! The supply: the cause of a reset, the battery, and the backup SRAM.

pub mod backup_copies;
pub mod battery;
pub mod reset_cause;

#[cfg(target_os = "none")]
pub(crate) mod backup;
