//! Services: SDO, heartbeat, EMCY and LSS.

use super::{Application, Device, Next};
use crate::lss;
use crate::transmit::{RETRY, Turn};
use crate::{CanId, Frame, Instant, Transmit};

/// Function codes of the pre-defined connection set (CiA 301, 7.3.5).
const SDO_RESPONSE: u16 = 0x580;
const SDO_REQUEST: u16 = 0x600;
const ERROR_CONTROL: u16 = 0x700;
/// Frames for which a block upload leaves room in the queue: all PDOs of a SYNC, a heartbeat, an EMCY.
const RESERVED_ROOM: usize = 10;

impl<A: Application, const N: usize, const T: usize, const R: usize, const W: usize, const M: usize>
    Device<A, N, T, R, W, M>
{
    /// Takes a frame with one of the [`service_ids`](Device::service_ids). Any other is ignored.
    #[inline]
    pub fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        self.take_service_frame(frame, now, out);
        self.services_next()
    }

    #[inline(never)]
    fn take_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        if frame.id() == self.core.service(SDO_REQUEST).get() {
            self.on_sdo(frame, now, out);
        } else if frame.id() == lss::REQUEST.get() {
            self.on_lss(frame, &mut self.turn(now, out));
        } else if frame.id() & 0x780 == ERROR_CONTROL && !A::SERVICES_ONLY {
            self.core.on_heartbeat(frame, now);
        }
        if now >= self.core.services_due {
            self.send_services(now, out);
        }
    }

    /// A request has eight bytes (CiA 301, 7.2.4.3); anything else is none.
    fn on_sdo(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let has_sdo = self.core.state.has_services();
        let Some(request) = frame.full().filter(|_| has_sdo) else { return };
        match self.server.take_next(request, &mut self.core, now) {
            Some(false) => (),
            Some(true) => self.respond(&mut self.turn(now, out)),
            None => self.on_request(request, &mut self.turn(now, out)),
        }
    }

    #[allow(clippy::trivially_copy_pass_by_ref)] // As in `sdo`.
    fn on_request(&mut self, request: &[u8; 8], turn: &mut Turn<'_, impl Transmit>) {
        let was_idle = self.server.is_idle();
        let has_reply = self.server.answer(request, &mut self.core, turn.now);
        // A deadline that was there is later now, but for the pause within a block.
        if was_idle && !self.server.is_idle() || self.server.is_within_block() {
            self.core.services_due = self.core.services_due.min(self.server.deadline());
        }
        // Only a request without a reply starts a block.
        if has_reply {
            return self.respond(turn);
        }
        // A reply that still waits is obsolete: its client has gone on.
        self.reply_due = Instant::NEVER;
        if !A::SERVICES_ONLY && self.server.is_sending() {
            self.send_block(turn);
        }
    }

    /// Sends segments of a block upload while the queue is far from full: a transfer must not take the room of PDOs.
    fn send_block(&mut self, turn: &mut Turn<'_, impl Transmit>) {
        let id = self.core.service(SDO_RESPONSE);
        let has_reply = self.server.send_block(&self.core, turn.now, |data| {
            turn.room() > RESERVED_ROOM && turn.send(Frame::data_frame(id, 8, data))
        });
        if has_reply {
            self.respond(turn);
        }
        self.block_due = if self.server.is_sending() { turn.now + RETRY } else { Instant::NEVER };
        self.core.services_due = self.core.services_due.min(self.block_due);
    }

    /// Sends the server's reply.
    pub(super) fn respond(&mut self, turn: &mut Turn<'_, impl Transmit>) {
        let id = self.core.service(SDO_RESPONSE);
        if turn.send(Frame::data_frame(id, 8, self.server.reply())) {
            self.reply_due = Instant::NEVER;
        } else {
            self.reply_due = turn.now + RETRY;
            self.core.services_due = self.core.services_due.min(self.reply_due);
        }
    }

    /// Sends what is due of the services, and hands over what is left to the caller.
    #[inline]
    pub fn poll_services(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        if now >= self.core.services_due {
            self.send_services(now, out);
        }
        self.services_next()
    }

    #[inline(never)]
    fn send_services(&mut self, now: Instant, out: &mut impl Transmit) {
        self.poll_switching(now);
        let turn = &mut self.turn(now, out);
        self.poll_lss(turn);
        self.poll_heartbeat(turn);
        if !A::SERVICES_ONLY {
            self.poll_watches(now);
        }
        if self.core.state.has_services() {
            if !A::SERVICES_ONLY {
                self.core.emcy.poll(turn);
            }
            self.poll_sdo(turn);
        }
        self.core.services_due = self.next_service();
    }

    fn poll_heartbeat(&mut self, turn: &mut Turn<'_, impl Transmit>) {
        if !self.core.is_initialising() {
            let id = self.core.service(ERROR_CONTROL);
            self.core.heartbeat.poll(id, self.core.state, turn);
        }
    }

    fn poll_sdo(&mut self, turn: &mut Turn<'_, impl Transmit>) {
        if turn.now >= self.reply_due {
            self.respond(turn);
        }
        if self.server.expire(turn.now) {
            self.respond(turn);
        }
        if !A::SERVICES_ONLY && turn.now >= self.block_due {
            self.send_block(turn);
        }
    }

    fn next_service(&self) -> Instant {
        let core = &self.core;
        let lss = self.next_lss();
        if core.is_initialising() {
            return lss;
        }
        let heartbeat = lss.min(core.heartbeat.due());
        if A::SERVICES_ONLY {
            return heartbeat.min(self.next_sdo());
        }
        let watched = heartbeat.min(core.watches.due());
        if !core.state.has_services() {
            return watched;
        }
        watched.min(core.emcy.due()).min(self.next_sdo()).min(self.block_due)
    }

    fn next_sdo(&self) -> Instant {
        self.server.deadline().min(self.reply_due)
    }

    /// Identifiers of frames for [`on_service_frame`](Device::on_service_frame).
    pub fn service_ids(&self) -> impl Iterator<Item = CanId> {
        let sdo = self.core.node_id.map(|own| own.service(SDO_REQUEST));
        [lss::REQUEST].into_iter().chain(sdo).chain(self.core.watches.ids())
    }
}
