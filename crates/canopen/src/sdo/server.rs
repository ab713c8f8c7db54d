//! The server: one transfer at a time, request in, response out.

mod requests;

use super::block_download::Receiver;
use super::block_upload::Sender;
use super::objects::BUFFER;
use super::segmented::{Download, Upload};
use super::{Abort, BlockSegment, BlockSize, Multiplexer, Objects, Response};
use crate::{Duration, Instant};

/// How long the client of a transfer may be silent. CiA 301 leaves the time to the device.
const TIME_OUT: Duration = Duration::from_millis(1000);
/// How long a client may pause within a block before it is told what has arrived: its last segment was lost.
const BLOCK_PAUSE: Duration = Duration::from_millis(300);

/// The state of the one SDO channel (1200h).
#[derive(Debug)]
pub(crate) struct Server {
    transfer: Transfer,
    multiplexer: Multiplexer,
    /// The value under way: a snapshot for an upload, what has come so far of a download.
    buffer: [u8; BUFFER],
    /// When the transfer last went on.
    active: Instant,
    /// The last request of this transfer that could be one of a series, and whether `reply` answers it.
    previous: [u8; 8],
    is_answered: bool,
    /// The frame of the last response.
    reply: [u8; 8],
}

#[derive(Debug)]
enum Transfer {
    Idle,
    Upload(Upload),
    Download(Download),
    BlockUpload(Sender),
    BlockDownload(Receiver),
    /// All has arrived; the reply waits until the device has done what was asked.
    Held,
}

/// Whether there is a reply, or nothing to say yet.
type Answer = Result<bool, Abort>;

impl Server {
    pub(crate) const fn new() -> Server {
        Server {
            transfer: Transfer::Idle,
            multiplexer: Multiplexer { index: 0, sub: 0 },
            buffer: [0; BUFFER],
            active: Instant(0),
            previous: [0; 8],
            is_answered: false,
            reply: [0; 8],
        }
    }

    /// The response that was made last, as a frame.
    pub(crate) fn reply(&self) -> [u8; 8] {
        self.reply
    }

    /// Whether no transfer is under way.
    pub(crate) fn is_idle(&self) -> bool {
        matches!(self.transfer, Transfer::Idle)
    }

    /// Whether a block download is under way.
    pub(crate) fn takes_block(&self) -> bool {
        matches!(self.transfer, Transfer::BlockDownload(_))
    }

    /// Whether the client is sending a block.
    pub(crate) fn is_within_block(&self) -> bool {
        matches!(&self.transfer, Transfer::BlockDownload(receiver) if receiver.is_within_block())
    }

    /// When [`expire`](Server::expire) has something to do.
    pub(crate) fn deadline(&self) -> Instant {
        match &self.transfer {
            Transfer::Idle => Instant::NEVER,
            _ if self.is_within_block() => self.active + BLOCK_PAUSE,
            _ => self.active + TIME_OUT,
        }
    }

    /// Forgets the transfer under way, without a word to the client: the NMT state no longer allows any.
    pub(crate) fn reset(&mut self) {
        self.transfer = Transfer::Idle;
        self.multiplexer = Multiplexer { index: 0, sub: 0 };
        (self.previous, self.is_answered) = ([0; 8], false);
    }

    /// Takes a frame that is a segment within a block and needs nothing but a place in the buffer; whether it is one. Any other
    /// is for [`answer`](Server::answer). The deadline is not earlier afterwards.
    #[inline]
    pub(crate) fn take_segment(&mut self, frame: &[u8; 8], now: Instant) -> bool {
        let Transfer::BlockDownload(receiver) = &mut self.transfer else { return false };
        let is_taken = receiver.take_next(frame, &mut self.buffer);
        if is_taken {
            self.active = now;
        }
        is_taken
    }

    /// Takes a request; whether there is a reply.
    // The requests that begin a download or an upload are the most frequent ones. They belong to no series: nothing is to be
    // compared with the request before, and nothing to be remembered.
    #[inline]
    pub(crate) fn answer(&mut self, frame: &[u8; 8], objects: &mut impl Objects, now: Instant) -> bool {
        let command = frame[0] >> 5;
        if !matches!(command, 1 | 2) || self.wants_block_segments() {
            self.go_on(frame, objects, now)
        } else if command == 1 {
            self.initiate_download(frame, objects, now)
        } else {
            self.initiate_upload(frame, objects, now)
        }
    }

