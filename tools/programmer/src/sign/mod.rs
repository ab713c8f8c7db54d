//! Signing keys and signed images for the field update: the functions of `cargo xtask sign`, for tests and other tools
//! as well.
//!
//! The crate `update` defines the format of an image; this crate adds the secret half.

pub mod code;
pub mod image;
pub mod key;
pub mod key_list;
pub mod product;
