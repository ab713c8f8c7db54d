//! An LSS service with an answer.

use super::{Error, Name, Options, frame, response};
use crate::client::service::later;
use crate::client::{Service, Step, Taken};
use crate::lss::{Request, Response};
use crate::{Frame, Instant};

/// Interprets a response to the last request; `None` for a response that does not answer the request.
type Interpret<T> = fn(Request, Response) -> Option<Result<T, Error>>;

/// Up to four requests and the answer to the last request. Without an answer, all requests are sent again: none of
/// them does harm when it arrives twice.
#[derive(Clone, Copy, Debug)]
pub struct Exchange<T> {
    name: Name,
    requests: [Option<Request>; 4],
    interpret: Interpret<T>,
    options: Options,
    /// How many requests of this attempt have been sent.
    sent: usize,
    until: Instant,
    answer: Option<Result<T, Error>>,
}

impl<T> Exchange<T> {
    pub(super) fn new(
        name: Name,
        request: Request,
        interpret: Interpret<T>,
        options: Options,
    ) -> Exchange<T> {
        Exchange::of([Some(request), None, None, None], name, interpret, options)
    }

    pub(super) fn of(
        requests: [Option<Request>; 4],
        name: Name,
        interpret: Interpret<T>,
        options: Options,
    ) -> Exchange<T> {
        Exchange { name, requests, interpret, options, sent: 0, until: Instant::NEVER, answer: None }
    }

    fn pending(&self) -> Option<Request> {
        self.requests.get(self.sent).copied().flatten()
    }
}

impl<T: Copy> Service for Exchange<T> {
    type Output = Result<T, Error>;

    fn next(&mut self, now: Instant) -> Step<Result<T, Error>> {
        if let Some(answer) = self.answer {
            return Step::Done(answer);
        }
        if now >= self.until && self.pending().is_none() {
            if self.options.retries == 0 {
                return Step::Done(Err(Error::NoAnswer(self.name)));
            }
            self.options.retries -= 1;
            self.sent = 0;
        }
        let Some(request) = self.pending() else { return Step::Wait(self.until) };
        self.sent += 1;
        self.until = later(now, self.options.timeout);
        Step::Send(frame(request))
    }

    fn on_frame(&mut self, frame: &Frame, _: Instant) -> Taken {
        let Some(response) = response(frame) else { return Taken::Ignored };
        let is_waiting = self.pending().is_none() && self.answer.is_none();
        let last = self.sent.checked_sub(1).and_then(|last| self.requests.get(last).copied().flatten());
        let Some(request) = last.filter(|_| is_waiting) else { return Taken::Ignored };
        self.answer = (self.interpret)(request, response);
        if self.answer.is_some() { Taken::Used } else { Taken::Unexpected }
    }
}
