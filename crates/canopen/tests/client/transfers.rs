//! All transfers of many lengths, and the effect of lost, doubled and wrong frames.

use canopen::client::sdo::{
    AbortCode, BlockDownload, BlockUpload, Buffer, Download, Error, Options, SEGMENT_TIME, Upload,
};
use canopen::client::{Service, Step, Taken};
use canopen::sdo::{Abort, BlockEnd, BlockSize, Bytes, Initiate, Multiplexer, Request, Response, Segment};
use canopen::{Frame, Instant};

use crate::server::{Device, NODE, OBJECT, Outcome, Server, once, run};

const LENGTHS: [usize; 14] = [0, 1, 4, 5, 7, 8, 14, 28, 29, 888, 889, 890, 1778, 3000];

fn value(len: usize) -> Vec<u8> {
    (0..len).map(|byte| (byte * 7 % 251) as u8).collect()
}

fn upload(server: &mut impl Device, options: Options) -> (Outcome, Vec<u8>, Instant) {
    let mut memory = vec![0; 4000];
    let mut upload = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), options);
    let (outcome, end, _) = run(&mut upload, server);
    (outcome, upload.into_sink().as_slice().to_vec(), end)
}

fn block_upload(server: &mut impl Device, options: Options) -> (Outcome, Vec<u8>, Instant) {
    let mut memory = vec![0; 4000];
    let mut upload = BlockUpload::new(NODE, OBJECT, Buffer::new(&mut memory), options);
    let (outcome, end, _) = run(&mut upload, server);
    (outcome, upload.into_sink().as_slice().to_vec(), end)
}

#[test]
fn values_of_any_length_both_ways() {
    for len in LENGTHS {
        for is_sizeless in [false, true] {
            let mut server = Server { is_sizeless, ..Server::new(&value(len)) };
            assert_eq!(upload(&mut server, once()).1, value(len), "{len}");
            for block_size in [1, 2, 126, 127] {
                let options = Options { block_size: BlockSize::new(block_size).unwrap(), ..once() };
                let (outcome, read, _) = block_upload(&mut server, options);
                assert_eq!((outcome, read == value(len)), (Ok(()), true), "{len} in {block_size}");
            }
        }
        for block_size in [1, 4, 127] {
            let mut server = Server { block_size, ..Server::new(&[]) };
            let data = value(len);
            let mut download = Download::new(NODE, OBJECT, &data, once());
            assert_eq!(run(&mut download, &mut server).0, Ok(()), "{len}");
            assert_eq!((server.value == data, download.transferred()), (true, len));
            server.value.clear();
            let mut download = BlockDownload::new(NODE, OBJECT, &data, once());
            assert_eq!(run(&mut download, &mut server).0, Ok(()), "{len} in {block_size}");
            assert_eq!((server.value == data, download.transferred()), (true, len));
        }
    }
}

/// Zeros in blocks of one segment: all segments are equal, and none may be taken for a repetition.
#[test]
fn equal_segments_count_each() {
    let options = Options { block_size: BlockSize::new(1).unwrap(), ..once() };
    assert_eq!(block_upload(&mut Server::new(&[0; 100]), options).1, [0; 100]);
}

/// Loses or doubles one answer of a server.
struct Faulty {
    server: Server,
    copies: usize,
    at: usize,
    count: usize,
}

impl Device for Faulty {
    fn answer(&mut self, request: [u8; 8]) -> Vec<[u8; 8]> {
        let mut answers = vec![];
        for answer in self.server.answer(request) {
            let copies = if self.count == self.at { self.copies } else { 1 };
            answers.extend(std::iter::repeat_n(answer, copies));
            self.count += 1;
        }
        answers
    }
}

