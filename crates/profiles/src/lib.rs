//! The profiles of the node: the measurements, and their objects on the bus.
//!
//! A profile is a folder with all of its parts: its rows, its arithmetic, and one implementation of
//! [`profile::Profile`] and [`profile::Chain`]. This file has the only list of the profiles. The crate uses no
//! hardware, clock or bus.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]
// Nothing that comes from the bus or from the flash may panic or index out of range.
#![cfg_attr(
    not(test),
    warn(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

pub mod board;
pub mod communication;
pub mod fault;
mod last_sent;
mod list;
mod older_samples;
pub mod pair;
pub mod product;
pub mod profile;
pub mod table;

pub mod combined;
pub mod encoder;
pub mod lift;
pub mod pressure;

pub use older_samples::OlderSamples;

personalities! {
    Pressure => pressure, "pressure.eds", "Pressure and temperature transmitter, CiA 404";
    Encoder => encoder, "encoder.eds", "Encoder, CiA 406";
    Combined => combined, "combined.eds", "Encoder and transmitter in one, CiA 406 and CiA 404";
    Lift => lift, "lift.eds", "Car position, load measuring and panel units of a lift, CiA 417";
}

impl Personality {
    /// Product code of object 1018h:2.
    #[must_use]
    pub const fn product_code(self) -> u32 {
        product::code(self.number())
    }
}

#[cfg(test)]
mod tests;
