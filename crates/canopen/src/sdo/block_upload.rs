//! Block upload (CiA 301, 7.2.4.3.13 to 15): the server sends up to 127 segments before it waits for an answer.

use super::objects::{BUFFER, Source};
use super::{Abort, BlockEnd, BlockSegment, BlockSize, Bytes, Objects, crc};

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

    /// Sends segments of the block as long as `send` takes them.
    pub(super) fn send(
        &mut self,
        buffer: &[u8; BUFFER],
        objects: &impl Objects,
        mut send: impl FnMut([u8; 8]) -> bool,
    ) -> Result<(), Abort> {
        let content = self.source.content(buffer, objects)?;
        let mut rest = content.get(self.offset(self.sequence)..).unwrap_or(&[]);
        while self.is_sending() {
            let (data, after) = next_segment(rest);
            let last = after.is_empty();
            let sequence = BlockSize::new(self.sequence + 1).ok_or(Abort::Sequence)?;
            if !send(BlockSegment { last, sequence, data }.encode()) {
                break;
            }
            self.sequence = sequence.get();
            if last || sequence == self.block_size {
                self.phase = Phase::Waiting;
            }
            rest = after;
        }
        self.check(content);
        Ok(())
    }

    /// Takes what has been sent into the CRC.
    fn check(&mut self, content: &[u8]) {
        let sent = self.offset(self.sequence).min(content.len());
        if let Some(new) = content.get(self.checked..sent) {
            self.crc = crc::extend(self.crc, new);
            self.checked = sent;
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

/// Seven bytes, the last of all filled with zeros, and what follows them.
fn next_segment(content: &[u8]) -> ([u8; 7], &[u8]) {
    match content.split_first_chunk() {
        Some((data, rest)) => (*data, rest),
        None => (Bytes::from_slice(content).padded(), &[]),
    }
}
