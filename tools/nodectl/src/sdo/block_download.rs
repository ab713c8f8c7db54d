//! Block download (CiA 301, 7.2.4.3.9 to 11): up to 127 segments before the server answers.

use canopen::sdo::{BlockEnd, BlockSegment, BlockSize, Multiplexer, Request, Response};

use super::channel::Channel;
use super::{CRC, Cause};

/// So many blocks in a row of which nothing arrives, and the transfer has failed.
const FUTILE: usize = 3;

/// Writes a value of at least one byte. `progress` is told the bytes that have arrived.
pub(super) fn download(
    channel: &mut Channel,
    at: Multiplexer,
    value: &[u8],
    progress: &mut dyn FnMut(usize),
) -> Result<(), Cause> {
    let initiate = Request::BlockDownload { at, crc: true, size: u32::try_from(value.len()).ok() };
    let size = channel.ask(initiate, |response| match response {
        Response::BlockDownload(of, size) if of == at => Some(size),
        _ => None,
    })?;
    send_blocks(channel, initiate, value, size, progress)?;
    let end = BlockEnd::of(value.len(), CRC.checksum(value));
    channel.ask(Request::BlockDownloadEnd(end), |response| {
        matches!(response, Response::BlockDownloaded).then_some(())
    })
}

fn send_blocks(
    channel: &mut Channel,
    initiate: Request,
    value: &[u8],
    mut size: BlockSize,
    progress: &mut dyn FnMut(usize),
) -> Result<(), Cause> {
    let (mut done, mut futile) = (0, 0);
    while done < value.len() {
        let sent = send_block(channel, &value[done..], size)?;
        let (sequence, next) = channel.answer(initiate, |response| match response {
            Response::BlockAcknowledge(sequence, next) if sequence <= sent => Some((sequence, next)),
            _ => None,
        })?;
        // What is not acknowledged goes out again, in the next block.
        done += 7 * usize::from(sequence);
        size = next;
        futile = if sequence == 0 { futile + 1 } else { 0 };
        if futile == FUTILE {
            return Err(Cause::Unexpected);
        }
        progress(done.min(value.len()));
    }
    Ok(())
}

/// Sends the segments of one block; how many they are.
fn send_block(channel: &mut Channel, rest: &[u8], size: BlockSize) -> Result<u8, Cause> {
    let mut sent = 0;
    for (piece, sequence) in rest.chunks(7).zip((1..=size.get()).filter_map(BlockSize::new)) {
        let mut data = [0; 7];
        data[..piece.len()].copy_from_slice(piece);
        sent = sequence.get();
        let last = 7 * usize::from(sent) >= rest.len();
        channel.send(BlockSegment { last, sequence, data }.encode())?;
    }
    Ok(sent)
}
