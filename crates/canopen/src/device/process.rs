//! Process data: NMT commands, SYNC, PDOs.

use super::Definition;
use super::inner::Inner;
use super::rpdos::filter_bit;
use super::services::Services;
use super::{Device, Next, STALE};
use crate::dictionary::{Rule, Services as Has};
use crate::nmt::Command;
use crate::pdo::{Chain, ProcessContext, Tpdo};
use crate::sdo::Multiplexer;
use crate::time_stamp::TimeOfDay;
use crate::{Application, CanId, Frame, Instant, Span, Tick, Transmit};
use core::marker::PhantomData;

impl<D: Definition> Device<D> {
    /// Takes a frame for either half.
    #[inline]
    pub fn on_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        let now = self.tick_of_frame(now);
        if self.is_request(frame) {
            self.send_due_process(now, out);
            if !self.take_segment(frame, now) {
                self.take_service_frame(frame, now, out);
            }
        } else {
            self.take_process_frame(frame, now, out);
            self.take_other_service(frame, now, out);
        }
        self.services_next()
    }

    /// Sends all frames that are due, in both halves.
    #[inline(never)]
    pub fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let now = self.tick(now);
        self.send_due_process(now, out);
        self.send_due_services(now, out);
        self.next()
    }

    /// Takes a frame with one of the [`process_ids`](Device::process_ids). Any other is ignored.
    // Inlined, so that a caller that ignores a part of `Next` does not pay for it. The work is in a separate function.
    #[inline]
    pub fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        let now = self.tick_of_frame(now);
        self.take_process_frame(frame, now, out);
        self.process_next()
    }

    #[inline(never)]
    fn take_process_frame(&mut self, frame: &Frame, now: Tick, out: &mut impl Transmit) {
        let is_nmt = frame.id() == CanId::NMT.get();
        if is_nmt {
            self.on_nmt(frame);
        }
        let is_of_process = !is_nmt && self.inner.is_of_process(frame);
        if !Inner::<D>::has_process() || !is_of_process && now < self.inner.process_due {
            return;
        }
        if D::SERVICES.contains(Has::TIME) && self.inner.on_time(frame) {
            return;
        }
        let context = &mut self.services.process_context(now, out);
        if is_of_process && self.inner.state.has_pdos() {
            self.inner.take_pdo_frame(frame, context);
        }
        self.inner.send_process(context);
    }

    /// Result of a call for process data: deadlines only.
    #[inline]
    pub(super) fn process_next(&self) -> Next {
        let Inner { process_due, services_due, .. } = self.inner;
        let (process, services) = (self.clock.instant(process_due), self.clock.instant(services_due));
        Next { process, services, action: None, parameters: false }
    }

    #[inline(never)]
    fn on_nmt(&mut self, frame: &Frame) {
        let own = self.inner.node_id.filter(|_| !self.inner.is_initialising());
        let Some(command) = own.and_then(|own| Command::parse(frame.data(), own)) else { return };
        self.command(command);
    }

    /// Sends the process data that is due.
    #[inline]
    pub fn poll_process(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let now = self.tick(now);
        self.send_due_process(now, out);
        self.process_next()
    }

    #[inline]
    fn send_due_process(&mut self, now: Tick, out: &mut impl Transmit) {
        if Inner::<D>::has_process() && now >= self.inner.process_due {
            self.run_process(now, out);
        }
    }

    #[inline(never)]
    fn run_process(&mut self, now: Tick, out: &mut impl Transmit) {
        self.inner.run_process(&mut self.services.process_context(now, out));
    }

    /// Lets the application update values in the image, and sends the PDOs that their change triggers. If the device
    /// starts by itself (1F80h), the first `publish` after a start makes the device operational.
    pub fn publish(
        &mut self,
        now: Instant,
        out: &mut impl Transmit,
        update: impl FnOnce(&mut D::Application, &mut [u8]),
    ) -> Next {
        let now = self.tick(now);
        self.show(update);
        self.send_changes(now, out);
        self.process_next()
    }

    /// Writes a value for the application, with the checks and effects of a value received by PDO. Returns whether the
    /// object accepts it: a value of its length and within its limits, in an object that has no service of CiA 301 and is
    /// no command. To be called before [`publish`](Device::publish), which gives the deadlines that follow.
    pub fn write_value(&mut self, at: Multiplexer, bytes: &[u8]) -> bool {
        let Ok(entry) = self.inner.dictionary.find(at.index, at.sub) else { return false };
        matches!(entry.rule(), Rule::Plain | Rule::Application)
            && bytes.len() == usize::from(entry.field().size)
            && self.inner.store_process_value(&entry, bytes)
    }

    /// Sends a TPDO of type 254 or 255 for an event of the application, now or when its inhibit time is over. `tpdo` is
    /// the number of the TPDO, 1 to 512. A TPDO that is not valid, or of another type, is not sent.
    pub fn send_tpdo(&mut self, tpdo: u16, now: Instant, out: &mut impl Transmit) -> Next {
        let now = self.tick(now);
        let context = &mut self.services.process_context(now, out);
        let place = self.inner.tpdo_place(tpdo);
        if self.inner.state.has_pdos()
            && let Some(tpdo) = place.and_then(|place| self.inner.tpdos.as_mut().get_mut(usize::from(place)))
        {
            tpdo.on_event();
            self.inner.process_due = STALE;
        }
        self.inner.send_process(context);
        self.process_next()
    }

    /// Sends the time stamp, if bit 30 of 1012h is set and the NMT state allows it. Returns whether it is sent.
    pub fn send_time(&mut self, time: TimeOfDay, now: Instant, out: &mut impl Transmit) -> bool {
        let now = self.tick(now);
        let context = &mut self.services.process_context(now, out);
        self.inner.time_frame(time).is_some_and(|frame| context.send(frame))
    }

    fn send_changes(&mut self, now: Tick, out: &mut impl Transmit) {
        let context = &mut self.services.process_context(now, out);
        self.inner.self_start(context);
        if self.inner.state.has_pdos() {
            self.inner.each_tpdo(Chain::Valid, |tpdo, (number, image, application)| {
                tpdo.on_change(image, |place| application.is_quiet(number, place, image), context);
            });
            let events_due = self.inner.send_events(context);
            self.inner.process_due = self.inner.process_due.min(events_due);
            if Inner::<D>::has(Has::MULTIPLEXED_TPDO) {
                self.inner.scanner.on_change(self.inner.image.as_ref(), context);
                self.inner.process_due = self.inner.process_due.min(self.inner.scanner.due());
            }
        }
        self.inner.send_process(context);
    }

    /// Identifiers of frames for [`on_process_frame`](Device::on_process_frame), data and remote.
    pub fn process_ids(&self) -> impl Iterator<Item = CanId> {
        let mut number = 0;
        core::iter::from_fn(move || self.inner.next_process_id(&mut number))
    }

    /// The identifiers as acceptance filters: each with a mask of the bits to compare. If an RPDO takes the frames of
    /// all nodes ([`takes_all_nodes`](crate::Application::takes_all_nodes)), there are far fewer filters than identifiers.
    pub fn process_filters(&self) -> impl Iterator<Item = (CanId, u16)> {
        let all_nodes = self.inner.all_nodes().map(|id| (id, CanId::FUNCTION));
        self.own_process_ids().map(|id| (id, 0x7FF)).chain(all_nodes)
    }

    fn own_process_ids(&self) -> impl Iterator<Item = CanId> {
        (0..self.inner.own_frames()).filter_map(|number| self.inner.process_id(number))
    }
}

