//! The log of updates. The record room of staging, which the next clear erases, says what became of the newest download;
//! the application turns that into an [`Event`] and keeps the last sixteen of them in its parameter memory.
//!
//! | word | programmed by | content |
//! |---|---|---|
//! | note | the bootloader | 1F57h of the refusal that has ended the download, or the copy |
//! | cause | the application | why it confirms itself, or withdraws |
//! | begun | the application | 0: that the program is on trial is in the log |
//! | ended | the application | 0: the end is in the log |

use core::fmt;

use crate::area::Layout;
use crate::flash::{Flash, all_are, program};
use crate::header::{Header, Version};
use crate::record::{Commit, RECORD_ROOM, is_zero, mark};
use crate::status::Status;
use crate::trial::{Reason, Trial, is_another, staged};

/// Number of events of the log.
pub const LOG_LEN: usize = 16;
/// Bytes of an event.
const EVENT: usize = 8;

/// Distances of the words from the start of the record room, behind the marks of the trial.
const NOTE: u32 = 32;
const CAUSE: u32 = 40;
const BEGUN: u32 = 48;
const ENDED: u32 = 56;

/// The outcome of a download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The program is on trial.
    OnTrial,
    /// The program runs, and there was nothing to be kept: no trial.
    Installed,
    /// The program on trial was confirmed.
    Confirmed(Cause),
    /// The program on trial was rolled back after three starts.
    Failed,
    /// The program on trial was withdrawn.
    Withdrawn(Cause),
    /// The bootloader has refused the download, or its copy: 1F57h.
    Refused(Status),
    /// The download ended before the image did.
    BrokenOff,
}

/// The decider of a trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cause {
    /// Not known: the power failed at that moment.
    #[default]
    Unknown,
    /// A master, with a command to 2002h:2.
    Command,
    /// A master, by an SDO request, an NMT command or a heartbeat.
    Master,
    /// A time of 2002h.
    Time,
    /// The holder of the key for changes of the program, with a command to 2002h:2.
    Holder,
}

impl Cause {
    const ALL: [Cause; 5] = [Cause::Unknown, Cause::Command, Cause::Master, Cause::Time, Cause::Holder];

    fn from_code(code: u8) -> Cause {
        Cause::ALL.into_iter().find(|cause| *cause as u8 == code).unwrap_or_default()
    }

    /// Notes the cause. To be called after [`Trial::confirm`] or [`Trial::withdraw`]: a power cut between the two may take the
    /// cause, but not the decision.
    pub fn note<F: Flash>(self, flash: &mut F, layout: &Layout) {
        let code = self as u8;
        program_once(flash, layout, CAUSE, [code, !code, code, !code]);
    }

    fn read<F: Flash>(flash: &mut F, layout: &Layout) -> Cause {
        let [code, complement, same, again] = word(flash, place(layout, CAUSE));
        let is_whole = (same, again) == (code, complement) && complement == !code;
        if is_whole { Cause::from_code(code) } else { Cause::Unknown }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Outcome::OnTrial => f.write_str("on trial"),
            Outcome::Installed => f.write_str("installed without a trial"),
            Outcome::Confirmed(cause) => write!(f, "confirmed by {cause}"),
            Outcome::Failed => f.write_str("rolled back after three starts"),
            Outcome::Withdrawn(cause) => write!(f, "rolled back by {cause}"),
            Outcome::Refused(status) => write!(f, "refused: {status}"),
            Outcome::BrokenOff => f.write_str("broken off in the download"),
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Cause::Unknown => "an unknown cause",
            Cause::Command => "a command",
            Cause::Master => "a message of a master",
            Cause::Time => "a time of 2002h",
            Cause::Holder => "a command of the key holder",
        })
    }
}

/// An event: the outcome, and the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event {
    /// The outcome of the download.
    pub outcome: Outcome,
    /// Version of the downloaded program, up to 255.255.255; 0 if its header did not arrive.
    pub version: Version,
    /// Generation of the key that the header names.
    pub generation: u8,
}

