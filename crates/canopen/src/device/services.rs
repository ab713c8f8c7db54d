//! Services: the SDO server, the heartbeat and LSS, and their deadlines.

use super::body::Body;
use super::lss::LssSlave;
use super::{Application as _, Next, Node, STALE};
use crate::frame::FullFrameId;
use crate::lss::{self, BitRate};
use crate::pdo::Budget;
use crate::sdo::{Abort, Server};
use crate::transmit::{Context, ProcessContext, RETRY};
use crate::{CanId, Frame, Instant, NodeId, Transmit};

/// Function codes of the pre-defined connection set (CiA 301, 7.3.5).
const SDO_RESPONSE: u16 = 0x580;
const SDO_REQUEST: u16 = 0x600;
const ERROR_CONTROL: u16 = 0x700;

/// The SDO server and the LSS slave of a device, with the responses that wait for room in the queue.
#[derive(Debug)]
pub(super) struct Services {
    server: Server,
    /// The CAN-ID of requests to the server. A request has eight bytes (CiA 301, 7.2.4.3); any other frame is not a
    /// request.
    sdo_request: FullFrameId,
    /// When to send a reply of the server again that found the queue full.
    reply_due: Instant,
    /// When to continue a block that found the queue full.
    block_due: Instant,
    lss: LssSlave,
    /// The share of process data in the bus.
    budget: Budget,
}

impl Services {
    pub(super) fn new(node_id: Option<NodeId>) -> Services {
        Services {
            server: Server::new(),
            sdo_request: sdo_request(node_id),
            reply_due: Instant::NEVER,
            block_due: Instant::NEVER,
            lss: LssSlave::new(node_id),
            budget: Budget::new(BitRate::FASTEST.kbit()),
        }
    }

    pub(super) fn set_bit_rate(&mut self, bit_rate: BitRate) {
        self.lss.set_bit_rate(bit_rate);
        self.set_bus_bit_rate(bit_rate);
    }

    /// Sets the bit rate at which the bus runs.
    pub(super) fn set_bus_bit_rate(&mut self, bit_rate: BitRate) {
        self.budget.set_bit_rate(bit_rate.kbit());
    }

    /// Resets the services. Returns the node-ID with which the device starts.
    pub(super) fn restart(&mut self) -> Option<NodeId> {
        self.forget_transfer();
        self.lss.restart();
        self.sdo_request = sdo_request(self.lss.node_id());
        self.lss.node_id()
    }

    /// Whether no client waits for a response, except for that of a job.
    pub(super) fn is_between_requests(&self) -> bool {
        let waits = self.reply_due.min(self.block_due).min(self.lss.due());
        self.server.is_between_requests() && waits == Instant::NEVER
    }

    fn forget_transfer(&mut self) {
        self.server.reset();
        (self.reply_due, self.block_due) = (Instant::NEVER, Instant::NEVER);
    }

    /// The time and the transmit queue for one call of the device. While the bit rate changes, the queue accepts
    /// nothing.
    pub(super) fn context<'a, Q: Transmit>(&self, now: Instant, out: &'a mut Q) -> Context<'a, Q> {
        Context { now, out, is_open: !self.lss.is_switching() }
    }

    /// The same for process data, which have a share of the bus. `has_pdos`: whether the device has PDOs at all.
    pub(super) fn process_context<'a, Q: Transmit>(
        &'a mut self,
        has_pdos: bool,
        now: Instant,
        out: &'a mut Q,
    ) -> ProcessContext<'a, Q> {
        if has_pdos {
            self.budget.begin(now, || out.has_waiting_pdo());
        }
        ProcessContext { now, out, is_open: !self.lss.is_switching(), budget: &mut self.budget }
    }
}

/// The CAN-ID of requests to the SDO server. Without a node-ID, the CAN-ID for node-ID 0, which no client uses.
fn sdo_request(node_id: Option<NodeId>) -> FullFrameId {
    CanId::of_service(SDO_REQUEST, node_id.map_or(0, NodeId::get)).into()
}

