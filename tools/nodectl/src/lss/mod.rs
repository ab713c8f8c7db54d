//! The LSS master of crate `canopen` on an open bus (CiA 305).

mod error;
mod master;

pub use canopen::client::lss::Options;
pub use error::Error;
pub use master::{Master, Selection};
