//! EMCYs of other nodes: object 1028h, whose sub-index is the node-ID of the producer.

use super::inner::Inner;
use super::{Application, Definition};
use crate::dictionary::Services;
use crate::emcy::Message;
use crate::{CanId, CobId, Frame, NodeId};

const EMCY_CONSUMER: u16 = 0x1028;

impl<D: Definition> Inner<D> {
    /// The producers that are consumed, with their CAN-IDs.
    fn producers(&self) -> impl Iterator<Item = (NodeId, CanId)> {
        let entries = self.dictionary.object(EMCY_CONSUMER).filter(|_| Self::has(Services::EMCY_CONSUMER));
        entries.filter_map(|entry| NodeId::new(entry.sub()).zip(CobId::enabled(self.word(entry.field))))
    }

    /// The CAN-IDs of the EMCYs that are consumed.
    pub(super) fn emcy_ids(&self) -> impl Iterator<Item = CanId> {
        self.producers().map(|(_, id)| id)
    }

    /// Takes a frame, if it is an EMCY of another node and the NMT state allows it.
    #[inline(never)]
    pub(super) fn on_emergency(&mut self, frame: &Frame) {
        if !self.state.has_services() {
            return;
        }
        let producer = self.producers().find_map(|(node, id)| Some((node, frame.full(id)?)));
        if let Some((node, data)) = producer {
            self.application.emergency(node, Message::parse(*data), self.image.as_mut());
        }
    }
}
