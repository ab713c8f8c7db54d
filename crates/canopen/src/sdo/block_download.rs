//! Block download (CiA 301, 7.2.4.3.9 to 11): the client sends up to 127 segments before it waits for an answer.

use super::objects::{BUFFER, Sink};
use super::{Abort, BlockEnd, BlockSegment, BlockSize, Objects, crc};
use crate::Instant;

/// A block download under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    sink: Sink,
    check_crc: bool,
    crc: u16,
    /// Last segment of this block that came in sequence.
    sequence: u8,
    /// The segment that came last, in sequence or not. One that comes twice in a row counts once.
    newest: Option<BlockSegment>,
    /// Something of this block has come.
    has_begun: bool,
    /// The newest segment. It may be the last one, and how much of that is data is only known at the end.
    held: Option<[u8; 7]>,
    /// The last segment is there: only the end is missing.
    complete: bool,
}

impl Receiver {
    pub(super) fn new(sink: Sink, check_crc: bool) -> Receiver {
        Receiver {
            sink,
            check_crc,
            crc: 0,
            sequence: 0,
            newest: None,
            has_begun: false,
            held: None,
            complete: false,
        }
    }

    /// Whether frames are segments now, and not requests.
    pub(super) fn wants_segments(&self) -> bool {
        !self.complete
    }

    /// Whether a block has begun: if its last segment is lost, nobody would answer it.
    pub(super) fn is_within_block(&self) -> bool {
        self.wants_segments() && self.has_begun
    }

    /// Takes a segment; `true` at the end of a block. Segments after a gap are left to be sent again.
    pub(super) fn take(
        &mut self,
        segment: BlockSegment,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<bool, Abort> {
        self.has_begun = true;
        if self.newest.replace(segment) == Some(segment) {
            return Ok(false);
        }
        if segment.sequence.get() == self.sequence + 1 {
            self.sequence += 1;
            self.flush(0, buffer, objects)?;
            self.held = Some(segment.data);
            self.complete = segment.last;
        }
        Ok(segment.last || segment.sequence == BlockSize::MAX)
    }

    /// The sequence number to acknowledge; the next block begins.
    pub(super) fn acknowledge(&mut self) -> u8 {
        self.has_begun = false;
        core::mem::take(&mut self.sequence)
    }

    /// Passes on what is held, but for the `unused` bytes at its end.
    fn flush(
        &mut self,
        unused: u8,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<(), Abort> {
        let Some(held) = self.held.take() else { return Ok(()) };
        let (data, _) = held.split_at_checked(7 - usize::from(unused.min(7))).unwrap_or((&held, &[]));
        self.crc = crc::extend(self.crc, data);
        self.sink.append(data, buffer, objects)
    }

    /// The end of the transfer.
    pub(super) fn end(
        mut self,
        end: BlockEnd,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
        now: Instant,
    ) -> Result<(), Abort> {
        self.flush(end.unused, buffer, objects)?;
        if self.check_crc && self.crc != end.crc {
            return Err(Abort::Crc);
        }
        self.sink.complete(buffer, objects, now)
    }
}
