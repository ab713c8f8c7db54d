//! A monitor for a CANopen bus: judges every frame by CiA 301 and by the settings that its nodes have.
//!
//! [`Monitor`] gets the frames of a bus with their times, and knows the settings of the nodes from the SDO transfers
//! that it follows and from data sheets ([`Sheet`]). It reports a [`Breach`] with the frames that show it. It sends
//! nothing and reads no clock: a test, a log file or a live bus feed it in the same way.
//!
//! A caller that knows more passes more: the sender of each frame ([`Sender`]), incidents of the board ([`Incident`]),
//! the next deadline of a node, and values that it has read without the bus. Rules that need such knowledge stay silent
//! without it.
//!
//! ```
//! use canopen::{Frame, Instant};
//! use monitor::{Monitor, Rule, Sender};
//!
//! let mut monitor = Monitor::new();
//! let frames: [(u64, u16, &[u8]); 3] =
//!     [(0, 0x705, &[0]), (10_000, 0x705, &[127]), (20_000, 0x705, &[4])];
//! for (at, id, data) in frames {
//!     monitor.frame(Instant(at), &Frame::new(id, data).unwrap(), Sender::Unknown);
//! }
//! assert_eq!(monitor.breaches()[0].rule, Rule::NmtState);
//! ```
#![forbid(unsafe_code)]

mod boot;
mod breach;
mod bus;
mod device;
mod errors;
mod heartbeat;
mod nmt;
mod pdo;
mod sdo;
mod sheet;
mod values;
mod watch;

pub use breach::{Breach, Rule};
pub use sheet::{Entry, Initial, Kind, Sheet};
pub use watch::{Incident, Monitor, Sender};

/// Index and sub-index of an object.
pub type Key = (u16, u8);

/// A finding of a part of the monitor: a rule and a description.
pub(crate) type Findings = Vec<(Rule, String)>;
