//! The server: one transfer at a time, request in, response out.

use super::block_download::Receiver;
use super::block_upload::Sender;
use super::objects::{BUFFER, Sink, Source};
use super::segmented::{Download, Upload};
use super::{Abort, BlockEnd, BlockSegment, BlockSize, Bytes, Initiate, Multiplexer, Objects, Request};
use super::{Response, Segment, Writable};
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
    /// The last request of this transfer that could be one of a series, and its answer.
    previous: ([u8; 8], Option<[u8; 8]>),
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
            previous: ([0; 8], None),
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

    /// When [`expire`](Server::expire) has something to do.
    pub(crate) fn deadline(&self) -> Instant {
        match &self.transfer {
            Transfer::Idle => Instant::NEVER,
            Transfer::BlockDownload(receiver) if receiver.is_within_block() => self.active + BLOCK_PAUSE,
            _ => self.active + TIME_OUT,
        }
    }

    /// Forgets the transfer under way, without a word to the client: the NMT state no longer allows any.
    pub(crate) fn reset(&mut self) {
        self.transfer = Transfer::Idle;
        self.multiplexer = Multiplexer { index: 0, sub: 0 };
        self.previous = ([0; 8], None);
    }

    /// Takes a segment within a block; whether that has a reply, which is an abort. `None` for any other frame, which is
    /// for [`answer`](Server::answer). The deadline is not earlier afterwards.
    pub(crate) fn take_expected<O: Objects>(
        &mut self,
        frame: [u8; 8],
        objects: &mut O,
        now: Instant,
    ) -> Option<bool> {
        let Transfer::BlockDownload(receiver) = &mut self.transfer else { return None };
        if O::IS_SMALL || !receiver.expects(frame) {
            return None;
        }
        self.active = now;
        let taken = receiver.take_expected(frame, &mut self.buffer, objects);
        Some(taken.is_err_and(|abort| self.give_up(abort)))
    }

    /// Takes a request; whether there is a reply.
    pub(crate) fn answer<O: Objects>(&mut self, frame: [u8; 8], objects: &mut O, now: Instant) -> bool {
        // The requests that begin a download or an upload belong to no series: nothing to compare, nothing to remember.
        if !O::IS_SMALL && matches!(frame[0] >> 5, 1 | 2) && !self.wants_block_segments() {
            let answer = self.dispatch(frame, objects, now);
            return self.conclude(answer, objects, now);
        }
        if let Some(reply) = self.repeated(frame) {
            self.reply = reply;
            return true;
        }
        let answer = match self.block_segment(frame) {
            Some(segment) => self.take_block_segment(segment, objects),
            None => self.dispatch(frame, objects, now),
        };
        let has_reply = self.conclude(answer, objects, now);
        self.previous = (frame, has_reply.then_some(self.reply));
        has_reply
    }

    /// The answer to a frame that came twice, be it that the bus repeated it or that the client missed the answer.
    /// Segments and the end of a block download change from one to the next; only they can be known as repeated, and
    /// what begins a block download, as no first segment looks like it.
    fn repeated(&self, frame: [u8; 8]) -> Option<[u8; 8]> {
        let (previous, reply) = self.previous;
        let changes = matches!(frame[0] >> 5, 0 | 3) || frame[0] & 0xE1 == 0xC1;
        let is_repeatable =
            |reply| Response::begins_block_download(reply) || changes && !self.wants_block_segments();
        reply.filter(|reply| frame == previous && is_repeatable(*reply))
    }

    fn dispatch<O: Objects>(&mut self, frame: [u8; 8], objects: &mut O, now: Instant) -> Answer {
        let is_repeated = frame == self.previous.0;
        match Request::parse(frame).ok_or(Abort::Command)? {
            Request::Upload(at) => self.upload(at, objects),
            Request::Download(at, initiate) => self.download(at, initiate, objects, now),
            Request::UploadSegment { toggle } => self.upload_segment(toggle, objects),
            Request::DownloadSegment(segment) => self.download_segment(&segment, objects, now),
            Request::Abort(..) => {
                self.transfer = Transfer::Idle;
                Ok(false)
            }
            Request::BlockDownload { at, crc, size } => self.block_download(at, crc, size, objects),
            Request::BlockDownloadEnd(end) => self.block_download_end(end, objects, now),
            _ if O::IS_SMALL => Err(Abort::Command),
            Request::BlockUpload { at, block_size, threshold, .. } => {
                self.block_upload(at, block_size, threshold, objects)
            }
            Request::BlockUploadStart => self.sender()?.start(is_repeated).map(|()| false),
            Request::BlockAcknowledge { sequence, block_size } => {
                match self.sender()?.acknowledge(sequence, block_size, is_repeated)? {
                    Some(end) => Ok(self.say(Response::BlockUploadEnd(end))),
                    None => Ok(false),
                }
            }
            // The confirmation of the end is not answered; one that was refused is refused again.
            Request::BlockUploadEnded if is_repeated && self.previous.1.is_none() => Ok(false),
            Request::BlockUploadEnded => {
                self.sender()?.ended()?;
                self.transfer = Transfer::Idle;
                Ok(false)
            }
        }
    }

    /// Makes a response: there is a reply, `true`.
    #[inline]
    fn say(&mut self, response: Response) -> bool {
        self.reply = response.encode();
        true
    }

    /// The end of a request: an error ends the transfer, and the reply to a write that takes its time is kept back.
    fn conclude(&mut self, answer: Answer, objects: &mut impl Objects, now: Instant) -> bool {
        let has_reply = self.settle(answer, now);
        let is_held = answer == Ok(true) && objects.take_deferred();
        if is_held {
            self.transfer = Transfer::Held;
        }
        has_reply && !is_held
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
    fn settle(&mut self, answer: Answer, now: Instant) -> bool {
        self.active = now;
        answer.unwrap_or_else(|abort| self.give_up(abort))
    }

    /// Ends the transfer: the one place where an error becomes an abort message.
    fn give_up(&mut self, abort: Abort) -> bool {
        self.transfer = Transfer::Idle;
        self.say(Response::Abort(self.multiplexer, abort.code()))
    }

    /// A new transfer; one that was under way is forgotten, as its client has started over.
    fn begin(&mut self, at: Multiplexer) {
        self.transfer = Transfer::Idle;
        self.multiplexer = at;
        self.previous.1 = None;
    }

    fn upload(&mut self, at: Multiplexer, objects: &mut impl Objects) -> Answer {
        self.begin(at);
        let value = objects.read(at)?;
        if value.len() <= 4 {
            return Ok(self.say(Response::Uploaded(at, Bytes::from_slice(value))));
        }
        let source = Source::new(at, value, &mut self.buffer);
        self.transfer = Transfer::Upload(Upload::new(source));
        Ok(self.say(Response::UploadSegmented(at, Some(source.size()))))
    }

    fn upload_segment(&mut self, toggle: bool, objects: &impl Objects) -> Answer {
        let Transfer::Upload(upload) = &mut self.transfer else { return Err(Abort::Command) };
        let segment = upload.next(toggle, &self.buffer, objects)?;
        if segment.last {
            self.transfer = Transfer::Idle;
        }
        Ok(self.say(Response::UploadedSegment(segment)))
    }

    fn download(
        &mut self,
        at: Multiplexer,
        initiate: Initiate,
        objects: &mut impl Objects,
        now: Instant,
    ) -> Answer {
        self.begin(at);
        match initiate {
            Initiate::Expedited(bytes) => objects.write(at, bytes.as_slice(), now)?,
            Initiate::Unsized(data) => {
                let value = unsized_value(data, at, objects)?;
                objects.write(at, value.as_slice(), now)?;
            }
            Initiate::Segmented(size) => {
                self.transfer = Transfer::Download(Download::new(Sink::open(at, size, objects)?));
            }
        }
        Ok(self.say(Response::Downloaded(at)))
    }

    fn download_segment(&mut self, segment: &Segment, objects: &mut impl Objects, now: Instant) -> Answer {
        let Transfer::Download(download) = &mut self.transfer else { return Err(Abort::Command) };
        download.take(segment, &mut self.buffer, objects, now)?;
        if segment.last {
            self.transfer = Transfer::Idle;
        }
        Ok(self.say(Response::DownloadedSegment { toggle: segment.toggle }))
    }

    fn block_download(
        &mut self,
        at: Multiplexer,
        crc: bool,
        size: Option<u32>,
        objects: &mut impl Objects,
    ) -> Answer {
        self.begin(at);
        let sink = Sink::open(at, size, objects)?;
        self.transfer = Transfer::BlockDownload(Receiver::new(sink, crc));
        Ok(self.say(Response::BlockDownload(at, BlockSize::MAX)))
    }

    fn wants_block_segments(&self) -> bool {
        matches!(&self.transfer, Transfer::BlockDownload(receiver) if receiver.wants_segments())
    }

    /// Within a block a frame is a segment, unless its first byte is that of an abort. Afterwards it still is one
    /// when it is the last one again.
    fn block_segment(&self, frame: [u8; 8]) -> Option<BlockSegment> {
        let Transfer::BlockDownload(receiver) = &self.transfer else { return None };
        let segment = BlockSegment::parse(frame)?;
        (receiver.wants_segments() || frame == self.previous.0).then_some(segment)
    }

    fn take_block_segment(&mut self, segment: BlockSegment, objects: &mut impl Objects) -> Answer {
        let Transfer::BlockDownload(receiver) = &mut self.transfer else { return Err(Abort::Command) };
        if !receiver.take(segment, &mut self.buffer, objects)? {
            return Ok(false);
        }
        let sequence = receiver.acknowledge();
        Ok(self.say(Response::BlockAcknowledge(sequence, BlockSize::MAX)))
    }

    fn block_download_end(&mut self, end: BlockEnd, objects: &mut impl Objects, now: Instant) -> Answer {
        let Transfer::BlockDownload(receiver) = &mut self.transfer else { return Err(Abort::Command) };
        receiver.end(end, &mut self.buffer, objects, now)?;
        self.transfer = Transfer::Idle;
        Ok(self.say(Response::BlockDownloaded))
    }

    /// A value of no more than `threshold` bytes goes by the simpler transfers.
    fn block_upload(
        &mut self,
        at: Multiplexer,
        block_size: u8,
        threshold: u8,
        objects: &mut impl Objects,
    ) -> Answer {
        self.begin(at);
        let source = Source::new(at, objects.read(at)?, &mut self.buffer);
        if source.len() <= usize::from(threshold) {
            return self.upload(at, objects);
        }
        let block_size = BlockSize::new(block_size).ok_or(Abort::BlockSize)?;
        self.transfer = Transfer::BlockUpload(Sender::new(source, block_size));
        Ok(self.say(Response::BlockUpload { at, crc: true, size: Some(source.size()) }))
    }

    fn sender(&mut self) -> Result<&mut Sender, Abort> {
        match &mut self.transfer {
            Transfer::BlockUpload(sender) => Ok(sender),
            _ => Err(Abort::Command),
        }
    }

    /// Whether segments of a block wait to be sent.
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

/// The value of an expedited download that leaves its size to the type.
fn unsized_value(data: [u8; 4], at: Multiplexer, objects: &impl Objects) -> Result<Bytes<4>, Abort> {
    match objects.writable(at)? {
        Writable::Value(size) => Ok(Bytes::from_slice(data.get(..size).unwrap_or(&data))),
        Writable::Stream(_) => Ok(Bytes::new(data, 4)),
    }
}
