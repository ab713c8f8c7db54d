//! The bus: decides when a frame begins and which participant sends it, and tells all participants about the frame.

use crate::slot::{Contender, Slot};
use crate::{Attachment, Controller, Event, Faults, Time};

/// Bits that an error-passive transmitter waits longer than others (ISO 11898-1:2015, 10.4.6.4).
const SUSPEND_BITS: u64 = 8;

/// A CAN bus. The caller lends the participants to the bus for each step; see the crate documentation.
#[derive(Debug, Default)]
pub struct Bus {
    /// Bit errors on the wire.
    pub faults: Faults,
    slot: Option<Slot>,
    /// The end of the last intermission.
    free: Time,
    recessive: Time,
    /// Error-passive transmitters whose transmission is suspended.
    suspended: Vec<usize>,
    suspended_until: Time,
    /// Number of participants that have been told the state of the wire.
    known: usize,
    frames: u64,
    busy: Time,
}

impl Bus {
    /// A bus that is idle since power-on.
    pub fn new() -> Bus {
        Bus::default()
    }

    /// Time from a start of frame to the end of an intermission, summed up to `now`. Divided by the elapsed time, this
    /// is the bus load.
    pub fn busy(&self, now: Time) -> Time {
        self.busy + self.slot.as_ref().map_or(Time::ZERO, |slot| now.min(slot.end()) - slot.start())
    }

    /// Whether a frame is on the wire, or the intermission after it. No other frame can begin before their end.
    pub fn is_busy(&self) -> bool {
        self.slot.is_some()
    }

    /// Frames begun, including those that failed. The fault injector gives the next frame this number.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Processes everything up to `now` and returns the instant of the next event: an event of the frame on the wire,
    /// the end of the frame, or the next start of frame; `Time::NEVER` when no participant requests a frame.
    ///
    /// The place in `participants` identifies a participant; new ones go to the end. `log` gets the traffic.
    pub fn step(
        &mut self,
        participants: &mut [&mut dyn Controller],
        now: Time,
        log: &mut dyn FnMut(Event),
    ) -> Time {
        self.welcome(participants);
        loop {
            let next = self.next(participants);
            if next > now || next == Time::NEVER {
                return next;
            }
            match self.slot.as_mut().map(|slot| slot.proceed(participants, log)) {
                None => self.begin(participants, next),
                Some(true) => {}
                Some(false) => self.end(participants),
            }
        }
    }

    fn next(&self, participants: &[&mut dyn Controller]) -> Time {
        match &self.slot {
            Some(slot) => slot.next(),
            None => {
                let wishes = participants.iter().enumerate().filter_map(|(n, p)| self.wish(n, p.requested()));
                wishes.min().map_or(Time::NEVER, |wish| wish.max(self.free))
            }
        }
    }

    /// The earliest instant at which a participant with this request may begin a frame.
    fn wish(&self, participant: usize, requested: Option<Time>) -> Option<Time> {
        let suspended = self.suspended.contains(&participant);
        Some(requested?.max(if suspended { self.suspended_until } else { Time::ZERO }))
    }

    /// Tells new participants the state of the wire.
    fn welcome(&mut self, participants: &mut [&mut dyn Controller]) {
        for participant in participants.iter_mut().skip(self.known) {
            match &self.slot {
                Some(slot) => participant.start_of_frame(false, slot.start()),
                None => participant.idle(self.recessive),
            }
        }
        self.known = participants.len();
    }

    /// Start of frame: computes the whole course of the frame.
    fn begin(&mut self, participants: &mut [&mut dyn Controller], start: Time) {
        let attachments: Vec<Attachment> = participants.iter_mut().map(|p| p.attachment(start)).collect();
        let contenders = self.contenders(participants, &attachments, start);
        if contenders.is_empty() {
            // The participant that made the request has left the bus in the meantime: look again a little later.
            self.free = start + Time::from_micros(1);
            return;
        }
        for (n, participant) in participants.iter_mut().enumerate() {
            participant.start_of_frame(contenders.iter().any(|c| c.participant == n), start);
        }
        let slot =
            Slot::plan(start, &contenders, &attachments, &mut |bits| self.faults.of_frame(self.frames, bits));
        self.frames += u64::from(slot.is_some());
        self.slot = slot;
    }

    fn contenders(
        &self,
        participants: &mut [&mut dyn Controller],
        attachments: &[Attachment],
        start: Time,
    ) -> Vec<Contender> {
        let mut contenders = Vec::new();
        for (n, (participant, attachment)) in participants.iter_mut().zip(attachments).enumerate() {
            let wish = self.wish(n, participant.requested());
            if attachment.can_send()
                && wish.is_some_and(|wish| wish <= start)
                && let (Some(timing), Some(frame)) = (attachment.timing(), participant.pending(start))
            {
                contenders.push(Contender { participant: n, timing, frame });
            }
        }
        contenders
    }

    /// End of the intermission.
    fn end(&mut self, participants: &mut [&mut dyn Controller]) {
        let Some(slot) = self.slot.take() else { return };
        self.busy += slot.end() - slot.start();
        self.free = slot.end();
        self.recessive = slot.recessive();
        participants.iter_mut().for_each(|participant| participant.idle(slot.recessive()));
        self.suspended_until = slot.end() + slot.bit() * SUSPEND_BITS;
        self.suspended = slot.transmitters().to_vec();
        self.suspended.retain(|n| {
            let attachment = participants.get_mut(*n).map(|sender| sender.attachment(slot.end()));
            matches!(attachment, Some(Attachment::Passive { .. }))
        });
    }
}
