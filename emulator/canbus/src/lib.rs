//! A CAN bus in bit-accurate virtual time.
//!
//! The bus runs the protocol of ISO 11898-1 (classic CAN) bit by bit: stuffing, bitwise arbitration, the ACK slot,
//! error and overload flags with their superposition, delimiters, intermission and suspended transmission. Its
//! participants are [`Controller`]s: register-level models of a CAN peripheral, [`HostNode`]s in this process and
//! network clients, a [`Babbler`]. The caller lends the participants to the bus for each call, so an emulated board can
//! own its controller.
//!
//! # Co-simulation
//!
//! A loop owns the boards and the bus. In each turn it
//!
//! 1. runs every board to `limit = min(now + Q, next)`, where `next` is what the last [`Bus::step`] returned. A
//!    board that requests a transmission stops right there, and lowers `limit` to that instant for the boards that
//!    still have to run;
//! 2. calls `step` with all participants and the earliest instant that any board has reached.
//!
//! `step` returns the next event: the end of a frame for its receivers and, a bit later, for its transmitter, the
//! end of the intermission, or a start of frame that is already requested. All boards have then reached exactly the
//! instant of this event, so a frame requested in the last bit of an intermission takes part in the arbitration.
//!
//! While the bus is idle, only the quantum `Q` limits how far the boards run. A board may then have run up to `Q` past
//! a start of frame that another board has caused. No event is missed as long as `Q` is shorter than the time between a
//! start of frame and the first event that a receiver can notice:
//!
//! * frames without errors: the end of the shortest frame, so any `Q` of up to 43 bits is causal;
//! * with injected errors, or participants at another bit rate: an error is reported no earlier than 12 bits after
//!   the start of frame (six to see the error, six of the flag). With `Q` of up to 12 bits this is causal too.
//!
//! Wake-up by a start of frame and the end of a wait for 11 recessive bits may be late by up to `Q`. Whatever `Q`
//! is, the same input gives the same traffic.
//!
//! ```
//! use canbus::{Bus, Controller, Event, Frame, HostNode, StandardId, Time};
//!
//! let bit = Time::of_cycle(1_000_000);
//! let (mut a, mut b) = (HostNode::new(bit), HostNode::new(bit));
//! let heartbeat = Frame::data(StandardId::new(0x701).unwrap(), &[5]).unwrap();
//! a.send(heartbeat, Time::ZERO);
//!
//! let mut bus = Bus::new();
//! let mut now = Time::ZERO;
//! while now != Time::NEVER {
//!     // Here boards would run to `now`.
//!     let mut participants: [&mut dyn Controller; 2] = [&mut a, &mut b];
//!     now = bus.step(&mut participants, now, &mut |event| {
//!         if let Event::Frame { end, frame, .. } = event {
//!             println!("({end}) vcan0 {frame}");
//!         }
//!     });
//! }
//! assert_eq!(b.receive().unwrap().frame, heartbeat);
//! ```
//!
//! # Simplifications
//!
//! * A controller begins at the instant of its request when the bus is idle, not at the next edge of its bit clock.
//! * Propagation takes no time, and a controller sees an edge in the quantum in which the edge comes. So the sample
//!   point does not matter among participants with the same clock. With different clocks, every participant samples
//!   where its [`BitTiming`] says and resynchronises.
//! * A participant at another bit rate than the transmitter restarts with each frame, and only its error flag can
//!   delay the next frame.
//! * At most one overload frame follows a frame, and none follows an error frame. A participant waits until a disturbed
//!   delimiter is over and does not count the disturbance as another error.

mod babbler;
mod bits;
mod bus;
mod candump;
mod confinement;
mod controller;
mod event;
mod faults;
mod frame;
mod host;
mod monitor;
mod receiver;
mod slot;
mod station;
mod time;
mod timing;
mod wire;

pub use babbler::Babbler;
pub use bits::frame_bits;
pub use bus::Bus;
pub use candump::{NotARecord, Record};
pub use confinement::{Confinement, ErrorState};
pub use controller::{Attachment, BusError, Controller, ErrorReport};
pub use event::Event;
pub use faults::{Fault, Faults, Position, SeenBy};
pub use frame::{ExtendedId, Frame, Id, StandardId};
pub use host::{HostNode, Order, Stamped};
pub use monitor::Monitor;
pub use time::Time;
pub use timing::BitTiming;
