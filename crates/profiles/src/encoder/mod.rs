//! Encoders according to CiA 406: from the readings of the hardware to position, speed, cams and work area.
//!
//! ```text
//! timer count, index ─┐
//!                     ├─ Input ─ Tracker ─ ShaftPosition ─ Position (Scale, offset) ─ 6004h ─┬─ CamChannel 6300h
//! SSI frame ── Format ┘             │                                                        └─ area 6400h
//!                                   └─ Speedometer ─ 6030h
//! ```
//!
//! [`Encoder`] has two of these chains and their common part: alarms, warnings, operating time.
//!
//! # Cost of a sample
//!
//! Everything that depends on parameters alone is computed when a parameter changes, not at every sample (1 kHz). A
//! sample has no 64-bit division: units within a turn come from a multiplication by a fraction, turns are added one by
//! one ([`Position`]), cams compare with prepared windows, and the speed needs one division in single precision.
//!
//! # Interpretation of CiA 406
//!
//! Where the text of CiA 406 v3.0 leaves something open, the interpretation is given here; the code refers to this
//! list.
//!
//! * 6000h bit 3 is printed "reward": read as reverse, as in 6500h. Reserved bits are refused, and so is a direction
//!   bit that applies to no sensor. Bit 1 of 6500h says that the diagnostic is supported, not that it runs.
//! * 6001h and 6002h take all of UNSIGNED32 but 0, also beyond the resolution of the sensor (6501h, 6502h). The
//!   position repeats after 6002h whatever the ratio of 6002h to 6001h is, since turns are counted without end.
//! * A preset must be below 6002h; a higher one is refused. A change of the units sets the offset to 0; a change of the
//!   direction keeps the position, and the offset follows ([`Position::rescale`]).
//! * 6010h and 6020h are INTEGER32 (v3.1), 6003h and 6004h UNSIGNED32: the same 32 bits. A limit of a cam or of the work
//!   area below zero is a position at the end of the range.
//! * Both channels are scaled by the same 6000h to 6002h. 6005h applies to linear encoders, whatever bit 2 of 6000h is:
//!   without the scaling function, 6002h is replaced by all positions that the sensor distinguishes.
//! * Cam limits in the wrong order are swapped. A disabled cam reads 0 whatever its polarity. Hysteresis moves the
//!   points where a cam goes off outwards; for a cam that was off, the limits alone decide ([`Cam`]).
//! * 6400h bit 0 is set when a limit of 650Ah is reached. A limit at either end of INTEGER32, the default, counts as no
//!   limit. The limits have no channel: they apply to both.
//! * An alarm stays until its cause has gone and it is acknowledged, through the manufacturer-specific object 2109h.
//! * 6502h cannot hold 65 536, and 6501h cannot hold 2^32.
//! * 1000h has type 10 when two channels are used, else the type of the one sensor.

mod area;
mod cam;
mod chain;
mod channel;
mod commissioning;
mod fraction;
mod implausible;
mod input;
mod parameters;
mod position;
mod reference;
mod retained_state;
mod scale;
mod sensor;
mod speed;
mod ssi;
mod supervision;
mod tracker;
mod trust;

pub mod objects;

pub use area::{Area, Module, OUT_OF_RANGE, OVERFLOW, UNDERFLOW, area_state};
pub use cam::{Cam, CamChannel, Cams};
pub use chain::{Encoder, Snapshot};
pub use channel::ChannelValues;
pub use commissioning::Progress;
pub use input::{
    SENSOR_ALARM, SENSOR_HELD, SENSOR_IMPLAUSIBLE, SENSOR_INDEX, SENSOR_NO_SIGNAL, SENSOR_PARITY,
    SENSOR_POSITION_ERROR, SENSOR_TOO_FAST, SENSOR_UNREFERENCED,
};
pub use objects::{FAULTS, Objects, ROWS, fields, handles};
pub use parameters::{
    AUTOMATIC, CODE_SEQUENCE, COMMISSIONING, ChannelParameters, Command, DIRECTION, HIGHEST_RATE,
    HIGHEST_SPEED, LongSpeed, Parameters, SCALING,
};
pub use position::Position;
pub use retained_state::{OperatingTime, PositionRecord, RetainedChannel, RetainedState, Start};
pub use scale::{Native, Scale, Settings};
pub use sensor::{Sensor, SensorType};
pub use speed::{STANDSTILL, Speedometer, speed_value};
pub use ssi::{Coding, Fault, Format, Parity, Reading};
pub use supervision::{
    ALARM_COMMISSIONING, ALARM_POSITION, Conditions, Limits, SUPPORTED_ALARMS, SUPPORTED_WARNINGS,
    WARNING_BATTERY, WARNING_FREQUENCY, WARNING_OPERATING_TIME, WARNING_REFERENCE, WARNING_SPEED,
    WARNING_WATCHDOG,
};
pub use tracker::{ShaftPosition, Tracker};
