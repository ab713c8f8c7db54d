//! SDO block transfers: complete data, lost and repeated frames, and all possible errors.

use crate::bench::{Bench, ID, repeatable};
use canopen::sdo::{BlockEnd, BlockSegment, BlockSize, Multiplexer, Request, Response};
use canopen::{Duration, Frame};
use proptest::prelude::*;

const DOMAIN: Multiplexer = Multiplexer { index: 0x6104, sub: 0 };
const TEXT: Multiplexer = Multiplexer { index: 0x6103, sub: 0 };
const RESPONSE: u16 = 0x580 + ID as u16;

/// CRC-16/XMODEM bit by bit, as defined in CiA 301.
fn crc(data: &[u8]) -> u16 {
    data.iter().fold(0, |crc: u16, byte| {
        (0..8)
            .fold(crc ^ u16::from(*byte) << 8, |crc, _| crc << 1 ^ if crc & 0x8000 != 0 { 0x1021 } else { 0 })
    })
}

fn data(len: usize) -> Vec<u8> {
    (0..len).map(|i| (i * 7 + i / 251) as u8).collect()
}

fn end(data: &[u8]) -> BlockEnd {
    let tail = data.chunks(7).next_back().map_or(0, <[u8]>::len);
    BlockEnd { unused: 7 - tail as u8, crc: crc(data) }
}

fn segment(data: &[u8], number: usize, sequence: u8) -> BlockSegment {
    let mut bytes = [0; 7];
    let chunk = data.chunks(7).nth(number).unwrap_or(&[]);
    bytes[..chunk.len()].copy_from_slice(chunk);
    let last = (number + 1) * 7 >= data.len();
    BlockSegment { last, sequence: BlockSize::new(sequence).unwrap(), data: bytes }
}

/// A segment that is not the last one.
fn middle(data: [u8; 7], sequence: u8) -> BlockSegment {
    BlockSegment { last: false, sequence: BlockSize::new(sequence).unwrap(), data }
}

/// Fate of a frame on the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    Arrives,
    IsLost,
    ArrivesTwice,
}

struct Client {
    bench: Bench,
    fates: Box<dyn Iterator<Item = Fate>>,
}

impl Client {
    fn new() -> Client {
        Client { bench: Bench::booted(), fates: Box::new(std::iter::repeat(Fate::Arrives)) }
    }

    /// Sends a segment, according to its fate, and returns the answer if there is one.
    fn send_segment(&mut self, segment: BlockSegment) -> Option<Response> {
        let frame = Frame::new(0x600 + u16::from(ID), &segment.encode()).unwrap();
        match self.fates.next().unwrap() {
            Fate::Arrives => self.bench.receive(frame),
            Fate::ArrivesTwice => (0..2).for_each(|_| self.bench.receive(frame)),
            Fate::IsLost => (),
        }
        self.response()
    }

    fn response(&mut self) -> Option<Response> {
        let frames: Vec<_> = self.bench.take().into_iter().filter(|frame| frame.id() == RESPONSE).collect();
        assert!(frames.len() <= 1, "{frames:?}");
        frames.first().map(|frame| Response::parse(frame.data().try_into().unwrap()).unwrap())
    }

    /// A block download that sends unacknowledged segments again.
    fn download(&mut self, at: Multiplexer, data: &[u8]) -> Response {
        let request = Request::BlockDownload { at, crc: true, size: Some(data.len() as u32) };
        let Some(Response::BlockDownload(_, size)) = self.bench.ask(request) else { panic!() };
        let segments = data.len().div_ceil(7).max(1);
        let mut done = 0;
        let mut blocks = 0;
        while done < segments {
            blocks += 1;
            assert!(blocks < 200, "no progress");
            let mut answer = None;
            for sequence in (1..=size.get()).take(segments - done) {
                answer =
                    self.send_segment(segment(data, done + usize::from(sequence) - 1, sequence)).or(answer);
            }
            match answer.or_else(|| self.wait()) {
                Some(Response::BlockAcknowledge(sequence, _)) => done += usize::from(sequence),
                // No segment of the block has arrived, so the server does not know of the block.
                None => (),
                other => return other.unwrap(),
            }
        }
        self.bench.ask(Request::BlockDownloadEnd(end(data))).unwrap()
    }

