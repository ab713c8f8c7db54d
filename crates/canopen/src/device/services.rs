//! Services: the SDO server, the heartbeat and LSS, and when each of them is due.

use super::body::Body;
use super::lss::Layer;
use super::{Next, Node, STALE};
use crate::lss::{self, BitRate};
use crate::sdo::{Abort, Server};
use crate::transmit::{RETRY, Turn};
use crate::{CanId, Frame, Instant, NodeId, Transmit};

/// Function codes of the pre-defined connection set (CiA 301, 7.3.5).
const SDO_RESPONSE: u16 = 0x580;
const SDO_REQUEST: u16 = 0x600;
const ERROR_CONTROL: u16 = 0x700;
/// Frames for which a block upload leaves room in the queue: all PDOs of a SYNC, a heartbeat, an EMCY.
const RESERVED_ROOM: usize = 10;

impl<B: Body> Node<B> {
    /// Takes a frame with one of the [`service_ids`](Node::service_ids). Any other is ignored.
    #[inline]
    pub fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        self.services.take_frame(frame, now, out, &mut self.body);
        self.services_next()
    }

    /// Sends what is due of the services, and hands over what is left to the caller.
    #[inline]
    pub fn poll_services(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        if now >= self.body.basic().services_due {
            self.services.poll(now, out, &mut self.body);
        }
        self.services_next()
    }

    /// Identifiers of frames for [`on_service_frame`](Node::on_service_frame).
    pub fn service_ids(&self) -> impl Iterator<Item = CanId> {
        let sdo = self.body.basic().node_id.map(|own| own.service(SDO_REQUEST));
        [lss::REQUEST].into_iter().chain(sdo).chain(self.body.watched_ids())
    }
}

/// What serves a device: the SDO server and the LSS slave, with their responses.
#[derive(Debug)]
pub(super) struct Services {
    server: Server,
    /// When to try again to send a reply of the server that found the queue full.
    reply_due: Instant,
    /// When to go on with a block that found the queue full.
    block_due: Instant,
    lss: Layer,
}

impl Services {
    pub(super) fn new(node_id: Option<NodeId>) -> Services {
        Services {
            server: Server::new(),
            reply_due: Instant::NEVER,
            block_due: Instant::NEVER,
            lss: Layer::new(node_id),
        }
    }

    pub(super) fn set_bit_rate(&mut self, bit_rate: BitRate) {
        self.lss.set_bit_rate(bit_rate);
    }

    /// A reset of the device; the node-ID with which the device starts.
    pub(super) fn restart(&mut self) -> Option<NodeId> {
        self.forget_transfer();
        self.lss.restart();
        self.lss.node_id()
    }

    /// A transfer does not survive a state without SDO.
    pub(super) fn follow_state(&mut self, body: &impl Body) {
        if !body.basic().state.has_services() {
            self.forget_transfer();
        }
    }

    fn forget_transfer(&mut self) {
        self.server.reset();
        (self.reply_due, self.block_due) = (Instant::NEVER, Instant::NEVER);
    }

