//! Decoding of PDOs by the mapping in force.

use std::collections::{BTreeMap, BTreeSet};

use canopen::pdo::{Address, MappedObject, Mpdo};
use canopen::sdo::Multiplexer;
use canopen::{CobId, Frame, NodeId};

use super::sdo::Transferred;
use super::{Knowledge, Said, Shown, equals, hex, value};
use crate::object::{Place, at};
use crate::tpdo::Tpdo;

/// The numbers of mapped objects that stand for the kinds of MPDO (CiA 301, 7.5.2.36).
const MPDO: [u32; 2] = [0xFE, 0xFF];

/// A PDO of a node.
#[derive(Debug)]
struct Pdo {
    node: NodeId,
    name: String,
    /// Whether the PDO is a TPDO.
    is_sent: bool,
    content: Content,
}

#[derive(Debug)]
enum Content {
    Mapped(Tpdo),
    Multiplexed,
}

/// The PDOs of all known nodes.
#[derive(Debug, Default)]
pub(super) struct Pdos {
    by_node: BTreeMap<NodeId, BTreeMap<u16, Pdo>>,
    /// The node that owns the PDO of a CAN-ID.
    owners: BTreeMap<u16, NodeId>,
    /// Nodes with changed knowledge. Their PDOs are looked up again with the next frame.
    changed: BTreeSet<NodeId>,
}

impl Pdos {
    /// Notes that the knowledge about a node has changed.
    pub(super) fn forget(&mut self, node: NodeId) {
        self.changed.insert(node);
    }

    /// Takes the value that a transfer has shown.
    pub(super) fn note(&mut self, node: NodeId, known: &mut Knowledge, event: &Transferred) {
        if let Some(bytes) = event.value() {
            known.tell(event.at, bytes);
            if (0x1400..0x1C00).contains(&event.at.index) {
                self.forget(node);
            }
        }
    }

    /// Whether a known PDO has this CAN-ID.
    pub(super) fn has(&mut self, id: u16, nodes: &BTreeMap<NodeId, Knowledge>) -> bool {
        if !self.changed.is_empty() {
            for node in std::mem::take(&mut self.changed) {
                let pdos = nodes.get(&node).map(|known| look_up(node, known)).unwrap_or_default();
                self.by_node.insert(node, pdos);
            }
            self.owners = owners(&self.by_node);
        }
        self.owners.contains_key(&id)
    }

    /// The content of a frame, and the node that owns the PDO.
    pub(super) fn on_frame(
        &mut self,
        frame: &Frame,
        nodes: &BTreeMap<NodeId, Knowledge>,
    ) -> (Option<NodeId>, Said) {
        let owner = self.owners.get(&frame.id());
        let found =
            owner.and_then(|owner| Some((self.by_node.get(owner)?.get(&frame.id())?, nodes.get(owner)?)));
        let Some((pdo, known)) = found else { return (None, unknown(frame)) };
        if frame.is_remote() {
            return (Some(pdo.node), Said::text(format!("{}: asked for", pdo.name)));
        }
        let (what, values) = match &pdo.content {
            Content::Mapped(mapped) => (String::new(), mapped_values(pdo.node, mapped, known, frame)),
            Content::Multiplexed => multiplexed(pdo.node, known, frame),
        };
        let list: Vec<String> =
            values.iter().map(|shown| format!("{}{}", short(known, shown.at), equals(shown))).collect();
        let list = if list.is_empty() { hex(frame) } else { list.join(", ") };
        (Some(pdo.node), Said { text: format!("{}{what}: {list}", pdo.name), values, abort: None })
    }
}

/// The name of an object without the name of its record; where it is unknown, its address.
fn short(known: &Knowledge, at: Multiplexer) -> String {
    known.catalogue().entry(at).map_or_else(|| Place(at).to_string(), |entry| entry.name.clone())
}

