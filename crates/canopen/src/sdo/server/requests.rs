//! The reaction of the server to each request.

use super::{Answer, Server, Transfer};
use crate::Instant;
use crate::sdo::block_download::Receiver;
use crate::sdo::block_upload::Sender;
use crate::sdo::objects::{Sink, Source};
use crate::sdo::segmented::{Download, Upload};
use crate::sdo::{
    Abort, BlockEnd, BlockSegment, BlockSize, Bytes, Initiate, Multiplexer, Objects, Request, Response,
    Segment, Writable,
};

impl<O: Objects> Server<O> {
    /// Takes a request that is not a segment of a block. `is_repeated` is `true` if it is equal to the request before.
    #[inline]
    pub(super) fn dispatch(
        &mut self,
        frame: &[u8; 8],
        is_repeated: bool,
        objects: &mut O,
        now: Instant,
    ) -> Answer {
        let Some(request) = Request::parse(frame) else {
            // Without a transfer, the abort message names the object of this frame instead of the last transfer's
            // object.
            if self.is_idle() {
                self.multiplexer = Multiplexer::parse(frame);
            }
            return Err(Abort::Command);
        };
        match request {
            // `answer` handles these two.
            Request::Upload(_) | Request::Download(..) => Err(Abort::Command),
            Request::UploadSegment { toggle } => self.upload_segment(toggle, objects),
            Request::DownloadSegment(segment) => self.download_segment(&segment, objects, now),
            Request::Abort(..) => {
                self.abandon(objects);
                Ok(false)
            }
            Request::BlockDownload { at, .. } if !O::BLOCK_DOWNLOAD => {
                self.begin(at, objects);
                Err(Abort::Command)
            }
            Request::BlockDownloadEnd(_) if !O::BLOCK_DOWNLOAD => Err(Abort::Command),
            Request::BlockDownload { at, crc, size } => self.block_download(at, crc, size, objects),
            Request::BlockDownloadEnd(end) => self.block_download_end(end, objects, now),
            Request::BlockUpload { at, .. } if !O::BLOCK_UPLOAD => {
                self.begin(at, objects);
                Err(Abort::Command)
            }
            _ if !O::BLOCK_UPLOAD => Err(Abort::Command),
            Request::BlockUpload { at, block_size, threshold, .. } => {
                self.block_upload(at, block_size, threshold, objects)
            }
            Request::BlockUploadStart => self.sender()?.start(is_repeated).map(|()| false),
            Request::BlockAcknowledge { sequence, block_size } => {
                match self.sender()?.acknowledge(sequence, block_size, is_repeated)? {
                    Some(end) => Ok(self.set_reply(Response::BlockUploadEnd(end))),
                    None => Ok(false),
                }
            }
            // A confirmation has no answer, so a repetition is ignored. A refused confirmation is refused again.
            Request::BlockUploadEnded if is_repeated && !self.is_answered => Ok(false),
            Request::BlockUploadEnded => {
                let sender = self.sender()?;
                sender.ended()?;
                if O::PARTS {
                    sender.source().close(true, objects);
                }
                self.transfer = Transfer::Idle;
                Ok(false)
            }
        }
    }

    /// Takes the request that begins a download.
    #[inline(never)]
    pub(super) fn initiate_download(&mut self, frame: &[u8; 8], objects: &mut O, now: Instant) -> bool {
        let at = Multiplexer::parse(frame);
        self.begin(at, objects);
        // Most downloads are expedited: their data is used directly from the frame.
        let result = match Initiate::expedited(frame) {
            Some(data) => objects.write(at, data, now),
            None => self.download(at, frame, objects, now),
        };
        let answer = result.map(|()| self.set_reply(Response::Downloaded(at)));
        self.conclude(answer, objects, now)
    }

    /// Takes the request that begins an upload.
    #[inline(never)]
    pub(super) fn initiate_upload(&mut self, frame: &[u8; 8], objects: &mut O, now: Instant) -> bool {
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
        if value.len() <= 4 {
            return Ok(self.set_reply(Response::Uploaded(at, Bytes::from_slice(value))));
        }
        let source = Source::new(at, value, &mut self.buffer);
        self.transfer = Transfer::Upload(Upload::new(source));
        Ok(self.set_reply(Response::UploadSegmented(at, Some(source.size()))))
    }

