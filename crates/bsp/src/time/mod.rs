//! The time of the node, by a timer whose counter is extended.

pub mod extension;

#[cfg(target_os = "none")]
pub(crate) mod time_base;
