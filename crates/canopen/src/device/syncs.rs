//! SYNC in the device: objects 1005h, 1006h, 1007h, 1019h, and the reaction to a SYNC.

use super::Definition;
use super::inner::Inner;
use super::{Application, STALE};
use crate::dictionary::Services;
use crate::emcy::Fault;
use crate::pdo::{Chain, ProcessContext};
use crate::sync::Settings;
use crate::transmit::RETRY;
use crate::{Frame, Tick, Transmit};

impl<D: Definition> Inner<D> {
    pub(super) fn configure_sync(&mut self, now: Tick) {
        let [overflow, ..] = self.number(0x1019, 0).to_le_bytes();
        let settings = Settings {
            cob_id: self.number_or(0x1005, 0, 0x80),
            period: self.number(0x1006, 0),
            window: self.number(0x1007, 0),
            overflow,
        };
        if Self::has(Services::SYNC_PRODUCER) && self.sync_producer.configure(&settings) {
            self.restart_sync();
        }
        self.sync.configure(settings);
        self.end_sync_faults(now);
    }

    /// A SYNC is right, or the settings are new.
    #[inline(never)]
    fn end_sync_faults(&mut self, now: Tick) {
        self.clear(Fault::SyncMissing, now);
        self.clear(Fault::SyncLength, now);
    }

    /// Begins or ends the production of SYNCs, after a change of the settings or of the NMT state.
    pub(super) fn restart_sync(&mut self) {
        if self.state.has_services() {
            self.sync_producer.restart();
        } else {
            self.sync_producer.stop();
        }
        self.process_due = STALE;
    }

    /// Sends the SYNC that is due, and reacts to it as to the SYNC of another node.
    #[inline(never)]
    pub(super) fn produce_sync(&mut self, context: &mut ProcessContext<'_, impl Transmit, Self>) {
        if context.now < self.sync_producer.due() {
            return;
        }
        let frame = self.sync_producer.frame();
        if !context.send(frame) {
            return self.sync_producer.wait_until(context.now.plus(RETRY));
        }
        self.sync_producer.sent(context.now);
        if self.state.has_pdos() {
            self.on_sync(&frame, context);
        }
    }

    pub(super) fn on_sync(&mut self, frame: &Frame, context: &mut ProcessContext<'_, impl Transmit, Self>) {
        let Ok(sync) = self.sync.take(frame, context.now) else {
            return self.raise(Fault::SyncLength, context.now);
        };
        if self.sync.is_back() {
            self.end_sync_faults(context.now);
        }
        let mut links = self.first_rpdos;
        while let Some(rpdo) = self.rpdos.as_mut().get_mut(links.next(Chain::Synchronous)) {
            let place = links.next(Chain::Synchronous);
            links = rpdo.links;
            if let Some(data) = rpdo.take_waiting() {
                self.store_rpdo(place, data);
            }
        }
        self.application.synchronised(sync.counter, self.image.as_mut());
        self.each_tpdo(Chain::Synchronous, |tpdo, (_, image, _)| tpdo.on_sync(sync, image, context));
        if D::Application::SENDS_EVENTS && self.sends_events {
            self.send_events_with_sync(context);
        }
        self.process_due = self.process_due.min(self.sync.due());
    }

    /// Detects a missing SYNC, and drops TPDOs that were not sent within the synchronous window.
    pub(super) fn poll_sync(&mut self, now: Tick) {
        if self.sync.expire(now) {
            self.raise(Fault::SyncMissing, now);
            self.process_due = STALE;
        }
        if self.sync.is_window_over(now) {
            self.tpdos.as_mut().iter_mut().for_each(crate::pdo::Tpdo::drop_synchronous);
        }
    }
}
