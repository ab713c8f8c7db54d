//! The other side of the bus: an SDO client, an LSS master, an NMT master and a consumer of heartbeats.
//!
//! A device is served by a [`Device`](crate::Device). Tools that configure, watch and update devices are built from
//! the pieces of this module, on a host or on a controller: nothing here reads a clock, waits, allocates or panics,
//! whatever a device sends.
//!
//! Everything that takes more than one frame is a [`Service`]. A service tells its caller the next step (send a frame,
//! wait until some instant, done) and takes the frames that arrive. One loop drives all services:
//!
//! ```
//! use canopen::client::sdo::{Buffer, Options, Upload};
//! use canopen::client::{Service, Step};
//! use canopen::sdo::Multiplexer;
//! use canopen::{Frame, Instant, NodeId};
//!
//! /// A bus with one device. Its device type (1000h) is 401, and it answers nothing else.
//! struct Bus {
//!     now: Instant,
//!     answer: Option<Frame>,
//! }
//!
//! impl Bus {
//!     fn send(&mut self, frame: Frame) {
//!         if frame.id() == 0x605 && frame.data().starts_with(&[0x40, 0x00, 0x10, 0]) {
//!             self.answer = Frame::new(0x585, &[0x43, 0x00, 0x10, 0, 0x91, 0x01, 0, 0]);
//!         }
//!     }
//!
//!     /// The next frame; `None` when no frame arrives until then.
//!     fn receive(&mut self, until: Instant) -> Option<Frame> {
//!         let frame = self.answer.take();
//!         self.now = if frame.is_some() { self.now } else { until };
//!         frame
//!     }
//! }
//!
//! fn run<S: Service>(service: &mut S, bus: &mut Bus) -> S::Output {
//!     loop {
//!         match service.next(bus.now) {
//!             Step::Send(frame) => bus.send(frame),
//!             Step::Wait(until) => {
//!                 if let Some(frame) = bus.receive(until) {
//!                     service.on_frame(&frame, bus.now);
//!                 }
//!             }
//!             Step::Done(output) => return output,
//!         }
//!     }
//! }
//!
//! let mut bus = Bus { now: Instant(0), answer: None };
//! let node = NodeId::new(5).ok_or("a node-ID")?;
//! let mut memory = [0; 16];
//! let device_type = Multiplexer { index: 0x1000, sub: 0 };
//! let mut upload = Upload::new(node, device_type, Buffer::new(&mut memory), Options::default());
//! run(&mut upload, &mut bus)?;
//! assert_eq!(upload.into_sink().as_slice(), [0x91, 0x01, 0, 0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | Module | What it does | Source |
//! |---|---|---|
//! | [`sdo`] | reads and writes objects: expedited, segmented, in blocks | CiA 301, 7.2.4 |
//! | [`lss`] | finds devices by their identity, sets node-ID and bit rate | CiA 305 |
//! | [`nmt`] | starts, stops and resets devices | CiA 301, 7.3.2 |
//! | [`heartbeat`] | knows which devices are alive, and in which state | CiA 301, 7.2.8 |

pub mod heartbeat;
pub mod lss;
pub mod nmt;
pub mod sdo;
mod service;

pub use service::{Service, Step, Taken};
