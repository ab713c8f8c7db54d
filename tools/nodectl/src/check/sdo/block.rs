//! Checks of block transfers, which are optional.

use canopen::sdo::{BlockEnd, BlockSegment, BlockSize, Request, Response};
use crc::{CRC_16_XMODEM, Crc};

use super::super::prelude::*;
use crate::object::at;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "SDO-60",
        "1000h is uploaded in a block without CRC",
        "CiA 301, 7.2.4.3.12",
        upload_plain::<0x1000>,
    ),
    Check::new(
        "SDO-61",
        "A long entry is uploaded in blocks without CRC",
        "CiA 301, 7.2.4.3.12",
        upload_plain::<0x1008>,
    ),
    Check::new("SDO-62", "A long entry is uploaded in blocks with CRC", "CiA 301, 7.2.4.3.16", upload_crc),
    Check::new("SDO-63", "1017h takes a block without CRC", "CiA 301, 7.2.4.3.8", download_plain::<0x1017>),
    Check::new("SDO-64", "1017h takes a block with CRC", "CiA 301, 7.2.4.3.16", download_crc::<0x1017>),
    Check::new("SDO-65", "100Ch takes a block without CRC", "CiA 301, 7.2.4.3.8", download_plain::<0x100C>),
    Check::new("SDO-66", "100Ch takes a block with CRC", "CiA 301, 7.2.4.3.16", download_crc::<0x100C>),
    Check::new("SDO-67", "A wrong CRC is refused", "CiA 301, table 22", wrong_crc),
    Check::new("SDO-68", "Block size 0 is refused", "CiA 301, table 22", block_size::<0>),
    Check::new("SDO-69", "Block size 128 is refused", "CiA 301, table 22", block_size::<128>),
    Check::new("SDO-70", "Sequence number 128 in an acknowledge is refused", "CiA 301, table 22", sequence),
    Check::new("SDO-71", "Blocks of one segment are served", "CiA 301, 7.2.4.3.13", single_segments),
    Check::new("SDO-72", "A lost segment of a download is told", "CiA 301, 7.2.4.3.10", lost_segment),
    Check::new("SDO-73", "A lost segment of an upload is sent again", "CiA 301, 7.2.4.3.14", repeated),
    Check::new("SDO-74", "The server's block size is 1 to 127", "CiA 301, 7.2.4.3.9", server_block_size),
    Check::new("SDO-75", "Blocks and segments give the same data", "CiA 301, 7.2.4.3.12", same_data),
    Check::new("SDO-76", "An abort of the client ends a block upload", "CiA 301, 7.2.4.3.17", aborted),
    Check::new("SDO-77", "A block download to 1000h is refused", "CiA 301, table 22", read_only),
    Check::new("SDO-78", "A block upload of an absent object is refused", "CiA 301, table 22", absent),
];

/// The data of a block upload, and the CRC if the device has sent one.
struct Uploaded {
    bytes: Vec<u8>,
    crc: Option<u16>,
}

/// Begins a block upload. Returns whether its end will carry a CRC. Skipped where the device has no block transfers.
fn begin_upload(s: &mut Subject<'_>, index: u16, crc: bool, block_size: u8) -> Outcome<bool> {
    let request = Request::BlockUpload { at: at(index, 0), crc, block_size, threshold: 0 };
    match s.respond(request)? {
        Response::BlockUpload { crc, .. } => Ok(crc),
        Response::Abort(_, abort::COMMAND) => Err(skip("the device has no block transfers")),
        Response::Abort(_, abort::NO_OBJECT) => Err(skip(format!("the device has no {index:04X}h"))),
        other => Err(fail("the response to the initiation of a block upload", format!("{other:X?}"))),
    }
}

/// The next segments, up to the last segment of the transfer or to `most` segments. Fails if too few come.
fn segments(s: &mut Subject<'_>, request: Request, most: u8) -> Outcome<Vec<BlockSegment>> {
    let (mark, id) = (s.mark(), 0x580 + s.id());
    s.send(0x600 + s.id(), &request.encode())?;
    for _ in 0..50 {
        s.pass(10)?;
        let came = s.heard(mark, id);
        let parsed = came.iter().filter_map(|heard| BlockSegment::parse(heard.frame.data().try_into().ok()?));
        let segments: Vec<BlockSegment> = parsed.collect();
        if segments.len() >= usize::from(most) || segments.last().is_some_and(|segment| segment.last) {
            return Ok(segments);
        }
    }
    Err(fail(format!("{most} segments, or fewer with the last"), "no more came in 500 ms"))
}

