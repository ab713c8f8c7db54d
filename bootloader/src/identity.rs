//! Where the node is on the bus: what the last start has left in RAM, else what is stored in the device record.

use bsp::bit_timing::BitTiming;
use bsp::handover::Handover;
use bsp::memory::{PARAMETER_PAGE, parameter_pages};
use canopen::NodeId;
use storage::{DeviceRecord, Memory, Pages};

/// Where a node is found of which nothing is known.
const NODE_ID: Option<NodeId> = NodeId::new(126);

/// Node-ID and bit rate.
#[derive(Clone, Copy)]
pub(crate) struct Identity {
    /// `None` for a node that waits for LSS to give it one.
    pub(crate) node_id: Option<NodeId>,
    /// `None` where it has to be found.
    pub(crate) timing: Option<BitTiming>,
}

impl Identity {
    pub(crate) fn read(note: Option<Handover>) -> Identity {
        match note {
            Some(note) => Identity { node_id: note.node_id.and_then(NodeId::new), timing: Some(note.timing) },
            None => stored().map_or(Identity { node_id: NODE_ID, timing: None }, |record| Identity {
                node_id: NodeId::new(record.node_id()),
                timing: BitTiming::of(record.bit_rate_kbit()),
            }),
        }
    }
}

/// The device record that LSS or the factory has stored.
fn stored() -> Option<DeviceRecord> {
    storage::device_record(&mut Memory(parameter_pages()), Pages::new(0, PARAMETER_PAGE))
}
