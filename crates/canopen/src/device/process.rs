//! Process data: NMT commands, SYNC, PDOs.

use super::{Application, Core, Device, Next, STALE};
use crate::nmt::Command;
use crate::pdo::{Chain, Rpdo, Tpdo};
use crate::transmit::Turn;
use crate::{CanId, Frame, Instant, Transmit};

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Device<A, N, T, R, W, M>
{
    /// Takes a frame, whatever half it is for.
    #[inline]
    pub fn on_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        self.take_process_frame(frame, now, out);
        self.on_service_frame(frame, now, out)
    }

    /// Sends what is due in both halves.
    #[inline]
    pub fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let _ = self.poll_process(now, out);
        self.poll_services(now, out)
    }

    /// Takes a frame with one of the [`process_ids`](Device::process_ids). Any other is ignored.
    // What follows is put together where the caller needs it; the work has its place once.
    #[inline]
    pub fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        self.take_process_frame(frame, now, out);
        self.process_next()
    }

    #[inline(never)]
    fn take_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let turn = &mut self.turn(now, out);
        if frame.id() == CanId::NMT.get() {
            self.on_nmt(frame);
        } else if self.core.state.has_pdos() && !A::SERVICES_ONLY {
            self.core.on_pdo_frame(frame, turn);
        }
        self.send_process(turn);
    }

    #[inline(never)]
    fn on_nmt(&mut self, frame: &Frame) {
        let own = self.core.node_id.filter(|_| !self.core.is_initialising());
        let Some(command) = own.and_then(|own| Command::parse(frame.data(), own)) else { return };
        self.command(command);
    }

    /// Sends what is due of process data.
    #[inline]
    pub fn poll_process(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        if now >= self.core.process_due {
            let turn = &mut self.turn(now, out);
            self.send_process(turn);
        }
        self.process_next()
    }

    pub(super) fn send_process(&mut self, turn: &mut Turn<'_, impl Transmit>) {
        let core = &mut self.core;
        if A::SERVICES_ONLY {
            core.process_due = Instant::NEVER;
            return;
        }
        if turn.now < core.process_due {
            return;
        }
        self.run_process(turn);
    }

    #[inline(never)]
    fn run_process(&mut self, turn: &mut Turn<'_, impl Transmit>) {
        let core = &mut self.core;
        core.poll_sync(turn.now);
        let mut due = core.poll_rpdos(turn.now);
        core.each_tpdo(Chain::Valid, |tpdo, image| {
            tpdo.poll(image, turn);
            due = due.min(tpdo.due());
        });
        due = due.min(core.send_events(turn));
        core.scanner.poll(&core.image, turn);
        core.process_due = due.min(core.scanner.due()).min(core.sync.due());
    }

    /// Lets the application update values in the image, and sends what their change triggers. The first call after a start
    /// is the one with which a device that starts by itself (1F80h) becomes operational.
    pub fn publish(
        &mut self,
        now: Instant,
        out: &mut impl Transmit,
        update: impl FnOnce(&mut A, &mut [u8]),
    ) -> Next {
        self.show(update);
        self.send_changes(now, out);
        self.process_next()
    }

    /// Sends a TPDO of type 254 or 255 now, or as soon as its inhibit time is over: an event that the application has
    /// found. `tpdo` is the number, 1 to 512; one that is not valid, or of another type, is not sent.
    pub fn send_tpdo(&mut self, tpdo: u16, now: Instant, out: &mut impl Transmit) -> Next {
        let turn = &mut self.turn(now, out);
        let place = self.core.tpdo_place(tpdo);
        if self.core.state.has_pdos()
            && let Some(tpdo) = place.and_then(|place| self.core.tpdos.get_mut(usize::from(place)))
        {
            tpdo.on_event();
            self.core.process_due = STALE;
        }
        self.send_process(turn);
        self.process_next()
    }

    fn send_changes(&mut self, now: Instant, out: &mut impl Transmit) {
        let turn = &mut self.turn(now, out);
        self.start_by_itself(turn);
        if self.core.state.has_pdos() && !A::SERVICES_ONLY {
            self.core.each_tpdo(Chain::Valid, |tpdo, image| tpdo.on_change(image, turn));
            let events_due = self.core.send_events(turn);
            self.core.scanner.on_change(&self.core.image, turn);
            self.core.process_due = self.core.process_due.min(self.core.scanner.due()).min(events_due);
        }
        self.send_process(turn);
    }

    /// Identifiers of frames for [`on_process_frame`](Device::on_process_frame), data and remote.
    pub fn process_ids(&self) -> impl Iterator<Item = CanId> {
        let all_nodes = self.core.all_nodes.into_iter().flat_map(|(id, _)| id.of_all_nodes());
        self.own_process_ids().chain(all_nodes)
    }

    /// The same for acceptance filters: identifiers, and the bits of them that count. With an RPDO for all nodes
    /// ([`Application::takes_all_nodes`]) they are fewer by far.
    pub fn process_filters(&self) -> impl Iterator<Item = (CanId, u16)> {
        let all_nodes = self.core.all_nodes.map(|(id, _)| (id, CanId::FUNCTION));
        self.own_process_ids().map(|id| (id, 0x7FF)).chain(all_nodes)
    }

    fn own_process_ids(&self) -> impl Iterator<Item = CanId> {
        let received = self.core.rpdos.iter().filter_map(Rpdo::id);
        let requests = self.core.tpdos.iter().filter_map(Tpdo::settings).filter(|tpdo| tpdo.answers_remote);
        [CanId::NMT, self.core.sync.id()].into_iter().chain(received).chain(requests.map(|tpdo| tpdo.id))
    }
}

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Core<A, N, T, R, W, M>
{
    fn on_pdo_frame(&mut self, frame: &Frame, turn: &mut Turn<'_, impl Transmit>) {
        if self.sync.accepts(frame) {
            self.on_sync(frame, turn);
        } else if frame.is_remote() {
            self.each_tpdo(Chain::Valid, |tpdo, image| {
                if tpdo.settings().is_some_and(|settings| settings.id.get() == frame.id()) {
                    tpdo.on_remote(image, turn);
                }
            });
        } else {
            self.on_rpdo(frame, turn.now);
        }
    }

    /// Visits the TPDOs of a chain. What one of them could not send at once moves the next deadline.
    pub(super) fn each_tpdo(&mut self, chain: Chain, mut visit: impl FnMut(&mut Tpdo, &[u8])) {
        let mut links = self.first_tpdos;
        while let Some(tpdo) = self.tpdos.get_mut(links.next(chain)) {
            visit(tpdo, &self.image);
            if tpdo.is_pending() {
                self.process_due = STALE;
            }
            links = tpdo.links;
        }
    }
}
