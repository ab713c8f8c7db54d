//! `nodectl net apply --watch`: a small NMT manager.

use std::collections::BTreeMap;
use std::fmt;

use canopen::client::heartbeat::Heartbeat;
use canopen::nmt::{Command, State};
use canopen::{Duration, Instant, NodeId};
use serde::Serialize;

use super::apply::configure;
use super::finding::print;
use super::{Applied, Failure, Session, patience};
use crate::net::{Plan, PlannedNode, Start};
use crate::nmt::send;

/// The longest wait for a frame.
const WAKE: Duration = Duration::from_millis(100);

/// An event of a node.
#[derive(Serialize)]
struct Event {
    node: u8,
    event: &'static str,
}

/// The state of a node.
#[derive(Clone, Copy, Default)]
struct Watched {
    newest: Option<Instant>,
    is_lost: bool,
}

pub(super) fn run(session: &mut Session, plan: &Plan, how: &Applied) -> Result<(), Failure> {
    let begin = session.network.now();
    let end = how.duration.map(|seconds| begin + Duration::from_millis(u64::from(seconds) * 1000));
    let mut watched: BTreeMap<NodeId, Watched> = BTreeMap::new();
    while end.is_none_or(|end| session.network.now() < end) {
        let until = session.network.now() + WAKE;
        if let Some(received) = session.network.receive(until)?
            && let Some(heartbeat) = Heartbeat::parse(&received.frame)
            && let Some(planned) = plan.nodes.iter().find(|planned| planned.node == heartbeat.node)
        {
            hear(session, plan, planned, heartbeat.state, watched.entry(planned.node).or_default())?;
        }
        let now = session.network.now();
        for planned in &plan.nodes {
            miss(session, planned, watched.get_mut(&planned.node), now)?;
        }
    }
    Ok(())
}

/// Takes a heartbeat: a node that has booted is configured and started; one that was lost and has not booted is restarted.
fn hear(
    session: &mut Session,
    plan: &Plan,
    planned: &PlannedNode,
    state: State,
    watched: &mut Watched,
) -> Result<(), Failure> {
    let was_lost = std::mem::take(&mut watched.is_lost);
    if state == State::Initialising {
        tell(session, planned, "booted")?;
        session.forget(planned.node);
        let findings = configure(session, plan, planned, None, false)?;
        print(session, &findings)?;
        if findings.is_empty() && plan.start == Start::All && planned.member.start {
            send(&mut session.network, Command::Start, Some(planned.node))?;
        }
    } else if was_lost {
        tell(session, planned, "back without a boot-up message, restarted")?;
        send(&mut session.network, Command::ResetCommunication, Some(planned.node))?;
    }
    watched.newest = Some(session.network.now());
    Ok(())
}

/// Reports a node whose heartbeat is missing, once.
fn miss(
    session: &mut Session,
    planned: &PlannedNode,
    watched: Option<&mut Watched>,
    now: Instant,
) -> Result<(), Failure> {
    let (Some(watched), Some(time)) = (watched, planned.heartbeat()) else { return Ok(()) };
    let is_late = watched.newest.is_some_and(|newest| newest + patience(time) < now);
    if is_late && !watched.is_lost {
        watched.is_lost = true;
        tell(session, planned, "lost: no heartbeat")?;
    }
    Ok(())
}

fn tell(session: &mut Session, planned: &PlannedNode, event: &'static str) -> Result<(), Failure> {
    session.print(&Event { node: planned.node.get(), event })
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "node {}: {}", self.node, self.event)
    }
}
