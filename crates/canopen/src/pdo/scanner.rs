//! The producer of a multiplexed TPDO: monitors objects and sends their changes.
//!
//! In destination address mode, the objects are all mappable objects that no other TPDO maps, and they are sent to all
//! nodes. In source address mode, they are the objects of the object scanner list. With an event timer, only the timer
//! triggers the transmission, always of all objects. Without one, each changed object is sent. Entering Operational
//! sends all objects in both cases.

use super::{Address, Choices, Layout, Mpdo, ProcessContext};
use crate::array::{Array, Element};
use crate::dictionary::{Addressing, Field, little_endian};
use crate::sdo::Multiplexer;
use crate::transmit::RETRY;
use crate::{CanId, Frame, NodeId, Span, Tick, Transmit};

/// Settings of the multiplexed TPDO, from the dictionary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScannerSettings {
    pub(crate) id: CanId,
    pub(crate) addressing: Addressing,
    pub(crate) own: NodeId,
    /// Inhibit time in 100 us.
    pub(crate) inhibit: u16,
    /// Event timer in ms.
    pub(crate) event: u16,
}

impl ScannerSettings {
    fn message(self, watched: &Watched, data: [u8; 4]) -> [u8; 8] {
        let address = match self.addressing {
            Addressing::Source => Address::Source(self.own),
            Addressing::Destination => Address::Destination(None),
        };
        Mpdo { address, at: watched.at, data }.encode()
    }
}

/// A monitored object.
#[derive(Clone, Copy, Debug)]
pub struct Watched {
    at: Multiplexer,
    field: Field,
    /// The value that was sent last; `None` before the first transmission.
    sent: Option<[u8; 4]>,
    /// Whether the object is sent: no other TPDO maps the object, and the application broadcasts it.
    is_selected: bool,
    /// The value waits to be sent.
    is_pending: bool,
}

impl Element for Watched {
    const NEW: Watched = Watched {
        at: Multiplexer { index: 0, sub: 0 },
        field: Field { offset: 0, size: 0 },
        sent: None,
        is_selected: false,
        is_pending: false,
    };
}

impl Watched {
    pub(crate) fn new(at: Multiplexer, field: Field) -> Watched {
        Watched { at, field, sent: None, is_selected: true, is_pending: false }
    }

    fn value(&self, image: &[u8]) -> [u8; 4] {
        little_endian(self.field.get(image)).to_le_bytes()
    }
}

/// A list of at most as many objects as `L` has elements.
#[derive(Debug)]
struct List<L> {
    memory: L,
    len: usize,
}

impl<L: Array<Watched>> List<L> {
    fn push(&mut self, watched: Watched) {
        if let Some(free) = self.memory.as_mut().get_mut(self.len) {
            *free = watched;
            self.len += 1;
        }
    }

    #[inline(never)]
    fn iter_mut(&mut self) -> core::slice::IterMut<'_, Watched> {
        self.memory.as_mut().get_mut(..self.len).unwrap_or_default().iter_mut()
    }
}

/// The producer of the multiplexed TPDO, with room for as many objects as `L` has elements. Without settings it sends nothing.
#[derive(Debug)]
#[repr(C)] // As for `Inner`.
pub(crate) struct Scanner<L> {
    settings: Option<ScannerSettings>,
    /// Whether any object waits to be sent.
    is_pending: bool,
    event_due: Tick,
    /// The last transmission since the last reset. No reconfiguration shortens the inhibit time.
    sent: Tick,
    inhibited_until: Tick,
    watched: List<L>,
}

impl<L: Array<Watched>> Scanner<L> {
    pub(crate) fn new() -> Scanner<L> {
        Scanner {
            settings: None,
            watched: List { memory: L::NEW, len: 0 },
            is_pending: false,
            event_due: Tick::NEVER,
            sent: Tick::NEVER,
            inhibited_until: Tick::PAST,
        }
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.event_due.shift(by);
        self.sent.shift(by);
        self.inhibited_until.shift(by);
    }

    /// Whether the present settings are equal to these.
    pub(crate) fn has(&self, settings: Option<ScannerSettings>) -> bool {
        self.settings == settings
    }

    /// Takes new settings, and removes all monitored objects.
    pub(crate) fn configure(&mut self, settings: Option<ScannerSettings>) {
        self.settings = settings;
        self.watched.len = 0;
        self.stop();
    }

    /// Monitors one more object. Objects beyond the room are ignored.
    pub(crate) fn watch(&mut self, watched: Watched) {
        self.watched.push(watched);
    }

