//! Decoding of the frames on a bus, service by service, with the names, values and units of the objects.
//!
//! A [`Decoder`] takes the frames in their order and describes each. A transfer of several frames is one [`Line`], made
//! when the transfer ends. A heartbeat makes a line only when its state is new. The decoder sends nothing.

mod knowledge;
mod log;
mod pdo;
mod sdo;
mod services;

use std::collections::{BTreeMap, BTreeSet};

use canopen::sdo::Multiplexer;
use canopen::{Frame, Instant, NodeId};

pub use knowledge::Knowledge;
pub use log::{Foreign, ForeignKind, LogReader, NotARecord, Record};

use crate::Catalogue;
use crate::lift::{is_fixed, is_lift};
use crate::quantity::with_unit;
use crate::text::hex_digits;
use crate::value::Value;
use pdo::Pdos;
pub(crate) use sdo::{Transferred, Transfers};
use services::States;

/// The service that a frame belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Commands of the NMT master.
    Nmt,
    /// SYNC.
    Sync,
    /// TIME.
    Time,
    /// Emergencies.
    Emcy,
    /// Process data.
    Pdo,
    /// Transfers of objects.
    Sdo,
    /// Boot-up, heartbeat, node guarding.
    Heartbeat,
    /// Layer setting services.
    Lss,
    /// Anything else.
    Other,
}

impl Kind {
    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Nmt => "nmt",
            Kind::Sync => "sync",
            Kind::Time => "time",
            Kind::Emcy => "emcy",
            Kind::Pdo => "pdo",
            Kind::Sdo => "sdo",
            Kind::Heartbeat => "heartbeat",
            Kind::Lss => "lss",
            Kind::Other => "other",
        }
    }
}

/// A value on the bus.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// The object.
    pub at: Multiplexer,
    /// The name of the object; empty where none is known.
    pub name: String,
    /// The scaled value; `None` for an object that was requested and not answered.
    pub value: Option<Value>,
    /// The unit; empty where none is known.
    pub unit: String,
    /// The meaning of the number.
    pub meaning: Option<String>,
}

/// The description of a frame, or of a transfer of several frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Time of the frame on the bus; for a transfer, the time of its last frame.
    pub at: Instant,
    /// The identifier of the frame: a CAN-ID, or 29 bits of a frame that CANopen does not use.
    pub id: u32,
    /// The service.
    pub kind: Kind,
    /// The node that sends or receives the frame; `None` where the CAN-ID does not tell it.
    pub node: Option<NodeId>,
    /// The description in words.
    pub text: String,
    /// The values in the frame.
    pub values: Vec<Shown>,
    /// The abort code of an aborted transfer.
    pub abort: Option<u32>,
    /// The data of the frame.
    pub data: Vec<u8>,
}

/// The decoded part of a line.
#[derive(Debug, Default)]
struct Said {
    text: String,
    values: Vec<Shown>,
    abort: Option<u32>,
}

impl Said {
    fn text(text: impl Into<String>) -> Said {
        Said { text: text.into(), ..Said::default() }
    }
}

/// Decodes frames.
#[derive(Debug, Default)]
pub struct Decoder {
    nodes: BTreeMap<NodeId, Knowledge>,
    pdos: Pdos,
    transfers: Transfers,
    /// Nodes with a transfer whose begin is not in the trace. Its first frame is shown.
    without_begin: BTreeSet<NodeId>,
    states: States,
}

impl Decoder {
    /// Sets the knowledge about a node.
    pub fn know(&mut self, node: NodeId, knowledge: Knowledge) {
        self.nodes.insert(node, knowledge);
        self.pdos.forget(node);
    }

    /// Takes a transfer of which the frames were not handed over.
    pub(crate) fn hear(&mut self, node: NodeId, ended: &Transferred) {
        self.pdos.note(node, self.nodes.entry(node).or_default(), ended);
    }

    /// Whether a known node is a lift device.
    fn has_lift(&self) -> bool {
        self.nodes.values().any(|known| known.catalogue().device_type().is_some_and(is_lift))
    }

    /// Whether a node is one of this project.
    fn is_own(&self, node: Option<NodeId>) -> bool {
        let known = node.and_then(|node| self.nodes.get(&node));
        known.is_some_and(|known| known.catalogue().is_of_this_project())
    }

