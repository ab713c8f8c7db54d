//! LSS in the device: it works in every NMT state, and without a node-ID it is all there is.

use super::{Action, Application, Core, Device, STALE};
use crate::lss::{Effect, Identity, RESPONSE, Request, Response, Switch};
use crate::transmit::{Gate, RETRY};
use crate::{Frame, Instant, Transmit};

/// Identity object.
const IDENTITY: u16 = 0x1018;

/// A change of the bit rate under way (CiA 305, activate bit timing parameters).
#[derive(Clone, Copy, Debug)]
pub(super) enum Switching {
    /// The delay before it: nothing is sent, the bus becomes quiet.
    Before(Instant, Switch),
    /// The delay after it: all others change too.
    After(Instant),
}

impl Switching {
    fn due(self) -> Instant {
        match self {
            Switching::Before(due, _) | Switching::After(due) => due,
        }
    }
}

impl<A: Application, const N: usize> Device<A, N> {
    pub(super) fn on_lss(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let Some(request) = frame.full().and_then(Request::parse) else { return };
        let identity = self.core.identity();
        let outcome = self.lss.take(request, &identity, self.core.node_id);
        match outcome.effect {
            Some(Effect::Join) => self.core.begin_join(),
            Some(Effect::Switch(switch)) => {
                self.switching = Some(Switching::Before(now + switch.delay, switch));
            }
            Some(Effect::Store(configuration)) => self.store_configuration(configuration, now, out),
            None => (),
        }
        if let Some(response) = outcome.response {
            self.respond_lss(response, now, out);
        }
        self.core.services_due = STALE;
    }

    /// Sends a response. One that still waits is obsolete: its master has gone on.
    pub(super) fn respond_lss(&mut self, response: Response, now: Instant, out: &mut impl Transmit) {
        let is_sent = out.send(Frame::data_frame(RESPONSE, 8, response.encode())).is_ok();
        self.lss_response = (!is_sent).then_some((response, now + RETRY));
        self.core.services_due = STALE;
    }

    pub(super) fn poll_lss(&mut self, now: Instant, out: &mut impl Transmit) {
        match self.lss_response {
            Some((response, due)) if now >= due => self.respond_lss(response, now, out),
            _ => (),
        }
    }

    /// Goes on with a change of the bit rate. What was held back is sent after it.
    pub(super) fn poll_switching(&mut self, now: Instant) {
        self.switching = match self.switching {
            Some(Switching::Before(due, switch)) if now >= due => {
                self.core.pending.request = Some(Action::BitRate(switch.bit_rate));
                Some(Switching::After(now + switch.delay))
            }
            Some(Switching::After(due)) if now >= due => None,
            other => other,
        };
    }

    pub(super) fn next_lss(&self) -> Instant {
        let response = self.lss_response.map_or(Instant::NEVER, |(_, due)| due);
        self.switching.map_or(Instant::NEVER, Switching::due).min(response)
    }

    /// The way to the queue: shut while the bit rate changes.
    pub(super) fn gate<'a, T: Transmit>(&self, out: &'a mut T) -> Gate<'a, T> {
        Gate { out, is_open: self.switching.is_none() }
    }
}

impl<A: Application, const N: usize> Core<A, N> {
    fn identity(&self) -> Identity {
        Identity {
            vendor: self.number(IDENTITY, 1),
            product: self.number(IDENTITY, 2),
            revision: self.number(IDENTITY, 3),
            serial: self.number(IDENTITY, 4),
        }
    }
}
