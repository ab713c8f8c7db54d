//! EMCY: faults, emergency messages and the error history (CiA 301, 7.2.7).

mod fault;
mod history;
mod message;
mod producer;

use fault::FaultSet;
pub use fault::{Condition, ErrorClass, Fault};
pub(crate) use history::DEPTH as HISTORY;
pub use message::Message;
pub(crate) use producer::Producer;
