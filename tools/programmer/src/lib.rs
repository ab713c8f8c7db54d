//! A board at a debug probe, and what is written into it: [`sign`] makes keys and signed images, [`flash`] composes the
//! content of the flash, [`protect`] sets the option bytes, and [`probe`] calls probe-rs.
#![forbid(unsafe_code)]

#[cfg(feature = "programs")]
pub mod flash;
pub mod probe;
#[cfg(feature = "programs")]
pub mod protect;
#[cfg(feature = "programs")]
pub mod sign;
