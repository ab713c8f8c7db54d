//! LSS in the device. LSS works in every NMT state; without a node-ID it is the only service.

use super::inner::Inner;
use super::{Action, Definition, STALE};
use crate::lss::{BitRate, Configuration, Outcome, REQUEST, RESPONSE, Slave, Switch, frame_of_word};
use crate::transmit::{Context, RETRY};
use crate::{Frame, NodeId, Span, Tick, Transmit};

/// Identity object: its sub-indexes 1 to 4 are the parts of the identity.
const IDENTITY: u16 = 0x1018;

/// A change of the bit rate (CiA 305, activate bit timing parameters).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Switching {
    No,
    /// The delay before the change. Nothing is sent, so that the bus becomes quiet.
    Before(Switch),
    /// The delay after the change, until all other nodes have changed too.
    After,
}

/// The LSS slave and its last response.
#[derive(Debug)]
pub(super) struct LssSlave {
    slave: Slave,
    reply: [u8; 8],
    /// When to send the response again that found the queue full.
    reply_due: Tick,
    switching: Switching,
    /// When the present delay is over; `NEVER` while the bit rate does not change.
    switching_due: Tick,
}

impl LssSlave {
    pub(super) fn new(node_id: Option<NodeId>) -> LssSlave {
        LssSlave {
            slave: Slave::new(Configuration { node_id, bit_rate: BitRate::FASTEST }),
            reply: [0; 8],
            reply_due: Tick::NEVER,
            switching: Switching::No,
            switching_due: Tick::NEVER,
        }
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.reply_due.shift(by);
        self.switching_due.shift(by);
    }

    pub(super) fn set_bit_rate(&mut self, bit_rate: BitRate) {
        self.slave.set_pending(Configuration { bit_rate, ..self.slave.pending() });
    }

    pub(super) fn set_node_id(&mut self, node_id: Option<NodeId>) {
        self.slave.set_pending(Configuration { node_id, ..self.slave.pending() });
    }

    pub(super) fn is_selected(&self) -> bool {
        self.slave.is_selected()
    }

    /// A reset of the device. A response that still waits is discarded, as all waiting frames are.
    pub(super) fn restart(&mut self) {
        self.reply_due = Tick::NEVER;
        self.slave.reset();
    }

    /// The node-ID with which the device starts.
    pub(super) fn node_id(&self) -> Option<NodeId> {
        self.slave.pending().node_id
    }

    /// Whether a change of the bit rate is under way: nothing is sent during the change.
    pub(super) fn is_switching(&self) -> bool {
        self.switching_due != Tick::NEVER
    }

    #[inline(never)]
    pub(super) fn take_frame(
        &mut self,
        frame: &Frame,
        context: &mut Context<'_, impl Transmit>,
        inner: &mut Inner<impl Definition>,
    ) {
        let Some(request) = frame.full(REQUEST).copied() else { return };
        // A response that still waits is obsolete: the master has sent its next request.
        self.reply_due = Tick::NEVER;
        let identity = |part| inner.number(IDENTITY, part + 1);
        let response = match self.slave.take(request, identity, inner.node_id) {
            Outcome::Silence => None,
            Outcome::Answer(command, value) => Some((command, value)),
            Outcome::BootUp => {
                inner.request_boot_up();
                None
            }
            Outcome::Switch(switch) => {
                self.switching = Switching::Before(switch);
                self.switching_due = context.now.plus(switch.delay());
                None
            }
            // The response is sent at the end of the job.
            Outcome::Store(configuration) if inner.store_configuration(configuration) => None,
            Outcome::Store(_) => Some(Slave::stored(false)),
        };
        if let Some(response) = response {
            self.respond(response, context);
        }
        inner.services_due = STALE;
    }

    /// Sends a response, given as command specifier and value.
    pub(super) fn respond(&mut self, (command, value): (u8, u32), context: &mut Context<'_, impl Transmit>) {
        self.reply = frame_of_word(command, value);
        self.send(context);
    }

    #[inline(never)]
    fn send(&mut self, context: &mut Context<'_, impl Transmit>) {
        let is_sent = context.send(Frame::data_frame(RESPONSE, 8, self.reply));
        self.reply_due = if is_sent { Tick::NEVER } else { context.now.plus(RETRY) };
    }

    /// Sends the response again that found the queue full.
    pub(super) fn poll(&mut self, context: &mut Context<'_, impl Transmit>) {
        if context.now >= self.reply_due {
            self.send(context);
        }
    }

    /// Continues a change of the bit rate. Frames that were held back are sent after the change. Returns the new bit rate
    /// when the bus changes to it.
    pub(super) fn poll_switching(
        &mut self,
        now: Tick,
        inner: &mut Inner<impl Definition>,
    ) -> Option<BitRate> {
        if now < self.switching_due {
            return None;
        }
        let Switching::Before(switch) = self.switching else {
            (self.switching, self.switching_due) = (Switching::No, Tick::NEVER);
            return None;
        };
        inner.ask(Action::BitRate(switch.bit_rate));
        let quiet_until = now.plus(switch.delay());
        self.switching = Switching::After;
        self.switching_due = if quiet_until > now { quiet_until } else { Tick::NEVER };
        Some(switch.bit_rate)
    }

    /// The next deadline of `poll` or `poll_switching`.
    pub(super) fn due(&self) -> Tick {
        self.switching_due.min(self.reply_due)
    }
}