    /// Begins an upload in parts, in segments. One to four bytes are in the response itself, which cannot be empty.
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
        let segment = upload.next(toggle, &mut self.buffer, objects)?;
        if segment.last {
            if O::PARTS {
                upload.source().close(true, objects);
            }
            self.transfer = Transfer::Idle;
        }
        Ok(self.set_reply(Response::UploadedSegment(segment)))
    }

    #[inline(never)]
    fn download(
        &mut self,
        at: Multiplexer,
        frame: &[u8; 8],
        objects: &mut O,
        now: Instant,
    ) -> Result<(), Abort> {
        let value = match Initiate::parse(frame) {
            Initiate::Expedited(bytes) => bytes,
            Initiate::Unsized(data) => unsized_value(data, at, objects)?,
            Initiate::Segmented(size) => {
                self.transfer = Transfer::Download(Download::new(Sink::open(at, size, objects)?));
                return Ok(());
            }
        };
        objects.write(at, value.as_slice(), now)
    }

    fn download_segment(&mut self, segment: &Segment, objects: &mut O, now: Instant) -> Answer {
        let Transfer::Download(download) = &mut self.transfer else { return Err(Abort::Command) };
        download.take(segment, &mut self.buffer, objects, now)?;
        if segment.last {
            self.transfer = Transfer::Idle;
        }
        Ok(self.set_reply(Response::DownloadedSegment { toggle: segment.toggle }))
    }

    fn block_download(&mut self, at: Multiplexer, crc: bool, size: Option<u32>, objects: &mut O) -> Answer {
        self.begin(at, objects);
        let sink = Sink::open(at, size, objects)?;
        self.transfer = Transfer::BlockDownload(Receiver::new(sink, crc));
        Ok(self.set_reply(Response::BlockDownload(at, BlockSize::MAX)))
    }

    pub(super) fn take_block_segment(&mut self, segment: BlockSegment, objects: &mut O) -> Answer {
        let Transfer::BlockDownload(receiver) = &mut self.transfer else { return Err(Abort::Command) };
        if !receiver.take(segment, &mut self.buffer, objects)? {
            return Ok(false);
        }
        let sequence = receiver.acknowledge();
        Ok(self.set_reply(Response::BlockAcknowledge(sequence, BlockSize::MAX)))
    }

    fn block_download_end(&mut self, end: BlockEnd, objects: &mut O, now: Instant) -> Answer {
        let Transfer::BlockDownload(receiver) = &mut self.transfer else { return Err(Abort::Command) };
        receiver.end(end, &mut self.buffer, objects, now)?;
        self.transfer = Transfer::Idle;
        Ok(self.set_reply(Response::BlockDownloaded))
    }

    /// Begins a block upload. A value of at most `threshold` bytes is sent as an ordinary upload.
    fn block_upload(&mut self, at: Multiplexer, block_size: u8, threshold: u8, objects: &mut O) -> Answer {
        self.begin(at, objects);
        if O::PARTS {
            let size = BlockSize::new(block_size).ok_or(Abort::BlockSize)?;
            if let Some(len) = objects.open(at)? {
                let source = Source::in_parts(at, len);
                return if len <= usize::from(threshold) {
                    self.upload_parts(source, at, objects)
                } else {
                    Ok(self.send_blocks(at, source, size))
                };
            }
        }
        let source = Source::new(at, objects.read(at)?, &mut self.buffer);
        if source.len() <= usize::from(threshold) {
            return self.upload(at, objects);
        }
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

/// The value of an expedited download without a size. The size is taken from the data type.
fn unsized_value(data: [u8; 4], at: Multiplexer, objects: &impl Objects) -> Result<Bytes<4>, Abort> {
    match objects.writable(at)? {
        Writable::Value(size) => Ok(Bytes::from_slice(data.get(..size).unwrap_or(&data))),
        Writable::Stream => Ok(Bytes::new(data, 4)),
    }
}