impl<D: Definition> Services<D> {
    /// The time and the transmit queue for one call of the device for its process data, which have a share of the bus.
    pub(super) fn process_context<'a, Q: Transmit>(
        &'a mut self,
        now: Tick,
        out: &'a mut Q,
    ) -> ProcessContext<'a, Q, Inner<D>> {
        if D::Application::BUS_SHARE {
            self.budget.begin(now, || out.has_waiting_pdo());
        }
        ProcessContext {
            now,
            out,
            is_open: !(D::Application::LSS && self.lss.is_switching()),
            budget: &mut self.budget,
            choices: PhantomData,
        }
    }
}

impl<D: Definition> Inner<D> {
    /// The CAN-ID of the RPDO that takes the frames of all nodes.
    fn all_nodes(&self) -> Option<CanId> {
        if Self::has(Has::MULTIPLEXED_RPDO) { self.all_nodes.map(|(id, _)| id) } else { None }
    }

    /// How many frames the process data may take: NMT, SYNC, time stamp, RPDOs, requests for TPDOs.
    fn own_frames(&self) -> usize {
        3 + self.rpdos.as_ref().len() + self.tpdos.as_ref().len()
    }

    /// The CAN-ID of one of the own frames; `None` for one that is switched off.
    fn process_id(&self, number: usize) -> Option<CanId> {
        let rpdos = self.rpdos.as_ref();
        match number {
            0 => Some(CanId::NMT),
            1 => Some(self.sync.id()).filter(|_| Self::has(Has::SYNC)),
            2 => self.time_stamp.consumed().filter(|_| Self::has(Has::TIME)),
            _ if number < 3 + rpdos.len() => rpdos.get(number - 3)?.id(),
            _ if !Self::has(Has::REMOTE) => None,
            _ => self.tpdos.as_ref().get(number - 3 - rpdos.len())?.requested(),
        }
    }