#[test]
fn a_lost_or_doubled_answer_does_no_harm() {
    let data = value(100);
    for copies in [0, 2] {
        for at in 0..20 {
            let faulty = || Faulty { server: Server::new(&data), copies, at, count: 0 };
            let retries = u8::from(copies == 0);
            let options = Options { retries, block_size: BlockSize::new(5).unwrap(), ..once() };
            let context = format!("{copies} copies of {at}");
            let (outcome, read, _) = upload(&mut faulty(), options);
            assert_eq!((outcome, read == data), (Ok(()), true), "{context}");
            let (outcome, read, _) = block_upload(&mut faulty(), options);
            assert_eq!((outcome, read == data), (Ok(()), true), "{context}");
            let (mut server, new) = (faulty(), value(99));
            assert_eq!(
                run(&mut Download::new(NODE, OBJECT, &new, options), &mut server).0,
                Ok(()),
                "{context}"
            );
            assert!(server.server.value == new);
            let (mut server, new) = (faulty(), value(99));
            let mut download = BlockDownload::new(NODE, OBJECT, &new, options);
            assert_eq!(run(&mut download, &mut server).0, Ok(()), "{context}");
            assert!(server.server.value == new);
        }
    }
}

/// Segments lost within a block of a download are sent again in the next block.
#[test]
fn lost_segments_are_sent_again() {
    for lost in 1..=15 {
        let (mut server, data, mut segments) = (Server::new(&[]), value(100), 0);
        let mut lossy = |request: [u8; 8]| {
            let is_segment = matches!(request[0] & 0x7F, 1..=4);
            segments += usize::from(is_segment);
            // The last segment of a block must arrive, because a server waits for it.
            let is_end = request[0] & 0x80 != 0 || request[0] & 0x7F == 4;
            if is_segment && segments == lost && !is_end { vec![] } else { server.answer(request) }
        };
        assert_eq!(run(&mut BlockDownload::new(NODE, OBJECT, &data, once()), &mut lossy).0, Ok(()), "{lost}");
        assert!(server.value == data, "{lost}");
    }
}

#[test]
fn a_refusal_ends_a_transfer_at_once_and_is_not_answered() {
    let refuse = |_: [u8; 8]| vec![Response::Abort(OBJECT, Abort::NoObject.code()).encode()];
    let mut memory = [0; 8];
    let mut transfer = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), Options::default());
    let (outcome, _, sent) = run(&mut transfer, &mut refuse.clone());
    assert_eq!(outcome, Err(Error::Abort(AbortCode(0x0602_0000))));
    assert_eq!(outcome.unwrap_err().to_string(), "0602 0000h, object does not exist");
    assert_eq!(sent.len(), 1);
}

/// The server waits for a frame that was lost.
#[test]
fn a_time_out_of_the_server_is_tried_again() {
    let mut server = Server::new(&[7; 20]);
    let mut is_late = true;
    let mut once_late = |request: [u8; 8]| {
        // The first segment is lost.
        if request[0] == 0x60 && std::mem::take(&mut is_late) {
            return vec![Response::Abort(OBJECT, Abort::TimeOut.code()).encode()];
        }
        server.answer(request)
    };
    let options = Options { retries: 1, ..once() };
    assert_eq!(upload(&mut once_late, options).1, [7; 20]);
    let mut always_late = |_: [u8; 8]| vec![Response::Abort(OBJECT, Abort::TimeOut.code()).encode()];
    assert_eq!(upload(&mut always_late, options).0, Err(Error::Abort(Abort::TimeOut.into())));
}

/// An abort message for another object belongs to an earlier transfer.
#[test]
fn a_late_abort_message_is_passed_over() {
    let mut server = Server::new(&[1, 2]);
    let mut late = |request: [u8; 8]| {
        let other = Multiplexer { index: 0x2001, sub: 0 };
        let late = Response::Abort(other, Abort::TimeOut.code()).encode();
        [vec![late], server.answer(request)].concat()
    };
    assert_eq!(upload(&mut late, once()).1, [1, 2]);
}

