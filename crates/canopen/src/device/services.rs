//! Services: the SDO server, the heartbeat and LSS, and their deadlines.

use super::inner::Inner;
use super::lss::LssSlave;
use super::{Action, Application as _, Definition, Device, Next, STALE};
use crate::array::{Array, Element};
use crate::dictionary::Services as Has;
use crate::frame::FullFrameId;
use crate::lss::{self, BitRate};
use crate::nmt::State;
use crate::pdo::Budget;
use crate::sdo::{Abort, Channel};
use crate::transmit::Context;
use crate::{CanId, Frame, Instant, NodeId, Span, Tick, Transmit};

/// Function codes of the pre-defined connection set (CiA 301, 7.3.5).
const SDO_RESPONSE: u16 = 0x580;
const SDO_REQUEST: u16 = 0x600;
pub(super) const ERROR_CONTROL: u16 = 0x700;

/// The SDO server and the LSS slave of a device, with the responses that wait for room in the queue.
#[repr(C)] // As for `Inner`.
pub(super) struct Services<D: Definition> {
    /// The CAN-ID of requests to the server. A request has eight bytes (CiA 301, 7.2.4.3); any other frame is not a
    /// request.
    sdo_request: FullFrameId,
    pub(super) lss: LssSlave,
    /// The share of process data in the bus.
    pub(super) budget: Budget,
    sdo: Channel<Inner<D>>,
    /// The channels of 1201h and up.
    pub(super) more_sdo: D::Servers,
}

impl<D: Definition> Services<D> {
    pub(super) fn new(node_id: Option<NodeId>) -> Services<D> {
        Services {
            sdo: Channel::NEW,
            sdo_request: sdo_request(node_id),
            more_sdo: D::Servers::NEW,
            lss: LssSlave::new(node_id),
            budget: Budget::new(BitRate::FASTEST.kbit()),
        }
    }

    // Inlined: a new device that is moved by a builder is otherwise copied on the stack.
    #[allow(clippy::inline_always)] // The copy takes 12 KB.
    #[inline(always)]
    pub(super) fn set_bit_rate(&mut self, bit_rate: BitRate) {
        self.lss.set_bit_rate(bit_rate);
        self.set_bus_bit_rate(bit_rate);
    }

    /// Sets the bit rate at which the bus runs.
    pub(super) fn set_bus_bit_rate(&mut self, bit_rate: BitRate) {
        if D::Application::BUS_SHARE && Inner::<D>::has_process() {
            self.budget.set_bit_rate(bit_rate.kbit());
        }
    }

    /// Whether an LSS master configures the device.
    pub(super) fn is_in_lss(&self) -> bool {
        D::Application::LSS && self.lss.is_selected()
    }

    pub(super) fn set_node_id(&mut self, node_id: Option<NodeId>) {
        self.lss.set_node_id(node_id);
    }

    /// Resets the services.
    pub(super) fn restart(&mut self, inner: &mut Inner<D>) {
        self.forget_transfers(inner);
        if D::Application::LSS {
            self.lss.restart();
        }
        self.sdo_request = sdo_request(self.lss.node_id());
    }

    /// Whether no client waits for a response, except for that of a job.
    pub(super) fn is_between_requests(&self) -> bool {
        let mut channels = core::iter::once(&self.sdo).chain(self.more_sdo.as_ref());
        channels.all(Channel::is_between_requests) && self.lss.due() == Tick::NEVER
    }

    /// The epoch of the clock has moved.
    pub(super) fn shift(&mut self, by: Span) {
        self.sdo.shift(by);
        self.more_sdo.as_mut().iter_mut().for_each(|sdo| sdo.shift(by));
        if D::Application::LSS {
            self.lss.shift(by);
        }
        if D::Application::BUS_SHARE && Inner::<D>::has_process() {
            self.budget.shift(by);
        }
    }

    fn forget_transfers(&mut self, inner: &mut Inner<D>) {
        self.sdo.forget(inner);
        self.more_sdo.as_mut().iter_mut().for_each(|sdo| sdo.forget(inner));
    }

    /// The time and the transmit queue for one call of the device. While the bit rate changes, the queue accepts
    /// nothing.
    pub(super) fn context<'a, Q: Transmit>(&self, now: Tick, out: &'a mut Q) -> Context<'a, Q> {
        Context { now, out, is_open: !(D::Application::LSS && self.lss.is_switching()) }
    }
}