    /// The next CAN-ID from a number on: of the own frames, then of those that all nodes send.
    #[inline(never)]
    fn next_process_id(&self, number: &mut usize) -> Option<CanId> {
        while *number < self.own_frames() {
            *number += 1;
            let id = self.process_id(*number - 1);
            if id.is_some() {
                return id;
            }
        }
        let all_nodes = self.all_nodes()?;
        *number += 1;
        all_nodes.of_node(*number - self.own_frames())
    }

    /// Whether a frame may be a SYNC, a PDO or a time stamp for this device. Most frames of other nodes are not.
    #[inline]
    fn is_of_process(&self, frame: &Frame) -> bool {
        self.rpdo_filter & filter_bit(frame.id()) != 0
            || Self::has(Has::REMOTE) && frame.is_remote()
            || Self::has(Has::SYNC) && self.sync.id().get() == frame.id()
            || Self::has(Has::TIME)
    }

    fn take_pdo_frame(&mut self, frame: &Frame, context: &mut ProcessContext<'_, impl Transmit, Self>) {
        if Self::has(Has::SYNC) && self.sync.accepts(frame) {
            self.on_sync(frame, context);
        } else if frame.is_remote() {
            self.on_remote(frame, context);
        } else if Self::has(Has::RPDO) {
            self.on_rpdo(frame, context.now);
        }
    }

    /// Answers a remote frame with each TPDO of its CAN-ID.
    fn on_remote(&mut self, frame: &Frame, context: &mut ProcessContext<'_, impl Transmit, Self>) {
        if Self::has(Has::REMOTE) {
            self.each_tpdo(Chain::Valid, |tpdo, (_, image, _)| {
                if tpdo.requested().is_some_and(|id| id.get() == frame.id()) {
                    tpdo.on_remote(image, context);
                }
            });
        }
    }

    /// Visits the TPDOs of a chain. A TPDO that could not be sent at once makes the process data due.
    pub(super) fn each_tpdo(
        &mut self,
        chain: Chain,
        mut visit: impl FnMut(&mut Tpdo, (usize, &[u8], &D::Application)),
    ) {
        let mut links = self.first_tpdos;
        while let place = links.next(chain)
            && let Some(tpdo) = self.tpdos.as_mut().get_mut(place)
        {
            let image = self.image.as_ref();
            visit(tpdo, (place, image, &self.application));
            if D::Application::THRESHOLDS && tpdo.take_sent() {
                self.application.sent(place, image);
            }
            if tpdo.is_pending() {
                self.process_due = STALE;
            }
            links = tpdo.links;
        }
    }

    #[inline(never)]
    pub(super) fn run_process(&mut self, context: &mut ProcessContext<'_, impl Transmit, Self>) {
        if Self::has(Has::SYNC_PRODUCER) {
            self.produce_sync(context);
        }
        if Self::has(Has::SYNC) {
            self.poll_sync(context.now);
        }
        let mut due = if Self::has(Has::RPDO) { self.poll_rpdos(context.now) } else { Tick::NEVER };
        self.each_tpdo(Chain::Valid, |tpdo, (_, image, _)| {
            tpdo.poll(image, context);
            due = due.min(tpdo.due());
        });
        due = due.min(self.send_events(context));
        if Self::has(Has::MULTIPLEXED_TPDO) {
            self.scanner.poll(self.image.as_ref(), context);
            due = due.min(self.scanner.due());
        }
        if Self::has(Has::SYNC) {
            due = due.min(self.sync.due());
        }
        if Self::has(Has::SYNC_PRODUCER) {
            due = due.min(self.sync_producer.due());
        }
        // Nothing that is due stays due: a deadline in the past would wake the caller for ever.
        debug_assert!(due > context.now, "process data are still due after a poll");
        self.process_due = due.max(context.now.plus(Span(1)));
    }
}