    /// Selects the objects to send. An object that is selected for the first time is sent.
    pub(crate) fn select(&mut self, is_broadcast: impl Fn(Multiplexer) -> bool) {
        self.watched.iter_mut().for_each(|watched| watched.is_selected = is_broadcast(watched.at));
    }

    /// Forgets the sent values of objects that are not selected, so that they are sent as new if they are selected
    /// again.
    pub(crate) fn forget_deselected(&mut self) {
        for watched in self.watched.iter_mut().filter(|watched| !watched.is_selected) {
            (watched.sent, watched.is_pending) = (None, false);
        }
    }

    /// Sends the selected objects that have not been sent: those that were selected in Operational.
    pub(crate) fn send_new(&mut self) {
        for watched in self.watched.iter_mut().filter(|watched| watched.is_selected) {
            watched.is_pending |= watched.sent.is_none();
            self.is_pending |= watched.is_pending;
        }
    }

    /// Deselects the objects that a TPDO maps.
    pub(crate) fn deselect(&mut self, layout: &Layout) {
        for watched in self.watched.iter_mut() {
            watched.is_selected &= !layout.contains(watched.field);
        }
    }

    /// Sends all objects, on entering Operational.
    pub(crate) fn start(&mut self) {
        self.stop();
        if self.settings.is_some() {
            self.send_all();
        }
    }

    fn send_all(&mut self) {
        self.is_pending = false;
        for watched in self.watched.iter_mut() {
            watched.is_pending = watched.is_selected;
            self.is_pending |= watched.is_selected;
        }
    }

    /// Discards everything that waits, on leaving Operational. The inhibit time continues.
    pub(crate) fn stop(&mut self) {
        self.watched.iter_mut().for_each(|watched| watched.is_pending = false);
        (self.is_pending, self.event_due) = (false, Tick::NEVER);
        self.inhibited_until = self.inhibit_end();
    }

    /// At a reset: the inhibit time does not outlast the next `stop`.
    pub(crate) fn forget_sent(&mut self) {
        self.sent = Tick::NEVER;
    }

    fn inhibit_end(&self) -> Tick {
        match (self.sent, &self.settings) {
            (Tick::NEVER, _) | (_, None) => Tick::PAST,
            (sent, Some(settings)) => sent.plus(Span::from_inhibit(settings.inhibit)),
        }
    }

    /// When the next frame or the event timer is due.
    pub(crate) fn due(&self) -> Tick {
        if self.is_pending { self.inhibited_until.min(self.event_due) } else { self.event_due }
    }

    /// Sends the objects whose value has changed.
    pub(crate) fn on_change(
        &mut self,
        image: &[u8],
        context: &mut ProcessContext<'_, impl Transmit, impl Choices>,
    ) {
        let Some(settings) = &self.settings else { return };
        if settings.event == 0 {
            for watched in self.watched.iter_mut().filter(|watched| watched.is_selected) {
                watched.is_pending |= watched.sent != Some(watched.value(image));
                self.is_pending |= watched.is_pending;
            }
        }
        self.poll(image, context);
    }

    /// Sends the objects that wait, one after the other, as the inhibit time and the queue allow.
    pub(crate) fn poll(
        &mut self,
        image: &[u8],
        context: &mut ProcessContext<'_, impl Transmit, impl Choices>,
    ) {
        let Some(settings) = self.settings else { return };
        let elapsed = context.now >= self.event_due;
        if elapsed {
            self.send_all();
        }
        if elapsed || self.is_pending && settings.event != 0 && self.event_due == Tick::NEVER {
            self.event_due = context.now.plus(Span::from_millis(settings.event));
        }
        if !self.is_pending {
            return;
        }
        for watched in self.watched.iter_mut().filter(|watched| watched.is_pending) {
            if context.now < self.inhibited_until {
                return;
            }
            let data = watched.value(image);
            // All these frames have the same identifier but different objects: no frame may replace another in the
            // queue.
            if !context.send_event(Frame::data_frame(settings.id, 8, settings.message(watched, data))) {
                self.inhibited_until = context.now.plus(RETRY);
                return;
            }
            (watched.sent, watched.is_pending) = (Some(data), false);
            self.sent = context.now;
            if settings.inhibit != 0 {
                self.inhibited_until = context.now.plus(Span::from_inhibit(settings.inhibit));
            }
        }
        self.is_pending = false;
    }
}
