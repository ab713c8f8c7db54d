//! Expedited and segmented upload (CiA 301, 7.2.4.3.5 and 7.2.4.3.6).

use super::link::{Channel, Link};
use super::sink::Sink;
use super::transfer::{self, Progress, Transfer};
use super::{Error, Options, Upload};
use crate::Instant;
use crate::sdo::{Multiplexer, Request, Response, Segment};

/// An upload under way.
#[derive(Debug)]
pub struct Protocol<S> {
    sink: S,
    /// `None` before the server has announced segments.
    segments: Option<Segments>,
    received: usize,
}

#[derive(Clone, Copy, Debug)]
struct Segments {
    toggle: bool,
    /// Total number of bytes, if the server announces it.
    size: Option<usize>,
}

impl<S: Sink> Upload<S> {
    /// Reads an object of a server into a sink.
    #[must_use]
    pub fn new(channel: impl Into<Channel>, at: Multiplexer, sink: S, options: Options) -> Upload<S> {
        Transfer::with(Protocol::new(sink), channel.into(), at, options)
    }

    /// The sink with the received bytes.
    #[must_use]
    pub fn into_sink(self) -> S {
        self.protocol.into_sink()
    }
}

impl<S: Sink> Protocol<S> {
    pub(super) fn new(sink: S) -> Protocol<S> {
        Protocol { sink, segments: None, received: 0 }
    }

    pub(super) fn into_sink(self) -> S {
        self.sink
    }

    pub(super) fn sink(&mut self) -> &mut S {
        &mut self.sink
    }

    /// Forgets the bytes received so far.
    pub(super) fn reset(&mut self) {
        (self.segments, self.received) = (None, 0);
    }

    /// Takes the data of an expedited transfer.
    fn take_all(&mut self, bytes: &[u8]) -> Result<Progress, Error> {
        let fits = self.sink.begin(u32::try_from(bytes.len()).ok()) && self.sink.append(bytes);
        self.received = bytes.len();
        if fits { Ok(Progress::Complete) } else { Err(Error::TooLong) }
    }

    fn begin_segments(&mut self, size: Option<u32>, link: &mut Link) -> Result<Progress, Error> {
        if !self.sink.begin(size) {
            return Err(Error::TooLong);
        }
        let size = size.map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        self.segments = Some(Segments { toggle: false, size });
        link.ask(Request::UploadSegment { toggle: false });
        Ok(Progress::Continues)
    }

    /// Takes a segment. An empty segment that is not the last one is refused: the transfer might never end.
    fn take(&mut self, segment: &Segment, now: Segments, link: &mut Link) -> Result<Progress, Error> {
        if segment.toggle != now.toggle {
            return Ok(Progress::Unexpected);
        }
        self.received = self.received.saturating_add(segment.data.len().into());
        let is_too_much = now.size.is_some_and(|size| self.received > size);
        let is_too_little = segment.last && now.size.is_some_and(|size| self.received < size);
        if is_too_much || is_too_little || segment.data.is_empty() && !segment.last {
            return Err(Error::Unexpected);
        }
        if !self.sink.append(segment.data.as_slice()) {
            return Err(Error::TooLong);
        }
        if segment.last {
            return Ok(Progress::Complete);
        }
        let toggle = !now.toggle;
        self.segments = Some(Segments { toggle, ..now });
        link.ask(Request::UploadSegment { toggle });
        Ok(Progress::Continues)
    }
}

impl<S: Sink> transfer::Protocol for Protocol<S> {
    fn begin(&mut self, link: &mut Link) {
        self.reset();
        link.begin(Request::Upload(link.at));
    }

    fn on_response(&mut self, data: [u8; 8], link: &mut Link, _: Instant) -> Result<Progress, Error> {
        match (self.segments, Response::parse(data)) {
            (None, Some(Response::Uploaded(of, bytes))) if of == link.at => self.take_all(bytes.as_slice()),
            (None, Some(Response::UploadSegmented(of, size))) if of == link.at => {
                self.begin_segments(size, link)
            }
            (Some(now), Some(Response::UploadedSegment(segment))) => self.take(&segment, now, link),
            _ => Ok(Progress::Unexpected),
        }
    }

    fn transferred(&self) -> usize {
        self.received
    }
}