/// An unknown PDO, by the pre-defined connection set (CiA 301, 7.3.5).
pub(super) fn unknown(frame: &Frame) -> Said {
    let group = frame.id() >> 7;
    let name = match group % 2 {
        1 => format!("TPDO {}", group / 2),
        _ => format!("RPDO {}", (group / 2).saturating_sub(1)),
    };
    Said::text(format!("{name}: {}", hex(frame)))
}

/// The PDOs of a node by CAN-ID. Where an RPDO and a TPDO share a CAN-ID, the TPDO counts, because the sender knows the
/// content best.
fn look_up(node: NodeId, known: &Knowledge) -> BTreeMap<u16, Pdo> {
    // RPDOs come first, so that TPDOs replace them.
    known.pdos().into_iter().filter_map(|index| pdo(node, known, index)).collect()
}

/// The owner of each CAN-ID. Where several nodes have a PDO with the CAN-ID, the sender owns it.
fn owners(by_node: &BTreeMap<NodeId, BTreeMap<u16, Pdo>>) -> BTreeMap<u16, NodeId> {
    let all = |is_sent: bool| {
        let pdos = by_node.values().flat_map(BTreeMap::iter);
        pdos.filter(move |(_, pdo)| pdo.is_sent == is_sent).map(|(id, pdo)| (*id, pdo.node))
    };
    all(false).chain(all(true)).collect()
}

/// The PDO of a communication parameter; `None` where the PDO is off or empty.
fn pdo(node: NodeId, known: &Knowledge, index: u16) -> Option<(u16, Pdo)> {
    let cob_id = CobId::parse(known.number(at(index, 1), node)?).filter(|cob_id| !cob_id.bit31)?;
    let mapping = index + 0x200;
    let count = known.number(at(mapping, 0), node)?;
    let is_sent = index >= 0x1800;
    let (direction, number) = if is_sent { ("TPDO", index - 0x17FF) } else { ("RPDO", index - 0x13FF) };
    let content = if MPDO.contains(&count) {
        Content::Multiplexed
    } else {
        let slots = (1..=u8::try_from(count).ok().filter(|count| (1..=64).contains(count))?)
            .map(|slot| known.number(at(mapping, slot), node).map(MappedObject::parse));
        Content::Mapped(Tpdo { number, id: cob_id.id.get(), mapping: slots.collect::<Option<_>>()? })
    };
    Some((cob_id.id.get(), Pdo { node, name: format!("{direction} {number}"), is_sent, content }))
}

fn mapped_values(node: NodeId, mapped: &Tpdo, known: &Knowledge, frame: &Frame) -> Vec<Shown> {
    // Indices below 0020h are data types, which fill gaps.
    let values = mapped.values(frame.data()).filter(|(at, _)| at.index >= 0x20);
    values.map(|(at, bytes)| value(known, known.catalogue(), node, at, &bytes)).collect()
}

/// The content of a multiplexed PDO, and its addressee.
fn multiplexed(node: NodeId, known: &Knowledge, frame: &Frame) -> (String, Vec<Shown>) {
    let Some(mpdo) = frame.data().try_into().ok().and_then(Mpdo::parse) else { return Default::default() };
    let what = match mpdo.address {
        Address::Source(node) => format!(" (MPDO of node {})", node.get()),
        Address::Destination(None) => " (MPDO for all nodes)".to_owned(),
        Address::Destination(Some(node)) => format!(" (MPDO for node {})", node.get()),
    };
    (what, vec![value(known, known.catalogue(), node, mpdo.at, size_of(known, mpdo.at, &mpdo.data))])
}

/// The bytes of the object in an MPDO, whose data field always has four bytes.
fn size_of<'a>(known: &Knowledge, at: Multiplexer, data: &'a [u8; 4]) -> &'a [u8] {
    let bits = match known.catalogue().data_type(at).map(eds::DataType::class) {
        Some(eds::Class::Signed(bits) | eds::Class::Unsigned(bits) | eds::Class::Real(bits)) => bits,
        _ => 32,
    };
    &data[..usize::from(bits).div_ceil(8).min(4)]
}