    fn wait(&mut self) -> Option<Response> {
        self.bench.run(Duration::from_millis(310));
        self.response()
    }

    /// A block upload that asks again for missing segments; returns the data and the end of the transfer.
    fn upload(&mut self, at: Multiplexer, block_size: u8) -> (Vec<u8>, BlockEnd) {
        let request = Request::BlockUpload { at, crc: true, block_size, threshold: 0 };
        let Some(Response::BlockUpload { crc: true, size: Some(size), .. }) = self.bench.ask(request) else {
            panic!()
        };
        let mut data = vec![];
        self.request(Request::BlockUploadStart);
        for _ in 0..3000 {
            let frames = self.block();
            if let [frame] = &frames[..]
                && let Some(Response::BlockUploadEnd(end)) = Response::parse(*frame)
                && data.len() >= size as usize
            {
                data.truncate(data.len() - usize::from(end.unused));
                self.request(Request::BlockUploadEnded);
                return (data, end);
            }
            let mut sequence = 0;
            for segment in frames.into_iter().map(|frame| BlockSegment::parse(frame).unwrap()) {
                if self.fates.next() != Some(Fate::IsLost) && segment.sequence.get() == sequence + 1 {
                    data.extend_from_slice(&segment.data);
                    sequence += 1;
                }
            }
            self.request(Request::BlockAcknowledge { sequence, block_size });
        }
        panic!("no progress");
    }

    fn request(&mut self, request: Request) {
        self.bench.receive(Frame::new(0x600 + u16::from(ID), &request.encode()).unwrap());
    }

    /// All frames of the server until it waits.
    fn block(&mut self) -> Vec<[u8; 8]> {
        self.bench.run(Duration::from_millis(200));
        let frames = self.bench.take().into_iter().filter(|frame| frame.id() == RESPONSE);
        frames.map(|frame| frame.data().try_into().unwrap()).collect()
    }
}

fn lossy(percent: u32) -> impl Strategy<Value = Vec<Fate>> {
    let fate = prop_oneof![
        100 - 2 * percent => Just(Fate::Arrives),
        percent => Just(Fate::IsLost),
        percent => Just(Fate::ArrivesTwice),
    ];
    // Not a multiple of any block's length, so that the fates meet different segments in each block.
    prop::collection::vec(fate, 307)
}

#[test]
fn data_of_any_length_arrives_both_ways() {
    for len in [1, 4, 6, 7, 8, 14, 888, 889, 890, 1778, 4096] {
        let mut client = Client::new();
        assert_eq!(client.download(DOMAIN, &data(len)), Response::BlockDownloaded, "{len}");
        assert_eq!(client.bench.device.application().domain, data(len));
        assert_eq!(client.upload(DOMAIN, 127), (data(len), end(&data(len))));
    }
}

#[test]
fn small_blocks_and_their_change() {
    let mut client = Client::new();
    client.bench.device.application_mut().domain = data(200);
    for block_size in [1, 2, 100] {
        assert_eq!(client.upload(DOMAIN, block_size).0, data(200));
    }
}

#[test]
fn a_value_of_the_image_goes_in_blocks_too() {
    let mut client = Client::new();
    assert_eq!(client.download(TEXT, b"seven bytes and 2"), Response::BlockDownloaded);
    assert_eq!(client.bench.read(0x6103, 0), Ok(b"seven bytes and 2".to_vec()));
    assert_eq!(client.upload(TEXT, 127).0, b"seven bytes and 2");
    let short = Multiplexer { index: 0x6100, sub: 0 };
    assert_eq!(client.download(short, &[4, 0]), Response::BlockDownloaded);
    assert_eq!(client.upload(short, 127).0, [4, 0]);
    assert_eq!(client.download(short, &[6, 0]), Response::Abort(short, 0x0609_0031));
}

