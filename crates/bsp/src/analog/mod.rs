//! The analogue inputs: conversions by DMA, and their averages.

pub mod chip_thermometer;
pub mod oversampling;
pub mod step;

#[cfg(target_os = "none")]
pub(crate) mod sampling;