#[test]
fn an_answer_for_another_object_ends_nothing() {
    let other = Multiplexer { index: 0x2001, sub: 0 };
    let bytes = Bytes::from_slice(&[1, 2]);
    for answer in [Response::Uploaded(other, bytes), Response::UploadSegmented(other, Some(9))] {
        let mut wrong = |_: [u8; 8]| vec![answer.encode()];
        assert_eq!(upload(&mut wrong, once()).0, Err(Error::Unexpected), "{answer:?}");
    }
    let mut wrong = |_: [u8; 8]| vec![Response::Downloaded(other).encode()];
    for data in [&[1][..], &[0; 9]] {
        let mut download = Download::new(NODE, OBJECT, data, once());
        assert_eq!(run(&mut download, &mut wrong).0, Err(Error::Unexpected), "{data:?}");
    }
    let mut wrong = |_: [u8; 8]| vec![Response::BlockDownload(other, BlockSize::MAX).encode()];
    let mut download = BlockDownload::new(NODE, OBJECT, &[0; 9], once());
    let (outcome, _, sent) = run(&mut download, &mut wrong);
    assert_eq!(
        (outcome, sent.len()),
        (Err(Error::Unexpected), 2),
        "the request and the abort message, no segment"
    );
}

/// A server without block transfers may name the object of the previous transfer.
#[test]
fn an_unknown_request_is_refused_with_any_object_in_the_answer() {
    let mut simple = |_: [u8; 8]| {
        let before = Multiplexer { index: 0x1F56, sub: 1 };
        vec![Response::Abort(before, Abort::Command.code()).encode()]
    };
    assert_eq!(block_upload(&mut simple, once()).0, Err(Error::Abort(AbortCode(0x0504_0001))));
}

#[test]
fn silence_takes_the_time_outs_and_aborts_at_the_server() {
    let mut memory = [0; 8];
    let mut transfer = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), Options::default());
    let (outcome, end, sent) = run(&mut transfer, &mut |_: [u8; 8]| vec![]);
    assert_eq!(outcome, Err(Error::NoAnswer));
    assert!((2_000_000..2_001_000).contains(&end.0), "two attempts of a second: {end:?}");
    let commands: Vec<u8> = sent.iter().map(|frame| frame.data()[0]).collect();
    assert_eq!(commands, [0x40, 0x80, 0x40, 0x80]);
    assert_eq!(sent[1].data()[4..], [0x00, 0x00, 0x04, 0x05]);
    assert!(matches!(transfer.next(end), canopen::client::Step::Done(Err(Error::NoAnswer))));
}

/// All segments of a block are handed to the adapter at once. On a busy bus the last one is sent seconds later.
#[test]
fn the_answer_to_a_block_has_the_time_of_its_segments_too() {
    let data = value(889);
    let mut download = BlockDownload::new(NODE, OBJECT, &data, once());
    let sends = |step| matches!(step, Step::Send(_));
    let tell = |download: &mut BlockDownload<'_>, answer: Response, now| {
        let frame = Frame::new(0x580 + u16::from(NODE.get()), &answer.encode()).unwrap();
        assert_eq!(download.on_frame(&frame, Instant(now)), Taken::Used);
    };
    assert!(sends(download.next(Instant(0))));
    tell(&mut download, Response::BlockDownload(OBJECT, BlockSize::MAX), 0);
    for _ in 0..127 {
        assert!(sends(download.next(Instant(0))));
    }
    let latest = once().timeout.0 + 127 * SEGMENT_TIME.0;
    assert_eq!(download.next(Instant(latest - 1)), Step::Wait(Instant(latest)));
    tell(&mut download, Response::BlockAcknowledge(127, BlockSize::MAX), latest - 1);
    assert!(sends(download.next(Instant(latest))), "the end of the transfer");
}

