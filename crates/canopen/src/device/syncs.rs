//! SYNC in the device: objects 1005h, 1006h, 1007h, 1019h, and the reaction to a SYNC.

use super::body::Body;
use super::full::Full;
use super::{Application, STALE};
use crate::emcy::Fault;
use crate::pdo::Chain;
use crate::sync::Settings;
use crate::transmit::ProcessContext;
use crate::{Frame, Instant, Transmit};

impl<
    A: Application,
    const N: usize,
    const T: usize,
    const R: usize,
    const W: usize,
    const M: usize,
    const S: u16,
> Full<A, N, T, R, W, M, S>
{
    pub(super) fn configure_sync(&mut self, now: Instant) {
        let [overflow, ..] = self.basic().number(0x1019, 0).to_le_bytes();
        self.sync.configure(Settings {
            cob_id: self.basic().number_or(0x1005, 0, 0x80),
            period: self.basic().number(0x1006, 0),
            window: self.basic().number(0x1007, 0),
            overflow,
        });
        self.clear(Fault::SyncMissing, now);
    }

    pub(super) fn on_sync(&mut self, frame: &Frame, context: &mut ProcessContext<'_, impl Transmit>) {
        let Ok(sync) = self.sync.take(frame, context.now) else {
            return self.report(Fault::SyncLength, context.now);
        };
        if self.sync.is_back() {
            self.clear(Fault::SyncMissing, context.now);
        }
        let mut links = self.first_rpdos;
        while let Some(rpdo) = self.rpdos.get_mut(links.next(Chain::Synchronous)) {
            let place = links.next(Chain::Synchronous);
            links = rpdo.links;
            if let Some(data) = rpdo.take_waiting() {
                self.store_rpdo(place, data);
            }
        }
        self.basic.application.synchronised(sync.counter, &mut self.basic.image);
        self.each_tpdo(Chain::Synchronous, |tpdo, image| tpdo.on_sync(sync, image, context));
        if self.sends_events {
            self.send_events_with_sync(context);
        }
        self.basic.process_due = self.basic.process_due.min(self.sync.due());
    }

    /// Detects a missing SYNC, and drops TPDOs that were not sent within the synchronous window.
    pub(super) fn poll_sync(&mut self, now: Instant) {
        if self.sync.expire(now) {
            self.raise(Fault::SyncMissing, now);
            self.basic.process_due = STALE;
        }
        if self.sync.is_window_over(now) {
            self.tpdos.iter_mut().for_each(crate::pdo::Tpdo::drop_synchronous);
        }
    }
}
