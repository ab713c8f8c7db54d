//! The producer of a multiplexed TPDO: it watches objects and sends those that change.
//!
//! In destination address mode these are all objects that can be mapped and that no other TPDO carries, sent to all
//! nodes; in source address mode those of the object scanner list. With an event timer the timer alone sends, all of
//! them; without one, each change does. Entering Operational sends all in both cases.

use super::{Address, Addressing, Layout, Mpdo};
use crate::dictionary::Field;
use crate::sdo::Multiplexer;
use crate::transmit::{RETRY, Turn};
use crate::{CanId, Duration, Frame, Instant, NodeId, Transmit};
use heapless::Vec;

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

/// An object that is watched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watched {
    at: Multiplexer,
    field: Field,
    /// The value that was sent last; `None` before the first transmission.
    sent: Option<[u8; 4]>,
    /// No other TPDO carries it, and its part of the device is there.
    is_own: bool,
    /// The value waits to be sent.
    is_pending: bool,
}

impl Watched {
    pub(crate) fn new(at: Multiplexer, field: Field) -> Watched {
        Watched { at, field, sent: None, is_own: true, is_pending: false }
    }

    fn value(&self, image: &[u8]) -> [u8; 4] {
        let mut data = [0; 4];
        for (to, from) in data.iter_mut().zip(self.field.get(image)) {
            *to = *from;
        }
        data
    }
}

/// The producer, with room for `M` objects. Without settings there is none.
#[derive(Debug)]
pub(crate) struct Scanner<const M: usize> {
    settings: Option<ScannerSettings>,
    watched: Vec<Watched, M>,
    /// Some of them are to be sent.
    is_pending: bool,
    event_due: Instant,
    inhibited_until: Instant,
}

impl<const M: usize> Scanner<M> {
    pub(crate) const fn new() -> Scanner<M> {
        Scanner {
            settings: None,
            watched: Vec::new(),
            is_pending: false,
            event_due: Instant::NEVER,
            inhibited_until: Instant(0),
        }
    }

    /// Whether it has these settings already.
    pub(crate) fn has(&self, settings: Option<ScannerSettings>) -> bool {
        self.settings == settings
    }

    /// Takes new settings. It watches nothing then.
    pub(crate) fn configure(&mut self, settings: Option<ScannerSettings>) {
        self.settings = settings;
        self.watched.clear();
        self.stop();
    }

    /// Watches one more object; what is beyond its room is left out.
    pub(crate) fn watch(&mut self, watched: Watched) {
        let _ = self.watched.push(watched);
    }

    /// Watches of its objects those that are to be told; one that is told for the first time is sent.
    pub(crate) fn choose(&mut self, is_told: impl Fn(Multiplexer) -> bool) {
        self.watched.iter_mut().for_each(|watched| watched.is_own = is_told(watched.at));
    }

    /// Forgets the sent values of objects that are no longer sent: one that is chosen again later is sent as new.
    pub(crate) fn forget_others(&mut self) {
        for watched in self.watched.iter_mut().filter(|watched| !watched.is_own) {
            (watched.sent, watched.is_pending) = (None, false);
        }
    }

    /// No longer watches what a TPDO carries.
    pub(crate) fn leave_out(&mut self, layout: &Layout) {
        for watched in &mut self.watched {
            watched.is_own &= !layout.contains(watched.field);
        }
    }

    /// Entering Operational.
    pub(crate) fn start(&mut self) {
        self.stop();
        if self.settings.is_some() {
            self.send_all();
        }
    }

    fn send_all(&mut self) {
        self.is_pending = false;
        for watched in &mut self.watched {
            watched.is_pending = watched.is_own;
            self.is_pending |= watched.is_own;
        }
    }

    /// Leaving Operational.
    pub(crate) fn stop(&mut self) {
        self.watched.iter_mut().for_each(|watched| watched.is_pending = false);
        (self.is_pending, self.event_due, self.inhibited_until) = (false, Instant::NEVER, Instant(0));
    }

    /// The next instant at which something is due.
    pub(crate) fn due(&self) -> Instant {
        if self.is_pending { self.inhibited_until.min(self.event_due) } else { self.event_due }
    }

    /// Watched values may have changed.
    pub(crate) fn on_change(&mut self, image: &[u8], turn: &mut Turn<'_, impl Transmit>) {
        let Some(settings) = &self.settings else { return };
        if settings.event == 0 {
            for watched in self.watched.iter_mut().filter(|watched| watched.is_own) {
                watched.is_pending |= watched.sent != Some(watched.value(image));
                self.is_pending |= watched.is_pending;
            }
        }
        self.poll(image, turn);
    }

    /// Sends what is due: one after the other, as the inhibit time and the queue allow.
    pub(crate) fn poll(&mut self, image: &[u8], turn: &mut Turn<'_, impl Transmit>) {
        let Some(settings) = self.settings else { return };
        let elapsed = turn.now >= self.event_due;
        if elapsed {
            self.send_all();
        }
        if self.is_pending && settings.event != 0 && (elapsed || self.event_due == Instant::NEVER) {
            self.event_due = turn.now + Duration::from_millis(settings.event.into());
        }
        if !self.is_pending {
            return;
        }
        for watched in self.watched.iter_mut().filter(|watched| watched.is_pending) {
            if turn.now < self.inhibited_until {
                return;
            }
            let data = watched.value(image);
            // The next message has the same identifier and another object, so none takes the place of another.
            if !turn.send(Frame::data_frame(settings.id, 8, settings.message(watched, data))) {
                self.inhibited_until = turn.now + RETRY;
                return;
            }
            (watched.sent, watched.is_pending) = (Some(data), false);
            if settings.inhibit != 0 {
                self.inhibited_until = turn.now + Duration::from_inhibit(settings.inhibit);
            }
        }
        self.is_pending = false;
    }
}
