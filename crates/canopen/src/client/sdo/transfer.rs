//! The part that all kinds of transfer have in common: order of the steps, time-outs, retries, end.

use super::link::{Channel, Link};
use super::{Error, Options};
use crate::client::service::later;
use crate::client::{Service, Step, Taken};
use crate::sdo::{BlockSegment, Multiplexer};
use crate::{Frame, Instant};

/// One kind of transfer: its requests, and its reaction to the answers.
pub trait Protocol {
    /// Begins the transfer, perhaps once more.
    fn begin(&mut self, link: &mut Link);

    /// Takes a frame of the server that is not an abort message.
    ///
    /// # Errors
    /// The transfer has failed.
    fn on_response(&mut self, data: [u8; 8], link: &mut Link, now: Instant) -> Result<Progress, Error>;

    /// The next segment of a block; `None` when all are sent.
    fn segment(&mut self, _: &mut Link) -> Option<BlockSegment> {
        None
    }

    /// The next frame of the server has not arrived in time.
    ///
    /// # Errors
    /// The transfer has failed.
    fn on_silence(&mut self, link: &mut Link) -> Result<(), Error> {
        Err(link.silence())
    }

    /// Bytes that the receiver has taken.
    fn transferred(&self) -> usize;
}

/// The effect of an answer on the transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// The transfer continues.
    Continues,
    /// The transfer is complete; one last frame may remain to be sent.
    Complete,
    /// The answer does not fit the state of the transfer.
    Unexpected,
}

/// The state of the transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Nothing has been sent.
    New,
    Running,
    /// An abort message ends this attempt at the server; then the next attempt begins.
    Again,
    Over(Result<(), Error>),
}

/// A transfer of one object between this client and the server of a node.
///
/// The kinds are [`Upload`](super::Upload), [`Download`](super::Download), [`BlockUpload`](super::BlockUpload) and
/// [`BlockDownload`](super::BlockDownload).
#[derive(Debug)]
pub struct Transfer<P> {
    pub(super) protocol: P,
    link: Link,
    phase: Phase,
    /// The deadline of the whole transfer.
    end: Instant,
    retries: u8,
}

impl<P: Protocol> Transfer<P> {
    pub(super) fn with(protocol: P, channel: Channel, at: Multiplexer, options: Options) -> Transfer<P> {
        let retries = options.retries;
        let link = Link::new(channel, at, options);
        Transfer { protocol, link, phase: Phase::New, end: Instant::NEVER, retries }
    }

    /// How many bytes the receiver has taken so far. A restarted transfer counts from 0 again.
    #[must_use]
    pub fn transferred(&self) -> usize {
        self.protocol.transferred()
    }

    /// Cancels the transfer. The next step sends an abort message.
    pub fn abort(&mut self) {
        if !matches!(self.phase, Phase::Over(_)) {
            self.fail(Error::Cancelled);
        }
    }

    fn begin(&mut self) {
        self.phase = Phase::Running;
        self.protocol.begin(&mut self.link);
    }

    fn fail(&mut self, error: Error) {
        if let Some(code) = error.abort() {
            self.link.give_up(code);
        }
        self.phase = if error.is_worth_a_retry() && self.retries > 0 {
            self.retries -= 1;
            Phase::Again
        } else {
            Phase::Over(Err(error))
        };
    }

    /// Begins a new transfer, and fails a transfer that has reached its deadline.
    fn advance(&mut self, now: Instant) {
        if self.phase == Phase::New {
            self.end = later(now, self.link.options.limit);
            self.begin();
        }
        if now >= self.end && !matches!(self.phase, Phase::Over(_)) {
            self.retries = 0;
            self.fail(Error::Late);
        }
    }

    /// The answer of the server is late.
    fn on_silence(&mut self) {
        if let Err(error) = self.protocol.on_silence(&mut self.link) {
            self.fail(error);
        }
    }
}

impl<P: Protocol> Service for Transfer<P> {
    type Output = Result<(), Error>;

    fn next(&mut self, now: Instant) -> Step<Result<(), Error>> {
        self.advance(now);
        // Ends after two passes at the latest: the second pass has a frame to send or a result.
        loop {
            if let Some(frame) = self.link.outgoing(now) {
                return Step::Send(frame);
            }
            match self.phase {
                Phase::Over(result) => return Step::Done(result),
                Phase::Again | Phase::New => self.begin(),
                Phase::Running => {
                    if let Some(segment) = self.protocol.segment(&mut self.link) {
                        return Step::Send(self.link.segment(segment, now));
                    }
                    if now < self.link.answer_by() {
                        return Step::Wait(self.link.answer_by().min(self.end));
                    }
                    self.on_silence();
                }
            }
        }
    }

    fn on_frame(&mut self, frame: &Frame, now: Instant) -> Taken {
        let Some(data) = self.link.response(frame).filter(|_| self.phase == Phase::Running) else {
            return Taken::Ignored;
        };
        if self.link.is_repeated(data) {
            return Taken::Ignored;
        }
        if let Some(code) = self.link.refusal(data) {
            self.fail(Error::Abort(code));
            return Taken::Used;
        }
        match self.protocol.on_response(data, &mut self.link, now) {
            Ok(Progress::Continues) => Taken::Used,
            Ok(Progress::Complete) => {
                self.phase = Phase::Over(Ok(()));
                Taken::Used
            }
            Ok(Progress::Unexpected) => {
                self.link.note_unexpected();
                Taken::Unexpected
            }
            Err(error) => {
                self.fail(error);
                Taken::Used
            }
        }
    }
}
