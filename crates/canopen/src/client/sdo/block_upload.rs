//! Block upload (CiA 301, 7.2.4.3.13 to 15): up to 127 segments before the client answers.

use super::link::{Channel, Link};
use super::sink::Sink;
use super::transfer::{self, Progress, Transfer};
use super::{BlockUpload, Error, Options, upload};
use crate::sdo::{BlockEnd, BlockSegment, Multiplexer, Request, Response, crc};
use crate::{Duration, Instant};

/// A pause of this length within a block means that its last segment was lost. The time-out of servers is longer.
const PAUSE: Duration = Duration::from_millis(250);
/// The transfer fails after this many blocks in a row without a segment in sequence.
const MAX_EMPTY_BLOCKS: u8 = 3;

/// A block upload under way.
#[derive(Debug)]
pub struct Protocol<S> {
    /// The sink, and the protocol without blocks, which a server may choose instead.
    simple: upload::Protocol<S>,
    phase: Phase,
    /// Whether the server will send a CRC at the end.
    has_crc: bool,
    /// Total number of bytes, if the server announces it.
    size: Option<usize>,
    /// The newest segment. Only the end of the transfer tells how many bytes of the last segment are data.
    held: Option<[u8; 7]>,
    /// Bytes in the sink.
    received: usize,
    /// CRC of the bytes in the sink.
    crc: u16,
    /// Blocks in a row without a segment in sequence.
    empty_blocks: u8,
}

#[derive(Clone, Copy, Debug)]
enum Phase {
    /// The server has not chosen the kind of transfer yet.
    Begin,
    /// The server has chosen an expedited or segmented transfer.
    Simple,
    /// Segments are arriving; this one was the last in sequence.
    Block(u8),
    /// All segments have arrived; the server has not yet told how many bytes of the last one are data.
    End,
}

impl<S: Sink> BlockUpload<S> {
    /// Reads an object of a server into a sink.
    #[must_use]
    pub fn new(channel: impl Into<Channel>, at: Multiplexer, sink: S, options: Options) -> BlockUpload<S> {
        let protocol = Protocol {
            simple: upload::Protocol::new(sink),
            phase: Phase::Begin,
            has_crc: false,
            size: None,
            held: None,
            received: 0,
            crc: 0,
            empty_blocks: 0,
        };
        Transfer::with(protocol, channel.into(), at, options)
    }

    /// The sink with the received bytes.
    #[must_use]
    pub fn into_sink(self) -> S {
        self.protocol.simple.into_sink()
    }
}

impl<S: Sink> Protocol<S> {
    fn on_begin(&mut self, data: [u8; 8], link: &mut Link, now: Instant) -> Result<Progress, Error> {
        let (crc, size) = match Response::parse(data) {
            Some(Response::BlockUpload { at, crc, size }) if at == link.at => (crc, size),
            _ => return self.on_simple(data, link, now),
        };
        if !self.simple.sink().begin(size) {
            return Err(Error::TooLong);
        }
        self.has_crc = crc;
        self.size = size.map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        self.phase = Phase::Block(0);
        link.ask(Request::BlockUploadStart);
        Ok(Progress::Continues)
    }

    fn on_simple(&mut self, data: [u8; 8], link: &mut Link, now: Instant) -> Result<Progress, Error> {
        let progress = transfer::Protocol::on_response(&mut self.simple, data, link, now)?;
        if progress != Progress::Unexpected {
            self.phase = Phase::Simple;
        }
        Ok(progress)
    }

    fn on_segment(
        &mut self,
        segment: BlockSegment,
        before: u8,
        link: &mut Link,
        now: Instant,
    ) -> Result<Progress, Error> {
        let is_next = segment.sequence.get() == before.saturating_add(1);
        let sequence = if is_next { segment.sequence.get() } else { before };
        self.phase = Phase::Block(sequence);
        if is_next {
            self.hold(segment.data)?;
        }
        if segment.last || segment.sequence >= link.options.block_size {
            self.acknowledge(sequence, is_next && segment.last, link)?;
        } else {
            link.wait(PAUSE.min(link.options.timeout), now);
        }
        Ok(Progress::Continues)
    }

