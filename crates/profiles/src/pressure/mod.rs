//! The pressure and temperature channels: CiA 404, analogue input block.

mod raw;

pub use raw::{FactoryCalibration, RawSample};
