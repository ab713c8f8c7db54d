//! The nodes that were heard, and their state.

use std::collections::BTreeMap;
use std::sync::Arc;

use canopen::emcy::Message;
use canopen::nmt::State;
use canopen::sdo::Multiplexer;
use canopen::{Frame, NodeId};
use serde::Serialize;

use super::status::Count;
use crate::heartbeat::{self, Heartbeat};
use crate::{Catalogue, meaning, value};

/// The number of missing heartbeats after which a node counts as absent.
const MISSED: f64 = 3.0;
/// The time after which a node without a heartbeat counts as absent, in seconds.
const SILENCE: f64 = 5.0;

/// The identity of a node, read by SDO.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(super) struct Identity {
    pub(super) name: Option<String>,
    pub(super) personality: Option<String>,
    pub(super) data_sheet: bool,
    pub(super) device_type: Option<u32>,
    pub(super) vendor: Option<u32>,
    pub(super) product: Option<u32>,
    pub(super) revision: Option<u32>,
    pub(super) serial: Option<u32>,
    pub(super) version: Option<String>,
    pub(super) hardware: Option<String>,
    /// Why the data sheet that the user has named is not used for the node.
    pub(super) note: Option<String>,
}

impl Identity {
    /// Takes a value that another client has read. Returns whether the value is a part of the identity that was not
    /// known.
    pub(super) fn hear(&mut self, at: Multiplexer, bytes: &[u8]) -> bool {
        let before = self.clone();
        let word = || bytes.try_into().ok().map(u32::from_le_bytes);
        let text = || Some(value::text(bytes));
        match (at.index, at.sub) {
            (0x1000, 0) => self.device_type = word(),
            (0x1018, 1) => self.vendor = word(),
            (0x1018, 2) => self.product = word(),
            (0x1018, 3) => self.revision = word(),
            (0x1018, 4) => self.serial = word(),
            (0x1008, 0) => self.name = text(),
            (0x1009, 0) => self.hardware = text(),
            (0x100A, 0) => self.version = text(),
            _ => return false,
        }
        let device = self.vendor.zip(self.product);
        self.personality = device.and_then(|(vendor, product)| Catalogue::device_name(vendor, product));
        self.data_sheet |= self.personality.is_some();
        *self != before
    }

    /// The built-in data sheet of the device.
    pub(super) fn catalogue(&self) -> Option<Catalogue> {
        Catalogue::built_in(self.vendor?, self.product?)
    }
}

/// An emergency message.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Emergency {
    t: f64,
    code: u16,
    text: String,
    active: bool,
}

/// The state of a node.
#[derive(Default)]
pub(super) struct Node {
    pub(super) identity: Option<Identity>,
    pub(super) catalogue: Option<Arc<Catalogue>>,
    /// The time of the last request for the identity of the node; `None` if the node has to be asked.
    pub(super) asked: Option<f64>,
    pub(super) updating: bool,
    /// Whether another client talks to the node.
    pub(super) other_client: bool,
    /// The time of the last boot-up message.
    booted: Option<f64>,
    state: Option<State>,
    seen: f64,
    heartbeat: Option<f64>,
    last_heartbeat: Option<f64>,
    emergency: Option<Emergency>,
    count: Count,
    frames: f64,
    load: f64,
    is_alive: bool,
    is_new: bool,
}

/// News that pages get at once.
#[derive(Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub(super) enum News {
    State {
        node: u8,
        t: f64,
        state: &'static str,
    },
    Emcy {
        node: u8,
        #[serde(flatten)]
        emergency: Emergency,
    },
}

#[derive(Serialize)]
struct Row<'n> {
    node: u8,
    #[serde(flatten)]
    identity: &'n Identity,
    state: Option<&'static str>,
    alive: bool,
    heartbeat: Option<f64>,
    seen: f64,
    emcy: Option<&'n Emergency>,
    frames: f64,
    load: f64,
    updating: bool,
    other_client: bool,
}

/// All nodes.
#[derive(Default)]
pub(super) struct Nodes {
    nodes: BTreeMap<NodeId, Node>,
}

impl Nodes {
    pub(super) fn get(&self, node: NodeId) -> Option<&Node> {
        self.nodes.get(&node)
    }

