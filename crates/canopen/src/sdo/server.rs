//! The SDO server: one transfer at a time, at most one response to each request. Its channel: the responses that wait for
//! room in the transmit queue.

mod requests;

use super::block_download::Receiver;
use super::block_upload::Sender;
use super::objects::BUFFER;
use super::segmented::{Download, Upload};
use super::{Abort, BlockSegment, BlockSize, Multiplexer, Objects, Response};
use crate::array::Element;
use crate::transmit::{Context, RETRY};
use crate::{CanId, Frame, Span, Tick, Transmit};
use core::marker::PhantomData;

/// How long a client may be silent during a transfer. CiA 301 leaves the time to the device.
const TIME_OUT: Span = Span::from_millis(1000);
/// How long a client may be silent within a block. Then the last segment was lost, and the server acknowledges the
/// segments that have arrived.
const BLOCK_PAUSE: Span = Span::from_millis(300);

/// How long the client of an interrupted block may be silent within it.
const REST_PAUSE: Span = Span::from_millis(100);
/// How many segments may be lost while a reset of the communication interrupts a block.
const LOST: u8 = 16;
/// The same after a time-out: a node in bus-off is back earlier, and an adapter in bus-off may lose the frame that it sends.
/// The client may have its answer and begin again, so no more frames may look like segments.
const REST_AFTER_TIME_OUT: Span = Span::from_millis(5000);
const LOST_AFTER_TIME_OUT: u8 = 2;

/// The state of the only SDO channel (1200h).
// In this order, the arrays are one range of whole words, which one call sets to zero.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Server<O> {
    transfer: Transfer,
    multiplexer: Multiplexer,
    /// Whether `reply` answers the request `previous`.
    is_answered: bool,
    /// The time of the last progress.
    active: Tick,
    /// The last request that can be part of a series.
    previous: [u8; 8],
    /// The frame of the last response.
    reply: [u8; 8],
    /// For an upload, a copy of the value; for a download, the data received so far.
    buffer: [u8; BUFFER],
    objects: PhantomData<fn(&O)>,
}

// A tag of its own: every frame asks for it, and one in a niche takes two instructions more.
#[derive(Debug)]
#[repr(u8)]
enum Transfer {
    Idle,
    Upload(Upload),
    Download(Download),
    BlockUpload(Sender),
    /// All data has arrived. The reply waits until the device has carried out the write.
    Deferred,
    // The last two together: every frame asks whether it may be a segment of a block, with one comparison.
    BlockDownload(Receiver),
    /// None: a reset or a time-out has interrupted a block. The client may still be sending it, so its next segments are
    /// no requests. They come until `active`, and the sequence number of the next one is higher by `most` at most.
    Interrupted {
        last: u8,
        most: u8,
    },
}

/// Whether there is a reply now.
type Answer = Result<bool, Abort>;

