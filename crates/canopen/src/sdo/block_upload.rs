//! Block upload (CiA 301, 7.2.4.3.13 to 15): the server sends up to 127 segments before it waits for an answer.

use super::objects::{BUFFER, Source};
use super::{Abort, BlockEnd, BlockSegment, BlockSize, Objects, crc};

/// A block upload under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sender {
    source: Source,
    block_size: BlockSize,
    phase: Phase,
    /// Bytes that the client has acknowledged: where this block begins.
    acknowledged: usize,
    /// Segments of this block that are sent.
    sequence: u8,
    /// CRC of the first `checked` bytes. Segments sent again are not counted again.
    crc: u16,
    checked: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The client has not asked for the first block.
    Ready,
    /// Segments of a block go out.
    Sending,
    /// A block is out, or all of them are and the end is.
    Waiting,
    Ended,
}

impl Sender {
    pub(super) fn new(source: Source, block_size: BlockSize) -> Sender {
        Sender { source, block_size, phase: Phase::Ready, acknowledged: 0, sequence: 0, crc: 0, checked: 0 }
    }

    /// Whether a segment can be sent now.
    pub(super) fn is_sending(&self) -> bool {
        self.phase == Phase::Sending
    }

    /// The client is ready for the first block. It may say so twice.
    pub(super) fn start(&mut self, is_repeated: bool) -> Result<(), Abort> {
        match self.phase {
            Phase::Ready => self.phase = Phase::Sending,
            _ if is_repeated => (),
            _ => return Err(Abort::Command),
        }
        Ok(())
    }

    /// The bytes before a segment of this block.
    fn offset(&self, sequence: u8) -> usize {
        self.acknowledged + usize::from(sequence) * 7
    }

    /// The next segment of the block. To be followed by [`sent`](Sender::sent) once the queue has it.
    pub(super) fn segment(
        &self,
        buffer: &[u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<BlockSegment, Abort> {
        let offset = self.offset(self.sequence);
        let data = self.source.piece(offset, buffer, objects)?;
        let sequence = BlockSize::new(self.sequence + 1).ok_or(Abort::Sequence)?;
        Ok(BlockSegment { last: offset + 7 >= self.source.len(), sequence, data: data.padded() })
    }

    /// The segment is on its way.
    pub(super) fn sent(&mut self, segment: &BlockSegment) {
        let offset = self.offset(self.sequence);
        if offset == self.checked {
            let len = (self.source.len() - offset.min(self.source.len())).min(7);
            self.crc = crc::extend(self.crc, segment.data.get(..len).unwrap_or(&segment.data));
            self.checked += len;
        }
        self.sequence = segment.sequence.get();
        if segment.last || segment.sequence == self.block_size {
            self.phase = Phase::Waiting;
        }
    }

    /// The client has the block up to a segment and states the size of the next. The end, when it has everything.
    ///
    /// One that comes while the block is still going out, or that has more than the block, is the last one repeated. The
    /// last one of all is answered again.
    pub(super) fn acknowledge(
        &mut self,
        sequence: u8,
        block_size: u8,
        is_repeated: bool,
    ) -> Result<Option<BlockEnd>, Abort> {
        match self.phase {
            Phase::Sending => return Ok(None),
            Phase::Waiting if sequence > self.sequence && is_repeated => return Ok(None),
            Phase::Waiting if sequence > self.sequence => return Err(Abort::Sequence),
            Phase::Waiting => (),
            Phase::Ended if is_repeated => return Ok(Some(self.end())),
            Phase::Ready | Phase::Ended => return Err(Abort::Command),
        }
        self.block_size = BlockSize::new(block_size).ok_or(Abort::BlockSize)?;
        self.acknowledged = self.offset(sequence);
        self.sequence = 0;
        let is_all = self.acknowledged >= self.source.len();
        self.phase = if is_all { Phase::Ended } else { Phase::Sending };
        Ok(is_all.then(|| self.end()))
    }

    fn end(&self) -> BlockEnd {
        BlockEnd::of(self.source.len(), self.crc)
    }

    /// The client confirms the end.
    pub(super) fn ended(&self) -> Result<(), Abort> {
        if self.phase == Phase::Ended { Ok(()) } else { Err(Abort::Command) }
    }
}
