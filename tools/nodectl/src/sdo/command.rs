//! A write that the server need not acknowledge, such as a command that restarts its node.

use canopen::client::sdo::{AbortCode, Error};
use canopen::client::{Service, Step, Taken};
use canopen::sdo::{Bytes, Initiate, Multiplexer, Request, Response};
use canopen::{Duration, Frame, Instant, NodeId};

use super::Channel;

/// Writes one byte. A missing answer is no error, and no abort message follows it: the channel may be in use by another client
/// by then.
pub(super) struct Command {
    node: NodeId,
    at: Multiplexer,
    value: u8,
    timeout: Duration,
    until: Option<Instant>,
    result: Option<Result<(), Error>>,
}

impl Command {
    pub(super) fn new(node: NodeId, at: Multiplexer, value: u8, timeout: Duration) -> Command {
        Command { node, at, value, timeout, until: None, result: None }
    }
}

impl Service for Command {
    type Output = Result<(), Error>;

    fn next(&mut self, now: Instant) -> Step<Result<(), Error>> {
        if let Some(until) = self.until {
            let result = self.result.or((now >= until).then_some(Ok(())));
            return result.map_or(Step::Wait(until), Step::Done);
        }
        self.until = Some(now + self.timeout);
        let initiate = Initiate::Expedited(Bytes::from_slice(&[self.value]));
        let request = Request::Download(self.at, initiate).encode();
        match Frame::new(Channel::default_of(self.node).request, &request) {
            Some(frame) => Step::Send(frame),
            None => Step::Done(Ok(())),
        }
    }

    fn on_frame(&mut self, frame: &Frame, _: Instant) -> Taken {
        if frame.id() != Channel::default_of(self.node).response || self.until.is_none() {
            return Taken::Ignored;
        }
        self.result = match frame.data().try_into().ok().and_then(Response::parse) {
            Some(Response::Downloaded(of)) if of == self.at => Some(Ok(())),
            Some(Response::Abort(of, code)) if [self.at, Multiplexer::default()].contains(&of) => {
                Some(Err(Error::Abort(AbortCode(code))))
            }
            _ => return Taken::Ignored,
        };
        Taken::Used
    }
}