impl<O: Objects> Server<O> {
    const NEW: Server<O> = Server {
        transfer: Transfer::Idle,
        multiplexer: Multiplexer { index: 0, sub: 0 },
        is_answered: false,
        active: Tick::NEVER,
        previous: [0; 8],
        reply: [0; 8],
        buffer: [0; BUFFER],
        objects: PhantomData,
    };

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.active.shift(by);
    }

    /// The last response as a frame.
    pub(crate) fn reply(&self) -> [u8; 8] {
        self.reply
    }

    /// Whether no transfer is under way.
    pub(crate) fn is_idle(&self) -> bool {
        matches!(self.transfer, Transfer::Idle | Transfer::Interrupted { .. })
    }

    /// Whether no transfer is under way, or one whose response waits for [`release`](Server::release).
    pub(crate) fn is_between_requests(&self) -> bool {
        self.is_idle() || matches!(self.transfer, Transfer::Deferred)
    }

    /// Whether a block download is under way, or one was interrupted.
    pub(crate) fn takes_block(&self) -> bool {
        O::BLOCK_DOWNLOAD
            && matches!(self.transfer, Transfer::BlockDownload(_) | Transfer::Interrupted { .. })
    }

    /// Whether the client is sending a block.
    pub(crate) fn is_within_block(&self) -> bool {
        O::BLOCK_DOWNLOAD
            && matches!(&self.transfer, Transfer::BlockDownload(receiver) if receiver.is_within_block())
    }

    /// The sequence number before the next segment of a client that may send further ones. `has_heard`: it has the last
    /// acknowledge.
    #[inline(never)]
    fn last(&self, has_heard: bool) -> Option<u8> {
        match &self.transfer {
            Transfer::BlockDownload(receiver) if O::BLOCK_DOWNLOAD && receiver.expects_segments() => {
                Some(receiver.last(has_heard))
            }
            _ => None,
        }
    }

    /// The next deadline of [`expire`](Server::expire).
    // Not inlined: three callers.
    #[inline(never)]
    pub(crate) fn deadline(&self) -> Tick {
        match &self.transfer {
            // While the reply is held back, the client waits for the server.
            Transfer::Idle | Transfer::Deferred | Transfer::Interrupted { .. } => Tick::NEVER,
            _ if self.is_within_block() => self.active.plus(BLOCK_PAUSE),
            _ => self.active.plus(TIME_OUT),
        }
    }

    /// Forgets the transfer without an abort message: the NMT state no longer allows SDO.
    pub(crate) fn reset(&mut self, objects: &mut O) {
        (self.previous, self.is_answered) = ([0; 8], false);
        if O::BLOCK_DOWNLOAD && matches!(self.transfer, Transfer::Interrupted { .. }) {
            return;
        }
        let last = self.last(true);
        self.abandon(objects);
        match last {
            Some(last) => self.interrupt(last, LOST, self.active),
            None => self.multiplexer = Multiplexer { index: 0, sub: 0 },
        }
    }

    /// Takes a frame that is a segment within a block and only has to be copied to the buffer. Returns whether the
    /// frame was taken; if not, [`answer`](Server::answer) takes it. The deadline does not become earlier.
    #[inline]
    pub(crate) fn take_segment(&mut self, frame: &[u8; 8], now: Tick) -> bool {
        let Transfer::BlockDownload(receiver) = &mut self.transfer else { return self.take_rest(frame, now) };
        let is_taken = receiver.take_next(frame, &mut self.buffer);
        if is_taken {
            self.active = now;
        }
        is_taken
    }

    /// Takes a segment of an interrupted block, or the first one of another block: the client may have the last acknowledge, but
    /// not yet the abort message of the time-out. [`answer`](Server::answer) takes a frame that does not continue the block:
    /// it is a request. It also takes the end of the block, after which the client listens, unless the client has its
    /// answer: the abort message of a time-out.
    #[inline(never)]
    fn take_rest(&mut self, frame: &[u8; 8], now: Tick) -> bool {
        let Transfer::Interrupted { last, most } = self.transfer else { return false };
        let rest = BlockSegment::parse(*frame).filter(|segment| {
            let sequence = segment.sequence.get();
            let is_first = most == LOST_AFTER_TIME_OUT && sequence <= most;
            (is_first || (1..=most).contains(&sequence.wrapping_sub(last))) && now < self.active
        });
        let is_end = rest.is_some_and(|segment| segment.last || segment.sequence == BlockSize::MAX);
        match rest {
            Some(_) if is_end && most == LOST => return false,
            // The client may have begun another block before it has heard of the end.
            Some(segment) => self.interrupt(if is_end { 0 } else { segment.sequence.get() }, most, now),
            None => self.transfer = Transfer::Idle,
        }
        rest.is_some()
    }

    /// Waits for the rest of a block.
    #[inline(never)]
    fn interrupt(&mut self, last: u8, most: u8, now: Tick) {
        let pause = if most == LOST { REST_PAUSE } else { REST_AFTER_TIME_OUT };
        (self.transfer, self.active) = (Transfer::Interrupted { last, most }, now.plus(pause));
    }

    /// Takes a request. Returns whether there is a reply.
    // Requests that begin a download or an upload are the most frequent ones. They are not part of a series, so they
    // are neither compared with the request before nor remembered.
    #[inline]
    pub(crate) fn answer(&mut self, frame: &[u8; 8], objects: &mut O, now: Tick) -> bool {
        let command = frame[0] >> 5;
        if !matches!(command, 1 | 2) || self.expects_block_segments() {
            self.answer_in_series(frame, objects, now)
        } else if command == 1 {
            self.initiate_download(frame, objects, now)
        } else {
            self.initiate_upload(frame, objects, now)
        }
    }

    /// Takes a request of a series, which may repeat the request before.
    #[inline(never)]
    fn answer_in_series(&mut self, frame: &[u8; 8], objects: &mut O, now: Tick) -> bool {
        if O::BLOCK_DOWNLOAD && matches!(self.transfer, Transfer::Interrupted { .. }) {
            return self.give_up(Abort::DeviceState, objects);
        }
        let is_repeated = *frame == self.previous;
        if is_repeated && self.is_answered && self.is_repeatable(frame) {
            return true;
        }
        let answer = if self.is_block_segment(frame, is_repeated) {
            self.take_block_segment(frame, is_repeated, objects)
        } else {
            self.dispatch(frame, is_repeated, objects, now)
        };
        let has_reply = self.settle(answer, objects, now);
        (self.previous, self.is_answered) = (*frame, has_reply);
        has_reply
    }

    /// Whether a frame that repeats the one before gets the same answer again. Either the bus has repeated the frame,
    /// or the client has missed the answer. Segments and the end of a block download qualify, because each differs from
    /// the request before. So does the request that begins a block download, because no first segment of a block looks
    /// like it.
    fn is_repeatable(&self, frame: &[u8; 8]) -> bool {
        let changes = matches!(frame[0] >> 5, 0 | 3) || frame[0] & 0xE1 == 0xC1;
        Response::begins_block_download(&self.reply) || changes && !self.expects_block_segments()
    }

    fn expects_block_segments(&self) -> bool {
        O::BLOCK_DOWNLOAD
            && matches!(&self.transfer, Transfer::BlockDownload(receiver) if receiver.expects_segments())
    }

    /// Whether a frame is a segment of a block download. Within a block, every frame is one, unless its first byte is the one of
    /// an abort message. After the last block, only a repetition of the last segment is one.
    fn is_block_segment(&self, frame: &[u8; 8], is_repeated: bool) -> bool {
        let Transfer::BlockDownload(receiver) = &self.transfer else { return false };
        O::BLOCK_DOWNLOAD && frame[0] & 0x7F != 0 && (receiver.expects_segments() || is_repeated)
    }

    /// Stores the frame of a response. Returns `true`: there is a reply.
    #[inline(always)]
    #[allow(clippy::inline_always)] // As for `encode`.
    fn set_reply(&mut self, response: Response) -> bool {
        self.reply = response.encode();
        true
    }

    /// Ends a request that may have written. The reply to a write that takes time is held back. Returns whether there is a
    /// reply now.
    #[inline]
    fn written(&mut self, objects: &mut O) -> bool {
        let waits = objects.take_deferred();
        if waits {
            self.transfer = Transfer::Deferred;
        }
        !waits
    }

    /// Ends the transfer. The application learns of a domain whose transfer is not complete.
    fn abandon(&mut self, objects: &mut O) {
        if O::PARTS {
            match &self.transfer {
                Transfer::Upload(upload) => upload.source().close(false, objects),
                Transfer::BlockUpload(sender) => sender.source().close(false, objects),
                Transfer::Download(download) => download.sink().abandon(objects),
                Transfer::BlockDownload(receiver) => receiver.sink().abandon(objects),
                Transfer::Idle | Transfer::Interrupted { .. } | Transfer::Deferred => (),
            }
        }
        self.transfer = Transfer::Idle;
    }

    /// Reports the end of a write whose reply was held back. Returns whether there is a reply and its client still
    /// waits.
    pub(crate) fn release(&mut self, result: Result<(), Abort>, objects: &mut O, now: Tick) -> bool {
        if !matches!(self.transfer, Transfer::Deferred) {
            return false;
        }
        self.transfer = Transfer::Idle;
        self.settle(result.map(|()| true), objects, now)
    }

    /// Handles a time-out: acknowledges a block whose last segment was lost, or aborts the transfer. Returns whether
    /// there is a reply.
    pub(crate) fn expire(&mut self, objects: &mut O, now: Tick) -> bool {
        if now < self.deadline() {
            return false;
        }
        let acknowledged = match &mut self.transfer {
            Transfer::BlockDownload(receiver)
                if O::BLOCK_DOWNLOAD && receiver.is_within_block() && now < self.active.plus(TIME_OUT) =>
            {
                self.active = now;
                receiver.acknowledge()
            }
            _ => Err(Abort::TimeOut),
        };
        match acknowledged {
            Ok(sequence) => self.set_reply(Response::BlockAcknowledge(sequence, BlockSize::MAX)),
            Err(abort) => {
                let last = self.last(false);
                let has_reply = self.settle(Err(abort), objects, now);
                if let Some(last) = last {
                    self.interrupt(last, LOST_AFTER_TIME_OUT, now);
                }
                has_reply
            }
        }
    }

    /// Converts the answer to whether there is a reply. An error ends the transfer.
    #[inline]
    fn settle(&mut self, answer: Answer, objects: &mut O, now: Tick) -> bool {
        self.active = now;
        answer.unwrap_or_else(|abort| self.give_up(abort, objects))
    }

    /// Ends the transfer and stores the abort message.
    #[inline(never)]
    fn give_up(&mut self, abort: Abort, objects: &mut O) -> bool {
        self.abandon(objects);
        self.is_answered = false;
        self.set_reply(Response::Abort(self.multiplexer, abort.code()))
    }

    /// Whether segments of a block remain to be sent.
    #[inline]
    pub(crate) fn is_sending(&self) -> bool {
        O::BLOCK_UPLOAD && matches!(&self.transfer, Transfer::BlockUpload(sender) if sender.is_sending())
    }

    /// Sends segments of a block as long as `send` accepts them. Returns whether there is a reply, which is an abort
    /// message. A client waits for segments, so a queue that has no room for any does not delay the time-out.
    pub(crate) fn send_block(
        &mut self,
        objects: &mut O,
        now: Tick,
        mut send: impl FnMut([u8; 8]) -> bool,
    ) -> bool {
        let Transfer::BlockUpload(sender) = &mut self.transfer else { return false };
        let active = &mut self.active;
        let result = sender.send(&mut self.buffer, objects, |segment| {
            let is_sent = send(segment);
            if is_sent {
                *active = now;
            }
            is_sent
        });
        result.is_err_and(|abort| self.give_up(abort, objects))
    }
}

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

impl<O: Objects> Element for Channel<O> {
    const NEW: Channel<O> = Channel { server: Server::NEW, reply_due: Tick::NEVER, block_due: Tick::NEVER };
}

impl<O: Objects> Channel<O> {
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