    /// A request of a series: it may be the same as the one before.
    #[inline(never)]
    fn go_on(&mut self, frame: &[u8; 8], objects: &mut impl Objects, now: Instant) -> bool {
        let is_repeated = *frame == self.previous;
        if is_repeated && self.is_answered && self.is_repeatable(frame) {
            return true;
        }
        let answer = match self.block_segment(frame, is_repeated) {
            Some(segment) => self.take_block_segment(segment, objects),
            None => self.dispatch(frame, is_repeated, objects, now),
        };
        let has_reply = self.conclude(answer, objects, now);
        (self.previous, self.is_answered) = (*frame, has_reply);
        has_reply
    }

    /// Whether a frame that came twice gets the same answer twice, be it that the bus repeated it or that the client missed
    /// the answer. Segments and the end of a block download change from one to the next; only they can be known as
    /// repeated, and what begins a block download, as no first segment looks like it.
    fn is_repeatable(&self, frame: &[u8; 8]) -> bool {
        let changes = matches!(frame[0] >> 5, 0 | 3) || frame[0] & 0xE1 == 0xC1;
        Response::begins_block_download(&self.reply) || changes && !self.wants_block_segments()
    }

    fn wants_block_segments(&self) -> bool {
        matches!(&self.transfer, Transfer::BlockDownload(receiver) if receiver.wants_segments())
    }

    /// Within a block a frame is a segment, unless its first byte is that of an abort. Afterwards it still is one
    /// when it is the last one again.
    fn block_segment(&self, frame: &[u8; 8], is_repeated: bool) -> Option<BlockSegment> {
        let Transfer::BlockDownload(receiver) = &self.transfer else { return None };
        let segment = BlockSegment::parse(*frame)?;
        (receiver.wants_segments() || is_repeated).then_some(segment)
    }

    /// Makes a response: there is a reply, `true`.
    #[inline(always)]
    #[allow(clippy::inline_always)] // As for `encode`.
    fn say(&mut self, response: Response) -> bool {
        self.reply = response.encode();
        true
    }

    /// The end of a request: an error ends the transfer, and the reply to a write that takes its time is kept back.
    fn conclude(&mut self, answer: Answer, objects: &mut impl Objects, now: Instant) -> bool {
        if answer == Ok(true) && objects.take_deferred() {
            self.transfer = Transfer::Held;
            return self.settle(Ok(false), now);
        }
        self.settle(answer, now)
    }

    /// Whether there is a reply that was kept back and for which its client still waits.
    pub(crate) fn release(&mut self, result: Result<(), Abort>, now: Instant) -> bool {
        if !matches!(self.transfer, Transfer::Held) {
            return false;
        }
        self.transfer = Transfer::Idle;
        self.settle(result.map(|()| true), now)
    }

    /// Does what the time demands: answers a block that has lost its end, or gives up the transfer. Whether there is a
    /// reply.
    pub(crate) fn expire(&mut self, now: Instant) -> bool {
        if now < self.deadline() {
            return false;
        }
        match &mut self.transfer {
            Transfer::BlockDownload(receiver)
                if receiver.is_within_block() && now < self.active + TIME_OUT =>
            {
                let sequence = receiver.acknowledge();
                self.say(Response::BlockAcknowledge(sequence, BlockSize::MAX))
            }
            _ => self.settle(Err(Abort::TimeOut), now),
        }
    }

    /// An error ends the transfer.
    #[inline]
    fn settle(&mut self, answer: Answer, now: Instant) -> bool {
        self.active = now;
        answer.unwrap_or_else(|abort| self.give_up(abort))
    }

    /// Ends the transfer: the one place where an error becomes an abort message.
    #[inline(never)]
    fn give_up(&mut self, abort: Abort) -> bool {
        self.transfer = Transfer::Idle;
        self.is_answered = false;
        self.say(Response::Abort(self.multiplexer, abort.code()))
    }

    /// Whether segments of a block wait to be sent.
    #[inline]
    pub(crate) fn is_sending(&self) -> bool {
        matches!(&self.transfer, Transfer::BlockUpload(sender) if sender.is_sending())
    }

    /// Sends segments of a block as long as `send` takes them. Whether there is a reply, which is an abort.
    pub(crate) fn send_block(
        &mut self,
        objects: &impl Objects,
        now: Instant,
        send: impl FnMut([u8; 8]) -> bool,
    ) -> bool {
        let Transfer::BlockUpload(sender) = &mut self.transfer else { return false };
        let result = sender.send(&self.buffer, objects, send);
        self.settle(result.map(|()| false), now)
    }
}