    /// The entry of a node, marked as changed.
    pub(super) fn change(&mut self, node: NodeId) -> &mut Node {
        let entry = self.nodes.entry(node).or_default();
        entry.is_new = true;
        entry
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (NodeId, &Node)> {
        self.nodes.iter().map(|(node, entry)| (*node, entry))
    }

    /// Takes the information that a frame has about its sender.
    pub(super) fn on_frame(&mut self, frame: &Frame, t: f64) -> Option<News> {
        let (node, is_proof) = sender(frame)?;
        if !is_proof && !self.nodes.contains_key(&node) {
            return None;
        }
        let entry = self.nodes.entry(node).or_default();
        entry.is_new |= !entry.is_alive;
        (entry.seen, entry.is_alive) = (t, true);
        entry.count.add(frame);
        match frame.id() & !0x7F {
            0x080 => entry.on_emergency(node, frame, t),
            0x700 => entry.on_heartbeat(node, Heartbeat::parse(frame)?, t),
            _ => None,
        }
    }

    /// Counts the frames of the last `seconds`, and marks the nodes that are absent.
    pub(super) fn look(&mut self, t: f64, seconds: f64, kbit: Option<u16>) {
        for entry in self.nodes.values_mut() {
            let rate = entry.count.rate(seconds);
            let load = rate.load(kbit).unwrap_or(0.0);
            entry.is_new |= (entry.frames, entry.load) != (rate.frames, load);
            (entry.frames, entry.load) = (rate.frames, load);
            let patience = entry.heartbeat.map_or(SILENCE, |period| MISSED * period);
            if entry.is_alive && t - entry.seen > patience.max(1.0) {
                (entry.is_alive, entry.is_new, entry.last_heartbeat) = (false, true, None);
            }
        }
    }

    /// The event with all nodes.
    pub(super) fn all(&self) -> serde_json::Value {
        self.event(true, |_| true)
    }

    /// The event with the nodes that have changed since the last call; `None` where no node has.
    pub(super) fn changed(&mut self) -> Option<serde_json::Value> {
        let event =
            self.nodes.values().any(|entry| entry.is_new).then(|| self.event(false, |entry| entry.is_new));
        self.nodes.values_mut().for_each(|entry| entry.is_new = false);
        event
    }

    fn event(&self, all: bool, is_wanted: impl Fn(&Node) -> bool) -> serde_json::Value {
        let unknown = Identity::default();
        let wanted = self.nodes.iter().filter(|(_, entry)| is_wanted(entry));
        let rows: Vec<Row> = wanted.map(|(node, entry)| entry.row(*node, &unknown)).collect();
        serde_json::json!({ "event": "nodes", "all": all, "nodes": rows })
    }
}

impl Node {
    pub(super) fn is_alive(&self) -> bool {
        self.is_alive
    }

    pub(super) fn state(&self) -> Option<State> {
        self.state
    }

    /// Whether the identity of the node is not known, or in parts only.
    pub(super) fn is_unknown(&self) -> bool {
        self.identity.as_ref().is_none_or(|identity| identity.device_type.is_none())
    }

    /// The time since the last boot-up message in seconds; without one, it is long ago.
    pub(super) fn since_boot(&self, t: f64) -> f64 {
        self.booted.map_or(f64::INFINITY, |booted| t - booted)
    }

    /// Whether the node is one of this project.
    fn is_own(&self) -> bool {
        self.identity.as_ref().is_some_and(|identity| identity.personality.is_some())
    }

    fn on_emergency(&mut self, node: NodeId, frame: &Frame, t: f64) -> Option<News> {
        let message = Message::parse(frame.data().try_into().ok()?);
        let emergency = Emergency {
            t,
            code: message.code,
            active: message.code & 0xFF00 != 0,
            text: meaning::emergency(message, self.is_own()),
        };
        (self.emergency, self.is_new) = (Some(emergency.clone()), true);
        Some(News::Emcy { node: node.get(), emergency })
    }

    fn on_heartbeat(&mut self, node: NodeId, heard: Heartbeat, t: f64) -> Option<News> {
        let is_boot = heard.state == State::Initialising;
        let period = self.last_heartbeat.map(|last| round(t - last)).filter(|_| !is_boot);
        self.is_new |= period != self.heartbeat && period.is_some();
        self.heartbeat = period.or(self.heartbeat);
        self.last_heartbeat = Some(t).filter(|_| !is_boot);
        if self.state.replace(heard.state) == Some(heard.state) && !is_boot {
            return None;
        }
        self.is_new = true;
        if is_boot {
            // After a boot the node may have another program or be another device: ask again.
            (self.asked, self.emergency, self.booted) = (None, None, Some(t));
        }
        Some(News::State { node: node.get(), t, state: heartbeat::words(heard.state) })
    }

