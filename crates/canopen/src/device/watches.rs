//! The heartbeats of other nodes: object 1016h, and the reaction to a missing heartbeat.

use super::Definition;
use super::inner::Inner;
use crate::dictionary::Entry;
use crate::emcy::Fault;
use crate::heartbeat::{Change, Watch};
use crate::sdo::Abort;
use crate::{Frame, Instant};

const CONSUMER_TIME: u16 = 0x1016;

impl<D: Definition> Inner<D> {
    #[inline(never)]
    pub(super) fn take_heartbeat(&mut self, frame: &Frame, now: Instant) {
        if self.is_initialising() {
            return;
        }
        if let Some(change) = self.watches.take(frame, now) {
            self.on_watch(change, now);
        }
        self.services_due = self.services_due.min(self.watches.due());
    }

    pub(super) fn on_watch(&mut self, change: Change, now: Instant) {
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
    pub(super) fn configure_watch(&mut self, sub: u8, now: Instant) {
        let number = sub.saturating_sub(1);
        if self.watches.configure(number.into(), self.watch(sub)) {
            self.clear(Fault::Heartbeat(number), now);
        }
    }

    pub(super) fn configure_watches(&mut self, now: Instant) {
        for sub in (1..=u8::MAX).take(self.watches.len()) {
            self.configure_watch(sub, now);
        }
    }
}
