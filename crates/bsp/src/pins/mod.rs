//! Digital inputs and outputs: buttons, lamps, indicators, and pins without a use.

pub mod debounce;

#[cfg(target_os = "none")]
pub(crate) mod digital;
#[cfg(target_os = "none")]
pub(crate) mod gpio;
#[cfg(target_os = "none")]
pub(crate) mod idle_pins;
#[cfg(target_os = "none")]
pub mod led;
