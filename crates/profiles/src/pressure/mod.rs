//! The pressure and temperature channels: CiA 404, analogue input function block.
//!
//! The calibration of the device converts converter readings to field values in Pa and K (6100h). A channel then
//! filters them (61A0h, 61A1h), scales them (6126h, 6127h), converts them to the unit and prefix of 6131h, adds the
//! offset 6124h, and gives the process value in three number formats (6130h, 7130h, 9130h) with a status (6150h).

mod calibration;
mod channel;
mod filter;
mod precise;
mod recovery;
mod thermometer;
mod transmitter;
mod unit;

pub mod objects;

pub use calibration::{Polynomial, PressureCalibration};
pub use channel::{
    Channel, ChannelParameters, ChannelValues, STATUS_ABOVE, STATUS_BELOW, STATUS_INVALID,
    STATUS_UNCOMPENSATED, Span,
};
pub use filter::Filter;
pub use objects::{FAULTS, Objects, ROWS, fields, handles};
pub use recovery::Recovery;
pub use thermometer::{TemperatureCalibration, Thermistor, Thermometer};
pub use transmitter::{Calibration, Conditions, Parameters, Snapshot, Transmitter};
pub use unit::Unit;
