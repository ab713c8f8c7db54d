//! The NMT master (CiA 301, 7.2.8).

use canopen::nmt::{Command, State};
use canopen::{Duration, Frame, NodeId};

use crate::Network;
use crate::bus::BusError;
use crate::heartbeat::Heartbeat;

/// Sends a command to one node, or to all. No node acknowledges it.
///
/// # Errors
/// The bus is lost.
pub fn send(network: &mut Network, command: Command, node: Option<NodeId>) -> Result<(), BusError> {
    match Frame::new(0x000, &command.encode(node)) {
        Some(frame) => network.send(&frame),
        None => Ok(()),
    }
}

/// Restarts a node, or its communication; whether it has booted up in this time.
///
/// # Errors
/// The bus is lost.
pub fn reset(
    network: &mut Network,
    command: Command,
    node: NodeId,
    time: Duration,
) -> Result<bool, BusError> {
    send(network, command, Some(node))?;
    let booted = Heartbeat::wait(network, node, time, |state| state == State::Initialising)?;
    Ok(booted.is_some())
}
