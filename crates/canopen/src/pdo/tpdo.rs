//! One TPDO: when it is sent.
//!
//! The types 254 and 255 are sent on entering Operational and when the event timer elapses. Without an event timer, a PDO of
//! type 255 is sent with every change of a mapped value, at most once per inhibit time. With one, the timer alone sends: a
//! measured value changes a thousand times a second.

use super::{Layout, Links, Transmission};
use crate::sync::Sync;
use crate::transmit::{RETRY, Turn};
use crate::{CanId, Duration, Frame, Instant, Transmit};

/// What the objects 1800h.. and 1A00h.. say about a TPDO that is valid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    pub(crate) id: CanId,
    /// Whether a remote frame is answered (bit 30 of the COB-ID is 0).
    pub(crate) answers_remote: bool,
    pub(crate) transmission: Transmission,
    /// Inhibit time in 100 us.
    pub(crate) inhibit: u16,
    /// Event timer in ms.
    pub(crate) event: u16,
    /// SYNC counter with which the count of SYNCs begins; 0 for any.
    pub(crate) sync_start: u8,
    /// A frame that waits for the bus gives way to no newer one.
    pub(crate) sends_events: bool,
    pub(crate) layout: Layout,
}

impl Settings {
    fn sends_on_change(&self) -> bool {
        self.transmission == Transmission::Event && self.event == 0
    }
}

/// A TPDO and its timers. Without settings it does not exist.
#[derive(Debug)]
pub(crate) struct Tpdo {
    /// The PDOs that follow in the chains.
    pub(crate) links: Links,
    settings: Option<Settings>,
    /// Something waits to be sent: an event within the inhibit time, or a frame that found the queue full.
    pending: bool,
    /// SYNCs since the last transmission.
    syncs: u8,
    /// The SYNC with the start value has come.
    is_counting: bool,
    /// Data as last sent, or as sampled with SYNC for type 252.
    data: Option<[u8; 8]>,
    /// When the event timer elapses.
    event_due: Instant,
    /// Before this, an event waits.
    inhibited_until: Instant,
}

impl Tpdo {
    pub(crate) const fn new() -> Tpdo {
        Tpdo {
            links: Links::END,
            settings: None,
            pending: false,
            syncs: 0,
            is_counting: false,
            data: None,
            event_due: Instant::NEVER,
            inhibited_until: Instant(0),
        }
    }

    /// Takes new settings and starts afresh.
    pub(crate) fn configure(&mut self, settings: Option<Settings>) {
        self.settings = settings;
        self.stop();
    }

    pub(crate) fn settings(&self) -> Option<&Settings> {
        self.settings.as_ref()
    }

    /// Whether something waits to be sent.
    pub(crate) fn is_pending(&self) -> bool {
        self.pending
    }

    /// Entering Operational, or becoming valid in it.
    pub(crate) fn start(&mut self) {
        self.stop();
        self.pending = self.settings.as_ref().is_some_and(|settings| settings.transmission.is_event_driven());
    }

    /// Leaving Operational: nothing is due, a PDO that waits is dropped.
    pub(crate) fn stop(&mut self) {
        (self.pending, self.syncs, self.is_counting, self.data) = (false, 0, false, None);
        (self.event_due, self.inhibited_until) = (Instant::NEVER, Instant(0));
    }

    /// The next instant at which something is due.
    pub(crate) fn due(&self) -> Instant {
        if self.pending { self.inhibited_until.min(self.event_due) } else { self.event_due }
    }

