//! `nodectl net check`: the bus and its file, compared.

use std::collections::BTreeMap;
use std::fmt::Display;

use canopen::nmt::State;
use canopen::sdo::Multiplexer;
use canopen::{Duration, NodeId};
use serde::Serialize;

use super::finding::{Finding, What, end, print};
use super::senders::{Senders, listed};
use super::{Failure, LISTEN, Session, catalogue, patience};
use crate::configuration::{Configuration, Difference, looked_at};
use crate::net::{Date, Plan, PlannedNode, Start};
use crate::object::{Place, at};
use crate::scan::{Presence, scan};
use crate::text::{counted, visible};
use crate::value::Value;
use crate::{Catalogue, heartbeat, meaning};

/// The nodes that a scan has found.
pub(super) type Found = BTreeMap<NodeId, Presence>;

#[derive(Serialize)]
struct Fine {
    nodes: usize,
    findings: usize,
}

impl Display for Fine {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} as the file says", counted(self.nodes, "node is", "nodes are"))
    }
}

pub(super) fn run(session: &mut Session, plan: &Plan) -> Result<(), Failure> {
    let found = scan(&mut session.network, LISTEN)?;
    let mut count = 0;
    let mut tell = |session: &mut Session, findings: &[Finding]| {
        count += findings.len();
        print(session, findings)
    };
    tell(session, &of_bus(plan, &found))?;
    let present: Vec<&PlannedNode> =
        plan.nodes.iter().filter(|planned| is_there(&found, planned.node)).collect();
    let mut senders = Senders::default();
    for planned in &present {
        let findings = of_node(session, planned, &mut senders)?;
        tell(session, &findings)?;
    }
    tell(session, &senders.findings(plan))?;
    let states = of_states(session, plan, &present)?;
    tell(session, &states)?;
    if count == 0 {
        session.print(&Fine { nodes: present.len(), findings: 0 })?;
    }
    end(count)
}

/// Whether a node has answered.
pub(super) fn is_there(found: &Found, node: NodeId) -> bool {
    found.get(&node).is_some_and(|presence| presence.device_type.is_some() || presence.state.is_some())
}

/// Nodes that are missing or that the file does not have, and CAN-IDs of several nodes.
pub(super) fn of_bus(plan: &Plan, found: &Found) -> Vec<Finding> {
    let is_missing = |planned: &&PlannedNode| !planned.member.optional && !is_there(found, planned.node);
    let missing = plan.nodes.iter().filter(is_missing).map(|planned| {
        Finding::new(planned.node, What::Missing, format!("{} does not answer", planned.title()))
    });
    let is_known = |node: &NodeId| plan.nodes.iter().any(|planned| planned.node == *node);
    let unexpected = found.keys().filter(|node| !is_known(node)).map(|node| {
        Finding::new(*node, What::Unexpected, "the node is on the bus and not in the file".to_owned())
    });
    let shared = plan.shared_can_ids().into_iter().map(|(id, nodes)| {
        let text = format!("nodes {} are to send with {id:03X}h, by the file", listed(nodes));
        Finding { node: None, what: What::CanId, text }
    });
    missing.chain(unexpected).chain(shared).collect()
}

/// Everything about a node. A node that falls silent is a finding, and does not end the command.
fn of_node(
    session: &mut Session,
    planned: &PlannedNode,
    senders: &mut Senders,
) -> Result<Vec<Finding>, Failure> {
    session.begin_all();
    let mut findings = Vec::new();
    let compared = compare(session, planned, &mut findings);
    if let Err(failure) = compared.and_then(|()| senders.read(session, planned)) {
        findings.push(Finding::of_failure(planned.node, failure)?);
    }
    Ok(findings)
}

fn compare(session: &mut Session, planned: &PlannedNode, findings: &mut Vec<Finding>) -> Result<(), Failure> {
    findings.extend(of_identity(session, planned)?);
    if findings.iter().any(|finding| finding.what == What::Sheet) {
        return Ok(());
    }
    let catalogue = catalogue(session, planned)?;
    if let Some(wanted) = planned.member.date {
        findings.extend(of_date(session, planned.node, wanted)?);
    }
    let wanted = planned.wanted(&catalogue)?;
    let present = values(session, planned.node, &catalogue, &wanted)?;
    let is_wanted = |at: Multiplexer| wanted.values.contains_key(&(at.index, at.sub));
    for difference in wanted.differences(&present).into_iter().filter(|one| is_wanted(one.at)) {
        let name = catalogue.name(difference.at).unwrap_or_default();
        let [wanted, present] = texts(&catalogue, &difference);
        let words = format!("{} {name} is {present} instead of {wanted}", Place(difference.at));
        findings.push(Finding::new(planned.node, What::Value, words));
    }
    Ok(())
}

/// The values of a difference in words; as numbers where both have the same words.
fn texts(catalogue: &Catalogue, Difference { at, first, second }: &Difference) -> [String; 2] {
    let text = |value: &Option<Value>, words: &dyn Fn(&Value) -> String| {
        value.as_ref().map_or("not there".to_owned(), words)
    };
    let meanings = [first, second].map(|value| text(value, &|value| words(catalogue, *at, value)));
    if meanings[0] == meanings[1] {
        return [first, second].map(|value| text(value, &|value| visible(&value.to_string())));
    }
    meanings
}

/// A value in words: its meaning for an entry of 1016h, else the value itself.
fn words(catalogue: &Catalogue, at: Multiplexer, value: &Value) -> String {
    let meaning = meaning::of(catalogue, at, value).filter(|_| at.index == 0x1016);
    meaning.unwrap_or_else(|| visible(&value.to_string()))
}