#[test]
fn a_short_value_may_switch_to_another_transfer() {
    let mut bench = Bench::booted();
    let at = Multiplexer { index: 0x6100, sub: 0 };
    let request = |at, threshold| Request::BlockUpload { at, crc: true, block_size: 10, threshold };
    assert!(matches!(bench.ask(request(at, 4)), Some(Response::Uploaded(..))));
    assert!(matches!(bench.ask(request(at, 1)), Some(Response::BlockUpload { size: Some(2), .. })));
    let name = Multiplexer { index: 0x1008, sub: 0 };
    assert!(matches!(bench.ask(request(name, 26)), Some(Response::UploadSegmented(_, Some(26)))));
}

#[test]
fn faults_have_their_abort_codes() {
    let abort = |code| Some(Response::Abort(DOMAIN, code));
    let upload = |block_size| Request::BlockUpload { at: DOMAIN, crc: true, block_size, threshold: 0 };
    let mut client = Client::new();
    client.bench.device.application_mut().domain = data(20);
    for block_size in [0, 128, 255] {
        assert_eq!(client.bench.ask(upload(block_size)), abort(0x0504_0002));
    }
    for request in [Request::BlockUploadStart, Request::BlockUploadEnded, Request::BlockDownloadEnd(end(&[]))]
    {
        assert_eq!(client.bench.ask(request), abort(0x0504_0001));
    }
    client.bench.ask(upload(2));
    client.request(Request::BlockUploadStart);
    assert_eq!(client.block().len(), 2);
    let beyond = Request::BlockAcknowledge { sequence: 3, block_size: 2 };
    assert_eq!(client.bench.ask(beyond), abort(0x0504_0003));
    client.bench.ask(upload(2));
    client.request(Request::BlockUploadStart);
    client.block();
    let zero = Request::BlockAcknowledge { sequence: 2, block_size: 0 };
    assert_eq!(client.bench.ask(zero), abort(0x0504_0002));
}

#[test]
fn a_download_must_match_its_crc_and_its_size() {
    let abort = |code| Some(Response::Abort(DOMAIN, code));
    let begin = |crc, size| Request::BlockDownload { at: DOMAIN, crc, size };
    let wrong = BlockEnd { unused: 0, crc: 0 };
    for (request, last, expected) in [
        (begin(true, Some(7)), wrong, abort(0x0504_0004)),
        (begin(false, Some(7)), wrong, Some(Response::BlockDownloaded)),
        (begin(false, None), wrong, Some(Response::BlockDownloaded)),
        (begin(true, Some(8)), end(&data(7)), abort(0x0607_0013)),
        (begin(true, Some(6)), end(&data(7)), abort(0x0607_0012)),
    ] {
        let mut client = Client::new();
        client.bench.ask(request);
        let answer = client.send_segment(segment(&data(7), 0, 1));
        assert!(matches!(answer, Some(Response::BlockAcknowledge(1, _))));
        assert_eq!(client.bench.ask(Request::BlockDownloadEnd(last)), expected);
        let downloads = usize::from(expected == Some(Response::BlockDownloaded));
        assert_eq!(client.bench.device.application().downloads, downloads);
    }
}

#[test]
fn too_many_bytes_are_refused_when_they_arrive() {
    let mut client = Client::new();
    assert_eq!(client.download(DOMAIN, &data(5001)), Response::Abort(DOMAIN, 0x0800_0020));
    let size = Some(21);
    let request = Request::BlockDownload { at: TEXT, crc: true, size };
    assert_eq!(client.bench.ask(request), Some(Response::Abort(TEXT, 0x0607_0012)));
}

/// The client sends the whole block before it listens. The server refuses the data at the end of the block: until then,
/// every frame is a segment, and none is a request, whatever its number and its data look like.
#[test]
fn a_refused_segment_is_answered_at_the_end_of_its_block() {
    for accepted in 0..=125_u8 {
        let mut client = Client::new();
        // The next segment has a byte too many.
        let size = u32::from(accepted) * 7 + 6;
        client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: Some(size) });
        assert_no_request(&mut client, 1, 0x0607_0012);
    }
}