    /// A SYNC arrived.
    pub(crate) fn on_sync(&mut self, sync: Sync, image: &[u8], turn: &mut Turn<'_, impl Transmit>) {
        let Some(settings) = &self.settings else { return };
        match settings.transmission {
            Transmission::SyncCyclic(every) => {
                self.is_counting |=
                    sync.counter.is_none_or(|counter| [0, counter].contains(&settings.sync_start));
                if !self.is_counting {
                    return;
                }
                self.syncs = self.syncs.saturating_add(1);
                if self.syncs >= every.get() {
                    self.syncs = 0;
                    self.send(image, turn);
                }
            }
            Transmission::SyncAcyclic if self.has_changed(image) => self.send(image, turn),
            Transmission::SyncRemote => self.data = Some(settings.layout.gather(image)),
            _ => (),
        }
    }

    /// A remote frame asks for it. The synchronous types 0 to 240 belong to the SYNC and do not answer.
    pub(crate) fn on_remote(&mut self, image: &[u8], turn: &mut Turn<'_, impl Transmit>) {
        let Some(settings) = self.settings.as_ref().filter(|settings| settings.answers_remote) else {
            return;
        };
        match (settings.transmission, self.data) {
            (Transmission::SyncRemote, Some(sampled)) => {
                // The client asks again if the queue is full: a sample of the past need not be kept for it.
                turn.send_state(Frame::data_frame(settings.id, settings.layout.len(), sampled));
            }
            (Transmission::Remote | Transmission::Timer | Transmission::Event, _) => {
                self.send(image, turn);
            }
            _ => (),
        }
    }

    /// The application has found an event.
    pub(crate) fn on_event(&mut self) {
        self.pending |=
            self.settings.as_ref().is_some_and(|settings| settings.transmission.is_event_driven());
    }

    /// Mapped values may have changed.
    pub(crate) fn on_change(&mut self, image: &[u8], turn: &mut Turn<'_, impl Transmit>) {
        if self.settings.as_ref().is_some_and(Settings::sends_on_change) && self.has_changed(image) {
            self.pending = true;
            self.poll(image, turn);
        }
    }

    /// The synchronous window is over: a synchronous PDO that still waits for room would be taken for one of the next.
    pub(crate) fn drop_synchronous(&mut self) {
        let kind = self.settings.as_ref().map(|settings| settings.transmission);
        self.pending &= !matches!(kind, Some(Transmission::SyncAcyclic | Transmission::SyncCyclic(_)));
    }

    fn has_changed(&self, image: &[u8]) -> bool {
        self.settings.as_ref().is_some_and(|settings| self.data != Some(settings.layout.gather(image)))
    }

    /// Sends what is due.
    pub(crate) fn poll(&mut self, image: &[u8], turn: &mut Turn<'_, impl Transmit>) {
        let elapsed = turn.now >= self.event_due;
        self.pending |= elapsed;
        if elapsed {
            self.event_due = self.following_event(turn.now);
        }
        if self.pending && turn.now >= self.inhibited_until {
            self.send(image, turn);
        }
    }

    /// One period after the last due instant, so that delays do not add up; after a long gap, one period from now.
    fn following_event(&self, now: Instant) -> Instant {
        let Some(settings) = self.settings.as_ref().filter(|settings| settings.event != 0) else {
            return Instant::NEVER;
        };
        let period = Duration::from_millis(settings.event.into());
        let next = self.event_due + period;
        if self.event_due != Instant::NEVER && next > now { next } else { now + period }
    }

    /// Sends the present values. A full queue leaves it pending: when there is room, the values of then go out.
    fn send(&mut self, image: &[u8], turn: &mut Turn<'_, impl Transmit>) {
        let Some(settings) = &self.settings else { return };
        let data = settings.layout.gather(image);
        let frame = Frame::data_frame(settings.id, settings.layout.len(), data);
        let sent = if settings.sends_events { turn.send(frame) } else { turn.send_state(frame) };
        self.pending = !sent;
        self.inhibited_until = turn.now + if sent { Duration::from_inhibit(settings.inhibit) } else { RETRY };
        if sent {
            self.data = Some(data);
        }
        if settings.transmission.is_event_driven() && self.event_due == Instant::NEVER {
            self.event_due = self.following_event(turn.now);
        }
    }
}
