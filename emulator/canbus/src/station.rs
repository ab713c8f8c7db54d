//! The protocol engine of one participant for one frame: the levels that it drives, bit by bit, and its reaction to the
//! wire.

use crate::bits::{Bit, DOMINANT, Field, INTERMISSION_BITS, Level, RECESSIVE, encode};
use crate::receiver::{Receiver, Seen};
use crate::{Attachment, BusError, ErrorReport, Frame};

/// Bits of an error or overload flag; also the equal bits that complete a passive error flag.
const FLAG_BITS: u8 = 6;
/// Recessive bits of the delimiter after the first one.
const DELIMITER_BITS: u8 = 7;

/// An event for a participant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Notice {
    Lost,
    Sent,
    Received(Frame),
    Error(ErrorReport),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Sends or receives the frame.
    Frame,
    /// Six dominant bits, `left` of them to go.
    ActiveFlag { left: u8 },
    /// Recessive until six equal bits were seen; `run` of them so far.
    PassiveFlag { run: u8, last: Level },
    /// Waits until the flags of all others have ended.
    AfterFlag,
    /// Counts down the remaining bits of the delimiter.
    Delimiter { left: u8 },
    /// Counts down the bits between two frames.
    Intermission { left: u8 },
    /// Ready for the next frame.
    Done,
}

/// One participant, or several participants with identical behaviour on the wire.
#[derive(Clone, Debug)]
pub(crate) struct Station {
    attachment: Attachment,
    /// The bits to send, and the number of bits sent; `None` for a receiver.
    sending: Option<(Vec<Bit>, usize)>,
    receiver: Receiver,
    phase: Phase,
    drive: Level,
    report: Option<ErrorReport>,
    /// No further overload flag: one was sent, or the frame was faulty.
    overloaded: bool,
    resumed: bool,
}

impl Station {
    /// A station at its start of frame: with a frame to send, or a receiver.
    pub(crate) fn new(attachment: Attachment, frame: Option<&Frame>) -> Station {
        let sending = frame.map(|frame| (encode(frame), 0));
        let drive = if sending.is_some() { DOMINANT } else { RECESSIVE };
        Station {
            attachment,
            sending,
            receiver: Receiver::new(),
            phase: Phase::Frame,
            drive,
            report: None,
            overloaded: false,
            resumed: false,
        }
    }

    /// The level that the station drives.
    pub(crate) fn drives(&self) -> Level {
        self.drive || self.is_silent()
    }

    /// Whether the station is ready for the next frame: this frame is over, or the station never noticed its start. The
    /// latter happens when a bit error hides the start of frame of an error-passive transmitter, which then gives up
    /// without a dominant bit.
    pub(crate) fn is_done(&self) -> bool {
        let unaware = self.phase == Phase::Frame && self.sending.is_none() && !self.receiver.is_inside();
        self.phase == Phase::Done || unaware
    }

    /// Whether the station's dominant error flag is on the wire or may still come.
    pub(crate) fn threatens(&self) -> bool {
        let active = matches!(self.attachment, Attachment::Active { .. });
        active
            && match self.phase {
                Phase::Frame => self.sending.is_some() || self.receiver.is_inside(),
                phase => matches!(phase, Phase::ActiveFlag { .. }),
            }
    }

    /// Takes the error report that would otherwise wait for the end of the flags of other stations.
    pub(crate) fn take_report(&mut self) -> Option<Notice> {
        self.report.take().map(Notice::Error)
    }

    /// Samples the wire and decides the level to drive in the next bit.
    pub(crate) fn sample(&mut self, wire: Level) -> Option<Notice> {
        // A silent controller hears its own dominant bits as if they were on the wire (RM0390, bxCAN silent mode).
        let level = wire && (self.drive || !self.is_silent());
        match self.phase {
            Phase::Frame => self.sample_frame(level),
            Phase::ActiveFlag { left } => {
                self.step(left, |left| Phase::ActiveFlag { left }, Phase::AfterFlag);
                None
            }
            Phase::PassiveFlag { run, last } => {
                self.sample_passive_flag(run, last, level);
                None
            }
            Phase::AfterFlag => self.sample_after_flag(level),
            Phase::Delimiter { left } => {
                self.sample_delimiter(left, level);
                None
            }
            Phase::Intermission { left } => {
                self.sample_intermission(left, level);
                None
            }
            Phase::Done => {
                self.sample_idle(level);
                None
            }
        }
    }

    fn is_silent(&self) -> bool {
        matches!(self.attachment, Attachment::Silent { .. })
    }

    /// One bit of a counted phase is over.
    fn step(&mut self, left: u8, phase: impl Fn(u8) -> Phase, next: Phase) {
        self.enter(if left > 1 { phase(left - 1) } else { next });
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.drive = !matches!(phase, Phase::ActiveFlag { .. });
    }

