//! The update of many nodes, one after the other, because the bus is the bottleneck.

use std::collections::VecDeque;

use canopen::{Duration, NodeId};

use super::job::Job;
use super::waiting::Patience;
use super::{Error, Image, Options, Outcome, Watcher};
use crate::Network;

/// How long to wait for a lost node while others wait for their turn. The lost node gets a second turn after them.
const SHORT: Duration = Duration::from_millis(5000);
/// How long to wait for a bus that has not come back for the node before.
const LAST: Duration = Duration::from_millis(1000);

/// Updates nodes. After a failed node the others are still updated. The update of a lost node continues at the end.
pub fn update(
    network: &mut Network,
    nodes: &[NodeId],
    image: &Image,
    options: &Options,
    watcher: &mut dyn Watcher,
) -> Vec<(NodeId, Result<Outcome, Error>)> {
    let mut jobs: VecDeque<(Job, bool)> =
        nodes.iter().map(|&node| (Job::new(node, image, options), false)).collect();
    let (mut results, mut bus) = (Vec::new(), options.patience);
    while let Some((mut job, is_second)) = jobs.pop_front() {
        let can_wait = !is_second && !jobs.is_empty();
        let node = if can_wait { options.patience.min(SHORT) } else { options.patience };
        let result = job.run(network, Patience { node, bus }, watcher);
        let is_bus_lost = result.as_ref().is_err_and(Error::is_bus_lost);
        bus = if is_bus_lost { options.patience.min(LAST) } else { options.patience };
        match result {
            Err(Error::Lost { .. }) if can_wait => jobs.push_back((job, true)),
            result => results.push((job.node, result)),
        }
    }
    results
}
