//! Node-ID and bit rate of the node: from the note of the last start in RAM, otherwise from the device record. The
//! product code follows from the personality in the device record.

use bsp::can::bit_timing::BitTiming;
use bsp::chip::factory;
use bsp::chip::handover::Handover;
use bsp::chip::memory::{PARAMETER_PAGE, parameter_pages};
use canopen::NodeId;
use storage::{DeviceRecord, Memory, Pages};

/// Node-ID of a node without any data.
const NODE_ID: Option<NodeId> = NodeId::new(126);

/// Node-ID, bit rate and product code.
#[derive(Clone, Copy)]
pub(crate) struct Identity {
    /// `None` for a node that waits for LSS to assign one.
    pub(crate) node_id: Option<NodeId>,
    /// `None` if the bit rate has to be detected.
    pub(crate) timing: Option<BitTiming>,
    /// 1018h:2, as in the application.
    pub(crate) product: u32,
    /// 1018h:4. Read once, because during an erase a read of the unique identifier waits as long as one of the flash.
    pub(crate) serial_number: u32,
}

impl Identity {
    pub(crate) fn read(note: Option<Handover>) -> Identity {
        let (mut node_id, mut timing, mut personality) = (NODE_ID, None, 0);
        if let Some(record) = stored() {
            node_id = NodeId::new(record.node_id());
            timing = BitTiming::of(record.bit_rate_kbit());
            personality = record.personality();
        }
        if let Some(note) = note {
            node_id = note.node_id.and_then(NodeId::new);
            timing = Some(note.timing);
        }
        let serial_number = factory::serial_number();
        Identity { node_id, timing, product: profiles::product::code(personality), serial_number }
    }
}

/// The device record stored by LSS or the factory.
fn stored() -> Option<DeviceRecord> {
    storage::device_record(&mut Memory(parameter_pages()), Pages::new(0, PARAMETER_PAGE))
}
