//! The reaction of the server to each request.

use super::{Answer, Server, Transfer};
use crate::Tick;
use crate::sdo::block_download::Receiver;
use crate::sdo::block_upload::Sender;
use crate::sdo::objects::{Room, Sink, Source};
use crate::sdo::segmented::{Download, Upload};
use crate::sdo::{
    Abort, BlockEnd, BlockSize, Bytes, Initiate, Multiplexer, Objects, Response, TOGGLE, Writable, tail,
};

impl<O: Objects> Server<O> {
    /// Takes a request that is not a segment of a block. `is_repeated` is `true` if it is equal to the request before.
    #[inline]
    pub(super) fn dispatch(
        &mut self,
        frame: &[u8; 8],
        is_repeated: bool,
        objects: &mut O,
        now: Tick,
    ) -> Answer {
        let command = frame[0];
        match command >> 5 {
            0 => self.download_segment(frame, objects, now),
            3 => self.upload_segment(command & TOGGLE != 0, objects),
            4 => {
                self.abandon(objects);
                Ok(false)
            }
            5 => self.block_upload_request(frame, is_repeated, objects),
            6 => self.block_download_request(frame, objects, now),
            // `answer` handles 1 and 2.
            _ => {
                // Without a transfer, the abort message names the object of this frame instead of the last transfer's
                // object.
                if self.is_idle() {
                    self.multiplexer = Multiplexer::parse(frame);
                }
                Err(Abort::Command)
            }
        }
    }

    /// Takes a request of a block download that is not a segment.
    fn block_download_request(&mut self, frame: &[u8; 8], objects: &mut O, now: Tick) -> Answer {
        let [command, ..] = *frame;
        let is_end = command & 1 != 0;
        if !O::BLOCK_DOWNLOAD {
            return self.refuse_block(is_end, frame, objects);
        }
        if is_end {
            return self.block_download_end(BlockEnd::parse(frame), objects, now);
        }
        let size = (command & 2 != 0).then(|| u32::from_le_bytes(tail(frame)));
        self.block_download(Multiplexer::parse(frame), command & 4 != 0, size, objects)
    }

    /// Takes a request of a block upload.
    fn block_upload_request(&mut self, frame: &[u8; 8], is_repeated: bool, objects: &mut O) -> Answer {
        let [command, sequence, block_size, ..] = *frame;
        if !O::BLOCK_UPLOAD {
            return self.refuse_block(command & 3 != 0, frame, objects);
        }
        match command & 3 {
            0 => self.block_upload(Multiplexer::parse(frame), frame[4], frame[5], objects),
            // A confirmation has no answer, so a repetition is ignored. A refused confirmation is refused again.
            1 if is_repeated && !self.is_answered => Ok(false),
            1 => {
                let sender = self.sender()?;
                sender.ended()?;
                if O::PARTS {
                    sender.source().close(true, objects);
                }
                self.transfer = Transfer::Idle;
                Ok(false)
            }
            2 => {
                let sender = self.sender()?;
                if !sender.acknowledge(sequence, block_size, is_repeated)? {
                    return Ok(false);
                }
                let end = sender.end();
                Ok(self.set_reply(Response::BlockUploadEnd(end)))
            }
            _ => self.sender()?.start(is_repeated).map(|()| false),
        }
    }

    /// Refuses a request of a block transfer. A request that is not a part of one begins a transfer.
    fn refuse_block(&mut self, is_part: bool, frame: &[u8; 8], objects: &mut O) -> Answer {
        if !is_part {
            self.begin(Multiplexer::parse(frame), objects);
        }
        Err(Abort::Command)
    }

    /// Takes the request that begins a download.
    #[inline(never)]
    pub(super) fn initiate_download(&mut self, frame: &[u8; 8], objects: &mut O, now: Tick) -> bool {
        let at = Multiplexer::parse_word(frame);
        self.begin(at, objects);
        // Most downloads are expedited: their data is used directly from the frame.
        let result = match Initiate::expedited(frame) {
            Some(data) => objects.write(at, data, now),
            None => self.download(at, frame, objects, now),
        };
        let answer = result.map(|()| self.set_reply(Response::Downloaded(at)));
        if answer == Ok(true) && !self.written(objects) {
            return self.settle(Ok(false), objects, now);
        }
        self.settle(answer, objects, now)
    }

    /// Takes the request that begins an upload.
    #[inline(never)]
    pub(super) fn initiate_upload(&mut self, frame: &[u8; 8], objects: &mut O, now: Tick) -> bool {
        let answer = self.upload(Multiplexer::parse(frame), objects);
        self.settle(answer, objects, now)
    }

    /// Begins a transfer. A transfer that is under way is forgotten: its client has started over.
    fn begin(&mut self, at: Multiplexer, objects: &mut O) {
        self.abandon(objects);
        self.multiplexer = at;
        self.is_answered = false;
    }

    fn upload(&mut self, at: Multiplexer, objects: &mut O) -> Answer {
        self.begin(at, objects);
        if O::PARTS
            && let Some(len) = objects.open(at)?
        {
            return self.upload_parts(Source::in_parts(at, len), at, objects);
        }
        let value = objects.read(at)?;
        Ok(self.upload_value(at, value))
    }

    /// Begins the upload of a value that has been read. One to four bytes are in the response itself, which cannot be
    /// empty.
    fn upload_value(&mut self, at: Multiplexer, value: &[u8]) -> bool {
        if matches!(value.len(), 1..=4) {
            return self.set_reply(Response::Uploaded(at, Bytes::from_slice(value)));
        }
        let source = Source::new(at, value, &mut self.buffer);
        self.transfer = Transfer::Upload(Upload::new(source));
        self.set_reply(Response::UploadSegmented(at, Some(source.size())))
    }