    fn row<'n>(&'n self, node: NodeId, unknown: &'n Identity) -> Row<'n> {
        Row {
            node: node.get(),
            identity: self.identity.as_ref().unwrap_or(unknown),
            state: self.state.map(heartbeat::words),
            alive: self.is_alive,
            heartbeat: self.heartbeat,
            seen: self.seen,
            emcy: self.emergency.as_ref(),
            frames: self.frames,
            load: self.load,
            updating: self.updating,
            other_client: self.other_client,
        }
    }
}

/// The sender of a frame by the pre-defined connection set, and whether no other node can have sent the frame (CiA 301,
/// 7.3.5).
fn sender(frame: &Frame) -> Option<(NodeId, bool)> {
    let node = NodeId::new(u8::try_from(frame.id() & 0x7F).ok()?)?;
    match frame.id() & !0x7F {
        // A remote frame comes from another node, which asks this node.
        0x700 if frame.is_remote() => None,
        0x080 | 0x580 | 0x700 => Some((node, true)),
        // TPDOs. A TPDO of another node may have this COB-ID.
        0x180 | 0x280 | 0x380 | 0x480 => Some((node, false)),
        _ => None,
    }
}

/// Rounds to a hundredth of a second, because the host adds noise to a period.
fn round(seconds: f64) -> f64 {
    (seconds * 100.0).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u16, data: &[u8]) -> Frame {
        Frame::new(id, data).unwrap()
    }

    #[test]
    fn an_identity_is_learned_from_uploads_of_other_clients() {
        let mut identity = Identity::default();
        let at = crate::object::at;
        assert!(!identity.hear(at(0x1017, 0), &[1, 0]));
        assert!(identity.hear(at(0x1000, 0), &0x0002_0194_u32.to_le_bytes()));
        assert!(identity.hear(at(0x1018, 1), &profiles::product::VENDOR_ID.to_le_bytes()));
        assert!(identity.catalogue().is_none());
        assert!(identity.hear(at(0x1018, 2), &1_u32.to_le_bytes()));
        assert_eq!(identity.personality.as_deref(), Some("pressure"));
        assert!(identity.data_sheet && identity.catalogue().is_some());
        assert!(!identity.hear(at(0x1018, 2), &1_u32.to_le_bytes()), "nothing new");
    }

    fn row(nodes: &Nodes) -> serde_json::Value {
        nodes.all()["nodes"][0].clone()
    }

    #[test]
    fn a_node_is_known_by_its_boot_up_and_lost_after_three_heartbeats() {
        let mut nodes = Nodes::default();
        assert_eq!(nodes.on_frame(&frame(0x185, &[1]), 0.0), None, "a PDO proves nothing");
        let news = nodes.on_frame(&frame(0x705, &[0]), 0.0);
        assert_eq!(news, Some(News::State { node: 5, t: 0.0, state: "initialising" }));
        let news = nodes.on_frame(&frame(0x705, &[5]), 0.5);
        assert_eq!(news, Some(News::State { node: 5, t: 0.5, state: "operational" }));
        assert_eq!(nodes.on_frame(&frame(0x705, &[5]), 1.0), None);
        assert_eq!(row(&nodes)["heartbeat"], 0.5);
        nodes.look(2.4, 1.0, None);
        assert_eq!(row(&nodes)["alive"], true);
        nodes.look(2.6, 1.0, None);
        assert_eq!(row(&nodes)["alive"], false);
        nodes.on_frame(&frame(0x185, &[1]), 3.0);
        assert_eq!(row(&nodes)["alive"], true);
    }

    #[test]
    fn an_emergency_is_reported_and_ends_with_no_error() {
        let mut nodes = Nodes::default();
        let news = nodes.on_frame(&frame(0x085, &[0x30, 0x81, 0x11, 0, 0, 0, 0, 0]), 1.0).unwrap();
        let told = serde_json::to_value(&news).unwrap();
        assert_eq!(
            (&told["event"], &told["code"], &told["active"]),
            (&"emcy".into(), &0x8130.into(), &true.into())
        );
        nodes.on_frame(&frame(0x085, &[0; 8]), 2.0);
        assert_eq!(row(&nodes)["emcy"]["active"], false);
        assert_eq!(nodes.on_frame(&frame(0x085, &[1, 2]), 3.0), None);
    }

    #[test]
    fn only_changes_are_reported() {
        let mut nodes = Nodes::default();
        nodes.on_frame(&frame(0x701, &[5]), 0.0);
        nodes.on_frame(&frame(0x702, &[5]), 0.0);
        assert_eq!(nodes.changed().unwrap()["nodes"].as_array().map(Vec::len), Some(2));
        assert_eq!(nodes.changed(), None);
        nodes.change(NodeId::new(2).unwrap()).updating = true;
        let rows = nodes.changed().unwrap();
        assert_eq!((rows["nodes"].as_array().map(Vec::len), &rows["nodes"][0]["node"]), (Some(1), &2.into()));
    }
}
