//! Signing keys and signed images for the field update: what `cargo xtask sign` does, for tests and other tools as well.
//!
//! The format of an image is that of crate `update`; this crate adds the secret half.

pub mod code;
pub mod image;
pub mod key;
pub mod product;
