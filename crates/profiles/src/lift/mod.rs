//! The lift application profile, CiA 417.

pub mod catalogue;