    /// One call. The way to the queue is shut while the bit rate changes.
    pub(super) fn turn<'a, Q: Transmit>(&self, now: Instant, out: &'a mut Q) -> Turn<'a, Q> {
        Turn { now, out, is_open: !self.lss.is_switching() }
    }

    #[inline(never)]
    fn take_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit, body: &mut impl Body) {
        if frame.id() == body.basic().service(SDO_REQUEST).get() {
            self.take_request(frame, &mut self.turn(now, out), body);
        } else if frame.id() == lss::REQUEST.get() {
            self.lss.take_frame(frame, &mut self.turn(now, out), body);
        } else if frame.id() & 0x780 == ERROR_CONTROL {
            body.on_heartbeat(frame, now);
        }
        if now >= body.basic().services_due {
            self.poll(now, out, body);
        }
    }

    /// A request has eight bytes (CiA 301, 7.2.4.3); anything else is none.
    fn take_request(&mut self, frame: &Frame, turn: &mut Turn<'_, impl Transmit>, body: &mut impl Body) {
        let has_sdo = body.basic().state.has_services();
        let Some(request) = frame.full().filter(|_| has_sdo) else { return };
        match self.server.take_next(request, body, turn.now) {
            Some(false) => (),
            Some(true) => self.respond(turn, body),
            None => self.answer(request, turn, body),
        }
    }

    #[allow(clippy::trivially_copy_pass_by_ref)] // As in `sdo`.
    fn answer(&mut self, request: &[u8; 8], turn: &mut Turn<'_, impl Transmit>, body: &mut impl Body) {
        let was_idle = self.server.is_idle();
        let has_reply = self.server.answer(request, body, turn.now);
        // A deadline that was there is later now, but for the pause within a block.
        if was_idle && !self.server.is_idle() || self.server.is_within_block() {
            let basic = body.basic_mut();
            basic.services_due = basic.services_due.min(self.server.deadline());
        }
        // Only a request without a reply starts a block.
        if has_reply {
            return self.respond(turn, body);
        }
        // A reply that still waits is obsolete: its client has gone on.
        self.reply_due = Instant::NEVER;
        if self.server.is_sending() {
            self.send_block(turn, body);
        }
    }

    /// Sends segments of a block upload while the queue is far from full: a transfer must not take the room of PDOs.
    fn send_block(&mut self, turn: &mut Turn<'_, impl Transmit>, body: &mut impl Body) {
        let id = body.basic().service(SDO_RESPONSE);
        let has_reply = self.server.send_block(body, turn.now, |data| {
            turn.room() > RESERVED_ROOM && turn.send(Frame::data_frame(id, 8, data))
        });
        if has_reply {
            self.respond(turn, body);
        }
        self.block_due = if self.server.is_sending() { turn.now + RETRY } else { Instant::NEVER };
        let basic = body.basic_mut();
        basic.services_due = basic.services_due.min(self.block_due);
    }

    /// Sends the server's reply.
    fn respond(&mut self, turn: &mut Turn<'_, impl Transmit>, body: &mut impl Body) {
        let basic = body.basic_mut();
        let id = basic.service(SDO_RESPONSE);
        if turn.send(Frame::data_frame(id, 8, self.server.reply())) {
            self.reply_due = Instant::NEVER;
        } else {
            self.reply_due = turn.now + RETRY;
            basic.services_due = basic.services_due.min(self.reply_due);
        }
    }

    /// A job has come to its end: whoever waits for the end is answered, the LSS master if `lss_waits`.
    pub(super) fn finish(
        &mut self,
        result: Result<(), Abort>,
        lss_waits: bool,
        turn: &mut Turn<'_, impl Transmit>,
        body: &mut impl Body,
    ) {
        if lss_waits {
            self.lss.respond(lss::Slave::stored(result.is_ok()), turn);
        }
        if self.server.release(result, turn.now) {
            self.respond(turn, body);
        }
        body.basic_mut().services_due = STALE;
    }

    #[inline(never)]
    fn poll(&mut self, now: Instant, out: &mut impl Transmit, body: &mut impl Body) {
        self.lss.poll_switching(now, body);
        let turn = &mut self.turn(now, out);
        self.lss.poll(turn);
        let basic = body.basic_mut();
        if !basic.is_initialising() {
            let id = basic.service(ERROR_CONTROL);
            basic.heartbeat.poll(id, basic.state, turn);
            body.poll_errors(turn);
            self.follow_state(body);
        }
        if body.basic().state.has_services() {
            self.poll_sdo(turn, body);
        }
        body.basic_mut().services_due = self.due(body);
    }

    fn poll_sdo(&mut self, turn: &mut Turn<'_, impl Transmit>, body: &mut impl Body) {
        if turn.now >= self.reply_due {
            self.respond(turn, body);
        }
        if self.server.expire(turn.now) {
            self.respond(turn, body);
        }
        if turn.now >= self.block_due {
            self.send_block(turn, body);
        }
    }

    fn due(&self, body: &impl Body) -> Instant {
        let (lss, basic) = (self.lss.due(), body.basic());
        if basic.is_initialising() {
            return lss;
        }
        let due = lss.min(basic.heartbeat.due()).min(body.errors_due());
        // Without SDO, no transfer is under way, and nothing of the three is due.
        due.min(self.server.deadline()).min(self.reply_due).min(self.block_due)
    }
}
