//! Block upload (CiA 301, 7.2.4.3.13 to 15): the server sends up to 127 segments before it waits for an answer.

use super::objects::{BUFFER, Source};
use super::{Abort, BlockEnd, BlockSegment, BlockSize, Objects, crc};
use crate::copy::copy;

/// A block upload under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sender {
    source: Source,
    block_size: BlockSize,
    phase: Phase,
    /// Bytes that the client has acknowledged: the present block begins here.
    acknowledged: usize,
    /// Number of segments of this block that have been sent.
    sequence: u8,
    /// CRC of the first `checked` bytes. Segments that are sent again do not count again.
    crc: u16,
    checked: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The client has not asked for the first block.
    Ready,
    /// The segments of a block are being sent.
    Sending,
    /// The block has been sent, and waits for its acknowledgement.
    Waiting,
    Ended,
}

impl Sender {
    pub(super) fn new(source: Source, block_size: BlockSize) -> Sender {
        Sender { source, block_size, phase: Phase::Ready, acknowledged: 0, sequence: 0, crc: 0, checked: 0 }
    }

    pub(super) fn source(&self) -> &Source {
        &self.source
    }

    /// Whether segments of the block remain to be sent.
    pub(super) fn is_sending(&self) -> bool {
        self.phase == Phase::Sending
    }

    /// Starts the first block. The client may repeat this request.
    pub(super) fn start(&mut self, is_repeated: bool) -> Result<(), Abort> {
        match self.phase {
            Phase::Ready => self.phase = Phase::Sending,
            _ if is_repeated => (),
            _ => return Err(Abort::Command),
        }
        Ok(())
    }

    /// The offset of the data after the first `sequence` segments of this block.
    fn offset(&self, sequence: u8) -> usize {
        self.acknowledged + usize::from(sequence) * 7
    }

    /// Sends segments of the block as long as `send` accepts them.
    pub(super) fn send<O: Objects>(
        &mut self,
        buffer: &mut [u8; BUFFER],
        objects: &mut O,
        mut send: impl FnMut([u8; 8]) -> bool,
    ) -> Result<(), Abort> {
        if O::PARTS && self.source.is_in_parts() {
            return self.send_parts(buffer, objects, send);
        }
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

    /// As [`send`](Sender::send), for an upload in parts.
    fn send_parts(
        &mut self,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
        mut send: impl FnMut([u8; 8]) -> bool,
    ) -> Result<(), Abort> {
        while self.is_sending() {
            let offset = self.offset(self.sequence);
            let data = self.source.piece(offset, buffer, objects)?;
            let last = offset + usize::from(data.len()) >= self.source.len();
            let sequence = BlockSize::new(self.sequence + 1).ok_or(Abort::Sequence)?;
            if !send(BlockSegment { last, sequence, data: data.padded() }.encode()) {
                break;
            }
            self.sequence = sequence.get();
            if last || sequence == self.block_size {
                self.phase = Phase::Waiting;
            }
            // A segment that is sent again does not count again.
            if offset == self.checked {
                self.crc = crc::extend(self.crc, data.as_slice());
                self.checked += usize::from(data.len());
            }
        }
        Ok(())
    }

    /// Adds the sent data to the CRC.
    fn check(&mut self, content: &[u8]) {
        let sent = self.offset(self.sequence).min(content.len());
        if let Some(new) = content.get(self.checked..sent) {
            self.crc = crc::extend(self.crc, new);
            self.checked = sent;
        }
    }

    /// Takes the acknowledgement of a block up to a segment, with the size of the next block. Returns whether
    /// the client has all data, so that the end of the transfer follows.
    ///
    /// An acknowledgement that arrives while the block is still being sent, or that names a later segment, may be a
    /// repetition of the one before and is then ignored. A repetition of the final acknowledgement is answered again.
    pub(super) fn acknowledge(
        &mut self,
        sequence: u8,
        block_size: u8,
        is_repeated: bool,
    ) -> Result<bool, Abort> {
        match self.phase {
            Phase::Sending => return Ok(false),
            Phase::Waiting if sequence > self.sequence && is_repeated => return Ok(false),
            Phase::Waiting if sequence > self.sequence => return Err(Abort::Sequence),
            Phase::Waiting => (),
            Phase::Ended if is_repeated => return Ok(true),
            Phase::Ready | Phase::Ended => return Err(Abort::Command),
        }
        self.block_size = BlockSize::new(block_size).ok_or(Abort::BlockSize)?;
        self.acknowledged = self.offset(sequence);
        self.sequence = 0;
        let is_all = self.acknowledged >= self.source.len();
        self.phase = if is_all { Phase::Ended } else { Phase::Sending };
        Ok(is_all)
    }

    /// The end of the transfer.
    pub(super) fn end(&self) -> BlockEnd {
        BlockEnd::of(self.source.len(), self.crc)
    }

    /// Checks that the client may confirm the end now.
    pub(super) fn ended(&self) -> Result<(), Abort> {
        if self.phase == Phase::Ended { Ok(()) } else { Err(Abort::Command) }
    }
}

/// The next seven bytes, zeros after the last one, and the rest of the content.
fn next_segment(content: &[u8]) -> ([u8; 7], &[u8]) {
    if let Some((data, rest)) = content.split_first_chunk() {
        return (*data, rest);
    }
    let mut data = [0; 7];
    copy(&mut data, content);
    (data, &[])
}