/// Segment 2Bh looks like the download of a value, segments 40h to 5Fh like the upload.
const LIKE_REQUESTS: [u8; 7] = [0x00, 0x61, 0x00, 0x03, 0x00, 0x00, 0x00];

/// Sends the block from this segment on. The server takes none for a request, and aborts at the end of the block.
#[track_caller]
fn assert_no_request(client: &mut Client, first: u8, code: u32) {
    for sequence in first..=126 {
        let answer = client.send_segment(middle(LIKE_REQUESTS, sequence));
        assert_eq!(answer, None, "{sequence} from {first} on");
    }
    let end = client.send_segment(middle(LIKE_REQUESTS, 127));
    assert_eq!(end, Some(Response::Abort(DOMAIN, code)), "from {first} on");
    assert_eq!(client.bench.device.application().downloads, 0);
    assert_eq!(client.bench.read(0x6100, 0), Ok(vec![0, 0]), "from {first} on");
}

/// A client that ends a refused block early gets the abort message after the pause.
#[test]
fn a_refused_block_without_its_end_is_aborted_after_the_pause() {
    let mut client = Client::new();
    client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: Some(13) });
    for sequence in 1..=3 {
        assert_eq!(client.send_segment(middle([0; 7], sequence)), None);
    }
    assert_eq!(client.wait(), Some(Response::Abort(DOMAIN, 0x0607_0012)));
    assert_eq!(client.bench.read(0x1001, 0), Ok(vec![0]));
}

/// A master resets the node within a block, and the client sends the rest of the block. Some segments are lost while the node
/// starts.
#[test]
fn the_rest_of_a_block_after_a_reset_is_no_request() {
    for accepted in 0..=120_u8 {
        for lost in [0, 5] {
            let mut client = Client::new();
            client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
            for sequence in 1..=accepted {
                client.send_segment(middle(LIKE_REQUESTS, sequence));
            }
            client.bench.nmt(0x82);
            client.bench.start();
            assert_no_request(&mut client, accepted + 1 + lost, 0x0800_0022);
        }
    }
}

/// The server has acknowledged a pause, and the client begins its next block while the node starts.
#[test]
fn the_block_after_an_acknowledged_pause_and_a_reset_is_no_request() {
    for accepted in 1..=3 {
        let mut client = Client::new();
        client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
        for sequence in 1..=accepted {
            client.send_segment(middle(LIKE_REQUESTS, sequence));
        }
        assert_eq!(client.wait(), Some(Response::BlockAcknowledge(accepted, BlockSize::MAX)));
        client.bench.nmt(0x82);
        client.bench.start();
        assert_no_request(&mut client, 1, 0x0800_0022);
    }
}

/// An adapter repeats a segment whose acknowledgement it has not seen, also after the pause on a broken line.
#[test]
fn a_segment_that_is_repeated_after_the_acknowledge_of_a_pause_counts_once() {
    let mut client = Client::new();
    let content = data(21);
    client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: Some(21) });
    assert_eq!(client.send_segment(segment(&content, 0, 1)), None);
    assert_eq!(client.wait(), Some(Response::BlockAcknowledge(1, BlockSize::MAX)));
    assert_eq!(client.send_segment(segment(&content, 0, 1)), None);
    assert_eq!(client.send_segment(segment(&content, 1, 1)), None);
    let whole = client.send_segment(segment(&content, 2, 2));
    assert_eq!(whole, Some(Response::BlockAcknowledge(2, BlockSize::MAX)));
    assert_eq!(client.bench.ask(Request::BlockDownloadEnd(end(&content))), Some(Response::BlockDownloaded));
}

