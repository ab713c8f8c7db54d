//! The default SDO channel of a node, from the client's side (CiA 301, 7.3.5: 600h and 580h plus the node-ID).

use canopen::sdo::{Abort, Multiplexer, Request, Response};
use canopen::{Duration, Frame, Instant, NodeId};

use super::{AbortCode, Cause};
use crate::network::Network;

/// A way to one server, and how long that may take to answer.
pub(super) struct Channel<'n> {
    network: &'n mut Network,
    node: NodeId,
    timeout: Duration,
}

impl<'n> Channel<'n> {
    pub(super) fn new(network: &'n mut Network, node: NodeId, timeout: Duration) -> Channel<'n> {
        Channel { network, node, timeout }
    }

    pub(super) fn timeout(&self) -> Duration {
        self.timeout
    }

    pub(super) fn send(&mut self, data: [u8; 8]) -> Result<(), Cause> {
        let id = 0x600 + u16::from(self.node.get());
        let Some(frame) = Frame::new(id, &data) else { return Ok(()) };
        Ok(self.network.send(&frame)?)
    }

    /// The next frame of the server; `None` when there was none in this time.
    pub(super) fn frame(&mut self, time: Duration) -> Result<Option<[u8; 8]>, Cause> {
        let until = self.network.now() + time;
        self.frame_until(until)
    }

    fn frame_until(&mut self, until: Instant) -> Result<Option<[u8; 8]>, Cause> {
        let id = 0x580 + u16::from(self.node.get());
        Ok(self.network.wait(until, |frame| {
            let is_response = frame.id() == id;
            is_response.then(|| frame.data().try_into().ok())?
        })?)
    }

    /// Sends a request and waits for the response that `fits`.
    pub(super) fn ask<T>(
        &mut self,
        request: Request,
        fits: impl FnMut(Response) -> Option<T>,
    ) -> Result<T, Cause> {
        self.send(request.encode())?;
        self.answer(request, fits)
    }

    /// Waits for the response that `fits`. Others may be late answers to what was given up, and are passed over.
    pub(super) fn answer<T>(
        &mut self,
        request: Request,
        mut fits: impl FnMut(Response) -> Option<T>,
    ) -> Result<T, Cause> {
        let until = self.network.now() + self.timeout;
        let mut silence = Cause::NoAnswer;
        while let Some(frame) = self.frame_until(until)? {
            let response = Response::parse(frame);
            if let Some(code) = response.and_then(|response| refusal(request, response)) {
                return Err(Cause::Abort(code));
            }
            match response.and_then(&mut fits) {
                Some(answer) => return Ok(answer),
                None => silence = Cause::Unexpected,
            }
        }
        Err(silence)
    }

    /// Tells the server that the transfer is over. It has no answer.
    pub(super) fn give_up(&mut self, at: Multiplexer, abort: Abort) {
        // The transfer has failed already; a bus that fails too changes nothing.
        let _ = self.send(Request::Abort(at, abort.code()).encode());
    }
}

/// The code of an abort that answers this request. One for another object is late; a server that does not
/// understand a request at all may leave the object 0.
fn refusal(request: Request, response: Response) -> Option<AbortCode> {
    let Response::Abort(of, code) = response else { return None };
    let asked = match request {
        Request::Download(at, _) | Request::Upload(at) => Some(at),
        Request::BlockDownload { at, .. } | Request::BlockUpload { at, .. } => Some(at),
        _ => None,
    };
    let is_answer = asked.is_none_or(|at| at == of || of == Multiplexer::default());
    is_answer.then_some(AbortCode(code))
}
