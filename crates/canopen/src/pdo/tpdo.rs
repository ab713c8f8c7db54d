//! One TPDO: when it is sent.
//!
//! The types 254 and 255 are sent on entering Operational and when the event timer elapses. Without an event timer, a
//! TPDO of type 255 is sent with every change of a mapped value, at most once per inhibit time. With an event timer,
//! only the timer sends it, because a measured value may change a thousand times a second.
//!
//! A TPDO that sends events is sent when the application has an event, and never because a value has changed. The
//! inhibit time and the event timer determine when the application is asked for its waiting events.

use super::{Choices, Layout, Links, ProcessContext};
use crate::array::Element;
use crate::dictionary::Transmission;
use crate::sync::Sync;
use crate::transmit::RETRY;
use crate::{CanId, Frame, Span, Tick, Transmit};

/// Settings of a valid TPDO, from the objects 1800h.. and 1A00h.. .
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    pub(crate) id: CanId,
    /// Whether remote frames are answered (bit 30 of the COB-ID is 0).
    pub(crate) answers_remote: bool,
    pub(crate) transmission: Transmission,
    /// Inhibit time in 100 us.
    pub(crate) inhibit: u16,
    /// Event timer in ms.
    pub(crate) event: u16,
    /// SYNC start value: the counter value with which the counting of SYNCs begins; 0 for any.
    pub(crate) sync_start: u8,
    /// For a TPDO that sends events: its number, 1 to 512.
    pub(crate) events_of: Option<u16>,
    pub(crate) layout: Layout,
}

impl Settings {
    /// The settings of a TPDO that is not valid.
    const UNUSED: Settings = Settings {
        id: CanId::NMT,
        answers_remote: false,
        transmission: Transmission::SyncAcyclic,
        inhibit: 0,
        event: 0,
        sync_start: 0,
        events_of: None,
        layout: Layout::EMPTY,
    };

    /// The end of the inhibit time after a transmission. The types 254 and 255 have an inhibit time (CiA 301, 7.5.2.35).
    fn inhibit_end(&self, sent: Tick) -> Tick {
        match sent {
            Tick::NEVER => Tick::PAST,
            _ if self.transmission.is_event_driven() => sent.plus(Span::from_inhibit(self.inhibit)),
            _ => Tick::PAST,
        }
    }

    fn sends_on_change(&self) -> bool {
        self.transmission == Transmission::Event && self.event == 0 && self.events_of.is_none()
    }
}

/// A TPDO and its timers. Only valid TPDOs are in the chains; for a TPDO that is not valid, only `configure` and `stop`
/// may be called.
#[derive(Debug)]
#[allow(clippy::struct_excessive_bools)] // Independent flags.
pub struct Tpdo {
    /// The PDOs that follow in the chains.
    pub(crate) links: Links,
    is_valid: bool,
    settings: Settings,
    /// A transmission waits: for the end of the inhibit time, or for room in the queue.
    pending: bool,
    /// A transmission since the last [`Tpdo::take_sent`].
    is_sent: bool,
    /// SYNCs since the last transmission.
    syncs: u8,
    /// The SYNC with the start value has arrived.
    is_counting: bool,
    /// The data that was sent last; for type 252, the data sampled with the last SYNC.
    data: Option<[u8; 8]>,
    /// When the event timer elapses.
    event_due: Tick,
    /// The last transmission since the last reset, or `NEVER`. No reconfiguration shortens the inhibit time.
    sent: Tick,
    /// The end of the inhibit time; earlier, a transmission waits.
    inhibited_until: Tick,
    /// When to ask the application for events. Used only for a TPDO that sends events.
    events: Events,
}

/// When to ask the application for events.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::struct_excessive_bools)] // Independent flags.
struct Events {
    /// Events may wait in the application: ask again.
    may_wait: bool,
    /// The event timer has elapsed, and not all waiting events have been sent.
    is_open: bool,
    /// The event timer has elapsed, and nothing has been sent since.
    is_silent: bool,
}

impl Events {
    const NONE: Events = Events { may_wait: false, is_open: false, is_silent: false };
    const BEGIN: Events = Events { may_wait: true, is_open: true, is_silent: false };
}

impl Element for Tpdo {
    const NEW: Tpdo = Tpdo {
        // Set for all PDOs when the chains are made.
        links: Links::NONE,
        is_valid: false,
        settings: Settings::UNUSED,
        pending: false,
        is_sent: false,
        syncs: 0,
        is_counting: false,
        data: None,
        event_due: Tick::NEVER,
        sent: Tick::NEVER,
        inhibited_until: Tick::NEVER,
        events: Events::NONE,
    };
}