impl Event {
    /// The event that is not in the log yet; `None` without one. To be called by the application, after which
    /// [`Event::settle`] takes note that the log has it.
    pub fn pending<F: Flash>(flash: &mut F, layout: &Layout) -> Option<Event> {
        if is_zero(flash, place(layout, ENDED), 0) || all_are(&word(flash, layout.staging().start()), 0xFF) {
            return None;
        }
        let outcome = outcome(flash, layout)?;
        let mut header = Header::EMPTY;
        let is_whole = header.read(flash, layout.staging()).is_ok();
        let header = Some(header).filter(|_| is_whole);
        Some(Event {
            outcome,
            version: header.map_or(Version::default(), |header| header.version()),
            generation: header.map_or(0, |header| least(header.generation())),
        })
    }

    /// Takes note that this event is in the log.
    pub fn settle<F: Flash>(&self, flash: &mut F, layout: &Layout) {
        let word = if self.outcome == Outcome::OnTrial { BEGUN } else { ENDED };
        // If this fails, the next start finds the event once more, and it is the newest of the log.
        let _ = mark(flash, place(layout, word));
    }

    fn encode(&self) -> [u8; EVENT] {
        let (kind, reason, detail) = match self.outcome {
            Outcome::OnTrial => (1, 0, 0),
            Outcome::Installed => (2, 0, 0),
            Outcome::Confirmed(cause) => (3, cause as u8, 0),
            Outcome::Failed => (4, 0, 0),
            Outcome::Withdrawn(cause) => (5, cause as u8, 0),
            Outcome::Refused(status) => (6, status.code, status.detail),
            Outcome::BrokenOff => (7, 0, 0),
        };
        let [low, high] = detail.to_le_bytes();
        let Version { major, minor, patch } = self.version;
        let [major, minor, patch] = [major, minor, patch].map(|number| least(number.into()));
        [kind, reason, low, high, major, minor, patch, self.generation]
    }

    fn decode(bytes: [u8; EVENT]) -> Option<Event> {
        let [kind, reason, low, high, major, minor, patch, generation] = bytes;
        let outcome = match kind {
            1 => Outcome::OnTrial,
            2 => Outcome::Installed,
            3 => Outcome::Confirmed(Cause::from_code(reason)),
            4 => Outcome::Failed,
            5 => Outcome::Withdrawn(Cause::from_code(reason)),
            6 => Outcome::Refused(Status {
                busy: false,
                code: reason,
                detail: u16::from_le_bytes([low, high]),
            }),
            7 => Outcome::BrokenOff,
            _ => return None,
        };
        let version = Version { major: major.into(), minor: minor.into(), patch: patch.into() };
        Some(Event { outcome, version, generation })
    }
}

/// The last sixteen events, the newest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Log([u8; Log::LEN]);

impl Log {
    /// Bytes of the log, on the bus (2006h) and in the parameter memory.
    pub const LEN: usize = LOG_LEN * EVENT;
    /// A log without events.
    pub const EMPTY: Log = Log([0; Log::LEN]);

    /// The log in these bytes. Bytes that are missing hold no events.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Log {
        let mut log = Log::EMPTY;
        log.0.iter_mut().zip(bytes).for_each(|(to, byte)| *to = *byte);
        log
    }

    /// The bytes: event for event, the newest first, and zeros behind the last one.
    #[must_use]
    pub fn bytes(&self) -> &[u8; Log::LEN] {
        &self.0
    }

    /// The events, the newest first.
    pub fn events(&self) -> impl Iterator<Item = Event> {
        self.0.as_chunks().0.iter().map_while(|bytes| Event::decode(*bytes))
    }

    /// Adds an event, unless it is the newest already. The oldest of seventeen is dropped.
    pub fn add(&mut self, event: &Event) {
        if self.events().next().as_ref() != Some(event) {
            let all = event.encode().into_iter().chain(self.0);
            self.0.iter_mut().zip(all).for_each(|(to, byte)| *to = byte);
        }
    }
}

