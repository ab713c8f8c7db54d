//! Process data: NMT commands, SYNC, PDOs.

use super::{Application, Core, Device, STALE};
use crate::nmt::Command;
use crate::pdo::{PdoSet, Rpdo, Tpdo};
use crate::transmit::Turn;
use crate::{CanId, Frame, Instant, Transmit};

impl<A: Application, const N: usize> Device<A, N> {
    /// A frame with one of the [`process_ids`](Device::process_ids). Any other is ignored.
    pub fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let turn = &mut self.turn(now, out);
        if frame.id() == CanId::NMT.get() {
            self.on_nmt(frame, turn);
        } else if self.core.state.has_pdos() && !A::SERVICES_ONLY {
            self.core.on_pdo_frame(frame, turn);
        }
    }

    #[inline(never)]
    fn on_nmt(&mut self, frame: &Frame, turn: &mut Turn<'_, impl Transmit>) {
        let own = self.core.node_id.filter(|_| !self.core.is_initialising());
        let Some(command) = own.and_then(|own| Command::parse(frame.data(), own)) else { return };
        self.command(command);
        self.send_process(turn);
    }

    /// Sends what is due. Returns the instant of the next call.
    pub fn poll_process(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        let turn = &mut self.turn(now, out);
        self.send_process(turn)
    }

    pub(super) fn send_process(&mut self, turn: &mut Turn<'_, impl Transmit>) -> Instant {
        let core = &mut self.core;
        if A::SERVICES_ONLY {
            return Instant::NEVER;
        }
        if turn.now >= core.process_due {
            core.poll_sync(turn.now);
            let mut due = core.poll_rpdos(turn.now);
            core.each_tpdo(core.valid_tpdos, |tpdo, image| {
                tpdo.poll(image, turn);
                due = due.min(tpdo.due());
            });
            core.scanner.poll(&core.image, turn);
            core.process_due = due.min(core.scanner.due()).min(core.sync.due());
        }
        core.process_due
    }

    /// The application has updated values in the image: sends what a change triggers.
    pub fn changed(&mut self, now: Instant, out: &mut impl Transmit) {
        let turn = &mut self.turn(now, out);
        self.start_by_itself(turn);
        if self.core.state.has_pdos() && !A::SERVICES_ONLY {
            self.core.each_tpdo(self.core.valid_tpdos, |tpdo, image| tpdo.on_change(image, turn));
            self.core.scanner.on_change(&self.core.image, turn);
            self.core.process_due = self.core.process_due.min(self.core.scanner.due());
        }
    }

    /// Identifiers of frames for [`on_process_frame`](Device::on_process_frame), data and remote.
    pub fn process_ids(&self) -> impl Iterator<Item = CanId> {
        let received = self.core.rpdos.iter().filter_map(Rpdo::id);
        let requests = self.core.tpdos.iter().filter_map(Tpdo::settings).filter(|tpdo| tpdo.answers_remote);
        [CanId::NMT, self.core.sync.id()].into_iter().chain(received).chain(requests.map(|tpdo| tpdo.id))
    }
}

impl<A: Application, const N: usize> Core<A, N> {
    fn on_pdo_frame(&mut self, frame: &Frame, turn: &mut Turn<'_, impl Transmit>) {
        if self.sync.accepts(frame) {
            self.on_sync(frame, turn);
        } else if frame.is_remote() {
            self.each_tpdo(self.valid_tpdos, |tpdo, image| {
                if tpdo.settings().is_some_and(|settings| settings.id.get() == frame.id()) {
                    tpdo.on_remote(image, turn);
                }
            });
        } else {
            self.on_rpdo(frame, turn.now);
        }
    }

    /// Visits some TPDOs. What one of them could not send at once moves the next deadline.
    pub(super) fn each_tpdo(&mut self, tpdos: PdoSet, mut visit: impl FnMut(&mut Tpdo, &[u8])) {
        for number in tpdos.iter() {
            let Some(tpdo) = self.tpdos.get_mut(usize::from(number)) else { return };
            visit(tpdo, &self.image);
            if tpdo.is_pending() {
                self.process_due = STALE;
            }
        }
    }
}
