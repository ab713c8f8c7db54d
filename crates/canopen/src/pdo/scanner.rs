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

/// Objects that it can watch, one bit each: all that a dictionary can send (`dictionary::check`).
pub(crate) const WATCHED: usize = 48;

/// What the dictionary says about the PDO.
#[derive(Clone, Copy, Debug)]
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
    sent: [u8; 4],
}

impl Watched {
    pub(crate) fn new(at: Multiplexer, field: Field) -> Watched {
        Watched { at, field, sent: [0; 4] }
    }

    fn value(&self, image: &[u8]) -> [u8; 4] {
        let mut data = [0; 4];
        for (to, from) in data.iter_mut().zip(self.field.get(image)) {
            *to = *from;
        }
        data
    }
}

/// The producer. Without settings there is none.
#[derive(Debug)]
pub(crate) struct Scanner {
    settings: Option<ScannerSettings>,
    watched: Vec<Watched, WATCHED>,
    /// Which of them no other TPDO carries, a bit each.
    own: u64,
    /// Which of these are to be sent.
    pending: u64,
    event_due: Instant,
    inhibited_until: Instant,
}

impl Scanner {
    pub(crate) const fn new() -> Scanner {
        Scanner {
            settings: None,
            watched: Vec::new(),
            own: 0,
            pending: 0,
            event_due: Instant::NEVER,
            inhibited_until: Instant(0),
        }
    }

    /// Takes new settings. It watches nothing then.
    pub(crate) fn configure(&mut self, settings: Option<ScannerSettings>) {
        self.settings = settings;
        self.watched.clear();
        self.own = u64::MAX;
        self.stop();
    }

    /// Watches one more object; what is beyond its room is left out.
    pub(crate) fn watch(&mut self, watched: Watched) {
        let _ = self.watched.push(watched);
    }

    /// No longer watches what a TPDO carries.
    pub(crate) fn leave_out(&mut self, layout: &Layout) {
        for (number, watched) in (0..).zip(&self.watched) {
            if layout.contains(watched.field) {
                self.own &= !bit(number);
            }
        }
    }

    /// Entering Operational.
    pub(crate) fn start(&mut self) {
        self.stop();
        if self.settings.is_some() {
            self.pending = self.own;
        }
    }

    /// Leaving Operational.
    pub(crate) fn stop(&mut self) {
        (self.pending, self.event_due, self.inhibited_until) = (0, Instant::NEVER, Instant(0));
    }

    /// The next instant at which something is due.
    pub(crate) fn due(&self) -> Instant {
        if self.pending == 0 { self.event_due } else { self.inhibited_until.min(self.event_due) }
    }

    /// Watched values may have changed.
    pub(crate) fn on_change(&mut self, image: &[u8], turn: &mut Turn<'_, impl Transmit>) {
        let Some(settings) = &self.settings else { return };
        if settings.event == 0 {
            let changed = |watched: &Watched| watched.value(image) != watched.sent;
            let bits = self.watched.iter().zip(0..).filter(|(watched, _)| changed(watched));
            self.pending |= bits.fold(0, |pending, (_, number)| pending | bit(number)) & self.own;
        }
        self.poll(image, turn);
    }

    /// Sends what is due: one after the other, as the inhibit time and the queue allow.
    pub(crate) fn poll(&mut self, image: &[u8], turn: &mut Turn<'_, impl Transmit>) {
        let Some(settings) = &self.settings else { return };
        let elapsed = turn.now >= self.event_due;
        if elapsed {
            self.pending = self.own;
        }
        if self.pending != 0 && settings.event != 0 && (elapsed || self.event_due == Instant::NEVER) {
            self.event_due = turn.now + Duration::from_millis(settings.event.into());
        }
        for (number, watched) in (0..).zip(&mut self.watched) {
            if self.pending & bit(number) == 0 {
                continue;
            }
            if turn.now < self.inhibited_until {
                return;
            }
            let data = watched.value(image);
            // The next message has the same identifier and another object, so none takes the place of another.
            if !turn.send(Frame::data_frame(settings.id, 8, settings.message(watched, data))) {
                self.inhibited_until = turn.now + RETRY;
                return;
            }
            watched.sent = data;
            self.pending &= !bit(number);
            if settings.inhibit != 0 {
                self.inhibited_until = turn.now + Duration::from_inhibit(settings.inhibit);
            }
        }
        self.pending = 0;
    }
}

fn bit(number: u32) -> u64 {
    1_u64.checked_shl(number).unwrap_or(0)
}