/// A block download of two blocks whose first one has been sent.
fn first_block_sent(data: &[u8]) -> BlockDownload<'_> {
    let mut download = BlockDownload::new(NODE, OBJECT, data, once());
    assert!(matches!(download.next(Instant(0)), Step::Send(_)));
    tell(&mut download, Response::BlockDownload(OBJECT, BlockSize::MAX), 0);
    assert_eq!(segments(&mut download, 0).len(), 127);
    download
}

fn tell(download: &mut BlockDownload<'_>, answer: Response, ms: u64) {
    let frame = Frame::new(0x580 + u16::from(NODE.get()), &answer.encode()).unwrap();
    download.on_frame(&frame, Instant(ms * 1000));
}

/// The sequence numbers of the segments that the client sends now.
fn segments(download: &mut BlockDownload<'_>, ms: u64) -> Vec<u8> {
    let next = || match download.next(Instant(ms * 1000)) {
        Step::Send(frame) => Some(frame.data()[0]),
        _ => None,
    };
    std::iter::from_fn(next).collect()
}

/// A server that hears no segment for 300 ms acknowledges a part of the block. The other segments may still wait in the adapter:
/// the server discards them, and acknowledges none.
#[test]
fn a_block_behind_the_rest_of_the_block_before_is_sent_once() {
    let data = value(2 * 889);
    let mut download = first_block_sent(&data);
    tell(&mut download, Response::BlockAcknowledge(5, BlockSize::MAX), 301);
    assert_eq!((segments(&mut download, 301).len(), download.transferred()), (127, 35));
    for ms in [700, 1100, 5200] {
        tell(&mut download, Response::BlockAcknowledge(0, BlockSize::MAX), ms);
        assert_eq!(segments(&mut download, ms), [], "the block still waits");
    }
    tell(&mut download, Response::BlockAcknowledge(127, BlockSize::MAX), 9900);
    assert_eq!((segments(&mut download, 9900).len(), download.transferred()), (122, 35 + 889));
    tell(&mut download, Response::BlockAcknowledge(0, BlockSize::MAX), 9950);
    assert_eq!(segments(&mut download, 9950).len(), 122, "nothing is left of the block before");
}

/// An acknowledge soon after the begin of the block is the one of its last segment.
#[test]
fn a_block_of_which_no_segment_has_arrived_is_sent_again() {
    let data = value(2 * 889);
    let mut download = first_block_sent(&data);
    tell(&mut download, Response::BlockAcknowledge(5, BlockSize::MAX), 100);
    assert_eq!(segments(&mut download, 100).len(), 127);
    tell(&mut download, Response::BlockAcknowledge(0, BlockSize::MAX), 150);
    assert_eq!((segments(&mut download, 150).len(), download.transferred()), (127, 35));
}

/// The adapter takes the segments of a block so slowly that the server acknowledges a part of it.
#[test]
fn an_acknowledge_before_the_last_segment_of_a_block_counts() {
    let data = value(2 * 889);
    let mut download = BlockDownload::new(NODE, OBJECT, &data, once());
    assert!(matches!(download.next(Instant(0)), Step::Send(_)));
    tell(&mut download, Response::BlockDownload(OBJECT, BlockSize::MAX), 0);
    for _ in 0..20 {
        assert!(matches!(download.next(Instant(0)), Step::Send(_)));
    }
    tell(&mut download, Response::BlockAcknowledge(0, BlockSize::MAX), 300);
    tell(&mut download, Response::BlockAcknowledge(21, BlockSize::MAX), 300);
    assert_eq!(download.transferred(), 0);
    tell(&mut download, Response::BlockAcknowledge(20, BlockSize::MAX), 301);
    assert_eq!((segments(&mut download, 301).len(), download.transferred()), (127, 140));
}

