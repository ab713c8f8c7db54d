//! The time from a start of frame to the end of its intermission. The course of the frame is computed at the start of
//! frame; each participant receives an event at its instant.

use std::collections::VecDeque;

use crate::bits::encode;
use crate::faults::{Flip, SeenBy};
use crate::station::Notice;
use crate::wire::{Course, Happening, Nature, Tap, run};
use crate::{Attachment, BitTiming, BusError, Controller, ErrorReport, Event, Frame, Time};

/// A participant that begins a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contender {
    pub(crate) participant: usize,
    pub(crate) timing: BitTiming,
    pub(crate) frame: Frame,
}

#[derive(Debug)]
pub(crate) struct Slot {
    start: Time,
    winner: Contender,
    transmitters: Vec<usize>,
    agenda: VecDeque<(Time, Item)>,
    recessive: Time,
    end: Time,
}

#[derive(Debug)]
enum Item {
    Notice { to: Vec<usize>, notice: Notice },
    Log(Event),
}

impl Slot {
    /// Computes the course of the frames that `contenders` begin at `start`; `None` without a contender. `flips`
    /// returns the bit errors of a frame of the given number of bits.
    pub(crate) fn plan(
        start: Time,
        contenders: &[Contender],
        attachments: &[Attachment],
        flips: &mut dyn FnMut(usize) -> Vec<Flip>,
    ) -> Option<Slot> {
        let winner = *contenders.iter().min_by_key(|contender| contender.frame.arbitration())?;
        let flips = flips(encode(&winner.frame).len());
        let mut taps = taps(contenders, attachments, winner.timing, &flips);
        let course = run(&mut taps, start, winner.timing, &flips);
        let key = winner.frame.arbitration();
        let transmitters = contenders.iter().filter(|contender| contender.frame.arbitration() == key);
        let mut slot = Slot {
            start,
            winner,
            transmitters: transmitters.map(|contender| contender.participant).collect(),
            agenda: VecDeque::new(),
            recessive: course.recessive,
            end: course.end,
        };
        slot.agenda = slot.agenda(contenders, &taps, &course);
        Some(slot)
    }

    pub(crate) fn start(&self) -> Time {
        self.start
    }

    /// The end of the intermission.
    pub(crate) fn end(&self) -> Time {
        self.end
    }

    /// When the last dominant bit ends.
    pub(crate) fn recessive(&self) -> Time {
        self.recessive
    }

    /// The length of a bit of the frame.
    pub(crate) fn bit(&self) -> Time {
        self.winner.timing.bit()
    }

    /// The participants that won the arbitration: one, unless several sent the same identifier.
    pub(crate) fn transmitters(&self) -> &[usize] {
        &self.transmitters
    }

    /// The instant of the next event.
    pub(crate) fn next(&self) -> Time {
        self.agenda.front().map_or(self.end, |(at, _)| *at)
    }

    /// Reports the next event; `false` when none is left.
    pub(crate) fn proceed(
        &mut self,
        participants: &mut [&mut dyn Controller],
        log: &mut dyn FnMut(Event),
    ) -> bool {
        let Some((at, item)) = self.agenda.pop_front() else { return false };
        let abandoned = self.is_abandoned(participants, at);
        match item {
            Item::Notice { to, notice } => {
                let notice = if abandoned { cut_short(notice) } else { notice };
                for participant in to {
                    tell(participants, participant, &notice, at);
                }
            }
            Item::Log(Event::Frame { .. }) if abandoned => log(self.error_event(BusError::Stuff, at)),
            Item::Log(event) => log(event),
        }
        true
    }

    /// Whether no transmitter is left, because of a reset or a power cut in the middle of the frame.
    fn is_abandoned(&self, participants: &mut [&mut dyn Controller], at: Time) -> bool {
        self.transmitters
            .iter()
            .all(|n| participants.get_mut(*n).is_none_or(|sender| sender.attachment(at) == Attachment::Off))
    }