impl<B: Body> Node<B> {
    /// Takes a frame with one of the [`service_ids`](Node::service_ids). Any other is ignored.
    #[inline]
    pub fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        match frame.full(self.services.sdo_request) {
            Some(request) => {
                // A segment of a block that only needs a place in the buffer. In any state: without SDO, there is no
                // transfer.
                let server = &mut self.services.server;
                if server.takes_block() && server.take_segment(request, now) {
                    return self.process_next();
                }
                self.take_request(request, now, out);
            }
            None => self.take_other_service(frame, now, out),
        }
        self.services_next()
    }

    /// Sends the frames of the services that are due, and returns a waiting action.
    #[inline]
    pub fn poll_services(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        if now >= self.body.basic().services_due {
            self.send_services(now, out);
        }
        self.services_next()
    }

    /// Identifiers of frames for [`on_service_frame`](Node::on_service_frame).
    pub fn service_ids(&self) -> impl Iterator<Item = CanId> {
        let sdo = self.body.basic().node_id.map(|own| own.service(SDO_REQUEST));
        [lss::REQUEST].into_iter().chain(sdo).chain(self.body.watched_ids())
    }

    /// Takes a request to the SDO server.
    #[inline(never)]
    #[allow(clippy::trivially_copy_pass_by_ref)] // As in `sdo`.
    fn take_request(&mut self, request: &[u8; 8], now: Instant, out: &mut impl Transmit) {
        if self.body.basic().state.has_services() {
            self.on_request(request, &mut self.services.context(now, out));
        }
        self.send_due_services(now, out);
    }

    /// Takes a frame that is no request to the SDO server: LSS, or the heartbeat of another node.
    #[inline(never)]
    pub(super) fn take_other_service(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        if frame.id() == lss::REQUEST.get() {
            let context = &mut self.services.context(now, out);
            self.services.lss.take_frame(frame, context, &mut self.body);
        } else if frame.id() & 0x780 == ERROR_CONTROL {
            self.body.on_heartbeat(frame, now);
        }
        self.send_due_services(now, out);
    }

    /// Whether a frame is a request to the SDO server.
    #[inline]
    pub(super) fn is_request(&self, frame: &Frame) -> bool {
        frame.full(self.services.sdo_request).is_some()
    }

    #[inline]
    fn send_due_services(&mut self, now: Instant, out: &mut impl Transmit) {
        if now >= self.body.basic().services_due {
            self.send_services(now, out);
        }
    }

    #[allow(clippy::trivially_copy_pass_by_ref)] // As in `sdo`.
    fn on_request(&mut self, request: &[u8; 8], context: &mut Context<'_, impl Transmit>) {
        let Services { server, reply_due, .. } = &mut self.services;
        let has_reply = server.answer(request, &mut self.body, context.now);
        if !server.is_idle() {
            self.body.basic_mut().serve_until(server.deadline());
        }
        // Only a request without a reply can start a block.
        if has_reply {
            return self.respond(context);
        }
        // A reply that still waits is obsolete: the client has sent its next request.
        *reply_due = Instant::NEVER;
        if B::Application::BLOCK_UPLOAD && server.is_sending() {
            self.send_block(context);
        }
    }

    /// Sends segments of a block upload while the queue has plenty of room: a transfer must not delay PDOs.
    #[inline(never)]
    fn send_block(&mut self, context: &mut Context<'_, impl Transmit>) {
        let id = self.body.basic().service(SDO_RESPONSE);
        let server = &mut self.services.server;
        let has_reply = server.send_block(&self.body, context.now, |data| {
            context.room() > B::RESERVED_ROOM && context.send(Frame::data_frame(id, 8, data))
        });
        let block_due = if server.is_sending() { context.now.plus(RETRY) } else { Instant::NEVER };
        self.services.block_due = block_due;
        self.body.basic_mut().serve_until(block_due);
        if has_reply {
            self.respond(context);
        }
    }

    /// Sends the server's reply.
    #[inline(never)]
    fn respond(&mut self, context: &mut Context<'_, impl Transmit>) {
        let basic = self.body.basic_mut();
        let id = basic.service(SDO_RESPONSE);
        if context.send(Frame::data_frame(id, 8, self.services.server.reply())) {
            self.services.reply_due = Instant::NEVER;
        } else {
            self.services.reply_due = context.now.plus(RETRY);
            basic.serve_until(self.services.reply_due);
        }
    }

    /// A job is finished: answers the SDO client that waits for it, and the LSS master if `lss_waits`.
    pub(super) fn finish_job(
        &mut self,
        result: Result<(), Abort>,
        lss_waits: bool,
        context: &mut Context<'_, impl Transmit>,
    ) {
        if lss_waits {
            self.services.lss.respond(lss::Slave::stored(result.is_ok()), context);
        }
        if self.services.server.release(result, context.now) {
            self.respond(context);
        }
        self.body.basic_mut().services_due = STALE;
    }

    /// Forgets the transfer in a state without SDO.
    pub(super) fn silence_services(&mut self) {
        if !self.body.basic().state.has_services() {
            self.services.forget_transfer();
        }
    }

    #[inline(never)]
    fn send_services(&mut self, now: Instant, out: &mut impl Transmit) {
        if let Some(bit_rate) = self.services.lss.poll_switching(now, &mut self.body) {
            self.services.set_bus_bit_rate(bit_rate);
        }
        let context = &mut self.services.context(now, out);
        self.services.lss.poll(context);
        if !self.body.basic().is_initialising() {
            // Nothing precedes the boot-up message. Any other heartbeat follows the EMCY that gives the reason for a new
            // state.
            let boots_up = self.body.basic().heartbeat.boots_up();
            if !boots_up {
                self.body.poll_errors(context);
            }
            let basic = self.body.basic_mut();
            let id = basic.service(ERROR_CONTROL);
            basic.heartbeat.poll(id, basic.state, context);
            if boots_up {
                self.body.poll_errors(context);
            }
            self.silence_services();
        }
        if self.body.basic().state.has_services() {
            self.poll_sdo(context);
        }
        self.body.basic_mut().services_due = self.next_service();
        debug_assert!(self.body.basic().services_due > now, "what is due does not stay due");
    }

    fn poll_sdo(&mut self, context: &mut Context<'_, impl Transmit>) {
        // Both are checked: the deadline of the transfer may have passed while a reply waited for room.
        let is_expired = self.services.server.expire(context.now);
        if is_expired || context.now >= self.services.reply_due {
            self.respond(context);
        }
        if B::Application::BLOCK_UPLOAD && context.now >= self.services.block_due {
            self.send_block(context);
        }
    }

    fn next_service(&self) -> Instant {
        let (services, basic) = (&self.services, self.body.basic());
        let lss = services.lss.due();
        if basic.is_initialising() {
            return lss;
        }
        let due = lss.min(basic.heartbeat.due()).min(self.body.errors_due());
        // In a state without SDO there is no transfer, and none of these three deadlines is set.
        due.min(services.server.deadline()).min(services.reply_due).min(services.block_due)
    }
}
