//! The server: one transfer at a time, request in, response out.

use super::{Abort, Bytes, Initiate, Multiplexer, Request, Response, Segment};
use crate::{Duration, Instant};

/// How long the client of a segmented transfer may be silent. CiA 301 leaves the time to the device.
const TIME_OUT: Duration = Duration::from_millis(1000);
/// The longest value that travels in segments: a `VISIBLE_STRING` of 50 characters is the longest in the dictionary.
const BUFFER: usize = 64;

/// What the server serves: the dictionary with its values and rules.
pub(crate) trait Objects {
    /// The value of an entry, one byte or more.
    fn read(&mut self, multiplexer: Multiplexer) -> Result<&[u8], Abort>;
    /// How many bytes a write to the entry takes at most, once it is clear that it may be written at all.
    fn writable(&self, multiplexer: Multiplexer) -> Result<usize, Abort>;
    /// Replaces the value of an entry and does what follows from it.
    fn write(&mut self, multiplexer: Multiplexer, bytes: &[u8], now: Instant) -> Result<(), Abort>;
}

/// The state of the one SDO channel (1200h).
#[derive(Debug)]
pub(crate) struct Server {
    transfer: Transfer,
    multiplexer: Multiplexer,
    /// The value under way: a snapshot for an upload, what has come so far of a download.
    buffer: [u8; BUFFER],
    /// Bytes of the value: in all for an upload, so far for a download.
    len: usize,
    deadline: Instant,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Transfer {
    Idle,
    /// `sent` bytes are with the client, the next request carries `toggle`.
    Upload {
        sent: usize,
        toggle: bool,
    },
    /// At most `limit` bytes, exactly `announced` where the client said so.
    Download {
        limit: usize,
        announced: Option<usize>,
        toggle: bool,
    },
}

impl Server {
    pub(crate) const fn new() -> Server {
        let multiplexer = Multiplexer { index: 0, sub: 0 };
        let transfer = Transfer::Idle;
        Server { transfer, multiplexer, buffer: [0; BUFFER], len: 0, deadline: Instant::NEVER }
    }

    /// When the transfer under way times out.
    pub(crate) fn deadline(&self) -> Instant {
        self.deadline
    }

    /// Forgets the transfer under way, without a word to the client: the NMT state no longer allows any.
    pub(crate) fn reset(&mut self) {
        self.transfer = Transfer::Idle;
        self.deadline = Instant::NEVER;
    }

    /// Answers a request. There is no answer to an abort.
    pub(crate) fn answer(
        &mut self,
        frame: [u8; 8],
        objects: &mut impl Objects,
        now: Instant,
    ) -> Option<Response> {
        let response = match Request::parse(frame) {
            Some(Request::Upload(multiplexer)) => self.upload(multiplexer, objects),
            Some(Request::Download(multiplexer, initiate)) => {
                self.download(multiplexer, initiate, objects, now)
            }
            Some(Request::UploadSegment { toggle }) => self.upload_segment(toggle),
            Some(Request::DownloadSegment(segment)) => self.download_segment(&segment, objects, now),
            Some(Request::Abort(..)) => {
                self.reset();
                return None;
            }
            None => Err(Abort::Command),
        };
        Some(self.settle(response, now))
    }

    /// Gives up the transfer under way when its time is over.
    pub(crate) fn expire(&mut self, now: Instant) -> Option<Response> {
        (now >= self.deadline).then(|| self.settle(Err(Abort::TimeOut), now))
    }

    /// An error ends the transfer; the one place where it becomes an abort message.
    fn settle(&mut self, response: Result<Response, Abort>, now: Instant) -> Response {
        if response.is_err() {
            self.transfer = Transfer::Idle;
        }
        self.deadline = if self.transfer == Transfer::Idle { Instant::NEVER } else { now + TIME_OUT };
        response.unwrap_or_else(|abort| Response::Abort(self.multiplexer, abort.code()))
    }