    /// Begins an upload in parts, in segments, as [`upload_value`](Server::upload_value).
    fn upload_parts(&mut self, mut source: Source, at: Multiplexer, objects: &mut O) -> Answer {
        if matches!(source.len(), 1..=4) {
            let piece = source.piece(0, &mut self.buffer, objects);
            source.close(piece.is_ok(), objects);
            return Ok(self.set_reply(Response::Uploaded(at, Bytes::from_slice(piece?.as_slice()))));
        }
        self.transfer = Transfer::Upload(Upload::new(source));
        Ok(self.set_reply(Response::UploadSegmented(at, Some(source.size()))))
    }

    fn upload_segment(&mut self, toggle: bool, objects: &mut O) -> Answer {
        let Transfer::Upload(upload) = &mut self.transfer else { return Err(Abort::Command) };
        if upload.next(toggle, &mut self.reply, &mut self.buffer, objects)? {
            if O::PARTS {
                upload.source().close(true, objects);
            }
            self.transfer = Transfer::Idle;
        }
        Ok(true)
    }

    #[inline(never)]
    fn download(
        &mut self,
        at: Multiplexer,
        frame: &[u8; 8],
        objects: &mut O,
        now: Tick,
    ) -> Result<(), Abort> {
        let [command, _, _, _, data @ ..] = frame;
        if command & 2 == 0 {
            let size = (command & 1 != 0).then(|| u32::from_le_bytes(*data));
            let sink = Sink::new(at, size, Room::of(at, size, objects)?);
            self.transfer = Transfer::Download(Download::new(sink));
            return Ok(());
        }
        // Expedited, without a size: it is that of the data type.
        let size = match objects.writable(at)? {
            Writable::Value(size) => size,
            Writable::Stream => data.len(),
        };
        objects.write(at, data.get(..size).unwrap_or(data), now)
    }

    fn download_segment(&mut self, frame: &[u8; 8], objects: &mut O, now: Tick) -> Answer {
        let Transfer::Download(download) = &mut self.transfer else { return Err(Abort::Command) };
        let is_complete = download.take(frame, &mut self.buffer, objects, now)?;
        if is_complete {
            self.transfer = Transfer::Idle;
        }
        self.set_reply(Response::DownloadedSegment { toggle: frame[0] & TOGGLE != 0 });
        Ok(!is_complete || self.written(objects))
    }

    fn block_download(&mut self, at: Multiplexer, crc: bool, size: Option<u32>, objects: &mut O) -> Answer {
        self.begin(at, objects);
        let sink = Sink::new(at, size, Room::of(at, size, objects)?);
        self.transfer = Transfer::BlockDownload(Receiver::new(sink, crc));
        Ok(self.set_reply(Response::BlockDownload(at, BlockSize::MAX)))
    }

    pub(super) fn take_block_segment(
        &mut self,
        frame: &[u8; 8],
        is_repeated: bool,
        objects: &mut O,
    ) -> Answer {
        let Transfer::BlockDownload(receiver) = &mut self.transfer else { return Err(Abort::Command) };
        if !receiver.take(frame, is_repeated, &mut self.buffer, objects) {
            return Ok(false);
        }
        let sequence = receiver.acknowledge()?;
        Ok(self.set_reply(Response::BlockAcknowledge(sequence, BlockSize::MAX)))
    }

    fn block_download_end(&mut self, end: BlockEnd, objects: &mut O, now: Tick) -> Answer {
        let Transfer::BlockDownload(receiver) = &mut self.transfer else { return Err(Abort::Command) };
        receiver.end(end, &self.previous, &mut self.buffer, objects, now)?;
        self.transfer = Transfer::Idle;
        self.set_reply(Response::BlockDownloaded);
        Ok(self.written(objects))
    }

    /// Begins a block upload. A value of at most `threshold` bytes is sent as an ordinary upload.
    fn block_upload(&mut self, at: Multiplexer, block_size: u8, threshold: u8, objects: &mut O) -> Answer {
        self.begin(at, objects);
        if O::PARTS {
            let size = BlockSize::new(block_size).ok_or(Abort::BlockSize)?;
            if let Some(len) = objects.open(at)? {
                let source = Source::in_parts(at, len);
                return if is_short(len, threshold) {
                    self.upload_parts(source, at, objects)
                } else {
                    Ok(self.send_blocks(at, source, size))
                };
            }
        }
        let value = objects.read(at)?;
        if is_short(value.len(), threshold) {
            return Ok(self.upload_value(at, value));
        }
        let source = Source::new(at, value, &mut self.buffer);
        let block_size = BlockSize::new(block_size).ok_or(Abort::BlockSize)?;
        Ok(self.send_blocks(at, source, block_size))
    }

    fn send_blocks(&mut self, at: Multiplexer, source: Source, block_size: BlockSize) -> bool {
        self.transfer = Transfer::BlockUpload(Sender::new(source, block_size));
        self.set_reply(Response::BlockUpload { at, crc: true, size: Some(source.size()) })
    }

    fn sender(&mut self) -> Result<&mut Sender, Abort> {
        match &mut self.transfer {
            Transfer::BlockUpload(sender) => Ok(sender),
            _ => Err(Abort::Command),
        }
    }
}

/// Whether an upload of `len` bytes changes from blocks to segments; never with the threshold 0.
fn is_short(len: usize, threshold: u8) -> bool {
    threshold != 0 && len <= usize::from(threshold)
}
