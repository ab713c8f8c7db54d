//! The bus: who may begin a frame and when, and who hears what of it.

use crate::slot::{Contender, Slot};
use crate::{Attachment, Controller, Event, Faults, Time};

/// Bits that an error-passive transmitter waits longer than others (ISO 11898-1:2015, 10.4.6.4).
const SUSPEND_BITS: u64 = 8;

/// A CAN bus. Its participants are lent to it for each step; see the crate documentation.
#[derive(Debug, Default)]
pub struct Bus {
    /// Bit errors on the wire.
    pub faults: Faults,
    slot: Option<Slot>,
    /// The end of the last intermission.
    free: Time,
    recessive: Time,
    /// Error-passive transmitters that let others go first.
    suspended: Vec<usize>,
    suspended_until: Time,
    /// Participants that know what the wire does.
    known: usize,
    frames: u64,
    busy: Time,
}

impl Bus {
    /// A bus that is idle since power-on.
    pub fn new() -> Bus {
        Bus::default()
    }

    /// Time from a start of frame to the end of an intermission, summed up to `now`: divided by the time passed
    /// it is the bus load.
    pub fn busy(&self, now: Time) -> Time {
        self.busy + self.slot.as_ref().map_or(Time::ZERO, |slot| now.min(slot.end()) - slot.start())
    }

    /// Frames begun, whatever became of them. The next one has this number for the fault injector.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Lets everything up to `now` happen and returns the next instant at which something will: an event of the
    /// frame on the wire, its end, or the next start of frame; `Time::NEVER` while nobody has a request.
    ///
    /// A participant is known by its place in `participants`; new ones go to the end. `log` gets the traffic.
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

    /// The earliest instant at which a participant with this request may begin.
    fn wish(&self, participant: usize, requested: Option<Time>) -> Option<Time> {
        let suspended = self.suspended.contains(&participant);
        Some(requested?.max(if suspended { self.suspended_until } else { Time::ZERO }))
    }

    /// Tells newcomers what the wire does.
    fn welcome(&mut self, participants: &mut [&mut dyn Controller]) {
        for participant in participants.iter_mut().skip(self.known) {
            match &self.slot {
                Some(slot) => participant.start_of_frame(false, slot.start()),
                None => participant.idle(self.recessive),
            }
        }
        self.known = participants.len();
    }

    /// Start of frame: works out the whole course of the frame.
    fn begin(&mut self, participants: &mut [&mut dyn Controller], start: Time) {
        let attachments: Vec<Attachment> = participants.iter_mut().map(|p| p.attachment(start)).collect();
        let contenders = self.contenders(participants, &attachments, start);
        if contenders.is_empty() {
            // Whoever made the request has left the bus in the meantime: look again a little later.
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
