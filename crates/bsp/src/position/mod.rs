//! The inputs of the encoders: incremental and SSI.

pub mod ssi_word;

#[cfg(target_os = "none")]
pub(crate) mod encoder;
#[cfg(target_os = "none")]
pub(crate) mod ssi;
#[cfg(target_os = "none")]
pub(crate) mod stream;
