//! Heartbeat: producer and consumer.

mod consumer;
mod producer;

pub use consumer::Monitored;
pub(crate) use consumer::{Change, Consumer, Watch};
pub(crate) use producer::Producer;
