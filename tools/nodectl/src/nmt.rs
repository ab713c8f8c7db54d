//! The NMT master on an open bus (CiA 301, 7.3.2.2).

use canopen::client::nmt::{Change, command};
use canopen::nmt::{Command, State};
use canopen::{Duration, NodeId};

use crate::Network;
use crate::bus::BusError;

/// Sends a command to one node, or to all. No node acknowledges it.
///
/// # Errors
/// The bus is lost.
pub fn send(network: &mut Network, specifier: Command, node: Option<NodeId>) -> Result<(), BusError> {
    network.send(&command(specifier, node))
}

/// Sends a command to one node and waits for the heartbeat or boot-up message that shows its effect. Returns the state,
/// or `None` when no such message has come in this time.
///
/// # Errors
/// The bus is lost.
pub fn change(
    network: &mut Network,
    specifier: Command,
    node: NodeId,
    time: Duration,
) -> Result<Option<State>, BusError> {
    network.run(&mut Change::new(specifier, node, time))
}
