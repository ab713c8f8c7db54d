//! Receiving and sending of frames, and the loss of the bus.

use std::sync::Arc;

use canopen::{Frame, NodeId};
use serde_json::json;

use super::{AT_ONCE, LISTEN, Pump, REOPEN};
use crate::Catalogue;
use crate::bus::{BusError, Received, clock};
use crate::cli::serve::jobs::Learned;
use crate::cli::serve::status;
use crate::trace::Transferred;

impl Pump {
    pub(super) fn take_frames(&mut self) {
        let mut until = if self.outlets.is_empty() { clock::now() + LISTEN } else { clock::now() };
        for _ in 0..AT_ONCE {
            let Ok(bus) = &mut self.bus else { return };
            match bus.receive(until) {
                Ok(Some(received)) => self.on_frame(&received),
                Ok(None) => return,
                Err(error) => return self.lose(error),
            }
            until = clock::now();
        }
    }

    pub(super) fn on_frame(&mut self, received: &Received) {
        let t = self.time.of_frame(received.at, clock::now());
        let frame = &received.frame;
        self.outlets.retain(|outlet| outlet.hand_over(received));
        self.count.add(frame);
        self.peak.add(status::bits(frame), t);
        if let Some(news) = self.nodes.on_frame(frame, t) {
            self.on_news(frame, t);
            self.pages.tell(&self.setup.hub, &json!(news));
        }
        self.live.on_frame(frame, t);
        self.hear_transfer(frame, t);
        if let Some((node, ended)) = self.others.on_frame(frame, clock::now()) {
            self.overhear(node, &ended);
        }
        if self.pages.have_trace() {
            self.tracer.on_frame(frame, received.at, t, false);
        }
    }

    /// Notes a node that boots, because it may have another PDO mapping now.
    pub(super) fn on_news(&mut self, frame: &Frame, t: f64) {
        let node = u8::try_from(frame.id() & 0x7F).ok().and_then(NodeId::new);
        if let (0x701..=0x77F, Some(node), [0]) = (frame.id(), node, frame.data()) {
            self.remapped.push((node, t));
            // An additional SDO server may be off again.
            self.others.set_channel(node, None);
        }
    }

    /// Learns the identity of a node from the transfers of other clients.
    fn overhear(&mut self, node: NodeId, ended: &Transferred) {
        let Some(bytes) = ended.read() else { return };
        let mut identity = self.nodes.get(node).and_then(|node| node.identity.clone()).unwrap_or_default();
        if identity.hear(ended.at, bytes) {
            let known = self.nodes.get(node).and_then(|node| node.catalogue.clone());
            let catalogue = identity.catalogue().map(Arc::new).or(known);
            let catalogue = catalogue.unwrap_or_else(|| Arc::new(Catalogue::unknown()));
            self.learn(node, Learned::Identity(identity, catalogue));
        }
    }

    /// Takes an SDO frame of any client, this program included.
    fn hear_transfer(&mut self, frame: &Frame, t: f64) {
        let Some((node, is_additional, frame)) = self.others.sdo(frame) else { return };
        let transfers = &mut self.transfers[usize::from(is_additional)];
        for ended in transfers.on_frame(node, &frame, clock::now()) {
            let Some(bytes) = ended.value() else { continue };
            if ended.is_write && (0x1800..0x1C00).contains(&ended.at.index) {
                self.note_remapped(node, t);
            }
            self.tracer.hear(node, &ended);
            if self.live.hear(node, ended.at, bytes) {
                self.tell_mapping(node);
            }
        }
    }

    /// Notes a node whose PDO parameters are written, by this program or by another master.
    pub(super) fn note_remapped(&mut self, node: NodeId, t: f64) {
        match self.remapped.iter_mut().find(|(other, _)| *other == node) {
            Some((_, since)) => *since = t,
            None => self.remapped.push((node, t)),
        }
    }

    pub(super) fn send(&mut self, frame: &Frame) {
        let Ok(bus) = &mut self.bus else { return };
        if let Err(error) = bus.send(frame) {
            return self.lose(error);
        }
        let (here, t) = (clock::now(), self.now());
        self.count.add(frame);
        self.peak.add(status::bits(frame), t);
        self.hear_transfer(frame, t);
        if self.pages.have_trace() {
            self.tracer.on_frame(frame, here, t, true);
        }
    }

    /// Handles the loss of the bus. All jobs notice the loss at their ports.
    pub(super) fn lose(&mut self, error: BusError) {
        self.bus = Err(error);
        self.outlets.clear();
        self.due.reopen = clock::now() + REOPEN;
        self.due.status = clock::now();
    }

    pub(super) fn reopen(&mut self) {
        let now = clock::now();
        if self.bus.is_ok() || now < self.due.reopen {
            return;
        }
        self.bus = self.setup.options.bus.open(self.setup.options.bit_rate());
        self.due.reopen = clock::now() + REOPEN;
        if self.bus.is_ok() {
            self.time.restart();
            self.due.status = now;
        }
    }
}
