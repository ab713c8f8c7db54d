//! Fastscan (CiA 305, 6.6): the identity of a slave without a node-ID, bit by bit.

use super::{Error, Name, Options, frame, response, switch_global};
use crate::client::service::later;
use crate::client::{Service, Step, Taken};
use crate::lss::{Identity, Request, Response};
use crate::{Duration, Frame, Instant};

/// Finds one slave that has no node-ID and puts it into the configuration state. The output is `None` when no slave
/// answers.
///
/// All slaves that match a question answer with the same frame, so the number of slaves does not matter. Silence means
/// that the bit is 1. A question takes the whole time-out. After an answer it takes another quarter of the time-out,
/// because other slaves may answer a little later. A lost answer makes the identity wrong; the question at the end of
/// each part detects this, and the search restarts, as often as [`Options::retries`] allows.
#[derive(Clone, Copy, Debug)]
pub struct Fastscan {
    options: Options,
    question: Question,
    /// The known bits of the identity; 0 where a bit is not known yet.
    found: [u32; 4],
    /// When the question ends; `None` before the question is sent.
    until: Option<Instant>,
    /// When the question ends at the latest, however many answers arrive.
    latest: Instant,
    is_answered: bool,
}

#[derive(Clone, Copy, Debug)]
enum Question {
    /// Switches all slaves to the waiting state before another attempt. This request has no answer.
    Release,
    /// Is there any slave without a node-ID?
    Anybody,
    /// `Bit(part, bit)`: is this bit of this part of the identity 0?
    Bit(u8, u8),
    /// Is this part of the identity right?
    Part(u8),
    Over(Result<Option<Identity>, Error>),
}

impl Fastscan {
    /// Questions of a successful search: whether there is any slave, and for each part 32 bits and the check of the
    /// part.
    pub const QUESTIONS: u8 = 1 + 4 * 33;

    /// A search with the time-out and the retries of `options`.
    #[must_use]
    pub const fn new(options: Options) -> Fastscan {
        let question = Question::Anybody;
        Fastscan { options, question, found: [0; 4], until: None, latest: Instant::NEVER, is_answered: false }
    }

    /// How many of the [`QUESTIONS`](Fastscan::QUESTIONS) have been asked.
    #[must_use]
    pub const fn asked(&self) -> u8 {
        match self.question {
            Question::Release | Question::Anybody => 0,
            Question::Bit(part, bit) => 1 + (part & 3) * 33 + (31 - (bit & 31)),
            Question::Part(part) => 1 + (part & 3) * 33 + 32,
            Question::Over(_) => Fastscan::QUESTIONS,
        }
    }

    fn part(&self, part: u8) -> u32 {
        self.found.get(usize::from(part)).copied().unwrap_or(0)
    }

    /// The frame of the question; `None` after the last question.
    fn request(&self) -> Option<Frame> {
        let fastscan = |value, bit, part, next| Some(frame(Request::Fastscan { value, bit, part, next }));
        match self.question {
            Question::Release => Some(switch_global(false)),
            Question::Anybody => fastscan(0, Request::CONFIRM, 0, 0),
            Question::Bit(part, bit) => fastscan(self.part(part), bit, part, part),
            // The slave continues with the next part. After the last part, the slave is selected.
            Question::Part(part) => fastscan(self.part(part), 0, part, (part + 1) % 4),
            Question::Over(_) => None,
        }
    }

    /// The next question, after an answer or after silence.
    fn following(&mut self) -> Question {
        match (self.question, self.is_answered) {
            (Question::Release, _) => Question::Anybody,
            (Question::Anybody, true) => {
                self.found = [0; 4];
                Question::Bit(0, 31)
            }
            (Question::Anybody, false) => self.again(Question::Anybody, Ok(None)),
            (Question::Bit(part, bit), is_zero) => self.learn(part, bit, is_zero),
            (Question::Part(3), true) => Question::Over(Ok(Some(self.identity()))),
            (Question::Part(part), true) => Question::Bit(part + 1, 31),
            (Question::Part(_), false) => self.again(Question::Release, Err(Error::NoAnswer(Name::Fastscan))),
            (over, _) => over,
        }
    }

    fn learn(&mut self, part: u8, bit: u8, is_zero: bool) -> Question {
        if let Some(found) = self.found.get_mut(usize::from(part)).filter(|_| !is_zero) {
            *found |= 1 << (bit & 31);
        }
        bit.checked_sub(1).map_or(Question::Part(part), |next| Question::Bit(part, next))
    }

    fn again(&mut self, question: Question, otherwise: Result<Option<Identity>, Error>) -> Question {
        let Some(retries) = self.options.retries.checked_sub(1) else { return Question::Over(otherwise) };
        self.options.retries = retries;
        question
    }

    fn identity(&self) -> Identity {
        let [vendor, product, revision, serial] = self.found;
        Identity { vendor, product, revision, serial }
    }
}

impl Service for Fastscan {
    type Output = Result<Option<Identity>, Error>;

    fn next(&mut self, now: Instant) -> Step<Result<Option<Identity>, Error>> {
        match self.until {
            Some(until) if now < until => return Step::Wait(until),
            Some(_) => self.question = self.following(),
            None => (),
        }
        if let Question::Over(result) = self.question {
            self.until = None;
            return Step::Done(result);
        }
        let Some(request) = self.request() else { return Step::Wait(now) };
        self.is_answered = false;
        let until = later(now, self.options.timeout);
        (self.until, self.latest) = (Some(until), later(until, self.options.timeout));
        Step::Send(request)
    }

    fn on_frame(&mut self, frame: &Frame, now: Instant) -> Taken {
        if self.until.is_none() || response(frame) != Some(Response::Identified) {
            return Taken::Ignored;
        }
        self.is_answered = true;
        self.until = Some(self.latest.min(later(now, Duration(self.options.timeout.0 / 4))));
        Taken::Used
    }
}
