//! The heartbeats of other nodes: object 1016h, and the reaction to a missing heartbeat.

use super::Application;
use super::Definition;
use super::inner::Inner;
use super::pdos::low_half;
use super::services::ERROR_CONTROL;
use crate::dictionary::Entry;
use crate::emcy::Fault;
use crate::heartbeat::{Change, Watch};
use crate::sdo::Abort;
use crate::transmit::Context;
use crate::{Frame, Tick, Transmit};

const CONSUMER_TIME: u16 = 0x1016;

impl<D: Definition> Inner<D> {
    #[inline(never)]
    pub(super) fn take_heartbeat(&mut self, frame: &Frame, now: Tick) {
        if self.is_initialising() {
            return;
        }
        let (application, image) = (&mut self.application, self.image.as_mut());
        let change = self.watches.take(frame, now, |node, state| application.node_state(node, state, image));
        if let Some(change) = change {
            self.on_watch(change, now);
        }
        self.services_due = self.services_due.min(self.watches.due());
    }

    /// Answers a remote frame of a guarding master. A device with a heartbeat is not guarded.
    #[inline(never)]
    pub(super) fn on_guard(&mut self, frame: &Frame, context: &mut Context<'_, impl Transmit>) {
        let id = self.service(ERROR_CONTROL);
        let is_guarded = !self.is_initialising() && !self.heartbeat.is_on();
        if !frame.is_remote() || frame.id() != id.get() || !is_guarded {
            return;
        }
        let (answer, is_back) = self.guarding.answer(self.state, context.now);
        // In a full queue the answer is dropped: the master repeats its request.
        if context.send(Frame::data_frame(id, 1, [answer, 0, 0, 0, 0, 0, 0, 0])) {
            self.guarding.toggle();
        }
        if is_back {
            self.clear(Fault::LifeGuard, context.now);
        }
        self.serve_until(self.guarding.due());
    }

    /// Gives life guarding its times, from 100Ch and 100Dh.
    pub(super) fn configure_guarding(&mut self, now: Tick) {
        let [factor, ..] = self.number(0x100D, 0).to_le_bytes();
        if self.guarding.configure(low_half(self.number(0x100C, 0)), factor) {
            self.clear(Fault::LifeGuard, now);
        }
    }

    pub(super) fn on_watch(&mut self, change: Change, now: Tick) {
        match change {
            Change::Lost(number) => self.raise(Fault::Heartbeat(number), now),
            Change::Back(number) => self.clear(Fault::Heartbeat(number), now),
        }
    }

    /// Checks a value of 1016h: bits 24..31 are reserved, and a node can be monitored only once.
    pub(super) fn check_watch(&self, entry: &Entry, value: u32) -> Result<(), Abort> {
        if value >> 24 != 0 {
            return Err(Abort::InvalidValue);
        }
        let Some(watch) = Watch::parse(value) else { return Ok(()) };
        let mut others = self.watches.nodes().zip(1..).filter(|(_, sub)| *sub != entry.sub());
        let is_double = others.any(|(node, _)| node == Some(watch.node));
        if is_double { Err(Abort::Parameter) } else { Ok(()) }
    }

    fn watch(&self, sub: u8) -> Option<Watch> {
        Watch::parse(self.number(CONSUMER_TIME, sub))
    }

    /// Configures the monitoring of a node, and clears its fault.
    pub(super) fn configure_watch(&mut self, sub: u8, now: Tick) {
        let number = sub.saturating_sub(1);
        if self.watches.configure(number.into(), self.watch(sub)) {
            self.clear(Fault::Heartbeat(number), now);
        }
    }

    pub(super) fn configure_watches(&mut self, now: Tick) {
        for sub in (1..=u8::MAX).take(self.watches.len()) {
            self.configure_watch(sub, now);
        }
    }
}