/// Uploads an object in blocks of this size. With `loses_one`, the first acknowledge leaves out the last segment of its
/// block, as if that segment was lost.
fn upload(s: &mut Subject<'_>, index: u16, crc: bool, block_size: u8, loses_one: bool) -> Outcome<Uploaded> {
    let crc = begin_upload(s, index, crc, block_size)?;
    let (mut bytes, mut request, mut loses) = (Vec::new(), Request::BlockUploadStart, loses_one);
    loop {
        let block = segments(s, request, block_size)?;
        let lost = usize::from(std::mem::take(&mut loses) && block.len() > 1);
        let kept = &block[..block.len() - lost];
        bytes.extend(kept.iter().flat_map(|segment| segment.data));
        let in_order = block.iter().zip(1..).all(|(segment, number)| segment.sequence.get() == number);
        ensure(in_order, "segments numbered from 1", format!("{block:?}"))?;
        let most = format!("at most {block_size} segments in a block");
        ensure(block.len() <= usize::from(block_size), most, format!("{}", block.len()))?;
        let sequence = u8::try_from(kept.len()).unwrap_or(127);
        request = Request::BlockAcknowledge { sequence, block_size };
        if kept.last().is_some_and(|segment| segment.last) {
            break;
        }
        ensure(bytes.len() < 100_000, "an end", "none after 100000 bytes")?;
    }
    match s.respond(request)? {
        Response::BlockUploadEnd(end) => {
            bytes.truncate(bytes.len() - usize::from(end.unused));
            let ended = Request::BlockUploadEnded.encode();
            s.send(0x600 + s.id(), &ended)?;
            s.pass(10)?;
            Ok(Uploaded { bytes, crc: crc.then_some(end.crc) })
        }
        other => Err(fail("the end of the block upload", format!("{other:X?}"))),
    }
}

fn upload_plain<const INDEX: u16>(s: &mut Subject<'_>) -> Outcome {
    let uploaded = upload(s, INDEX, false, 127, false)?.bytes;
    let expected = s.read(INDEX, 0)?;
    ensure(uploaded == expected, format!("{expected:02X?}"), format!("{uploaded:02X?}"))
}

fn crc(bytes: &[u8]) -> u16 {
    Crc::<u16>::new(&CRC_16_XMODEM).checksum(bytes)
}

fn upload_crc(s: &mut Subject<'_>) -> Outcome {
    let uploaded = upload(s, 0x1008, true, 127, false)?;
    let sent = uploaded.crc.ok_or_else(|| skip("the device has no CRC"))?;
    let expected = crc(&uploaded.bytes);
    ensure(sent == expected, format!("the CRC {expected:04X}h"), format!("{sent:04X}h"))
}

/// Begins a block download of two bytes. Returns the block size of the server.
fn begin_download(s: &mut Subject<'_>, index: u16, crc: bool) -> Outcome<BlockSize> {
    s.need_writable(index, 0)?;
    let value = s.read(index, 0)?;
    s.write(index, 0, &value)?;
    match s.respond(Request::BlockDownload { at: at(index, 0), crc, size: Some(2) })? {
        Response::BlockDownload(_, size) => Ok(size),
        Response::Abort(_, abort::COMMAND) => Err(skip("the device has no block transfers")),
        other => Err(fail("the response to the initiation of a block download", format!("{other:X?}"))),
    }
}

/// The only segment of a block download.
fn only_segment(sequence: u8, value: [u8; 2]) -> [u8; 8] {
    [0x80 | sequence, value[0], value[1], 0, 0, 0, 0, 0]
}

fn download(s: &mut Subject<'_>, index: u16, has_crc: bool, value: [u8; 2], check: u16) -> Outcome<Response> {
    begin_download(s, index, has_crc)?;
    let acknowledge = s.answer(only_segment(1, value))?;
    ensure(acknowledge[..2] == [0xA2, 1], "the acknowledge of segment 1", format!("{acknowledge:02X?}"))?;
    s.respond(Request::BlockDownloadEnd(BlockEnd::of(2, check)))
}

fn download_plain<const INDEX: u16>(s: &mut Subject<'_>) -> Outcome {
    let ended = download(s, INDEX, false, [0x10, 0x27], 0)?;
    ensure(ended == Response::BlockDownloaded, "the end of the block download", format!("{ended:X?}"))?;
    s.holds(INDEX, 0, 10_000)
}

fn download_crc<const INDEX: u16>(s: &mut Subject<'_>) -> Outcome {
    let ended = download(s, INDEX, true, [0x10, 0x27], crc(&[0x10, 0x27]))?;
    ensure(ended == Response::BlockDownloaded, "the end of the block download", format!("{ended:X?}"))?;
    s.holds(INDEX, 0, 10_000)
}

