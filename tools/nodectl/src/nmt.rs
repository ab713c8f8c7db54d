//! The NMT master on an open bus (CiA 301, 7.3.2.2).

use canopen::client::heartbeat::Heartbeat;
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

/// After the boot-up message of another node, how long to wait for that of the node itself.
const OTHERS: Duration = Duration::from_millis(500);

/// Restarts a node and waits for its boot-up message. Returns the node that has booted: LSS may have given it a new
/// node-ID, which is in force from now on. `None` when none has booted in this time.
///
/// # Errors
/// The bus is lost.
pub fn restart(
    network: &mut Network,
    specifier: Command,
    node: NodeId,
    time: Duration,
) -> Result<Option<NodeId>, BusError> {
    send(network, specifier, Some(node))?;
    let (mut until, mut other) = (network.now() + time, None);
    loop {
        let booted = network.wait(until, |frame| {
            let heartbeat = Heartbeat::parse(frame)?;
            (heartbeat.state == State::Initialising).then_some(heartbeat.node)
        })?;
        match booted {
            Some(booted) if booted == node => return Ok(booted.into()),
            Some(booted) if other.is_none() => {
                other = Some(booted);
                until = until.min(network.now() + OTHERS);
            }
            Some(_) => (),
            None => return Ok(other),
        }
    }
}
