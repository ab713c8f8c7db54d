//! `nodectl net apply`: configures and starts the nodes of a file.

use std::collections::BTreeMap;
use std::fmt;

use canopen::NodeId;
use canopen::nmt::{Command, State};
use serde::Serialize;

use super::super::dump::bring;
use super::super::store::{Group, Order, sign};
use super::check::{Found, date, is_there, of_bus, of_identity, of_states, values};
use super::finding::{Finding, What, end, print};
use super::{Applied, Failure, LISTEN, Session, catalogue, watch};
use crate::net::{Date, Plan, PlannedNode, Start};
use crate::nmt::send;
use crate::object::at;
use crate::scan::scan;
use crate::text::counted;

/// A node that has its configuration.
#[derive(Serialize)]
struct Done {
    node: u8,
    changes: usize,
    /// The node had the date of the file, and nothing was compared.
    has_date: bool,
    saved: bool,
    started: bool,
}

pub(super) fn run(session: &mut Session, plan: &Plan, how: &Applied) -> Result<(), Failure> {
    let found = scan(&mut session.network, LISTEN)?;
    let mut count = 0;
    let mut tell = |session: &mut Session, findings: &[Finding]| {
        count += findings.len();
        print(session, findings)
    };
    tell(session, &of_bus(plan, &found))?;
    let mut verified = verify(session, plan, &found)?;
    let (mut configured, mut may_start) = (Vec::new(), true);
    for planned in &plan.nodes {
        if !is_there(&found, planned.node) {
            may_start &= planned.member.optional;
            continue;
        }
        let findings = configure(session, plan, planned, verified.remove(&planned.node), how.all)?;
        tell(session, &findings)?;
        may_start &= findings.is_empty() || planned.member.optional;
        if findings.is_empty() {
            configured.push(planned);
        }
    }
    if plan.start == Start::All && may_start {
        start_all(session, plan, &configured)?;
    }
    // Without a start, the state is not yet that of the file.
    if plan.start != Start::All || may_start {
        let states = of_states(session, plan, &configured)?;
        tell(session, &states)?;
    }
    if how.watch {
        return watch::run(session, plan, how);
    }
    end(count)
}

/// The identities that are read already, as findings.
type Verified = BTreeMap<NodeId, Vec<Finding>>;

/// Looks for mistakes of the file at nodes whose data sheet depends on their identity, before any node is changed.
fn verify(session: &mut Session, plan: &Plan, found: &Found) -> Result<Verified, Failure> {
    let mut verified = Verified::new();
    let is_open = |planned: &&PlannedNode| planned.catalogue.is_none() && is_there(found, planned.node);
    for planned in plan.nodes.iter().filter(is_open) {
        session.begin_all();
        match verify_one(session, planned) {
            // The configuration of the node reports it.
            Err(failure @ Failure::Sdo(_)) => drop(Finding::of_failure(planned.node, failure)?),
            result => drop(verified.insert(planned.node, result?)),
        }
    }
    Ok(verified)
}

fn verify_one(session: &mut Session, planned: &PlannedNode) -> Result<Vec<Finding>, Failure> {
    let findings = of_identity(session, planned)?;
    if findings.is_empty() {
        let catalogue = catalogue(session, planned)?;
        planned.wanted(&catalogue)?;
    }
    Ok(findings)
}

/// Starts the nodes with one command, if all nodes are to be started; otherwise one after the other.
fn start_all(session: &mut Session, plan: &Plan, configured: &[&PlannedNode]) -> Result<(), Failure> {
    if plan.nodes.iter().all(|planned| planned.member.start) {
        return Ok(send(&mut session.network, Command::Start, None)?);
    }
    for planned in configured.iter().filter(|planned| planned.member.start) {
        send(&mut session.network, Command::Start, Some(planned.node))?;
    }
    Ok(())
}

/// Configures a node, and starts it where each is started on its own. A refusal of the node is a finding. The identity is
/// read where it is not `verified`.
pub(super) fn configure(
    session: &mut Session,
    plan: &Plan,
    planned: &PlannedNode,
    verified: Option<Vec<Finding>>,
    all: bool,
) -> Result<Vec<Finding>, Failure> {
    session.begin_all();
    match configure_one(session, planned, verified, all) {
        Ok(Ok(mut done)) => {
            done.started = plan.start == Start::Each && planned.member.start;
            if done.started {
                send(&mut session.network, Command::Start, Some(planned.node))?;
            }
            session.print(&done)?;
            Ok(Vec::new())
        }
        Ok(Err(findings)) => Ok(findings),
        Err(Failure::NotApplied(text)) => Ok(vec![Finding::new(planned.node, What::Refused, text)]),
        Err(failure) => Ok(vec![Finding::of_failure(planned.node, failure)?]),
    }
}

fn configure_one(
    session: &mut Session,
    planned: &PlannedNode,
    verified: Option<Vec<Finding>>,
    all: bool,
) -> Result<Result<Done, Vec<Finding>>, Failure> {
    let (node, member) = (planned.node, &planned.member);
    let findings = verified.map_or_else(|| of_identity(session, planned), Ok)?;
    if !findings.is_empty() {
        return Ok(Err(findings));
    }
    let catalogue = catalogue(session, planned)?;
    let done = |changes, has_date, saved| Done { node: node.get(), changes, has_date, saved, started: false };
    let wants_date = member.date.filter(|_| PlannedNode::has_date(&catalogue));
    if wants_date.is_some() && !all && date(session, node)? == wants_date {
        return Ok(Ok(done(0, true, false)));
    }
    // A device may refuse parameters, and PDOs above all, while it is operational.
    if session.network.heard(node).and_then(|heard| heard.state) == Some(State::Operational) {
        send(&mut session.network, Command::EnterPreOperational, Some(node))?;
    }
    let wanted = planned.wanted(&catalogue)?;
    let read = |session: &mut Session| values(session, node, &catalogue, &wanted);
    let mut changes = bring(session, node, catalogue.sheet(), &wanted, read)?;
    if let Some(date) = wants_date {
        changes += write_date(session, node, date)?;
    }
    let is_saved = member.save && changes > 0;
    if is_saved {
        sign(session, node, Order::Save, Group::All)?;
    }
    Ok(Ok(done(changes, false, is_saved)))
}

/// Writes the date of the configuration as the last value: a device clears it with each change.
fn write_date(session: &mut Session, node: NodeId, date: Date) -> Result<usize, Failure> {
    for (sub, value) in [(1, date.days), (2, date.milliseconds)] {
        let written = session.client(node).download(at(0x1020, sub), &value.to_le_bytes(), |_| ());
        written.map_err(|error| session.named(error))?;
    }
    Ok(2)
}

/// `node 5: 7 changes, read back, saved, started`
impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let saved = if self.saved { ", saved" } else { "" };
        let started = if self.started { ", started" } else { "" };
        let what = match self.changes {
            _ if self.has_date => "has the configuration of this date".to_owned(),
            0 => "has it already".to_owned(),
            changes => format!("{}, read back", counted(changes, "change", "changes")),
        };
        write!(f, "node {}: {what}{saved}{started}", self.node)
    }
}