/// Notes in staging why the bootloader has ended an update. Only the first note counts, until staging is erased.
#[inline(never)] // Little room in flash.
pub(crate) fn note<F: Flash>(flash: &mut F, layout: &Layout, status: Status) {
    program_once(flash, layout, NOTE, status.word().to_le_bytes());
}

fn outcome<F: Flash>(flash: &mut F, layout: &Layout) -> Option<Outcome> {
    let trial = Trial::read(flash, layout);
    let note = word(flash, place(layout, NOTE));
    match trial {
        Trial::Begun | Trial::Lost(_) => None,
        Trial::Open => (!is_zero(flash, place(layout, BEGUN), 0)).then_some(Outcome::OnTrial),
        Trial::Over(Reason::Starts) => Some(Outcome::Failed),
        Trial::Over(Reason::Withdrawn) => Some(Outcome::Withdrawn(Cause::read(flash, layout))),
        Trial::None if !all_are(&note, 0xFF) => {
            Some(Outcome::Refused(Status::from_word(u32::from_le_bytes(note))))
        }
        Trial::None => match staged(layout).read(flash) {
            Commit::Done if is_another(flash, layout, layout.staging()) => None,
            Commit::Done if is_zero(flash, place(layout, BEGUN), 0) => {
                Some(Outcome::Confirmed(Cause::read(flash, layout)))
            }
            Commit::Done => Some(Outcome::Installed),
            Commit::None | Commit::Torn => Some(Outcome::BrokenOff),
            Commit::Pending => None,
        },
    }
}

/// Programs a word that is erased.
fn program_once<F: Flash>(flash: &mut F, layout: &Layout, distance: u32, bytes: [u8; 4]) {
    let at = place(layout, distance);
    if all_are(&word(flash, at), 0xFF) {
        // Without it the log has an event without its reason.
        let _ = program(flash, at, &bytes);
    }
}

/// The word at `at`. A word that cannot be read is 0.
fn word<F: Flash>(flash: &mut F, at: u32) -> [u8; 4] {
    let mut word = [0; 4];
    let is_read = flash.read(at, &mut word).is_ok();
    if is_read { word } else { [0; 4] }
}

fn place(layout: &Layout, distance: u32) -> u32 {
    layout.staging().end().saturating_sub(RECORD_ROOM).saturating_add(distance)
}

/// A number in a byte; the largest one for a greater number.
fn least(number: u32) -> u8 {
    u8::try_from(number).unwrap_or(u8::MAX)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    fn event(outcome: Outcome, number: u8) -> Event {
        let version = Version { major: number.into(), minor: 2, patch: 3 };
        Event { outcome, version, generation: 17 }
    }

    #[test]
    fn every_event_reads_back() {
        let status = Status { busy: false, code: 66, detail: 0x1234 };
        let causes = Cause::ALL;
        let outcomes = [Outcome::OnTrial, Outcome::Installed, Outcome::Failed, Outcome::BrokenOff];
        let outcomes = outcomes.into_iter().chain([Outcome::Refused(status)]);
        let outcomes = outcomes.chain(causes.map(Outcome::Confirmed)).chain(causes.map(Outcome::Withdrawn));
        for outcome in outcomes {
            let event = event(outcome, 255);
            assert_eq!(Event::decode(event.encode()), Some(event));
        }
        assert_eq!(Event::decode([0; EVENT]), None);
    }

    #[test]
    fn the_log_keeps_the_last_sixteen_events_the_newest_first() {
        let mut log = Log::EMPTY;
        assert_eq!(log.events().count(), 0);
        for number in 0..40 {
            for _ in 0..2 {
                log.add(&event(Outcome::OnTrial, number));
            }
            let numbers: Vec<_> = log.events().map(|event| event.version.major).collect();
            let expected: Vec<_> = (0..=u16::from(number)).rev().take(LOG_LEN).collect();
            assert_eq!(numbers, expected);
            assert_eq!(Log::from_bytes(log.bytes()), log);
        }
    }
}
