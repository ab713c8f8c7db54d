//! Waiting for a node that restarts, or for a node or a bus that is lost.

use canopen::{Duration, NodeId};

use super::{Error, Program};
use crate::{Network, sdo};

/// How long a node may take to restart.
pub(super) const RESTART: Duration = Duration::from_millis(15_000);
/// The time between two requests to a busy node.
pub(super) const POLL: Duration = Duration::from_millis(100);
/// The number of pauses before a run continues that become longer: each is twice as long as the one before.
const LONGER: usize = 7;

/// How long to wait for what is lost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    pub(super) node: Duration,
    pub(super) bus: Duration,
}

/// The pauses before a run continues. A bus that is full for the update of another node has time to become free.
pub(super) fn pauses() -> impl Iterator<Item = Duration> {
    (0..LONGER).chain(std::iter::repeat(LONGER)).map(|doublings| Duration(POLL.0 << doublings))
}

/// Waits until a node is back from a restart, with or without a running program as `wanted`. A node that answers may take until
/// `limit`.
pub(super) fn wait_until_running(
    network: &mut Network,
    node: NodeId,
    options: sdo::Options,
    (wanted, limit): (bool, Duration),
    what: &'static str,
) -> Result<(), Error> {
    let begin = network.now();
    loop {
        let error = match Program::new(network, node, options).is_running() {
            Ok(is_running) if is_running == wanted => return Ok(()),
            Ok(_) => None,
            Err(error) if error.may_pass() && !error.is_bus_lost() => Some(error),
            Err(error) => return Err(error.into()),
        };
        let limit = if error.is_some() { RESTART } else { limit };
        if network.now() >= begin + limit {
            return Err(error.map_or(Error::Stuck { node, what }, Error::Sdo));
        }
        network.pause(POLL)?;
    }
}

/// Tries to open the bus, and returns whether it is open. After a failure it pauses, because the bus may come back; the caller
/// limits the whole time.
fn reopen(network: &mut Network) -> bool {
    let is_open = network.reopen().is_ok();
    if !is_open {
        std::thread::sleep(std::time::Duration::from_micros(POLL.0));
    }
    is_open
}

/// Waits for a lost node. Opens the bus again if the bus is lost, too.
pub(super) fn wait_for_return(
    network: &mut Network,
    node: NodeId,
    options: sdo::Options,
    patience: Patience,
) -> Result<(), Error> {
    let bus_until = network.now() + patience.bus;
    let mut until = network.now() + patience.node;
    loop {
        match Program::new(network, node, options).is_running() {
            Ok(_) => return Ok(()),
            // Without a bus, no other node can have its turn. The node has its time once the bus is open.
            Err(error) if error.is_bus_lost() => {
                if !reopen(network) && network.now() >= bus_until {
                    return Err(error.into());
                }
                until = bus_until.min(network.now() + patience.node);
            }
            // After bus-off, node and adapter send the frames of the broken transfer that they have kept. The node has
            // answered this request before, so another answer belongs to them.
            Err(_) => {
                let _ = network.pause(POLL);
            }
        }
        if network.now() >= until {
            return Err(Error::Lost { node, patience: patience.node.0 / 1_000_000 });
        }
    }
}
