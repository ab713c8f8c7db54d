//! Heartbeats and boot-up messages on an open bus (CiA 301, 7.2.8.2.2 and 7.2.8.3.2).

use canopen::nmt::State;
use canopen::{Duration, NodeId};

use crate::Network;
use crate::bus::BusError;

pub use canopen::client::heartbeat::Heartbeat;

/// Waits for the next heartbeat of a node; `None` when none has come in this time.
///
/// # Errors
/// The bus is lost.
pub fn wait(network: &mut Network, node: NodeId, time: Duration) -> Result<Option<State>, BusError> {
    let until = network.now() + time;
    network.wait(until, |frame| {
        Heartbeat::parse(frame).filter(|heard| heard.node == node).map(|heard| heard.state)
    })
}

/// The state in words.
#[must_use]
pub const fn words(state: State) -> &'static str {
    match state {
        State::Initialising => "initialising",
        State::Stopped => "stopped",
        State::Operational => "operational",
        State::PreOperational => "pre-operational",
    }
}
