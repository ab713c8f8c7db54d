//! LSS in the device: it works in every NMT state, and without a node-ID it is all there is.

use super::{Action, Application, Core, Device, STALE};
use crate::lss::{Identity, Outcome, RESPONSE, Request, Response, Switch};
use crate::transmit::{RETRY, Turn};
use crate::{Frame, Instant, Transmit};

/// Identity object.
const IDENTITY: u16 = 0x1018;

/// A change of the bit rate (CiA 305, activate bit timing parameters).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Switching {
    No,
    /// The delay before it: nothing is sent, the bus becomes quiet.
    Before(Switch),
    /// The delay after it: all others change too.
    After,
}

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Device<A, N, T, R, W, M>
{
    #[inline(never)]
    pub(super) fn on_lss(&mut self, frame: &Frame, turn: &mut Turn<'_, impl Transmit>) {
        let Some(request) = frame.full().copied().and_then(Request::parse) else { return };
        let identity = self.core.identity();
        let outcome = self.lss.take(request, &identity, self.core.node_id);
        let response = match outcome {
            Outcome::Silence => None,
            Outcome::Answer(response) => Some(response),
            Outcome::Join => {
                self.core.begin_join();
                None
            }
            Outcome::Switch(switch) => {
                self.switching = Switching::Before(switch);
                self.switching_due = turn.now + switch.delay();
                None
            }
            Outcome::Store(configuration) => self.core.store_configuration(configuration),
        };
        if let Some(response) = response {
            self.respond_lss(response, turn);
        }
        self.core.services_due = STALE;
    }

    /// Sends a response. One that still waits is obsolete: its master has gone on.
    pub(super) fn respond_lss(&mut self, response: Response, turn: &mut Turn<'_, impl Transmit>) {
        self.lss_reply = response.encode();
        self.send_lss(turn);
    }

    #[inline(never)]
    fn send_lss(&mut self, turn: &mut Turn<'_, impl Transmit>) {
        let is_sent = turn.send(Frame::data_frame(RESPONSE, 8, self.lss_reply));
        self.lss_reply_due = if is_sent { Instant::NEVER } else { turn.now + RETRY };
        self.core.services_due = STALE;
    }

    pub(super) fn poll_lss(&mut self, turn: &mut Turn<'_, impl Transmit>) {
        if turn.now >= self.lss_reply_due {
            self.send_lss(turn);
        }
    }

    /// Goes on with a change of the bit rate. What was held back is sent after it.
    pub(super) fn poll_switching(&mut self, now: Instant) {
        if now < self.switching_due {
            return;
        }
        (self.switching, self.switching_due) = match self.switching {
            Switching::Before(switch) => {
                self.core.pending.ask(Action::BitRate(switch.bit_rate));
                (Switching::After, now + switch.delay())
            }
            Switching::No | Switching::After => (Switching::No, Instant::NEVER),
        };
    }

    pub(super) fn next_lss(&self) -> Instant {
        self.switching_due.min(self.lss_reply_due)
    }

    /// One call. The way to the queue is shut while the bit rate changes.
    pub(super) fn turn<'a, Q: Transmit>(&self, now: Instant, out: &'a mut Q) -> Turn<'a, Q> {
        Turn { now, out, is_open: self.switching == Switching::No }
    }
}

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Core<A, N, T, R, W, M>
{
    fn identity(&self) -> Identity {
        Identity {
            vendor: self.number(IDENTITY, 1),
            product: self.number(IDENTITY, 2),
            revision: self.number(IDENTITY, 3),
            serial: self.number(IDENTITY, 4),
        }
    }
}