    fn agenda(&self, contenders: &[Contender], taps: &[Tap], course: &Course) -> VecDeque<(Time, Item)> {
        let notices = course.happenings.iter().map(|happening| {
            let to = taps[happening.tap].members.clone();
            (happening.at, Item::Notice { to, notice: happening.notice })
        });
        let events = self.frame_event(contenders, taps, course).into_iter().chain(self.failure(taps, course));
        let mut agenda: Vec<_> = notices.chain(events.map(|(at, event)| (at, Item::Log(event)))).collect();
        agenda.sort_by_key(|(at, _)| *at);
        agenda.into()
    }

    /// The event of a frame that was sent, or that at least one participant has received. Of several frames with the same
    /// identifier, it is the one that was sent: the others have met a bit error.
    fn frame_event(&self, contenders: &[Contender], taps: &[Tap], course: &Course) -> Option<(Time, Event)> {
        let of =
            |at: &Happening| contenders.iter().find(|own| taps[at.tap].members.contains(&own.participant));
        let sent = course.happenings.iter().find(|happening| matches!(happening.notice, Notice::Sent));
        let received = course.happenings.iter().find_map(|happening| match happening.notice {
            Notice::Received(frame) => Some((happening.at, frame)),
            _ => None,
        });
        let Contender { frame, participant: transmitter, .. } = *sent.and_then(of).unwrap_or(&self.winner);
        let end = sent.map(|happening| happening.at).or(received.map(|(at, _)| at))?;
        let frame = received.map_or(frame, |(_, frame)| frame);
        Some((end, Event::Frame { start: self.start, end, frame, transmitter }))
    }

    /// The error that made the transmission fail.
    fn failure(&self, taps: &[Tap], course: &Course) -> Option<(Time, Event)> {
        course.happenings.iter().find_map(|Happening { at, tap, notice }| match notice {
            Notice::Error(report) if taps[*tap].members.contains(&self.winner.participant) => {
                Some((*at, self.error_event(report.error, *at)))
            }
            _ => None,
        })
    }

    fn error_event(&self, error: BusError, end: Time) -> Event {
        let Contender { frame, participant: transmitter, .. } = self.winner;
        Event::Error { start: self.start, end, frame, error, transmitter }
    }
}

/// One tap for all participants that behave alike: same attachment, same bit length, and the same frame or none to
/// send. Each victim of a bit error has a tap of its own.
fn taps(contenders: &[Contender], attachments: &[Attachment], timing: BitTiming, flips: &[Flip]) -> Vec<Tap> {
    let mut taps: Vec<Tap> = Vec::new();
    for (n, attachment) in attachments.iter().enumerate() {
        let Some(own) = attachment.timing() else { continue };
        // In step with the transmitter, all edges come at the begin of a bit: the sample point makes no difference.
        let own = if own.bit() == timing.bit() { timing } else { own };
        let contender = contenders.iter().find(|contender| contender.participant == n);
        let nature =
            Nature { attachment: attachment.with(own), frame: contender.map(|contender| contender.frame) };
        let is_victim = flips.iter().any(|flip| flip.seen_by == SeenBy::Participant(n));
        match taps.iter_mut().find(|tap| !is_victim && tap.nature == Some(nature)) {
            Some(tap) => tap.members.push(n),
            None => taps.push(Tap::new(n, nature, own, is_victim)),
        }
    }
    taps
}

fn tell(participants: &mut [&mut dyn Controller], n: usize, notice: &Notice, at: Time) {
    let Some(participant) = participants.get_mut(n) else { return };
    match notice {
        Notice::Lost => participant.lost(at),
        Notice::Sent => participant.sent(at),
        Notice::Received(frame) => participant.received(frame, at),
        Notice::Error(report) => participant.error(report, at),
    }
}

/// A frame that stops in the middle is a stuff error for the receivers: they see six recessive bits.
fn cut_short(notice: Notice) -> Notice {
    match notice {
        Notice::Received(_) => Notice::Error(ErrorReport {
            error: BusError::Stuff,
            transmitting: false,
            dominant_in_flag: 0,
            dominant_after_flag: 0,
        }),
        other => other,
    }
}
