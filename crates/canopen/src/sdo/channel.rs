//! One SDO channel of the device: its server, and the responses that wait for room in the transmit queue.

use super::{Abort, Objects, Server};
use crate::transmit::{Context, RETRY};
use crate::{CanId, Frame, Span, Tick, Transmit};

/// A server with its responses. The CAN-ID of the responses is an argument: the default channel (1200h) follows the
/// node-ID, another one (1201h and up) its object.
pub struct Channel<O> {
    server: Server<O>,
    /// When to send a reply of the server again that found the queue full.
    reply_due: Tick,
    /// When to continue a block that found the queue full.
    block_due: Tick,
}

impl<O> core::fmt::Debug for Channel<O> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Channel").finish_non_exhaustive()
    }
}

impl<O: Objects> Channel<O> {
    pub(crate) const fn new() -> Channel<O> {
        Channel { server: Server::new(), reply_due: Tick::NEVER, block_due: Tick::NEVER }
    }

    /// Forgets the transfer without an abort message: the NMT state no longer allows SDO.
    pub(crate) fn forget(&mut self, objects: &mut O) {
        self.server.reset(objects);
        (self.reply_due, self.block_due) = (Tick::NEVER, Tick::NEVER);
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.server.shift(by);
        self.reply_due.shift(by);
        self.block_due.shift(by);
    }

    /// Whether the client waits for nothing, except for the end of a job.
    pub(crate) fn is_between_requests(&self) -> bool {
        self.server.is_between_requests() && self.reply_due.min(self.block_due) == Tick::NEVER
    }

    /// The next deadline of [`poll`](Channel::poll).
    pub(crate) fn due(&self) -> Tick {
        self.server.deadline().min(self.reply_due).min(self.block_due)
    }

    /// Whether a block download is under way.
    #[inline]
    pub(crate) fn takes_block(&self) -> bool {
        self.server.takes_block()
    }

    /// Takes a segment of a block that only needs a place in the buffer. Returns whether it was one.
    #[inline]
    #[allow(clippy::trivially_copy_pass_by_ref)] // As in `sdo`.
    pub(crate) fn take_segment(&mut self, request: &[u8; 8], now: Tick) -> bool {
        self.server.takes_block() && self.server.take_segment(request, now)
    }

    /// Takes a request, and sends the response. Returns the next deadline.
    #[allow(clippy::trivially_copy_pass_by_ref)] // As in `sdo`.
    pub(crate) fn take(
        &mut self,
        request: &[u8; 8],
        id: CanId,
        objects: &mut O,
        context: &mut Context<'_, impl Transmit>,
    ) -> Tick {
        // Only a request without a reply can start a block.
        if self.server.answer(request, objects, context.now) {
            self.respond(id, context);
        } else {
            // A reply that still waits is obsolete: the client has sent its next request.
            self.reply_due = Tick::NEVER;
            if O::BLOCK_UPLOAD && self.server.is_sending() {
                self.send_block(id, objects, context);
            }
        }
        let waits = self.reply_due.min(self.block_due);
        if self.server.is_idle() { waits } else { waits.min(self.server.deadline()) }
    }

    /// Sends segments of a block upload while the queue has plenty of room: a transfer must not delay PDOs.
    #[inline(never)]
    fn send_block(&mut self, id: CanId, objects: &mut O, context: &mut Context<'_, impl Transmit>) {
        let has_reply = self.server.send_block(objects, context.now, |data| {
            context.room() > O::RESERVED_ROOM && context.send(Frame::data_frame(id, 8, data))
        });
        self.block_due = if self.server.is_sending() { context.now.plus(RETRY) } else { Tick::NEVER };
        if has_reply {
            self.respond(id, context);
        }
    }

    /// Sends the server's reply.
    #[inline(never)]
    fn respond(&mut self, id: CanId, context: &mut Context<'_, impl Transmit>) {
        let is_sent = context.send(Frame::data_frame(id, 8, self.server.reply()));
        self.reply_due = if is_sent { Tick::NEVER } else { context.now.plus(RETRY) };
    }

    /// Reports the end of a write whose response was held back.
    pub(crate) fn release(
        &mut self,
        result: Result<(), Abort>,
        id: CanId,
        objects: &mut O,
        context: &mut Context<'_, impl Transmit>,
    ) {
        if self.server.release(result, objects, context.now) {
            self.respond(id, context);
        }
    }

    /// Sends what is due: a reply or a block that found the queue full, or the abort message of a time-out.
    pub(crate) fn poll(&mut self, id: CanId, objects: &mut O, context: &mut Context<'_, impl Transmit>) {
        // Both are checked: the deadline of the transfer may have passed while a reply waited for room.
        let is_expired = self.server.expire(objects, context.now);
        if is_expired || context.now >= self.reply_due {
            self.respond(id, context);
        }
        if O::BLOCK_UPLOAD && context.now >= self.block_due {
            self.send_block(id, objects, context);
        }
    }
}
