//! The whole encoder, from the readings of the hardware to the snapshot.

mod bench;
mod bits;
mod commissioning;
mod input;
mod motion;
mod parameters;
mod power;
mod preset;
mod random;
mod supervision;
