//! Finds the only node on the bus, for a command without `--select`. Fails where there are several nodes.

use std::collections::BTreeMap;

use canopen::lss::Identity;
use canopen::{Duration, NodeId};

use super::{describe, step};
use crate::cli::{Failure, Session};
use crate::lss::Master;
use crate::object::at;
use crate::scan::{Presence, scan};
use crate::text::note;

/// How long to listen for heartbeats, which usually come once a second.
const LISTEN: Duration = Duration::from_millis(1200);
/// The number of nodes that the error names. The search for further nodes ends there.
const NAMED: usize = 4;

/// The nodes with a node-ID that answer or send a heartbeat.
pub(super) fn configured(session: &mut Session) -> Result<BTreeMap<NodeId, Presence>, Failure> {
    Ok(scan(&mut session.network, LISTEN)?)
}

/// The identity of the only node on the bus.
pub(super) fn only(session: &mut Session) -> Result<Identity, Failure> {
    note("no --select: the only node on the bus is searched");
    let configured: Vec<NodeId> = configured(session)?.into_keys().collect();
    let unconfigured = unconfigured(session)?;
    match (&configured[..], &unconfigured[..]) {
        ([], []) => Err(Failure::Silence("no node answers, with a node-ID or without one".to_owned())),
        ([], [identity]) => Ok(*identity),
        ([node], []) => identity(session, *node),
        _ => {
            let nodes = configured.iter().map(|node| format!("node {}", node.get()));
            let others = unconfigured
                .iter()
                .map(|identity| format!("a node without node-ID ({})", describe(identity)));
            let names: Vec<String> = nodes.chain(others).collect();
            let message =
                format!("more than one node is on the bus: {}; name one with --select", names.join(", "));
            Err(Failure::Usage(message))
        }
    }
}

/// The nodes without a node-ID. A found node stays selected and takes no part in the search for the next node.
fn unconfigured(session: &mut Session) -> Result<Vec<Identity>, Failure> {
    let step = step(session, None);
    let mut master = Master::new(&mut session.network, step);
    master.release()?;
    let mut found = Vec::new();
    let result = loop {
        match master.fastscan(|_| ()) {
            Ok(Some(identity)) if found.len() < NAMED => found.push(identity),
            Ok(_) => break Ok(found),
            Err(error) => break Err(error),
        }
    };
    master.release()?;
    Ok(result?)
}

/// The identity in 1018h.
pub(super) fn identity(session: &mut Session, node: NodeId) -> Result<Identity, Failure> {
    let mut words = [0; 4];
    for (word, sub) in words.iter_mut().zip(1..) {
        *word = session.word(node, at(0x1018, sub))?.ok_or_else(|| {
            let node = node.get();
            Failure::Usage(format!(
                "node {node} does not tell all of its identity (1018h): name it with --select"
            ))
        })?;
    }
    let [vendor, product, revision, serial] = words;
    Ok(Identity { vendor, product, revision, serial })
}