impl Tpdo {
    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.event_due.shift(by);
        self.sent.shift(by);
        self.inhibited_until.shift(by);
    }

    /// Takes new settings and discards the state of the old ones.
    pub(crate) fn configure(&mut self, settings: Option<Settings>) {
        self.is_valid = settings.is_some();
        match settings {
            Some(settings) => self.settings = settings,
            None => self.settings.events_of = None,
        }
        self.stop();
    }

    /// The settings of a valid TPDO.
    pub(crate) fn settings(&self) -> Option<&Settings> {
        self.is_valid.then_some(&self.settings)
    }

    /// The CAN-ID of a valid TPDO that answers remote frames.
    pub(crate) fn requested(&self) -> Option<CanId> {
        self.settings().filter(|settings| settings.answers_remote).map(|settings| settings.id)
    }

    /// Whether a transmission waits.
    pub(crate) fn is_pending(&self) -> bool {
        self.pending
    }

    /// Triggers the first transmission, on entering Operational or when the TPDO becomes valid in it.
    pub(crate) fn start(&mut self) {
        self.stop();
        let events = self.events_of().is_some();
        self.pending = !events && self.is_valid && self.settings.transmission.is_event_driven();
        self.events = if events { Events::BEGIN } else { Events::NONE };
    }

    /// For a TPDO that sends events: its number.
    pub(crate) fn events_of(&self) -> Option<u16> {
        self.settings.events_of
    }

    /// For a TPDO that sends events: its number, if the application may be asked for an event now.
    pub(crate) fn asks_for_event<C: Choices>(
        &mut self,
        context: &mut ProcessContext<'_, impl Transmit, C>,
    ) -> Option<u16> {
        let number = self.events_of()?;
        let settings = &self.settings;
        let is_asked_now = settings.transmission.is_event_driven()
            && (settings.event == 0 || self.events.is_open)
            && !self.pending
            && context.now >= self.inhibited_until;
        if is_asked_now && !context.takes_event(settings.id.get(), settings.layout.len().into()) {
            (self.events.may_wait, self.inhibited_until) = (true, context.now.plus(RETRY));
            return None;
        }
        is_asked_now.then_some(number)
    }

    /// Handles the answer of the application. If `is_event`, the event is in the image.
    pub(crate) fn take_event<C: Choices>(
        &mut self,
        is_event: bool,
        image: &[u8],
        context: &mut ProcessContext<'_, impl Transmit, C>,
    ) {
        if is_event || self.events.is_silent && self.data.is_some() {
            self.send(image, context);
        }
        self.events.is_silent = false;
        self.events.may_wait = is_event;
        self.events.is_open &= is_event;
    }

    /// When to ask the application again.
    pub(crate) fn event_due(&self) -> Tick {
        let is_asked = self.events.may_wait
            && self.settings.transmission.is_event_driven()
            && (self.settings.event == 0 || self.events.is_open);
        if is_asked { self.inhibited_until } else { Tick::NEVER }
    }

    /// Discards a waiting transmission and the event timer, on leaving Operational. The inhibit time continues.
    pub(crate) fn stop(&mut self) {
        (self.pending, self.syncs, self.is_counting, self.data) = (false, 0, false, None);
        (self.event_due, self.inhibited_until) = (Tick::NEVER, self.settings.inhibit_end(self.sent));
        self.events = Events::NONE;
    }

    /// At a reset: the inhibit time does not outlast the next `stop`.
    pub(crate) fn forget_sent(&mut self) {
        self.sent = Tick::NEVER;
    }

    /// When the next transmission or the event timer is due.
    pub(crate) fn due(&self) -> Tick {
        if self.pending { self.inhibited_until.min(self.event_due) } else { self.event_due }
    }

    /// Sends or samples the values with a SYNC, depending on the transmission type.
    pub(crate) fn on_sync<C: Choices>(
        &mut self,
        sync: Sync,
        image: &[u8],
        context: &mut ProcessContext<'_, impl Transmit, C>,
    ) {
        let transmission = self.settings.transmission;
        match transmission {
            Transmission::SyncCyclic(every) if self.is_sent_with(sync, every.get()) => {
                self.send(image, context);
            }
            Transmission::SyncAcyclic if self.has_changed(image) => self.send(image, context),
            Transmission::SyncRemote => self.data = Some(self.settings.layout.gather(image)),
            _ => (),
        }
    }

    /// For a TPDO that sends events: its number, if a SYNC may send an event. For a cyclic type, every SYNC may.
    pub(crate) fn asks_with_sync(&self) -> Option<u16> {
        let is_asked = self.settings.transmission.is_synchronous() && !self.pending;
        self.settings.events_of.filter(|_| is_asked)
    }

    /// Counts SYNCs for a cyclic synchronous TPDO. Returns whether this SYNC sends it, which is every n-th one.
    fn is_sent_with(&mut self, sync: Sync, every: u8) -> bool {
        if !self.is_counting {
            let start = self.settings.sync_start;
            self.is_counting = sync.counter.is_none_or(|counter| start == 0 || start == counter);
            if !self.is_counting {
                return false;
            }
        }
        let is_turn = u32::from(self.syncs) + 1 >= every.into();
        self.syncs = if is_turn { 0 } else { self.syncs + 1 };
        is_turn
    }

    /// Answers a remote frame; the types 254 and 255 answer when the inhibit time is over. TPDOs of the synchronous types
    /// 0 to 240 are sent by SYNC only and do not answer.
    #[inline(never)]
    pub(crate) fn on_remote<C: Choices>(
        &mut self,
        image: &[u8],
        context: &mut ProcessContext<'_, impl Transmit, C>,
    ) {
        let settings = &self.settings;
        match (settings.transmission, self.data) {
            (Transmission::SyncRemote, Some(sampled)) => {
                // In a full queue the sample is dropped: the client repeats its request.
                context.send_pdo(Frame::data_frame(settings.id, settings.layout.len(), sampled));
            }
            // Before the first event, there is nothing to send.
            _ if C::SENDS_EVENTS && settings.events_of.is_some() && self.data.is_none() => (),
            (Transmission::Remote | Transmission::Timer | Transmission::Event, _) => {
                self.pending = true;
                self.poll(image, context);
            }
            _ => (),
        }
    }

    /// Requests a transmission for an event of the application.
    pub(crate) fn on_event(&mut self) {
        self.pending |= self.is_valid && self.settings.transmission.is_event_driven();
    }

    /// Sends the values if a mapped value has changed. `is_quiet`: whether a change at this place of the image is too
    /// small to be sent.
    #[inline]
    pub(crate) fn on_change<C: Choices>(
        &mut self,
        image: &[u8],
        is_quiet: impl Fn(usize) -> bool,
        context: &mut ProcessContext<'_, impl Transmit, C>,
    ) {
        let is_worth = || !C::THRESHOLDS || self.is_worth(image, is_quiet);
        if self.settings.sends_on_change() && self.has_changed(image) && is_worth() {
            self.pending = true;
            self.poll(image, context);
        }
    }

    /// Drops a synchronous TPDO that still waits at the end of the synchronous window: receivers would take it for a
    /// TPDO of the next SYNC.
    pub(crate) fn drop_synchronous(&mut self) {
        let kind = self.settings.transmission;
        // An event is kept: the application does not give it again.
        self.pending &= self.events_of().is_some()
            || !matches!(kind, Transmission::SyncAcyclic | Transmission::SyncCyclic(_));
    }

    /// Whether the TPDO has been sent since the last call.
    pub(crate) fn take_sent(&mut self) -> bool {
        core::mem::take(&mut self.is_sent)
    }

    /// Whether one of the changes is to be sent.
    fn is_worth(&self, image: &[u8], is_quiet: impl Fn(usize) -> bool) -> bool {
        let Some(sent) = self.data else { return true };
        let bytes = self.settings.layout.gather(image).into_iter().zip(sent);
        bytes.zip(self.settings.layout.offsets()).any(|((now, sent), place)| now != sent && !is_quiet(place))
    }

    fn has_changed(&self, image: &[u8]) -> bool {
        self.data != Some(self.settings.layout.gather(image))
    }

    /// Sends the TPDO if a transmission is due.
    pub(crate) fn poll<C: Choices>(
        &mut self,
        image: &[u8],
        context: &mut ProcessContext<'_, impl Transmit, C>,
    ) {
        let elapsed = context.now >= self.event_due;
        let sends_events = C::SENDS_EVENTS && self.events_of().is_some();
        if elapsed || sends_events && self.event_due == Tick::NEVER {
            self.event_due = self.event_due.following(self.settings.event, context.now);
        }
        if !sends_events {
            self.pending |= elapsed;
        } else if elapsed {
            self.events = Events { may_wait: true, is_open: true, is_silent: true };
        }
        if self.pending && context.now >= self.inhibited_until {
            self.send(image, context);
        }
    }

    /// Sends the present values. If the queue is full, the values of a later time are sent when there is room.
    fn send<C: Choices>(&mut self, image: &[u8], context: &mut ProcessContext<'_, impl Transmit, C>) {
        let Settings { id, layout, transmission, .. } = &self.settings;
        let data = layout.gather(image);
        let frame = || Frame::data_frame(*id, layout.len(), data);
        let sends_events = C::SENDS_EVENTS && self.settings.events_of.is_some();
        let is_sent = if sends_events { context.send_event(frame()) } else { context.send_pdo(frame()) };
        self.pending = !is_sent;
        if is_sent {
            (self.data, self.sent) = (Some(data), context.now);
            self.is_sent |= C::THRESHOLDS && self.settings.sends_on_change();
        } else {
            self.inhibited_until = context.now.plus(RETRY);
        }
        if transmission.is_event_driven() {
            self.restart_timers(context.now);
        }
    }

    /// A TPDO of type 254 or 255 has been sent, or has to wait.
    #[inline(never)]
    fn restart_timers(&mut self, now: Tick) {
        if !self.pending && self.settings.inhibit != 0 {
            self.inhibited_until = self.settings.inhibit_end(self.sent);
        }
        if self.event_due == Tick::NEVER {
            self.event_due = self.event_due.following(self.settings.event, now);
        }
    }
}