/// The bus is broken for longer than the time-out within a block, and the adapter of the client keeps the rest of the block.
#[test]
fn the_rest_of_a_block_after_a_time_out_is_no_request() {
    for accepted in 0..=127_u8 {
        let mut client = Client::new();
        client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
        for sequence in 1..=accepted {
            client.send_segment(middle(LIKE_REQUESTS, sequence));
        }
        client.bench.run(Duration::from_millis(1500));
        let mut answers = client.bench.sent();
        answers.retain(|(id, _)| *id == 0x585);
        let is_acknowledged = (1..127).contains(&accepted);
        assert_eq!(answers.len(), 1 + usize::from(is_acknowledged), "{accepted}: {answers:?}");
        // A block that has arrived as a whole is followed by another one. The adapter may lose the frame that it sends.
        let next = (accepted % 127 + 1 + accepted % 2).min(127);
        // The client may have begun another block.
        for sequence in (next..=127).chain(1..=127) {
            let answer = client.send_segment(middle(LIKE_REQUESTS, sequence));
            assert_eq!(answer, None, "{sequence} after {accepted}");
        }
        assert_eq!(client.bench.device.application().downloads, 0);
        assert_eq!(client.bench.read(0x6100, 0), Ok(vec![0, 0]), "after {accepted}");
        assert_eq!(client.download(DOMAIN, &data(900)), Response::BlockDownloaded);
    }
}

/// The client has the acknowledge of a part of a block, but not yet the abort message. Its adapter has lost the rest of that block,
/// and one frame more.
#[test]
fn another_block_after_a_time_out_is_no_request() {
    for accepted in 1..127_u8 {
        for lost in [0, 1] {
            let mut client = Client::new();
            client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
            for sequence in 1..=accepted {
                client.send_segment(middle(LIKE_REQUESTS, sequence));
            }
            client.bench.run(Duration::from_millis(1500));
            client.bench.take();
            for sequence in 1 + lost..=127 {
                let answer = client.send_segment(middle(LIKE_REQUESTS, sequence));
                assert_eq!(answer, None, "{sequence} after {accepted}");
            }
            assert_eq!(client.bench.read(0x6100, 0), Ok(vec![0, 0]), "after {accepted}");
        }
    }
}

/// A client that begins again, at once or later. A request that looks like the next segment is lost once.
#[test]
fn a_request_after_a_time_out_within_a_block_is_answered() {
    for accepted in (0..=126_u8).filter(|accepted| !(0x3E..=0x3F).contains(accepted)) {
        for pause in [0, 10, 4000] {
            let mut client = Client::new();
            client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
            for sequence in 1..=accepted {
                client.send_segment(middle([0; 7], sequence));
            }
            client.bench.run(Duration::from_millis(1500 + pause));
            client.bench.take();
            assert_eq!(client.bench.read(0x1001, 0), Ok(vec![0]), "{accepted}, after {pause} ms");
            assert_eq!(client.download(DOMAIN, &data(900)), Response::BlockDownloaded);
        }
    }
    let mut client = Client::new();
    client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
    for sequence in 1..=0x3F {
        client.send_segment(middle([0; 7], sequence));
    }
    client.bench.run(Duration::from_millis(6500));
    client.bench.take();
    assert_eq!(client.bench.read(0x1001, 0), Ok(vec![0]), "no rest comes any more");
}

/// A client that has seen the boot-up message begins again.
#[test]
fn a_request_after_a_reset_within_a_block_is_answered() {
    for pause in [0, 400] {
        let mut client = Client::new();
        client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
        for sequence in 1..=if pause == 0 { 3 } else { 0x3F } {
            client.send_segment(middle([0; 7], sequence));
        }
        client.bench.nmt(0x82);
        client.bench.start();
        client.bench.run(Duration::from_millis(pause));
        client.bench.take();
        assert_eq!(client.bench.read(0x1001, 0), Ok(vec![0]), "after {pause} ms");
        assert_eq!(client.bench.write(0x6100, 0, &[3, 0]), Ok(()), "after {pause} ms");
        assert_eq!(client.download(DOMAIN, &data(900)), Response::BlockDownloaded);
    }
}

