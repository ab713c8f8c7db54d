//! Core and memories: what survives a reset, the start of the application, errata.

pub mod crash_record;
pub mod handover;
pub mod serial_number;
pub mod vectors;

#[cfg(target_os = "none")]
pub mod application;
#[cfg(target_os = "none")]
pub(crate) mod confinement;
#[cfg(target_os = "none")]
pub mod crash;
#[cfg(target_os = "none")]
pub(crate) mod errata;
#[cfg(target_os = "none")]
pub mod factory;
#[cfg(target_os = "none")]
pub mod memory;
#[cfg(target_os = "none")]
pub(crate) mod observations;
#[cfg(target_os = "none")]
pub mod retained;
