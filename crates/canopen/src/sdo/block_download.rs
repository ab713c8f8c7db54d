//! Block download (CiA 301, 7.2.4.3.9 to 11): the client sends up to 127 segments before it waits for an answer.

use super::objects::{BUFFER, Sink};
use super::{Abort, BlockEnd, BlockSize, Objects};
use crate::Tick;

/// Bit of the first byte of a segment: no other follows.
const LAST: u8 = 0x80;

/// A block download under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    sink: Sink,
    check_crc: bool,
    /// Sequence number of the next segment.
    next: u8,
    /// The sequence number of the newest segment of this block that `take` has processed, in sequence or not; 0 before the
    /// first.
    newest: u8,
    /// The value of `next` after that segment. If `next` has advanced, `take_next` has taken other segments since then.
    next_then: u8,
    /// The sequence number of the last acknowledge.
    acknowledged: u8,
    /// Whether the last segment of the transfer has arrived. The end of the transfer tells how many of its bytes are data.
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
            newest: 0,
            next_then: 1,
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
        (self.next - 1).max(self.newest)
    }

    /// The sequence number before the client's next segment. After an acknowledge within a block, it depends on whether the
    /// client has heard it.
    pub(super) fn last(&self, has_heard: bool) -> u8 {
        match self.highest() {
            0 if !has_heard => self.acknowledged,
            highest => highest,
        }
    }

    /// Whether a block has begun and is not complete. If its last segment is lost, only a time-out can end the block.
    pub(super) fn is_within_block(&self) -> bool {
        self.expects_segments() && self.newest != 0
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

    /// Takes a segment. `is_repeated`: the frame is the same as the one before. Such a segment counts once. Returns `true` at
    /// the end of a block. The client sends segments after a gap again.
    pub(super) fn take(
        &mut self,
        frame: &[u8; 8],
        is_repeated: bool,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> bool {
        self.newest = frame[0] & !LAST;
        if is_repeated && self.next_then == self.next {
            return false;
        }
        let is_end = frame[0] & LAST != 0 || self.newest == BlockSize::MAX.get();
        if self.verdict.is_ok() {
            self.verdict = self.store(frame, is_end, buffer, objects);
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
        frame: &[u8; 8],
        is_end: bool,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<(), Abort> {
        let [first, data @ ..] = frame;
        if first & !LAST == self.next {
            self.next += 1;
            self.is_complete = first & LAST != 0;
            if !self.is_complete {
                self.sink.append(data, buffer, objects)?;
            }
        }
        if is_end { self.sink.hand_over(buffer, objects) } else { Ok(()) }
    }

    /// Begins the next block. Returns the sequence number to acknowledge, or the error of a segment of this block.
    pub(super) fn acknowledge(&mut self) -> Result<u8, Abort> {
        self.verdict?;
        self.acknowledged = self.next - 1;
        self.newest = 0;
        self.next_then = 1;
        self.sink.forbid_direct();
        self.next = 1;
        Ok(self.acknowledged)
    }

    /// Completes the transfer. `last` is the frame of the last segment.
    pub(super) fn end(
        &mut self,
        end: BlockEnd,
        last: &[u8; 8],
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
        now: Tick,
    ) -> Result<(), Abort> {
        if self.is_complete {
            let data = last.get(1..8 - usize::from(end.unused)).unwrap_or_default();
            self.sink.append(data, buffer, objects)?;
        }
        if self.check_crc && self.sink.crc(buffer) != end.crc {
            return Err(Abort::Crc);
        }
        self.sink.complete(buffer, objects, now)
    }
}