#[test]
fn an_abort_or_a_silent_client_ends_the_transfer() {
    let mut client = Client::new();
    client.bench.device.application_mut().domain = data(2000);
    for silence in [false, true] {
        let upload = Request::BlockUpload { at: DOMAIN, crc: true, block_size: 127, threshold: 0 };
        client.bench.ask(upload);
        client.request(Request::BlockUploadStart);
        client.block();
        if silence {
            client.bench.run(Duration::from_millis(1000));
            assert_eq!(client.response(), Some(Response::Abort(DOMAIN, 0x0504_0000)));
        } else {
            client.request(Request::Abort(DOMAIN, 0x0800_0000));
            assert_eq!(client.block(), [[0; 8]; 0]);
        }
        assert!(matches!(client.bench.ask(Request::BlockUploadEnded), Some(Response::Abort(..))));
    }
}

#[test]
fn a_request_right_after_a_block_upload_is_answered() {
    let mut client = Client::new();
    client.bench.device.application_mut().domain = data(100);
    client.upload(DOMAIN, 127);
    assert_eq!(client.bench.read(0x1001, 0), Ok(vec![0]));
}

/// A block upload of 700 bytes has begun, and the queue has this room.
fn uploading(room: usize) -> Client {
    let mut client = Client::new();
    client.bench.device.application_mut().domain = data(700);
    client.bench.ask(Request::BlockUpload { at: DOMAIN, crc: true, block_size: 127, threshold: 0 });
    client.bench.out.room = room;
    client.request(Request::BlockUploadStart);
    client
}

#[test]
fn a_block_leaves_room_in_the_queue() {
    let mut client = uploading(30);
    client.bench.run(Duration::from_millis(50));
    assert_eq!(client.bench.out.room, 10);
    client.bench.out.room = 1000;
    assert_eq!(client.block().len(), 100);
}

/// A client that gets no segment gives up.
#[test]
fn a_block_in_a_full_queue_ends_with_the_time_out() {
    let mut client = uploading(10);
    client.bench.take();
    let mut responses = |ms| {
        client.bench.run(Duration::from_millis(ms));
        client.bench.sent().into_iter().filter(|(id, _)| *id == 0x585).collect::<Vec<_>>()
    };
    assert_eq!(responses(998), []);
    assert_eq!(responses(3)[0].1[4..], 0x0504_0000_u32.to_le_bytes());
}

/// If a client pauses within a block, the server acknowledges the segments that have arrived; also in a later block of
/// which only the first segment has arrived.
#[test]
fn a_pause_within_any_block_is_answered() {
    for (at, size, blocks) in [(DOMAIN, 70, [(0, 3), (3, 1), (4, 1)]), (TEXT, 20, [(0, 0), (0, 1), (1, 1)])] {
        let mut client = Client::new();
        client.bench.ask(Request::BlockDownload { at, crc: true, size: Some(size) });
        for (begin, segments) in blocks.into_iter().filter(|(_, segments)| *segments > 0) {
            for sequence in 1..=segments {
                let number = begin + usize::from(sequence) - 1;
                assert_eq!(client.send_segment(segment(&data(70), number, sequence)), None);
            }
            assert_eq!(client.wait(), Some(Response::BlockAcknowledge(segments, BlockSize::MAX)));
        }
    }
}

/// A segment that arrives twice in a row counts once. A segment that arrives again later is the missing one.
#[test]
fn an_early_segment_is_taken_in_its_turn() {
    let mut client = Client::new();
    let content = data(35);
    client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: Some(35) });
    // The third segment overtakes the second one, and arrives again after it.
    for number in [0, 2, 1, 2, 3] {
        assert_eq!(client.send_segment(segment(&content, number, number as u8 + 1)), None);
    }
    let last = segment(&content, 4, 5);
    assert_eq!(client.send_segment(last), Some(Response::BlockAcknowledge(5, BlockSize::MAX)));
    assert_eq!(client.send_segment(last), None);
    assert_eq!(client.bench.ask(Request::BlockDownloadEnd(end(&content))), Some(Response::BlockDownloaded));
    assert_eq!(client.bench.device.application().domain, content);
}