fn wrong_crc(s: &mut Subject<'_>) -> Outcome {
    begin_download(s, 0x1017, true)?;
    let has_crc = s.newest(0x580 + s.id()).is_some_and(|frame| frame.frame.data()[0] & 4 != 0);
    s.give_up(0x1017, 0)?;
    if !has_crc {
        return Err(skip("the device has no CRC"));
    }
    match download(s, 0x1017, true, [0x10, 0x27], !crc(&[0x10, 0x27]))? {
        Response::Abort(_, abort::CRC) => Ok(()),
        other => Err(fail("abort 0504 0004h", format!("{other:X?}"))),
    }
}

fn block_size<const SIZE: u8>(s: &mut Subject<'_>) -> Outcome {
    begin_upload(s, 0x1000, false, 127)?;
    s.give_up(0x1000, 0)?;
    let request = Request::BlockUpload { at: at(0x1000, 0), crc: false, block_size: SIZE, threshold: 0 };
    s.aborts(request.encode(), &[abort::BLOCK_SIZE])
}

fn sequence(s: &mut Subject<'_>) -> Outcome {
    begin_upload(s, 0x1000, false, 127)?;
    segments(s, Request::BlockUploadStart, 127)?;
    let request = Request::BlockAcknowledge { sequence: 128, block_size: 127 };
    s.aborts(request.encode(), &[abort::SEQUENCE, abort::BLOCK_SIZE, abort::COMMAND])
}

fn single_segments(s: &mut Subject<'_>) -> Outcome {
    let uploaded = upload(s, 0x1008, false, 1, false)?.bytes;
    let expected = s.read(0x1008, 0)?;
    ensure(uploaded == expected, format!("{expected:02X?}"), format!("{uploaded:02X?}"))
}

fn lost_segment(s: &mut Subject<'_>) -> Outcome {
    begin_download(s, 0x1017, false)?;
    // Segment 1 is left out.
    let acknowledge = s.ask(only_segment(2, [0x10, 0x27]))?;
    s.give_up(0x1017, 0)?;
    let acknowledge = acknowledge.ok_or_else(|| fail("an acknowledge", "none"))?;
    ensure(acknowledge[..2] == [0xA2, 0], "the acknowledge of no segment", format!("{acknowledge:02X?}"))
}

fn repeated(s: &mut Subject<'_>) -> Outcome {
    let uploaded = upload(s, 0x1008, false, 127, true)?.bytes;
    let expected = s.read(0x1008, 0)?;
    ensure(uploaded == expected, format!("{expected:02X?}"), format!("{uploaded:02X?}"))
}

fn server_block_size(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    let request = Request::BlockDownload { at: at(0x1017, 0), crc: false, size: Some(2) };
    let answer = s.answer(request.encode())?;
    s.give_up(0x1017, 0)?;
    if answer[0] == 0x80 {
        return Err(skip("the device has no block transfers"));
    }
    ensure((1..=127).contains(&answer[4]), "1 to 127 in byte 4", format!("{answer:02X?}"))
}

fn same_data(s: &mut Subject<'_>) -> Outcome {
    begin_upload(s, 0x1008, false, 127)?;
    s.give_up(0x1008, 0)?;
    let in_blocks = s.try_block_read(0x1008, 0)?.map_err(|refusal| fail("a block upload", refusal))?;
    let in_segments = s.read(0x1008, 0)?;
    ensure(in_blocks == in_segments, format!("{in_segments:02X?}"), format!("{in_blocks:02X?}"))
}

fn aborted(s: &mut Subject<'_>) -> Outcome {
    begin_upload(s, 0x1008, false, 127)?;
    s.give_up(0x1008, 0)?;
    let (mark, id) = (s.mark(), 0x580 + s.id());
    let start = Request::BlockUploadStart.encode();
    s.send(0x600 + s.id(), &start)?;
    s.pass(300)?;
    let segments = s.heard(mark, id).iter().filter(|heard| heard.frame.data()[0] != 0x80).count();
    ensure(segments == 0, "no segment after the abort", format!("{segments}"))
}

fn read_only(s: &mut Subject<'_>) -> Outcome {
    begin_upload(s, 0x1000, false, 127)?;
    s.give_up(0x1000, 0)?;
    match s.try_block_write(0x1000, 0, &[1, 2, 3, 4])? {
        Err(Refusal(abort::READ_ONLY)) => Ok(()),
        other => Err(fail("abort 0601 0002h", format!("{other:X?}"))),
    }
}

fn absent(s: &mut Subject<'_>) -> Outcome {
    begin_upload(s, 0x1000, false, 127)?;
    s.give_up(0x1000, 0)?;
    match s.try_block_read(0x0FFF, 0)? {
        Err(Refusal(abort::NO_OBJECT)) => Ok(()),
        other => Err(fail("abort 0602 0000h", format!("{other:X?}"))),
    }
}