/// The CAN-ID of requests to the SDO server. Without a node-ID, the CAN-ID for node-ID 0, which no client uses.
fn sdo_request(node_id: Option<NodeId>) -> FullFrameId {
    CanId::of_service(SDO_REQUEST, node_id.map_or(0, NodeId::get)).into()
}

impl<D: Definition> Inner<D> {
    #[inline(never)]
    fn hand_over(&mut self) -> Option<Action> {
        let action = self.pending.take_action().or_else(|| self.jobs.hand_over().map(Action::Store));
        self.pending.is_waiting = self.pending.has_action() || self.jobs.is_new();
        if self.pending.is_waiting {
            self.services_due = STALE;
        }
        action
    }

    /// The data of a request with this identifier.
    #[inline]
    pub(super) fn request(frame: &Frame, id: FullFrameId) -> Option<&[u8; 8]> {
        frame.full(id).or_else(|| if D::Application::SHORT_REQUESTS { frame.short(id) } else { None })
    }
}

impl<D: Definition> Device<D> {
    /// Takes a frame with one of the [`service_ids`](Device::service_ids). Any other is ignored.
    #[inline]
    pub fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        let now = self.tick_of_frame(now);
        if self.take_segment(frame, now) {
            return self.process_next();
        }
        self.take_service_frame(frame, now, out);
        self.services_next()
    }

    /// Sends the frames of the services that are due, and returns a waiting action.
    #[inline]
    pub fn poll_services(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let now = self.tick(now);
        self.send_due_services(now, out);
        self.services_next()
    }

    /// Result of a call for services, with one waiting action.
    #[inline(never)]
    pub(super) fn next(&mut self) -> Next {
        self.services_next()
    }

    /// The same as [`next`](Device::next), for a caller that ignores a part of the result: it is inlined there.
    #[inline]
    pub(super) fn services_next(&mut self) -> Next {
        let inner = &mut self.inner;
        let parameters = core::mem::take(&mut inner.pending.parameters);
        let action = if inner.pending.is_waiting { inner.hand_over() } else { None };
        Next { action, parameters, ..self.process_next() }
    }

    /// Identifiers of frames for [`on_service_frame`](Device::on_service_frame), data and remote.
    pub fn service_ids(&self) -> impl Iterator<Item = CanId> {
        let sdo = self.inner.node_id.map(|own| own.service(SDO_REQUEST));
        let lss = D::Application::LSS.then_some(lss::REQUEST);
        let own = self.inner.node_id.filter(|_| Inner::<D>::has(Has::GUARDING));
        let guarding = own.map(|own| own.service(ERROR_CONTROL));
        // One state instead of a chain of iterators, whose parts stay in an image that has no such services.
        let (own, mut at) = ([lss, sdo, guarding], 0);
        let (mut watched, mut more) = (self.inner.watches.ids(), self.inner.more_service_ids());
        core::iter::from_fn(move || {
            while let Some(id) = own.get(at) {
                at += 1;
                if id.is_some() {
                    return *id;
                }
            }
            let watched = if Inner::<D>::has(Has::HEARTBEAT_CONSUMER) { watched.next() } else { None };
            watched.or_else(|| more.next())
        })
    }

    /// Takes a segment of a block that only needs a place in the buffer. In any state: without SDO, there is no transfer.
    /// Returns whether the frame was one.
    #[inline]
    pub(super) fn take_segment(&mut self, frame: &Frame, now: Tick) -> bool {
        let request = if self.services.sdo.takes_block() { self.request(frame) } else { None };
        request.is_some_and(|request| self.services.sdo.take_segment(request, now))
    }

    /// Takes a frame that [`take_segment`](Device::take_segment) has not taken.
    #[inline(never)]
    pub(super) fn take_service_frame(&mut self, frame: &Frame, now: Tick, out: &mut impl Transmit) {
        let Some(request) = self.request(frame) else { return self.take_other_service(frame, now, out) };
        if self.inner.state.has_services() {
            let (context, id) = (&mut self.services.context(now, out), self.inner.service(SDO_RESPONSE));
            let due = self.services.sdo.take(request, id, &mut self.inner, context);
            self.inner.serve_until(due);
        }
        self.send_due_services(now, out);
    }

    /// Takes a frame that is no request to the SDO server: LSS, or the heartbeat of another node.
    #[inline(never)]
    pub(super) fn take_other_service(&mut self, frame: &Frame, now: Tick, out: &mut impl Transmit) {
        if D::Application::LSS && frame.id() == lss::REQUEST.get() {
            let context = &mut self.services.context(now, out);
            self.services.lss.take_frame(frame, context, &mut self.inner);
        } else if frame.id() & 0x780 == ERROR_CONTROL {
            if Inner::<D>::has(Has::GUARDING) {
                self.inner.on_guard(frame, &mut self.services.context(now, out));
            }
            if Inner::<D>::has(Has::HEARTBEAT_CONSUMER) {
                self.inner.take_heartbeat(frame, now);
            }
        } else if Inner::<D>::has(Has::EMCY_CONSUMER) {
            self.inner.on_emergency(frame);
        }
        if Inner::<D>::has(Has::SDO_SERVERS) {
            self.take_more_sdo(frame, now, out);
        }
        self.send_due_services(now, out);
    }

    /// The data of a request to the SDO server.
    #[inline]
    fn request<'a>(&self, frame: &'a Frame) -> Option<&'a [u8; 8]> {
        Inner::<D>::request(frame, self.services.sdo_request)
    }

    /// Whether a frame is a request to the SDO server.
    #[inline]
    pub(super) fn is_request(&self, frame: &Frame) -> bool {
        self.request(frame).is_some()
    }

    #[inline]
    pub(super) fn send_due_services(&mut self, now: Tick, out: &mut impl Transmit) {
        if now >= self.inner.services_due {
            self.send_services(now, out);
        }
    }

    /// A job is finished: answers the SDO client that waits for it, and the LSS master if `lss_waits`.
    pub(super) fn finish_job(
        &mut self,
        result: Result<(), Abort>,
        lss_waits: bool,
        context: &mut Context<'_, impl Transmit>,
    ) {
        if D::Application::LSS && lss_waits {
            self.services.lss.respond(lss::Slave::stored(result.is_ok()), context);
        }
        self.services.sdo.release(result, self.inner.service(SDO_RESPONSE), &mut self.inner, context);
        if Inner::<D>::has(Has::SDO_SERVERS) {
            self.release_more(result, context);
        }
        self.inner.services_due = STALE;
    }

    /// Forgets the transfer in a state without SDO.
    pub(super) fn silence_services(&mut self) {
        if !self.inner.state.has_services() {
            self.services.forget_transfers(&mut self.inner);
        }
    }

    #[inline(never)]
    fn send_services(&mut self, now: Tick, out: &mut impl Transmit) {
        if D::Application::LSS
            && let Some(bit_rate) = self.services.lss.poll_switching(now, &mut self.inner)
        {
            self.services.set_bus_bit_rate(bit_rate);
        }
        let context = &mut self.services.context(now, out);
        if D::Application::LSS {
            self.services.lss.poll(context);
        }
        // A heartbeat follows the EMCY that gives the reason for a new state. Nothing precedes the boot-up message: the
        // device is Initialising until the message is sent.
        if !self.inner.is_initialising() {
            self.inner.poll_errors(context);
        }
        let boots_up = self.inner.heartbeat.boots_up();
        let id = self.inner.service(ERROR_CONTROL);
        self.inner.heartbeat.poll(id, self.inner.state, context);
        if boots_up && !self.inner.heartbeat.boots_up() {
            self.inner.enter(State::PreOperational);
            self.inner.poll_errors(context);
        }
        self.silence_services();
        if self.inner.state.has_services() {
            let id = self.inner.service(SDO_RESPONSE);
            self.services.sdo.poll(id, &mut self.inner, context);
            if Inner::<D>::has(Has::SDO_SERVERS) {
                self.poll_more_sdo(context);
            }
        }
        self.inner.services_due = self.next_service();
        debug_assert!(self.inner.services_due > now, "what is due does not stay due");
    }

    fn next_service(&self) -> Tick {
        let (services, inner) = (&self.services, &self.inner);
        let lss = if D::Application::LSS { services.lss.due() } else { Tick::NEVER };
        let due = lss.min(inner.heartbeat.due());
        if inner.is_initialising() {
            return due;
        }
        let due = due.min(self.inner.errors_due());
        // In a state without SDO there is no transfer, and none of these deadlines is set.
        services.more_sdo.as_ref().iter().fold(due.min(services.sdo.due()), |due, sdo| due.min(sdo.due()))
    }
}