#[test]
fn a_repeated_begin_of_a_download_is_no_segment() {
    let mut client = Client::new();
    let request = Request::BlockDownload { at: DOMAIN, crc: true, size: Some(7) };
    let ready = client.bench.ask(request);
    assert!(matches!(ready, Some(Response::BlockDownload(DOMAIN, _))));
    assert_eq!(client.bench.ask(request), ready);
    assert_eq!(
        client.send_segment(segment(&data(7), 0, 1)),
        Some(Response::BlockAcknowledge(1, BlockSize::MAX))
    );
    assert_eq!(client.bench.ask(Request::BlockDownloadEnd(end(&data(7)))), Some(Response::BlockDownloaded));
}

#[test]
fn the_requests_of_an_upload_may_come_twice() {
    let mut client = Client::new();
    client.bench.device.application_mut().domain = data(20);
    client.bench.ask(Request::BlockUpload { at: DOMAIN, crc: true, block_size: 3, threshold: 0 });
    client.request(Request::BlockUploadStart);
    client.request(Request::BlockUploadStart);
    assert_eq!(client.block().len(), 3);
    let all = Request::BlockAcknowledge { sequence: 3, block_size: 3 };
    for _ in 0..2 {
        assert_eq!(client.bench.ask(all), Some(Response::BlockUploadEnd(end(&data(20)))));
    }
    client.request(Request::BlockUploadEnded);
    client.request(Request::BlockUploadEnded);
    assert_eq!(client.block(), [[0; 8]; 0]);
}

proptest! {
    #![proptest_config(repeatable())]

    #[test]
    fn a_download_survives_lost_and_repeated_segments(fates in lossy(10), len in 1..2000_usize) {
        let mut client = Client::new();
        client.fates = Box::new(fates.into_iter().cycle());
        prop_assert_eq!(client.download(DOMAIN, &data(len)), Response::BlockDownloaded);
        prop_assert_eq!(&client.bench.device.application().domain, &data(len));
        prop_assert_eq!(client.bench.device.application().downloads, 1);
    }

    #[test]
    fn an_upload_survives_lost_segments(fates in lossy(10), len in 1..2000_usize, block_size in 1..=127_u8) {
        let mut client = Client::new();
        client.bench.device.application_mut().domain = data(len);
        client.fates = Box::new(fates.into_iter().cycle());
        prop_assert_eq!(client.upload(DOMAIN, block_size), (data(len), end(&data(len))));
    }
}

#[test]
fn a_block_continues_one_millisecond_after_a_full_queue() {
    let mut client = uploading(30);
    client.bench.out.room = 1000;
    let id = 0x580 + u16::from(crate::bench::ID);
    let segments =
        |bench: &crate::bench::Bench| bench.out.frames.iter().filter(|frame| frame.id() == id).count();
    assert_eq!(segments(&client.bench), 20);
    client.bench.run(Duration(999));
    assert_eq!(segments(&client.bench), 20);
    client.bench.run(Duration(1));
    assert_eq!(segments(&client.bench), 100);
}

/// The whole block has arrived before the reset, and the client sends the next one.
#[test]
fn the_block_after_a_complete_one_and_a_reset_is_no_request() {
    for lost in [0, 5] {
        let mut client = Client::new();
        client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
        for sequence in 1..=127 {
            client.send_segment(middle(LIKE_REQUESTS, sequence));
        }
        client.bench.nmt(0x82);
        client.bench.start();
        client.bench.take();
        assert_no_request(&mut client, 1 + lost, 0x0800_0022);
    }
}

