//! Checks of segmented transfers.

use canopen::sdo::{Bytes, Initiate, Request, Response, Segment};

use super::super::prelude::*;
use crate::object::at;

pub(super) const CHECKS: &[Check] = &[
    Check::new("SDO-30", "1017h takes a download in segments", "CiA 301, 7.2.4.3.4", download::<0x1017>),
    Check::new("SDO-31", "100Ch takes a download in segments", "CiA 301, 7.2.4.3.4", download::<0x100C>),
    Check::new("SDO-32", "A download in segments needs no announced size", "CiA 301, 7.2.4.3.3", unannounced),
    Check::new("SDO-33", "A long entry is uploaded in segments", "CiA 301, 7.2.4.3.7", upload),
    Check::new("SDO-34", "The upload gives the same data every time", "CiA 301, 7.2.4.3.7", same),
    Check::new("SDO-35", "The announced size is what comes", "CiA 301, 7.2.4.3.6", announced),
    Check::new("SDO-36", "Toggle bits of an upload alternate from 0", "CiA 301, 7.2.4.3.7", toggles),
    Check::new("SDO-37", "All segments but the last are full", "CiA 301, 7.2.4.3.7", full).recommended(),
    Check::new("SDO-38", "A wrong toggle bit ends an upload", "CiA 301, table 22", upload_toggle),
    Check::new("SDO-39", "A wrong toggle bit ends a download", "CiA 301, table 22", download_toggle),
    Check::new(
        "SDO-40",
        "A segment that nobody asked for is refused: upload",
        "CiA 301, table 22",
        lone_upload_segment,
    ),
    Check::new(
        "SDO-41",
        "A segment that nobody asked for is refused: download",
        "CiA 301, table 22",
        lone_download_segment,
    ),
    Check::new("SDO-42", "Too many bytes in segments are refused", "CiA 301, table 22", too_long),
    Check::new("SDO-43", "Too few bytes in segments are refused", "CiA 301, table 22", too_short),
    Check::new("SDO-44", "An abort of the client ends an upload", "CiA 301, 7.2.4.3.17", aborted_upload),
    Check::new(
        "SDO-45",
        "A download that is given up changes nothing",
        "CiA 301, 7.2.4.3.17",
        aborted_download,
    ),
    Check::new("SDO-46", "A new transfer may begin in the middle of one", "CiA 301, 7.2.4.2", begun_again)
        .recommended(),
    Check::new(
        "SDO-47",
        "A download in segments to 1000h is refused: read-only",
        "CiA 301, table 22",
        read_only,
    ),
];

/// An object with a long value: the name or a version of the device.
fn long(s: &mut Subject<'_>) -> Outcome<u16> {
    for index in [0x1008, 0x100A, 0x1009] {
        if let Response::UploadSegmented(..) = s.respond(Request::Upload(at(index, 0)))? {
            s.give_up(index, 0)?;
            return Ok(index);
        }
    }
    Err(skip("1008h, 1009h and 100Ah are absent or short"))
}

fn download<const INDEX: u16>(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(INDEX, 0)?;
    let taken = s.segmented(INDEX, 0, &[0x10, 0x27], true)?;
    taken.map_err(|refusal| fail("the download is taken", refusal))?;
    s.holds(INDEX, 0, 10_000)
}

fn unannounced(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    let taken = s.segmented(0x1017, 0, &[0x10, 0x27], false)?;
    taken.map_err(|refusal| fail("the download is taken", refusal))?;
    s.holds(0x1017, 0, 10_000)
}

fn bytes(segments: &[Segment]) -> Vec<u8> {
    segments.iter().flat_map(|segment| segment.data.as_slice().to_vec()).collect()
}

fn whole(s: &mut Subject<'_>) -> Outcome<(Option<u32>, Vec<Segment>)> {
    let index = long(s)?;
    let size = s.begin_segmented_upload(index, 0)?;
    Ok((size, s.segments()?))
}

fn upload(s: &mut Subject<'_>) -> Outcome {
    let (_, segments) = whole(s)?;
    ensure(bytes(&segments).len() > 4, "more than four bytes", format!("{segments:?}"))
}

fn same(s: &mut Subject<'_>) -> Outcome {
    let first = bytes(&whole(s)?.1);
    for _ in 0..4 {
        let again = bytes(&whole(s)?.1);
        ensure(again == first, format!("{first:02X?} again"), format!("{again:02X?}"))?;
    }
    Ok(())
}