    fn sample_frame(&mut self, level: Level) -> Option<Notice> {
        let seen = self.receiver.feed(level);
        match self.sending.take() {
            Some((bits, n)) => self.sample_sending(bits, n, level),
            None => self.sample_receiving(seen),
        }
    }

    /// A transmitter compares the level sent with the level read back (ISO 11898-1:2015, 10.11 and 10.8).
    fn sample_sending(&mut self, bits: Vec<Bit>, n: usize, level: Level) -> Option<Notice> {
        let sent = bits[n];
        let next = bits.get(n + 1).map(|bit| bit.level);
        self.sending = Some((bits, n + 1));
        match (sent.field, sent.level, level) {
            (Field::Ack, _, RECESSIVE) => self.fail(BusError::Ack),
            (Field::Arbitration, RECESSIVE, DOMINANT) => {
                self.sending = None;
                self.drive = RECESSIVE;
                return Some(Notice::Lost);
            }
            (Field::ArbitrationStuff, RECESSIVE, DOMINANT) => self.fail(BusError::Stuff),
            (Field::Other, RECESSIVE, DOMINANT) => self.fail(BusError::BitRecessive),
            (_, DOMINANT, RECESSIVE) => self.fail(BusError::BitDominant),
            _ => match next {
                Some(level) => self.drive = level,
                None => {
                    self.intermission();
                    return Some(Notice::Sent);
                }
            },
        }
        None
    }

    fn sample_receiving(&mut self, seen: Seen) -> Option<Notice> {
        self.drive = RECESSIVE;
        match seen {
            Seen::Nothing => {}
            Seen::AckSlotNext(answer) => self.drive = !answer,
            Seen::Valid(frame) => return Some(Notice::Received(frame)),
            Seen::End(RECESSIVE) => self.intermission(),
            Seen::End(_) => self.overload(),
            Seen::Error(error) => self.fail(error),
        }
        None
    }

    /// Begins an error flag. Whether the error counts as a transmit or as a receive error depends on the role at the
    /// moment of the error.
    fn fail(&mut self, error: BusError) {
        let transmitting = self.sending.is_some();
        self.report = Some(ErrorReport { error, transmitting, dominant_in_flag: 0, dominant_after_flag: 0 });
        self.overloaded = true;
        match self.attachment {
            Attachment::Passive { .. } => self.enter(Phase::PassiveFlag { run: 0, last: RECESSIVE }),
            _ => self.enter(Phase::ActiveFlag { left: FLAG_BITS }),
        }
    }

    /// Begins an overload flag. Even an error-passive station sends it dominant, because an overload is no error and is
    /// not counted. The standard allows two overload flags; the model sends one, so that a frame always ends.
    fn overload(&mut self) {
        if self.overloaded {
            return self.enter(Phase::AfterFlag);
        }
        self.overloaded = true;
        self.enter(Phase::ActiveFlag { left: FLAG_BITS });
    }

    fn intermission(&mut self) {
        self.enter(Phase::Intermission { left: INTERMISSION_BITS as u8 });
    }

    fn sample_passive_flag(&mut self, run: u8, last: Level, level: Level) {
        if let (Some(report), DOMINANT) = (&mut self.report, level) {
            report.dominant_in_flag += 1;
        }
        let run = if level == last || run == 0 { run + 1 } else { 1 };
        let done = run == FLAG_BITS;
        self.enter(if done { Phase::AfterFlag } else { Phase::PassiveFlag { run, last: level } });
    }

    fn sample_after_flag(&mut self, level: Level) -> Option<Notice> {
        if level == DOMINANT {
            if let Some(report) = &mut self.report {
                report.dominant_after_flag += 1;
            }
            return None;
        }
        self.enter(Phase::Delimiter { left: DELIMITER_BITS });
        self.take_report()
    }

    /// Only a participant at another bit rate can disturb a delimiter. The error has already been counted: the station
    /// just waits.
    fn sample_delimiter(&mut self, left: u8, level: Level) {
        if level == DOMINANT {
            return self.enter(Phase::AfterFlag);
        }
        self.step(
            left,
            |left| Phase::Delimiter { left },
            Phase::Intermission { left: INTERMISSION_BITS as u8 },
        );
    }

    /// A dominant level in the first two bits is an overload condition (ISO 11898-1:2015, 10.4.6).
    fn sample_intermission(&mut self, left: u8, level: Level) {
        if level == DOMINANT && left > 1 {
            return self.overload();
        }
        self.step(left, |left| Phase::Intermission { left }, Phase::Done);
    }

    /// Only the flag of a participant at another bit rate can come now. The flag looks like a start of frame; the
    /// station follows one such flag only.
    fn sample_idle(&mut self, level: Level) {
        if level == DOMINANT && !self.resumed {
            self.resumed = true;
            self.receiver = Receiver::new();
            self.receiver.feed(level);
            self.sending = None;
            self.enter(Phase::Frame);
        }
    }
}