/// The values that a node has of the wanted parameters, and of the objects on which the steps to them depend, such as the
/// COB-ID of a PDO. A value that the node refuses is missing.
pub(super) fn values(
    session: &mut Session,
    node: NodeId,
    catalogue: &Catalogue,
    wanted: &Configuration,
) -> Result<Configuration, Failure> {
    let mut present = Configuration::default();
    for (index, sub) in looked_at(wanted) {
        let Some(entry) = catalogue.sheet().get(index, sub) else { continue };
        if let Some(bytes) = session.optional(node, at(index, sub))? {
            present.values.insert((index, sub), Value::decode(&bytes, entry.data_type));
        }
    }
    Ok(present)
}

/// The identity of the node: 1000h, 1018h, 1009h, 100Ah, and whether the data sheet is for it.
pub(super) fn of_identity(session: &mut Session, planned: &PlannedNode) -> Result<Vec<Finding>, Failure> {
    let (node, wanted) = (planned.node, &planned.member.identity);
    let info = planned.catalogue.as_ref().map(|catalogue| &catalogue.sheet().device);
    let of_sheet = |number: u32| Some(number).filter(|number| *number != 0);
    let mut findings = Vec::new();
    for (place, what, wanted, sheet) in [
        (at(0x1000, 0), What::DeviceType, wanted.device_type, None),
        (at(0x1018, 1), What::Vendor, wanted.vendor, info.and_then(|info| of_sheet(info.vendor_number))),
        (at(0x1018, 2), What::Product, wanted.product, info.and_then(|info| of_sheet(info.product_number))),
        (at(0x1018, 3), What::Revision, wanted.revision, None),
        (at(0x1018, 4), What::Serial, wanted.serial, None),
    ] {
        if wanted.is_none() && sheet.is_none() {
            continue;
        }
        let is = match what {
            What::Vendor => session.device(node)?.0,
            What::Product => session.device(node)?.1,
            _ => session.word(node, place)?,
        };
        let differs = |wanted: Option<u32>| wanted.filter(|wanted| Some(*wanted) != is);
        let words = |wanted: u32| format!("{} instead of {wanted:08X}h", super::super::output::hex(is));
        if let Some(wanted) = differs(wanted) {
            findings.push(Finding::new(node, what, words(wanted)));
        }
        if let Some(sheet) = differs(sheet) {
            let text = format!("the data sheet is for another device: {} is {}", Place(place), words(sheet));
            findings.push(Finding::new(node, What::Sheet, text));
        }
    }
    for (index, what, wanted) in [
        (0x1009, What::Hardware, &planned.member.hardware),
        (0x100A, What::Software, &planned.member.software),
    ] {
        let Some(wanted) = wanted else { continue };
        let is = session.text(node, index)?.unwrap_or_default();
        if is != *wanted {
            let text = format!("\"{}\" instead of \"{}\"", visible(&is), visible(wanted));
            findings.push(Finding::new(node, what, text));
        }
    }
    Ok(findings)
}

fn of_date(session: &mut Session, node: NodeId, wanted: Date) -> Result<Option<Finding>, Failure> {
    let is = date(session, node)?;
    let words = is.map_or("none".to_owned(), |date| date.to_string());
    let text = format!("the configuration is of {words} instead of {wanted}");
    Ok((is != Some(wanted)).then(|| Finding::new(node, What::Date, text)))
}

/// The date of the configuration of a node (1020h).
pub(super) fn date(session: &mut Session, node: NodeId) -> Result<Option<Date>, Failure> {
    let (days, time) = (session.word(node, at(0x1020, 1))?, session.word(node, at(0x1020, 2))?);
    Ok(days.zip(time).map(|(days, milliseconds)| Date { days, milliseconds }))
}

/// Waits for a heartbeat of each node that has to send one. A node that is to be started must be operational.
pub(super) fn of_states(
    session: &mut Session,
    plan: &Plan,
    present: &[&PlannedNode],
) -> Result<Vec<Finding>, Failure> {
    let Some(longest) = present.iter().filter_map(|planned| planned.heartbeat()).max() else {
        return Ok(Vec::new());
    };
    let wait = patience(longest);
    let heard = listen(session, wait, present)?;
    let mut findings = Vec::new();
    for planned in present.iter().filter(|planned| planned.heartbeat().is_some()) {
        let is_started = planned.member.start && plan.start != Start::None;
        match heard.get(&planned.node) {
            None => {
                let text = format!("none within {} ms", wait.0 / 1000);
                findings.push(Finding::new(planned.node, What::Heartbeat, text));
            }
            Some(state) if is_started && *state != State::Operational => {
                let text = format!("the node is {}", heartbeat::words(*state));
                findings.push(Finding::new(planned.node, What::State, text));
            }
            Some(_) => (),
        }
    }
    Ok(findings)
}

/// The newest states of the nodes, from heartbeats that come from now on. Ends when all are operational.
fn listen(
    session: &mut Session,
    wait: Duration,
    nodes: &[&PlannedNode],
) -> Result<BTreeMap<NodeId, State>, Failure> {
    let mut heard = BTreeMap::new();
    session.network.forget();
    let until = session.network.now() + wait;
    session.network.wait(until, |frame| {
        let heartbeat = heartbeat::Heartbeat::parse(frame)?;
        heard.insert(heartbeat.node, heartbeat.state);
        let is_up = |planned: &&PlannedNode| {
            planned.heartbeat().is_none() || heard.get(&planned.node) == Some(&State::Operational)
        };
        nodes.iter().all(is_up).then_some(())
    })?;
    Ok(heard)
}