/// No segment of the block before has arrived either, so none of it can wait in the adapter.
#[test]
fn a_late_acknowledge_of_nothing_leaves_no_rest() {
    let data = value(2 * 889);
    let mut download = first_block_sent(&data);
    tell(&mut download, Response::BlockAcknowledge(0, BlockSize::MAX), 301);
    assert_eq!(segments(&mut download, 301).len(), 127);
    tell(&mut download, Response::BlockAcknowledge(0, BlockSize::MAX), 350);
    assert_eq!((segments(&mut download, 350).len(), download.transferred()), (127, 0));
}

#[test]
fn an_empty_value_is_sent_again_until_its_segment_is_acknowledged() {
    let mut download = BlockDownload::new(NODE, OBJECT, &[], once());
    assert!(matches!(download.next(Instant(0)), Step::Send(_)));
    tell(&mut download, Response::BlockDownload(OBJECT, BlockSize::MAX), 0);
    assert_eq!(segments(&mut download, 0), [0x81]);
    tell(&mut download, Response::BlockAcknowledge(0, BlockSize::MAX), 1);
    assert_eq!(segments(&mut download, 1), [0x81]);
    tell(&mut download, Response::BlockAcknowledge(1, BlockSize::MAX), 2);
    assert_eq!(segments(&mut download, 2), [0xDD], "the end, with seven unused bytes");
}

#[test]
fn up_to_four_bytes_are_written_with_one_request() {
    for data in [&[1][..], &[1, 2, 3, 4]] {
        let (outcome, _, sent) = run(&mut Download::new(NODE, OBJECT, data, once()), &mut Server::new(&[]));
        let request = Request::Download(OBJECT, Initiate::Expedited(Bytes::from_slice(data)));
        assert_eq!((outcome, sent.len(), sent[0].data()), (Ok(()), 1, &request.encode()[..]));
    }
}

#[test]
fn an_acknowledge_with_the_toggle_bit_of_another_segment_counts_for_nothing() {
    let mut wrong = |request: [u8; 8]| match Request::parse(&request) {
        Some(Request::Download(at, _)) => vec![Response::Downloaded(at).encode()],
        _ => vec![Response::DownloadedSegment { toggle: true }.encode()],
    };
    let mut download = Download::new(NODE, OBJECT, &[0; 5], once());
    assert_eq!(run(&mut download, &mut wrong).0, Err(Error::Unexpected));
    assert_eq!(download.transferred(), 0);
}

#[test]
fn less_data_than_announced_is_against_the_protocol() {
    let mut short = |request: [u8; 8]| match Request::parse(&request) {
        Some(Request::Upload(at)) => vec![Response::UploadSegmented(at, Some(8)).encode()],
        Some(Request::UploadSegment { toggle }) => {
            vec![
                Response::UploadedSegment(Segment { toggle, last: true, data: Bytes::new([1; 7], 7) })
                    .encode(),
            ]
        }
        _ => vec![],
    };
    assert_eq!(upload(&mut short, once()).0, Err(Error::Unexpected));
}

#[test]
fn the_begin_of_a_block_upload_of_another_object_begins_nothing() {
    let other = Multiplexer { index: 0x2001, sub: 0 };
    let mut wrong = |_: [u8; 8]| vec![Response::BlockUpload { at: other, crc: true, size: None }.encode()];
    let mut memory = [0; 8];
    let mut transfer = BlockUpload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
    let (outcome, _, sent) = run(&mut transfer, &mut wrong);
    assert_eq!((outcome, sent.len()), (Err(Error::Unexpected), 2), "the request and the abort message");
}

/// The announced size decides how long the last segment is.
#[test]
fn a_full_last_segment_may_have_seven_unused_bytes() {
    let mut server = Server::new(&value(14));
    let mut odd = |request: [u8; 8]| {
        let mut answers = server.answer(request);
        for answer in &mut answers {
            if let Some(Response::BlockUploadEnd(end)) =
                Response::parse(*answer).filter(|_| answer[0] >> 5 == 6)
            {
                *answer = Response::BlockUploadEnd(BlockEnd { unused: 7, ..end }).encode();
            }
        }
        answers
    };
    let (outcome, read, _) = block_upload(&mut odd, once());
    assert_eq!((outcome, read), (Ok(()), value(14)));
}

