//! The flash: its sectors, its controller, and the parts of it that a program may change.

pub mod flash_area;
pub mod sectors;
pub mod update_layout;

#[cfg(target_os = "none")]
pub mod controller;
#[cfg(target_os = "none")]
pub(crate) mod parameter_flash;
#[cfg(target_os = "none")]
pub(crate) mod program_flash;
#[cfg(target_os = "none")]
pub(crate) mod trial_flash;
