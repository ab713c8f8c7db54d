//! The LSS master (CiA 305), with the messages of crate `canopen`.

mod error;
mod fastscan;
mod master;

pub use error::Error;
pub use master::{Master, Selection};
