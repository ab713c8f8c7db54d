//! Block download (CiA 301, 7.2.4.3.9 to 11): up to 127 segments before the server answers.

use super::link::{Channel, Link};
use super::transfer::{self, Progress, Transfer};
use super::{BlockDownload, Error, Options};
use crate::client::service::later;
use crate::sdo::{BlockEnd, BlockSegment, BlockSize, Bytes, Multiplexer, Request, Response, crc};
use crate::{Duration, Instant};

/// The transfer fails after this many blocks in a row without a segment that the server acknowledged.
const MAX_EMPTY_BLOCKS: u8 = 3;
/// A server that hears no segment for a while may acknowledge a part of the block. Servers wait longer than this time, so an
/// acknowledge that comes earlier is the one of the last segment.
const SHORTEST_PAUSE: Duration = Duration::from_millis(250);

/// A block download under way.
#[derive(Debug)]
pub struct Protocol<'a> {
    data: &'a [u8],
    /// Bytes that the server has acknowledged: the present block begins here.
    done: usize,
    phase: Phase,
    /// Blocks in a row of which the server acknowledged no segment.
    empty_blocks: u8,
}

#[derive(Clone, Copy, Debug)]
enum Phase {
    /// The server has not yet announced the size of a block.
    Begin,
    Block(Block),
    /// The server has acknowledged all data, but has not yet confirmed the CRC.
    End,
}

#[derive(Clone, Copy, Debug)]
struct Block {
    size: BlockSize,
    /// Segments of this block that have been sent.
    sent: u8,
    /// The time of the answer before the block.
    since: Instant,
    /// The last segments of the block before may still wait in the adapter, behind more urgent frames. The server
    /// discards them, and acknowledges none.
    has_rest: bool,
}

impl<'a> BlockDownload<'a> {
    /// Writes an object of a server. Empty data is sent as one segment without bytes.
    #[must_use]
    pub fn new(
        channel: impl Into<Channel>,
        at: Multiplexer,
        data: &'a [u8],
        options: Options,
    ) -> BlockDownload<'a> {
        Transfer::with(
            Protocol { data, done: 0, phase: Phase::Begin, empty_blocks: 0 },
            channel.into(),
            at,
            options,
        )
    }
}

impl Protocol<'_> {
    /// The data that follows the first `sent` segments of the block.
    fn rest(&self, sent: u8) -> &[u8] {
        let offset = self.done.saturating_add(7 * usize::from(sent));
        self.data.get(offset..).unwrap_or(&[])
    }

    /// The number of segments in the block: the remaining ones, up to the block size of the server.
    fn len(&self, size: BlockSize) -> u8 {
        let segments = self.rest(0).len().div_ceil(7).max(1);
        u8::try_from(segments).map_or(size.get(), |segments| segments.min(size.get()))
    }

    /// The server has the block up to this segment. The remaining segments are sent again in the next block.
    fn acknowledge(&mut self, sequence: u8, next: Block, link: &mut Link) -> Result<Progress, Error> {
        let is_all = 7 * usize::from(sequence) >= self.rest(0).len() && sequence > 0;
        self.done = self.done.saturating_add(7 * usize::from(sequence)).min(self.data.len());
        self.empty_blocks = if sequence == 0 { self.empty_blocks.saturating_add(1) } else { 0 };
        if self.empty_blocks == MAX_EMPTY_BLOCKS {
            return Err(Error::Unexpected);
        }
        if is_all {
            let end = BlockEnd::of(self.data.len(), crc::extend(0, self.data));
            self.phase = Phase::End;
            link.ask(Request::BlockDownloadEnd(end));
        } else {
            self.phase = Phase::Block(next);
        }
        Ok(Progress::Continues)
    }

    /// Takes the answer to a block, or to a part of it.
    fn on_acknowledge(
        &mut self,
        block: Block,
        sequence: u8,
        size: BlockSize,
        link: &mut Link,
        now: Instant,
    ) -> Result<Progress, Error> {
        let Block { sent, since, has_rest, .. } = block;
        let is_sent = sent == self.len(block.size);
        if sequence > sent || (sequence == 0 && !is_sent) {
            return Ok(Progress::Unexpected);
        }
        if sequence == 0 && has_rest {
            // This block follows the rest. To repeat it now would send it twice.
            link.expect_equal();
            link.wait_for_block(sent, now);
            return Ok(Progress::Continues);
        }
        let is_late = now >= later(since, SHORTEST_PAUSE);
        let has_rest = sequence > 0 && sequence < sent && is_late;
        self.acknowledge(sequence, Block { size, sent: 0, since: now, has_rest }, link)
    }
}

impl transfer::Protocol for Protocol<'_> {
    fn begin(&mut self, link: &mut Link) {
        (self.done, self.phase, self.empty_blocks) = (0, Phase::Begin, 0);
        let size = u32::try_from(self.data.len()).ok();
        link.begin(Request::BlockDownload { at: link.at, crc: true, size });
    }

    fn segment(&mut self, link: &mut Link) -> Option<BlockSegment> {
        let Phase::Block(Block { size, sent, .. }) = self.phase else { return None };
        let sequence = BlockSize::new(sent.saturating_add(1)).filter(|next| next.get() <= self.len(size))?;
        let rest = self.rest(sent);
        let segment =
            BlockSegment { last: rest.len() <= 7, sequence, data: Bytes::from_slice(rest).padded() };
        if let Phase::Block(block) = &mut self.phase {
            block.sent = sequence.get();
        }
        if sequence.get() == self.len(size) {
            // Acknowledgements of two blocks of the same size are equal.
            link.expect_equal();
        }
        Some(segment)
    }

    fn on_response(&mut self, data: [u8; 8], link: &mut Link, now: Instant) -> Result<Progress, Error> {
        match (self.phase, Response::parse(data)) {
            (Phase::Begin, Some(Response::BlockDownload(of, size))) if of == link.at => {
                self.phase = Phase::Block(Block { size, sent: 0, since: now, has_rest: false });
                Ok(Progress::Continues)
            }
            (Phase::Block(block), Some(Response::BlockAcknowledge(sequence, size))) => {
                self.on_acknowledge(block, sequence, size, link, now)
            }
            (Phase::End, Some(Response::BlockDownloaded)) => Ok(Progress::Complete),
            _ => Ok(Progress::Unexpected),
        }
    }

    fn transferred(&self) -> usize {
        self.done
    }
}
