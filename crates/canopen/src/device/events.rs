//! TPDOs that send events: the application keeps the events, and gives one whenever the TPDO may be sent.

use super::Definition;
use super::inner::Inner;
use super::{Application, STALE};
use crate::pdo::{Chain, ProcessContext};
use crate::{Tick, Transmit};

impl<D: Definition> Inner<D> {
    /// The TPDO at this place can be sent from now on.
    pub(super) fn begin_events(&mut self, place: usize) {
        if !D::Application::SENDS_EVENTS {
            return;
        }
        let number = self.tpdos.as_ref().get(place).and_then(crate::pdo::Tpdo::events_of);
        if let Some(number) = number.filter(|_| self.state.has_pdos()) {
            self.application.begin_events(number, self.image.as_mut());
            self.process_due = STALE;
        }
    }

    /// Sends the waiting events of the application as far as they may be sent. Returns when to call again.
    #[inline]
    pub(super) fn send_events(&mut self, context: &mut ProcessContext<'_, impl Transmit, Self>) -> Tick {
        let is_asked = D::Application::SENDS_EVENTS && self.sends_events && self.state.has_pdos();
        if is_asked { self.ask_for_events(context) } else { Tick::NEVER }
    }

    #[inline(never)]
    fn ask_for_events(&mut self, context: &mut ProcessContext<'_, impl Transmit, Self>) -> Tick {
        let mut due = Tick::NEVER;
        for place in 0..self.tpdos.as_ref().len() {
            while self.send_event(place, context) {}
            due = due.min(self.tpdos.as_ref().get(place).map_or(Tick::NEVER, crate::pdo::Tpdo::event_due));
        }
        due
    }

    /// Sends one event of the TPDO, if the application has any. Returns whether an event was sent.
    fn send_event(&mut self, place: usize, context: &mut ProcessContext<'_, impl Transmit, Self>) -> bool {
        let Some(tpdo) = self.tpdos.as_mut().get_mut(place) else { return false };
        let Some(number) = tpdo.asks_for_event(context) else { return false };
        let is_event = self.application.next_event(number, self.image.as_mut());
        tpdo.take_event(is_event, self.image.as_ref(), context);
        is_event
    }

    /// Sends one event of each TPDO that the SYNC triggers.
    pub(super) fn send_events_with_sync(&mut self, context: &mut ProcessContext<'_, impl Transmit, Self>) {
        let mut links = self.first_tpdos;
        while let Some(tpdo) = self.tpdos.as_mut().get_mut(links.next(Chain::Valid)) {
            links = tpdo.links;
            if let Some(number) = tpdo.asks_with_sync() {
                let is_event = self.application.next_event(number, self.image.as_mut());
                tpdo.take_event(is_event, self.image.as_ref(), context);
                if tpdo.is_pending() {
                    self.process_due = STALE;
                }
            }
        }
    }
}
