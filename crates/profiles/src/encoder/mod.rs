//! Encoders as CiA 406 describes them: from what the hardware reads to position, speed, cams and work area.
//!
//! ```text
//! timer count, index ─┐
//!                     ├─ Input ─ Tracker ─ Shaft ─ Position (Scale, offset) ─ 6004h ─┬─ CamChannel 6300h
//! SSI frame ── Format ┘             │                                                └─ area 6400h
//!                                   └─ Speedometer ─ 6030h
//! ```
//!
//! [`Encoder`] is two of these chains, and what is common to them: alarms, warnings, operating time.
//!
//! # What a sample costs
//!
//! At 1 kHz everything that can be computed when a parameter changes is computed then. A sample has no 64-bit division:
//! units within a turn come from a multiplication by a fraction, turns add up one by one ([`Position`]), cams compare
//! with windows that are ready, and the speed is one division in single precision.
//!
//! # Where CiA 406 is open
//!
//! Readings that are not in the text of CiA 406 v3.0 are collected here; the code refers to them.
//!
//! * 6000h bit 3 is printed "reward": reverse, as in 6500h. Bits that are reserved are refused, as is a direction bit that
//!   no sensor has. In 6500h bit 1 says that the diagnostic is supported, not that it runs.
//! * 6001h and 6002h take all of UNSIGNED32 but 0, also beyond the resolution of the sensor (6501h, 6502h). The position repeats after
//!   6002h whatever its ratio to 6001h is, since turns are counted without end.
//! * A preset is below 6002h; above, it is refused. In other units the offset is 0 again; counted the other way, the
//!   position stays and the offset follows ([`Position::rescale`]).
//! * 6010h and 6020h are INTEGER32 (v3.1), 6003h and 6004h UNSIGNED32: the same 32 bits. Limits of cams and of the work
//!   area are signed and compare with the position as an unsigned number.
//! * Both channels are scaled by the same 6000h to 6002h; 6005h is for those that are linear.
//! * Cam limits in the wrong order are swapped; a cam that is not enabled reads 0 whatever its polarity; hysteresis
//!   moves the points where a cam goes off outwards, and without history the limits alone decide ([`Cam`]).
//! * 6400h bit 0 is set when a limit of 650Ah is reached. The ends of INTEGER32, as delivered, are no limits. The limits have no channel:
//!   they hold for both.
//! * An alarm stays until it is acknowledged, for which the manufacturer's object 2109h is there, and its cause has gone.
//! * 6502h cannot hold 65 536 and 6501h not 2^32.
//! * 1000h is type 10 when two channels are used, and the type of the sensor when one is.

mod area;
mod cam;
mod chain;
mod channel;
mod commissioning;
mod fraction;
mod input;
mod kept;
mod parameters;
mod position;
mod reference;
mod scale;
mod sensor;
mod shaft;
mod speed;
mod ssi;
mod stray;
mod supervision;

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
pub use kept::{Kept, KeptChannel, Lasting, OperatingTime, Start};
pub use objects::{FAULTS, Objects, ROWS, fields, handles};
pub use parameters::{
    AUTOMATIC, CODE_SEQUENCE, COMMISSIONING, ChannelParameters, Command, DIRECTION, HIGHEST_RATE,
    HIGHEST_SPEED, Parameters, SCALING,
};
pub use position::Position;
pub use scale::{Native, Scale, Settings};
pub use sensor::{Sensor, SensorType};
pub use shaft::{Shaft, Tracker};
pub use speed::{STANDSTILL, Speedometer, speed_value};
pub use ssi::{Coding, Fault, Format, Parity, Reading};
pub use supervision::{
    ALARM_COMMISSIONING, ALARM_POSITION, Conditions, Limits, SUPPORTED_ALARMS, SUPPORTED_WARNINGS,
    WARNING_BATTERY, WARNING_FREQUENCY, WARNING_OPERATING_TIME, WARNING_REFERENCE, WARNING_WATCHDOG,
};