    /// Holds a segment back, and hands the segment before it to the sink: that one was not the last.
    fn hold(&mut self, data: [u8; 7]) -> Result<(), Error> {
        match self.held.replace(data) {
            Some(before) => self.append(&before),
            None => Ok(()),
        }
    }

    fn append(&mut self, data: &[u8]) -> Result<(), Error> {
        self.received = self.received.saturating_add(data.len());
        self.crc = crc::extend(self.crc, data);
        if self.size.is_some_and(|size| self.received > size) {
            return Err(Error::Unexpected);
        }
        if self.simple.sink().append(data) { Ok(()) } else { Err(Error::TooLong) }
    }

    /// Acknowledges a block. The server sends segments that did not arrive in sequence again in the next block.
    fn acknowledge(&mut self, sequence: u8, is_all: bool, link: &mut Link) -> Result<(), Error> {
        self.empty_blocks = if sequence == 0 { self.empty_blocks.saturating_add(1) } else { 0 };
        if self.empty_blocks == MAX_EMPTY_BLOCKS {
            return Err(Error::Unexpected);
        }
        self.phase = if is_all { Phase::End } else { Phase::Block(0) };
        let block_size = link.options.block_size.get();
        if block_size == 1 {
            // All segments have the number 1, so two segments in a row may be equal.
            link.expect_equal();
        }
        link.ask(Request::BlockAcknowledge { sequence, block_size });
        Ok(())
    }

    fn on_end(&mut self, end: BlockEnd, link: &mut Link) -> Result<Progress, Error> {
        let held = self.held.take().unwrap_or_default();
        // Some servers report 7 unused bytes for a last segment that is full. The announced size, if any, decides.
        let is_full = end.unused == 7 && self.size == Some(self.received.saturating_add(7));
        let used = if is_full { 7 } else { 7 - usize::from(end.unused.min(7)) };
        self.append(held.get(..used).unwrap_or(&held))?;
        if self.size.is_some_and(|size| size != self.received) {
            return Err(Error::Unexpected);
        }
        if self.has_crc && self.crc != end.crc {
            return Err(Error::Crc);
        }
        link.ask(Request::BlockUploadEnded);
        Ok(Progress::Complete)
    }
}

impl<S: Sink> transfer::Protocol for Protocol<S> {
    fn begin(&mut self, link: &mut Link) {
        self.simple.reset();
        (self.phase, self.held, self.received, self.crc, self.empty_blocks) = (Phase::Begin, None, 0, 0, 0);
        let block_size = link.options.block_size.get();
        link.begin(Request::BlockUpload { at: link.at, crc: true, block_size, threshold: 0 });
    }

    fn on_response(&mut self, data: [u8; 8], link: &mut Link, now: Instant) -> Result<Progress, Error> {
        match self.phase {
            Phase::Begin => self.on_begin(data, link, now),
            Phase::Simple => self.on_simple(data, link, now),
            Phase::Block(before) => match BlockSegment::parse(data) {
                Some(segment) => self.on_segment(segment, before, link, now),
                None => Ok(Progress::Unexpected),
            },
            Phase::End => match Response::parse(data) {
                Some(Response::BlockUploadEnd(end)) => self.on_end(end, link),
                _ => Ok(Progress::Unexpected),
            },
        }
    }

    /// The last segments of a block are lost: acknowledges the segments that have arrived.
    fn on_silence(&mut self, link: &mut Link) -> Result<(), Error> {
        match self.phase {
            Phase::Block(sequence @ 1..) => self.acknowledge(sequence, false, link),
            _ => Err(link.silence()),
        }
    }

    fn transferred(&self) -> usize {
        match self.phase {
            Phase::Simple => self.simple.transferred(),
            _ => self.received,
        }
    }
}