#[test]
fn a_request_is_answered_a_tenth_of_a_second_after_the_last_segment_before_a_reset() {
    for (pause, is_answered) in [(99_999, false), (100_000, true)] {
        let mut client = Client::new();
        client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
        for sequence in 1..=0x3F {
            client.send_segment(middle([0; 7], sequence));
        }
        client.bench.nmt(0x82);
        client.bench.start();
        client.bench.run(Duration(pause));
        client.bench.take();
        // The request looks like the next segment, 40h.
        let answer = client.bench.ask(Request::Upload(Multiplexer { index: 0x1001, sub: 0 }));
        assert_eq!(answer.is_some(), is_answered, "after {pause} us");
    }
}

/// The client has sent its last segment, so no segment follows the time-out.
#[test]
fn a_request_after_a_time_out_at_the_end_of_a_download_is_answered() {
    let mut client = Client::new();
    let content = data(0x3F * 7);
    client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
    for sequence in 1..=0x3F {
        client.send_segment(segment(&content, usize::from(sequence) - 1, sequence));
    }
    client.bench.run(Duration::from_millis(1500));
    assert_eq!(client.response(), Some(Response::Abort(DOMAIN, 0x0504_0000)));
    assert_eq!(client.bench.read(0x1001, 0), Ok(vec![0]));
}

/// The caller has not polled in between.
#[test]
fn a_silence_of_a_second_within_a_block_ends_the_transfer() {
    let acknowledge = Response::BlockAcknowledge(3, BlockSize::MAX);
    for (silence, expected) in [(999_999, acknowledge), (1_000_000, Response::Abort(DOMAIN, 0x0504_0000))] {
        let mut client = Client::new();
        client.bench.ask(Request::BlockDownload { at: DOMAIN, crc: true, size: None });
        for sequence in 1..=3 {
            client.send_segment(middle([0; 7], sequence));
        }
        client.bench.now = client.bench.now + Duration(silence);
        client.bench.poll();
        assert_eq!(client.response(), Some(expected), "after {silence} us");
    }
}

/// An upload of 35 bytes whose first block, of two segments, has been sent.
fn begun_upload() -> Client {
    let mut client = Client::new();
    client.bench.device.application_mut().domain = data(35);
    client.bench.ask(Request::BlockUpload { at: DOMAIN, crc: true, block_size: 2, threshold: 0 });
    client.request(Request::BlockUploadStart);
    assert_eq!(client.block().len(), 2);
    client
}

#[test]
fn a_repeated_acknowledge_of_a_larger_block_is_ignored() {
    let mut client = begun_upload();
    let acknowledge = Request::BlockAcknowledge { sequence: 2, block_size: 1 };
    client.request(acknowledge);
    assert_eq!(client.block().len(), 1);
    client.request(acknowledge);
    assert_eq!(client.block(), [[0; 8]; 0], "the block has one segment");
    client.request(Request::BlockAcknowledge { sequence: 1, block_size: 2 });
    assert_eq!(client.block().len(), 2);
}

#[test]
fn a_begin_or_an_acknowledge_that_comes_again_later_ends_an_upload() {
    let abort = Some(Response::Abort(DOMAIN, 0x0504_0001));
    let mut client = begun_upload();
    client.request(Request::BlockAcknowledge { sequence: 2, block_size: 2 });
    assert_eq!(client.block().len(), 2);
    assert_eq!(client.bench.ask(Request::BlockUploadStart), abort);

    let mut client = begun_upload();
    client.request(Request::BlockAcknowledge { sequence: 2, block_size: 3 });
    assert_eq!(client.block().len(), 3);
    let all = Request::BlockAcknowledge { sequence: 3, block_size: 3 };
    assert_eq!(client.bench.ask(all), Some(Response::BlockUploadEnd(end(&data(35)))));
    assert_eq!(client.bench.ask(Request::BlockAcknowledge { sequence: 2, block_size: 3 }), abort);
}

#[test]
fn the_end_of_a_download_may_come_twice() {
    let mut client = Client::new();
    assert_eq!(client.download(DOMAIN, &data(20)), Response::BlockDownloaded);
    let again = client.bench.ask(Request::BlockDownloadEnd(end(&data(20))));
    assert_eq!((again, client.bench.device.application().downloads), (Some(Response::BlockDownloaded), 1));
}