fn announced(s: &mut Subject<'_>) -> Outcome {
    let (size, segments) = whole(s)?;
    let size = size.ok_or_else(|| skip("the device announces no size"))?;
    let came = bytes(&segments).len();
    ensure(usize::try_from(size) == Ok(came), format!("{size} bytes, as announced"), format!("{came}"))
}

fn toggles(s: &mut Subject<'_>) -> Outcome {
    let (_, segments) = whole(s)?;
    let alternate = segments.iter().enumerate().all(|(number, segment)| segment.toggle == (number % 2 == 1));
    ensure(alternate, "0, 1, 0 and so on", format!("{segments:?}"))
}

fn full(s: &mut Subject<'_>) -> Outcome {
    let (_, segments) = whole(s)?;
    let full = segments.iter().filter(|segment| !segment.last).all(|segment| segment.data.len() == 7);
    ensure(full, "seven bytes in each", format!("{segments:?}"))
}

fn upload_toggle(s: &mut Subject<'_>) -> Outcome {
    let index = long(s)?;
    s.begin_segmented_upload(index, 0)?;
    s.aborts(Request::UploadSegment { toggle: true }.encode(), &[abort::TOGGLE])
}

/// A segment of a download.
fn segment(toggle: bool, last: bool, data: &[u8]) -> [u8; 8] {
    Request::DownloadSegment(Segment { toggle, last, data: Bytes::from_slice(data) }).encode()
}

fn begin_download(s: &mut Subject<'_>, size: u32) -> Outcome {
    s.need_writable(0x1017, 0)?;
    match s.respond(Request::Download(at(0x1017, 0), Initiate::Segmented(Some(size))))? {
        Response::Downloaded(_) => Ok(()),
        other => Err(fail("the response to the initiation of a download", format!("{other:X?}"))),
    }
}

fn download_toggle(s: &mut Subject<'_>) -> Outcome {
    begin_download(s, 2)?;
    s.aborts(segment(true, true, &[0xE8, 3]), &[abort::TOGGLE])
}

fn lone_upload_segment(s: &mut Subject<'_>) -> Outcome {
    s.give_up(0x1000, 0)?;
    s.aborts(Request::UploadSegment { toggle: false }.encode(), &[abort::COMMAND])
}

fn lone_download_segment(s: &mut Subject<'_>) -> Outcome {
    s.give_up(0x1000, 0)?;
    s.aborts(segment(false, true, &[1, 2]), &[abort::COMMAND])
}

fn too_long(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    match s.segmented(0x1017, 0, &[1, 2, 3, 4, 5], true)? {
        Err(Refusal(abort::TOO_LONG | abort::LENGTH)) => Ok(()),
        other => Err(fail("abort 0607 0012h or 0607 0010h for five bytes", format!("{other:X?}"))),
    }
}

fn too_short(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    match s.segmented(0x1017, 0, &[1], true)? {
        Err(Refusal(abort::TOO_SHORT | abort::LENGTH)) => Ok(()),
        other => Err(fail("abort 0607 0013h or 0607 0010h for one byte", format!("{other:X?}"))),
    }
}

fn aborted_upload(s: &mut Subject<'_>) -> Outcome {
    let index = long(s)?;
    s.begin_segmented_upload(index, 0)?;
    s.give_up(index, 0)?;
    s.aborts(Request::UploadSegment { toggle: false }.encode(), &[abort::COMMAND])
}

fn aborted_download(s: &mut Subject<'_>) -> Outcome {
    s.need_writable(0x1017, 0)?;
    let before = s.number(0x1017, 0)?;
    s.set(0x1017, 0, before)?;
    begin_download(s, 2)?;
    s.give_up(0x1017, 0)?;
    s.holds(0x1017, 0, before)
}

fn begun_again(s: &mut Subject<'_>) -> Outcome {
    let index = long(s)?;
    s.begin_segmented_upload(index, 0)?;
    let answer = s.answer(Request::Upload(at(0x1000, 0)).encode())?;
    ensure(answer[0] >> 5 == 2, "the new transfer is served", format!("{answer:02X?}"))
}

fn read_only(s: &mut Subject<'_>) -> Outcome {
    match s.segmented(0x1000, 0, &[1, 2, 3, 4], true)? {
        Err(Refusal(abort::READ_ONLY)) => Ok(()),
        other => Err(fail("abort 0601 0002h", format!("{other:X?}"))),
    }
}
