//! Block upload (CiA 301, 7.2.4.3.13 to 15): up to 127 segments before the client answers.

use canopen::Duration;
use canopen::sdo::{BlockEnd, BlockSegment, BlockSize, Multiplexer, Request, Response};

use super::channel::Channel;
use super::segmented::{self, Begin, begin, complete};
use super::{AbortCode, CRC, Cause, LARGEST};

/// A pause within a block means that its last segment was lost. Shorter than what servers grant the client.
const PAUSE: Duration = Duration::from_millis(250);
/// So many blocks in a row of which nothing arrives, and the transfer has failed.
const FUTILE: usize = 3;

/// How a server takes a block upload.
enum Offer {
    Blocks {
        crc: bool,
        size: Option<u32>,
    },
    /// It has chosen a simpler transfer.
    Other(Begin),
}

/// Reads a value of any length.
pub(super) fn upload(channel: &mut Channel, at: Multiplexer) -> Result<Vec<u8>, Cause> {
    let block_size = BlockSize::MAX.get();
    let initiate = Request::BlockUpload { at, crc: true, block_size, threshold: 0 };
    let offer = channel.ask(initiate, |response| match response {
        Response::BlockUpload { at: of, crc, size } if of == at => Some(Offer::Blocks { crc, size }),
        other => begin(at, other).map(Offer::Other),
    })?;
    match offer {
        Offer::Other(Begin::Complete(value)) => Ok(value),
        Offer::Other(Begin::Segments(size)) => segmented::upload_segments(channel, size),
        Offer::Blocks { crc, size } => {
            let (value, end) = receive_blocks(channel)?;
            if crc && CRC.checksum(&value) != end.crc {
                return Err(Cause::Crc);
            }
            let value = complete(value, size)?;
            channel.send(Request::BlockUploadEnded.encode())?;
            Ok(value)
        }
    }
}

fn receive_blocks(channel: &mut Channel) -> Result<(Vec<u8>, BlockEnd), Cause> {
    channel.send(Request::BlockUploadStart.encode())?;
    let (mut value, mut futile) = (Vec::new(), 0);
    loop {
        let Block { sequence, is_last } = receive_block(channel, &mut value)?;
        futile = if sequence == 0 { futile + 1 } else { 0 };
        if futile == FUTILE {
            return Err(Cause::NoAnswer);
        }
        if value.len() > LARGEST {
            return Err(Cause::Unexpected);
        }
        let acknowledge = Request::BlockAcknowledge { sequence, block_size: BlockSize::MAX.get() };
        if is_last {
            let end = channel.ask(acknowledge, |response| match response {
                Response::BlockUploadEnd(end) => Some(end),
                _ => None,
            })?;
            value.truncate(value.len() - usize::from(end.unused));
            return Ok((value, end));
        }
        channel.send(acknowledge.encode())?;
    }
}

/// What has come of a block.
struct Block {
    /// Its last segment in sequence, 0 for none.
    sequence: u8,
    /// That was the last of the transfer.
    is_last: bool,
}

/// Appends the segments of a block to `value`, up to the first gap.
fn receive_block(channel: &mut Channel, value: &mut Vec<u8>) -> Result<Block, Cause> {
    let mut block = Block { sequence: 0, is_last: false };
    // The first segment may take as long as any answer.
    let mut patience = channel.timeout();
    while let Some(frame) = channel.frame(patience)? {
        let Some(segment) = BlockSegment::parse(frame) else {
            refused(frame)?;
            continue;
        };
        patience = PAUSE.min(channel.timeout());
        if segment.sequence.get() == block.sequence + 1 {
            block = Block { sequence: segment.sequence.get(), is_last: segment.last };
            value.extend_from_slice(&segment.data);
        }
        if segment.last || segment.sequence == BlockSize::MAX {
            break;
        }
    }
    Ok(block)
}

/// A frame that is no segment: an abort, or nothing at all.
fn refused(frame: [u8; 8]) -> Result<(), Cause> {
    match Response::parse(frame) {
        Some(Response::Abort(_, code)) => Err(Cause::Abort(AbortCode(code))),
        _ => Ok(()),
    }
}