/// The numbers of bytes that a transfer reports: one with each frame that it sends, and the one of its end.
fn progress<S: Service<Output = Outcome>>(
    transfer: &mut S,
    transferred: fn(&S) -> usize,
    device: &mut impl Device,
) -> Vec<usize> {
    let mut reported = vec![];
    loop {
        match transfer.next(Instant(0)) {
            Step::Send(frame) => {
                reported.push(transferred(transfer));
                for answer in device.answer(frame.data().try_into().unwrap()) {
                    transfer.on_frame(&Frame::new(0x585, &answer).unwrap(), Instant(0));
                }
            }
            Step::Wait(_) => panic!("no answer"),
            Step::Done(outcome) => {
                assert_eq!(outcome, Ok(()));
                return [reported, vec![transferred(transfer)]].concat();
            }
        }
    }
}

/// A server that answers the request for a block upload with segments or one frame, as CiA 301 allows.
fn without_blocks(server: &mut Server) -> impl FnMut([u8; 8]) -> Vec<[u8; 8]> {
    |request| match Request::parse(&request) {
        Some(Request::BlockUpload { at, .. }) => server.answer(Request::Upload(at).encode()),
        _ => server.answer(request),
    }
}

#[test]
fn an_upload_reports_its_progress() {
    let mut server = Server::new(&value(20));
    let mut memory = [0; 20];
    let mut transfer = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
    assert_eq!(progress(&mut transfer, |transfer| transfer.transferred(), &mut server), [0, 0, 7, 14, 20]);
    let mut memory = [0; 20];
    let options = Options { block_size: BlockSize::new(2).unwrap(), ..once() };
    let mut transfer = BlockUpload::new(NODE, OBJECT, Buffer::new(&mut memory), options);
    // The newest segment is held back.
    assert_eq!(
        progress(&mut transfer, |transfer| transfer.transferred(), &mut server),
        [0, 0, 7, 14, 20, 20]
    );
    // The server chooses segments.
    let mut memory = [0; 20];
    let mut transfer = BlockUpload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
    let mut simple = without_blocks(&mut server);
    assert_eq!(progress(&mut transfer, |transfer| transfer.transferred(), &mut simple), [0, 0, 7, 14, 20]);
    // A short value comes with the first answer.
    let mut server = Server::new(&value(4));
    let mut transfer = BlockUpload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
    let steps = progress(&mut transfer, |transfer| transfer.transferred(), &mut without_blocks(&mut server));
    assert_eq!(steps.last(), Some(&4));
}

#[test]
fn a_value_longer_than_its_place_is_refused() {
    for is_sizeless in [false, true] {
        let mut server = Server { is_sizeless, ..Server::new(&value(5000)) };
        assert_eq!(upload(&mut server, once()).0, Err(Error::TooLong));
        assert_eq!(block_upload(&mut server, once()).0, Err(Error::TooLong));
    }
}

#[test]
fn changed_data_is_a_crc_error() {
    let mut server = Server::new(&value(100));
    let mut changed = |request: [u8; 8]| {
        let mut answers = server.answer(request);
        answers.iter_mut().filter(|answer| answer[0] == 3).for_each(|answer| answer[5] ^= 1);
        answers
    };
    assert_eq!(block_upload(&mut changed, once()).0, Err(Error::Crc));
}

#[test]
fn a_transfer_can_be_given_up() {
    let mut transfer = Download::new(NODE, OBJECT, &[1], once());
    let _ = transfer.next(Instant(0));
    transfer.abort();
    let (outcome, _, sent) = run(&mut transfer, &mut |_: [u8; 8]| vec![]);
    assert_eq!((outcome, sent.len(), sent[0].data()[0]), (Err(Error::Cancelled), 1, 0x80));
}
