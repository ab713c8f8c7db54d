//! Block download (CiA 301, 7.2.4.3.9 to 11): the client sends up to 127 segments before it waits for an answer.

use super::objects::{BUFFER, Sink};
use super::{Abort, BlockEnd, BlockSegment, BlockSize, Objects};
use crate::Tick;

/// A block download under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    sink: Sink,
    check_crc: bool,
    /// Sequence number of the next segment.
    next: u8,
    /// The newest segment that `take` has processed, in sequence or not. A segment that arrives twice in a row counts
    /// once.
    newest: Option<BlockSegment>,
    /// The value of `next` after that segment. If `next` has advanced, `take_next` has taken other segments since then.
    next_then: u8,
    /// Whether any segment of this block has arrived.
    has_begun: bool,
    /// The sequence number of the last acknowledge.
    acknowledged: u8,
    /// Whether the last segment of the transfer has arrived, which is `newest` then. The end of the transfer tells how many
    /// of its bytes are data.
    is_complete: bool,
    /// The error of a segment. The end of the block reports it: the client sends the whole block before it listens, and
    /// no segment that is still on its way may be taken for a request.
    verdict: Result<(), Abort>,
}

impl Receiver {
    pub(super) fn new(sink: Sink, check_crc: bool) -> Receiver {
        Receiver {
            sink,
            check_crc,
            next: 1,
            newest: None,
            next_then: 1,
            has_begun: false,
            acknowledged: 0,
            is_complete: false,
            verdict: Ok(()),
        }
    }

    pub(super) fn sink(&self) -> &Sink {
        &self.sink
    }

    /// Whether the next frame is a segment and not a request.
    pub(super) fn expects_segments(&self) -> bool {
        !self.is_complete
    }

    /// The highest sequence number that has arrived in this block; 0 before the first.
    pub(super) fn highest(&self) -> u8 {
        let newest = self.newest.as_ref().map_or(0, |segment| segment.sequence.get());
        (self.next - 1).max(if self.has_begun { newest } else { 0 })
    }

    /// The sequence number before the client's next segment. After an acknowledge within a block, it depends on whether the
    /// client has heard it.
    pub(super) fn last(&self, has_heard: bool) -> u8 {
        match self.highest() {
            // A whole block is followed by another one.
            0 if !has_heard && self.acknowledged < BlockSize::MAX.get() => self.acknowledged,
            highest => highest,
        }
    }

    /// Whether a block has begun and is not complete. If its last segment is lost, only a time-out can end the block.
    pub(super) fn is_within_block(&self) -> bool {
        self.expects_segments() && self.has_begun
    }

    /// Takes a frame that is the next segment of a block, if the buffer has room for a whole segment. Most frames of a
    /// transfer take this fast path; the first and the last segment of a block do not. Returns whether the frame was
    /// taken.
    #[inline]
    pub(super) fn take_next(&mut self, frame: &[u8; 8], buffer: &mut [u8; BUFFER]) -> bool {
        let [sequence, data @ ..] = frame;
        let is_taken = *sequence == self.next && self.sink.append_direct(data, buffer);
        if is_taken {
            self.next += 1;
        }
        is_taken
    }

    /// Takes a segment. Returns `true` at the end of a block. The client sends segments after a gap again.
    pub(super) fn take(
        &mut self,
        segment: BlockSegment,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> bool {
        self.has_begun = true;
        let is_in_a_row = self.next_then == self.next;
        if self.newest.replace(segment) == Some(segment) && is_in_a_row {
            return false;
        }
        let is_end = segment.last || segment.sequence == BlockSize::MAX;
        if self.verdict.is_ok() {
            self.verdict = self.store(segment, is_end, buffer, objects);
            // `take_next` may take the following segments, except for the last segment of the block.
            let direct =
                if self.verdict.is_ok() { BlockSize::MAX.get().saturating_sub(self.next) } else { 0 };
            self.sink.allow_direct(direct.into());
        }
        self.next_then = self.next;
        is_end
    }

    /// Stores the data of a segment.
    fn store(
        &mut self,
        segment: BlockSegment,
        is_end: bool,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<(), Abort> {
        if segment.sequence.get() == self.next {
            self.next += 1;
            self.is_complete = segment.last;
            if !segment.last {
                self.sink.append(&segment.data, buffer, objects)?;
            }
        }
        if is_end { self.sink.hand_over(buffer, objects) } else { Ok(()) }
    }

    /// Begins the next block. Returns the sequence number to acknowledge, or the error of a segment of this block.
    pub(super) fn acknowledge(&mut self) -> Result<u8, Abort> {
        self.verdict?;
        self.acknowledged = self.next - 1;
        self.has_begun = false;
        self.next_then = 1;
        self.sink.allow_direct(0);
        self.next = 1;
        Ok(self.acknowledged)
    }

    /// Completes the transfer.
    pub(super) fn end(
        &mut self,
        end: BlockEnd,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
        now: Tick,
    ) -> Result<(), Abort> {
        if let Some(BlockSegment { data: last, .. }) = self.newest.as_ref().filter(|_| self.is_complete) {
            let data = last.get(..7 - usize::from(end.unused.min(7))).unwrap_or(last);
            self.sink.append(data, buffer, objects)?;
        }
        if self.check_crc && self.sink.crc(buffer) != end.crc {
            return Err(Abort::Crc);
        }
        self.sink.complete(buffer, objects, now)
    }
}
