//! The LSS master (CiA 305): finds devices by their identity and gives them a node-ID and a bit rate.
//!
//! Most services are an [`Exchange`]: one slave is in the configuration state and answers. [`Fastscan`] finds one slave
//! without a node-ID among any number of them. Two services have no answer and are one [`Frame`] each:
//! [`switch_global`] and [`activate_bit_rate`].
//!
//! ```
//! use canopen::client::lss::{self, Error, Options};
//! use canopen::client::{Service, Step};
//! use canopen::{Frame, Instant, NodeId};
//!
//! let node_id = NodeId::new(7).ok_or("a node-ID")?;
//! let mut exchange = lss::set_node_id(Some(node_id), Options::default());
//! let Step::Send(request) = exchange.next(Instant(0)) else { panic!("a request comes first") };
//! assert_eq!((request.id(), &request.data()[..2]), (0x7E5, &[0x11, 7][..]));
//!
//! let refusal = Frame::new(0x7E4, &[0x11, 1, 0, 0, 0, 0, 0, 0]).ok_or("a frame")?;
//! exchange.on_frame(&refusal, Instant(500));
//! let Step::Done(Err(error)) = exchange.next(Instant(500)) else { panic!("the slave refuses") };
//! assert_eq!(error.to_string(), "LSS node-ID: the node-ID is out of range");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod exchange;
mod fastscan;
mod services;

pub use error::{Error, Name};
pub use exchange::Exchange;
pub use fastscan::Fastscan;
pub use services::{
    activate_bit_rate, identify_unconfigured, inquire, inquire_node_id, select, set_bit_rate, set_node_id,
    store, switch_global,
};

use crate::lss::{REQUEST, RESPONSE, Request, Response};
use crate::{Duration, Frame};

/// Time-out and retries of a master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// The longest time until a slave answers.
    pub timeout: Duration,
    /// How often a request without an answer is sent again.
    pub retries: u8,
}

impl Default for Options {
    /// 100 ms and two retries.
    fn default() -> Options {
        Options { timeout: Duration::from_millis(100), retries: 2 }
    }
}

fn frame(request: Request) -> Frame {
    Frame::data_frame(REQUEST, 8, request.encode())
}

fn response(frame: &Frame) -> Option<Response> {
    Response::parse(*frame.full(RESPONSE)?)
}