    /// The line of a frame that CANopen does not use.
    #[must_use]
    pub fn on_foreign(frame: Foreign, at: Instant) -> Line {
        let Foreign { kind, id, data } = frame;
        let text = format!("{}: {}", kind.name(), hex_digits(&data, " "));
        let text = text.trim_end_matches(": ").to_owned();
        Line { at, id, kind: Kind::Other, node: None, text, values: Vec::new(), abort: None, data }
    }

    /// The lines of a frame. There is no line for a part of an unfinished transfer, and for a heartbeat without a
    /// change. There are two lines where a transfer begins before the former one has ended.
    pub fn on_frame(&mut self, frame: &Frame, at: Instant) -> Vec<Line> {
        let id = frame.id();
        let said = |kind, node, said: Said| Line {
            at,
            id: id.into(),
            kind,
            node,
            text: said.text,
            values: said.values,
            abort: said.abort,
            data: frame.data().to_vec(),
        };
        let one =
            |kind, node, text: Option<Said>| text.map(|text| said(kind, node, text)).into_iter().collect();
        let node = NodeId::new(u8::try_from(id & 0x7F).unwrap_or(0));
        match (id, node) {
            (0x000, _) => one(Kind::Nmt, None, Some(services::nmt(frame))),
            (0x080, _) => one(Kind::Sync, None, Some(services::sync(frame))),
            (0x100, _) => one(Kind::Time, None, Some(services::time(frame))),
            (0x7E4 | 0x7E5, _) => one(Kind::Lss, None, Some(services::lss(frame))),
            (0x701..=0x77F, node) => one(Kind::Heartbeat, node, self.states.on_frame(frame, node)),
            _ if self.pdos.has(id, &self.nodes) => {
                let (node, text) = self.pdos.on_frame(frame, &self.nodes);
                one(Kind::Pdo, node, Some(text))
            }
            (0x081..=0x0FF, node) => one(Kind::Emcy, node, Some(services::emcy(frame, self.is_own(node)))),
            (0x581..=0x5FF | 0x601..=0x67F, Some(node)) => {
                let known = self.nodes.entry(node).or_default();
                let is_within = self.transfers.has(node);
                let events = self.transfers.on_frame(node, frame, at);
                if events.is_empty() && !is_within && !self.transfers.has(node) {
                    let is_first = self.without_begin.insert(node);
                    return one(Kind::Sdo, Some(node), is_first.then(|| sdo::without_begin(frame)));
                }
                self.without_begin.remove(&node);
                let lines = events.into_iter().map(|event| {
                    self.pdos.note(node, known, &event);
                    said(Kind::Sdo, Some(node), event.say(known, node))
                });
                lines.collect()
            }
            (0x181..=0x57F, Some(node)) => {
                // A PDO of a lift does not tell its node.
                let node = Some(node).filter(|_| !(is_fixed(id) && self.has_lift()));
                one(Kind::Pdo, node, Some(pdo::unknown(frame)))
            }
            _ => one(Kind::Other, None, Some(Said::text(hex(frame)))),
        }
    }
}

/// A value as people read it: ` = 3.25 bar`; empty without a value.
fn equals(shown: &Shown) -> String {
    let Some(value) = &shown.value else { return String::new() };
    let meaning = shown.meaning.as_ref().map(|meaning| format!(" [{meaning}]")).unwrap_or_default();
    format!(" = {}{meaning}", with_unit(value, "", &shown.unit))
}

/// The data of a frame as pairs of digits.
fn hex(frame: &Frame) -> String {
    if frame.is_remote() {
        return format!("remote frame of {} bytes", frame.len());
    }
    hex_digits(frame.data(), " ")
}

/// The value of an object in these bytes, with its name, unit and meaning.
fn value(known: &Knowledge, catalogue: &Catalogue, node: NodeId, at: Multiplexer, bytes: &[u8]) -> Shown {
    let data_type = catalogue.data_type(at).unwrap_or_else(|| crate::value::guess(bytes));
    let quantity = known.quantity(at, node);
    let raw = Value::decode(bytes, data_type);
    Shown {
        at,
        name: catalogue.name(at).unwrap_or_default(),
        meaning: crate::meaning::of(catalogue, at, &raw),
        value: Some(quantity.apply(raw)),
        unit: quantity.unit,
    }
}
