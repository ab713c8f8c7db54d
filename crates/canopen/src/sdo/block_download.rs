//! Block download (CiA 301, 7.2.4.3.9 to 11): the client sends up to 127 segments before it waits for an answer.

use super::objects::{BUFFER, Sink};
use super::{Abort, BlockEnd, BlockSegment, BlockSize, Objects};
use crate::Instant;

/// A block download under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    sink: Sink,
    check_crc: bool,
    /// Sequence number of the segment that comes next.
    next: u8,
    /// The segment that came last, in sequence or not, if it may be the one that comes next. One that comes twice in a
    /// row counts once.
    newest: Option<BlockSegment>,
    /// What `next` was after the newest segment: where `next` has gone on, other segments have come since.
    next_then: u8,
    /// Something of this block has come.
    has_begun: bool,
    /// The last segment of all. How much of it is data, only the end says; nothing else is missing.
    last: Option<[u8; 7]>,
}

impl Receiver {
    pub(super) fn new(sink: Sink, check_crc: bool) -> Receiver {
        Receiver { sink, check_crc, next: 1, newest: None, next_then: 1, has_begun: false, last: None }
    }

    /// Whether frames are segments now, and not requests.
    pub(super) fn wants_segments(&self) -> bool {
        self.last.is_none()
    }

    /// Whether a block has begun: if its last segment is lost, nobody would answer it.
    pub(super) fn is_within_block(&self) -> bool {
        self.wants_segments() && self.has_begun
    }

    /// Takes a frame that is the next segment of a block, neither the first nor the last, if the buffer has room for a whole
    /// one: most frames of a transfer are nothing else. Whether the frame was taken.
    #[inline]
    pub(super) fn take_next(&mut self, frame: &[u8; 8], buffer: &mut [u8; BUFFER]) -> bool {
        let [sequence, data @ ..] = frame;
        let is_taken = *sequence == self.next && self.sink.append_direct(data, buffer);
        if is_taken {
            self.next += 1;
        }
        is_taken
    }

    /// Takes a segment; `true` at the end of a block. Segments after a gap are left to be sent again.
    pub(super) fn take(
        &mut self,
        segment: BlockSegment,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<bool, Abort> {
        self.has_begun = true;
        let is_in_a_row = self.next_then == self.next;
        if self.newest.replace(segment) == Some(segment) && is_in_a_row {
            return Ok(false);
        }
        let is_end = segment.last || segment.sequence == BlockSize::MAX;
        if segment.sequence.get() == self.next {
            self.next += 1;
            if segment.last {
                self.last = Some(segment.data);
            } else {
                self.sink.append(&segment.data, buffer, objects)?;
            }
        }
        if is_end {
            self.sink.hand_over(buffer, objects)?;
        } else {
            // Neither the first segment of a block, which comes here, nor the last one.
            self.sink.allow_direct(BlockSize::MAX.get().saturating_sub(self.next).into());
        }
        self.next_then = self.next;
        Ok(is_end)
    }

    /// The sequence number to acknowledge; the next block begins.
    pub(super) fn acknowledge(&mut self) -> u8 {
        self.has_begun = false;
        self.next_then = 1;
        self.sink.allow_direct(0);
        core::mem::replace(&mut self.next, 1) - 1
    }

    /// The end of the transfer.
    pub(super) fn end(
        &mut self,
        end: BlockEnd,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
        now: Instant,
    ) -> Result<(), Abort> {
        if let Some(last) = &self.last {
            let data = last.get(..7 - usize::from(end.unused.min(7))).unwrap_or(last);
            self.sink.append(data, buffer, objects)?;
        }
        if self.check_crc && self.sink.crc(buffer) != end.crc {
            return Err(Abort::Crc);
        }
        self.sink.complete(buffer, objects, now)
    }
}
