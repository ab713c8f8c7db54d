//! Heartbeat: the node's own, and those of the nodes that it watches.

mod consumer;
mod producer;

pub(crate) use consumer::{Change, Consumer, Watch};
pub(crate) use producer::Producer;