    /// A new transfer; one that was under way is forgotten, as its client has started over.
    fn begin(&mut self, multiplexer: Multiplexer) {
        self.transfer = Transfer::Idle;
        self.multiplexer = multiplexer;
    }

    fn upload(&mut self, multiplexer: Multiplexer, objects: &mut impl Objects) -> Result<Response, Abort> {
        self.begin(multiplexer);
        let value = objects.read(multiplexer)?;
        if value.len() <= 4 {
            return Ok(Response::Uploaded(multiplexer, Bytes::from_slice(value)));
        }
        self.buffer.get_mut(..value.len()).ok_or(Abort::Length)?.copy_from_slice(value);
        self.len = value.len();
        self.transfer = Transfer::Upload { sent: 0, toggle: false };
        Ok(Response::UploadSegmented(multiplexer, u32::try_from(self.len).unwrap_or(u32::MAX)))
    }

    fn upload_segment(&mut self, requested: bool) -> Result<Response, Abort> {
        let Transfer::Upload { sent, toggle } = self.transfer else { return Err(Abort::Command) };
        if requested != toggle {
            return Err(Abort::Toggle);
        }
        let rest = self.buffer.get(sent..self.len).unwrap_or(&[]);
        let data = Bytes::from_slice(rest);
        let last = rest.len() <= 7;
        self.transfer =
            if last { Transfer::Idle } else { Transfer::Upload { sent: sent + 7, toggle: !toggle } };
        Ok(Response::UploadedSegment(Segment { toggle, last, data }))
    }

    fn download(
        &mut self,
        multiplexer: Multiplexer,
        initiate: Initiate,
        objects: &mut impl Objects,
        now: Instant,
    ) -> Result<Response, Abort> {
        self.begin(multiplexer);
        match initiate {
            Initiate::Expedited(bytes) => objects.write(multiplexer, bytes.as_slice(), now)?,
            Initiate::Unsized(data) => {
                let size = objects.writable(multiplexer)?.min(data.len());
                objects.write(multiplexer, data.get(..size).unwrap_or(&data), now)?;
            }
            Initiate::Segmented(size) => self.expect_segments(size, objects.writable(multiplexer)?)?,
        }
        Ok(Response::Downloaded(multiplexer))
    }

    fn expect_segments(&mut self, size: Option<u32>, limit: usize) -> Result<(), Abort> {
        let announced = size.map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        if announced.is_some_and(|size| size > limit) {
            return Err(Abort::TooLong);
        }
        self.len = 0;
        self.transfer = Transfer::Download { limit: limit.min(BUFFER), announced, toggle: false };
        Ok(())
    }

    fn download_segment(
        &mut self,
        segment: &Segment,
        objects: &mut impl Objects,
        now: Instant,
    ) -> Result<Response, Abort> {
        let Transfer::Download { limit, announced, toggle } = self.transfer else {
            return Err(Abort::Command);
        };
        if segment.toggle != toggle {
            return Err(Abort::Toggle);
        }
        self.append(segment.data.as_slice(), announced.unwrap_or(limit).min(limit))?;
        self.transfer = Transfer::Download { limit, announced, toggle: !toggle };
        if segment.last {
            self.transfer = Transfer::Idle;
            self.complete(announced, objects, now)?;
        }
        Ok(Response::DownloadedSegment { toggle })
    }

    fn append(&mut self, bytes: &[u8], limit: usize) -> Result<(), Abort> {
        let end = self.len + bytes.len();
        let room = self.buffer.get_mut(self.len..end.min(limit)).unwrap_or(&mut []);
        if room.len() < bytes.len() {
            return Err(Abort::TooLong);
        }
        room.copy_from_slice(bytes);
        self.len = end;
        Ok(())
    }

    fn complete(
        &self,
        announced: Option<usize>,
        objects: &mut impl Objects,
        now: Instant,
    ) -> Result<(), Abort> {
        if announced.is_some_and(|size| size != self.len) {
            return Err(Abort::TooShort);
        }
        objects.write(self.multiplexer, self.buffer.get(..self.len).unwrap_or(&[]), now)
    }
}
