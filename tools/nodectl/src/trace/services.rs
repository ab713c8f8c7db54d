//! Decoding of the services whose frames need no further knowledge.

use std::collections::BTreeMap;

use canopen::emcy::Message;
use canopen::lss::{BitRate, Bound, Part, Request, Response};
use canopen::nmt::{Command, State};
use canopen::{Frame, NodeId};

use super::{Said, hex};
use crate::heartbeat::words;
use crate::meaning::emergency;

/// NMT commands (CiA 301, 7.2.8.2.1).
pub(super) fn nmt(frame: &Frame) -> Said {
    let &[specifier, node] = frame.data() else { return odd(frame, "no NMT command") };
    let whom = if node == 0 { "all nodes".to_owned() } else { format!("node {node}") };
    let command = Command::from_specifier(specifier);
    Said::text(match command {
        Some(Command::Start) => format!("start {whom}"),
        Some(Command::Stop) => format!("stop {whom}"),
        Some(Command::EnterPreOperational) => format!("enter pre-operational: {whom}"),
        Some(Command::ResetNode) => format!("reset {whom}"),
        Some(Command::ResetCommunication) => format!("reset communication of {whom}"),
        None => format!("unknown command {specifier:02X}h for {whom}"),
    })
}

/// SYNC, with its counter where there is one (CiA 301, 7.2.5).
pub(super) fn sync(frame: &Frame) -> Said {
    match frame.data() {
        [] => Said::text("SYNC"),
        [counter] => Said::text(format!("SYNC {counter}")),
        _ => odd(frame, "no SYNC"),
    }
}

/// TIME: milliseconds after midnight and days since 1984 (CiA 301, 7.2.6 and 7.1.6.5).
pub(super) fn time(frame: &Frame) -> Said {
    let &[a, b, c, d, low, high] = frame.data() else { return odd(frame, "no TIME") };
    let millis = u32::from_le_bytes([a, b, c, d & 0x0F]);
    let (seconds, millis) = (millis / 1000, millis % 1000);
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    let days = u16::from_le_bytes([low, high]);
    Said::text(format!("{hours:02}:{minutes:02}:{seconds:02}.{millis:03}, {days} days after 1984-01-01"))
}

/// Emergencies (CiA 301, 7.2.7).
pub(super) fn emcy(frame: &Frame, is_own: bool) -> Said {
    let Ok(data) = frame.data().try_into() else { return odd(frame, "no EMCY") };
    Said::text(emergency(Message::parse(data), is_own))
}

/// The last known state of each node.
#[derive(Debug, Default)]
pub(super) struct States(BTreeMap<Option<NodeId>, State>);

impl States {
    /// A boot-up message, a heartbeat with another state than before, or node guarding (CiA 301, 7.2.8.2.2 and 7.2.8.3.2).
    pub(super) fn on_frame(&mut self, frame: &Frame, node: Option<NodeId>) -> Option<Said> {
        if frame.is_remote() {
            return Some(Said::text("asked for its state (node guarding)"));
        }
        let &[code] = frame.data() else { return Some(odd(frame, "no heartbeat")) };
        let Some(state) = State::from_code(code & 0x7F) else {
            return Some(odd(frame, "unknown state"));
        };
        let before = self.0.insert(node, state);
        match state {
            State::Initialising if code == 0 => Some(Said::text("boot-up")),
            state => (before != Some(state)).then(|| Said::text(words(state))),
        }
    }
}

/// LSS (CiA 305).
pub(super) fn lss(frame: &Frame) -> Said {
    let Ok(data) = frame.data().try_into() else { return odd(frame, "no LSS message") };
    let text = if frame.id() == 0x7E5 {
        Request::parse(data).map(request)
    } else {
        Response::parse(data).map(response)
    };
    text.map_or_else(|| odd(frame, "unknown LSS message"), Said::text)
}

fn request(request: Request) -> String {
    match request {
        Request::SwitchGlobal { configuration: true } => "all nodes to configuration".to_owned(),
        Request::SwitchGlobal { configuration: false } => "all nodes to waiting".to_owned(),
        Request::Select(part, value) => format!("select {} {value:08X}h", name(part)),
        Request::NodeId(255) => "take the node-ID away".to_owned(),
        Request::NodeId(id) => format!("configure node-ID {id}"),
        Request::BitTiming { table: 0, index } => match BitRate::from_index(index).map(BitRate::kbit) {
            Some(0) => "configure automatic bit rate".to_owned(),
            Some(kbit) => format!("configure {kbit} kbit/s"),
            None => format!("configure bit timing {index}"),
        },
        Request::BitTiming { table, index } => format!("configure bit timing {index} of table {table}"),
        Request::Activate { delay } => format!("activate the bit rate, delay {delay} ms"),
        Request::Store => "store".to_owned(),
        Request::Identify(bound, value) => format!("who has {} {value:08X}h", bound_name(bound)),
        Request::IdentifyUnconfigured => "who has no node-ID".to_owned(),
        Request::Fastscan { bit: Request::CONFIRM, .. } => "fastscan: who has no node-ID".to_owned(),
        Request::Fastscan { value, bit, part, .. } => {
            let part = Part::ALL.get(usize::from(part)).map_or("", |part| name(*part));
            format!("fastscan: {part} {value:08X}h down to bit {bit}")
        }
        Request::Inquire(part) => format!("what is the {}", name(part)),
        Request::InquireNodeId => "what is the node-ID".to_owned(),
    }
}

fn response(response: Response) -> String {
    let done = |code: u8| if code == 0 { "done".to_owned() } else { format!("refused, error code {code}") };
    match response {
        Response::Selected => "selected".to_owned(),
        Response::NodeId(code) => format!("configure node-ID: {}", done(code)),
        Response::BitTiming(code) => format!("configure bit timing: {}", done(code)),
        Response::Stored(code) => format!("store: {}", done(code)),
        Response::Identified => "here".to_owned(),
        Response::Unconfigured => "a node has no node-ID".to_owned(),
        Response::Identity(part, value) => format!("{} {value:08X}h", name(part)),
        Response::NodeIdIs(255) => "no node-ID".to_owned(),
        Response::NodeIdIs(id) => format!("node-ID {id}"),
    }
}

const fn name(part: Part) -> &'static str {
    match part {
        Part::Vendor => "vendor-ID",
        Part::Product => "product code",
        Part::Revision => "revision number",
        Part::Serial => "serial number",
    }
}

const fn bound_name(bound: Bound) -> &'static str {
    match bound {
        Bound::Vendor => "vendor-ID",
        Bound::Product => "product code",
        Bound::RevisionLow => "revision number from",
        Bound::RevisionHigh => "revision number to",
        Bound::SerialLow => "serial number from",
        Bound::SerialHigh => "serial number to",
    }
}

fn odd(frame: &Frame, what: &str) -> Said {
    Said::text(format!("{what}: {}", hex(frame)))
}
