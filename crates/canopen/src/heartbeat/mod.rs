//! Error control: heartbeat producer and consumer, and node guarding.

mod consumer;
mod guarding;
mod producer;

pub use consumer::Monitored;
pub(crate) use consumer::{Change, Consumer, Watch};
pub(crate) use guarding::Guarding;
pub(crate) use producer::Producer;
