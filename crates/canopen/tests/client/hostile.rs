//! Servers that try to keep a client busy for ever, and servers that send random data. No transfer takes longer than
//! its limit, and none panics.

use canopen::client::sdo::{BlockDownload, BlockUpload, Buffer, Download, Error, Options, Upload};
use canopen::client::{Service, lss};
use canopen::sdo::{BlockSegment, BlockSize, Bytes, Request, Response, Segment};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::server::{Device, NODE, OBJECT, Outcome, Server, once, run};

/// The limit of a transfer, plus the time of its last frames.
const BOUND: u64 = 10_000_000 + 1_000;

fn bounded(service: &mut impl Service<Output = Outcome>, device: &mut impl Device) -> Outcome {
    let (outcome, end, _) = run(service, device);
    assert!(end.0 <= BOUND, "{end:?}");
    outcome
}

fn segments(data: &'static [u8]) -> impl FnMut([u8; 8]) -> Vec<[u8; 8]> {
    move |request| match Request::parse(&request) {
        Some(Request::Upload(at)) => vec![Response::UploadSegmented(at, None).encode()],
        Some(Request::UploadSegment { toggle }) => {
            vec![
                Response::UploadedSegment(Segment { toggle, last: false, data: Bytes::from_slice(data) })
                    .encode(),
            ]
        }
        _ => vec![],
    }
}

#[test]
fn segments_without_data_are_against_the_protocol() {
    let mut memory = [0; 64];
    let mut transfer = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
    assert_eq!(bounded(&mut transfer, &mut segments(&[])), Err(Error::Unexpected));
}

#[test]
fn segments_without_end_fill_the_memory_or_the_time_and_no_more() {
    let mut memory = vec![0; 1 << 20];
    let mut transfer = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
    assert_eq!(bounded(&mut transfer, &mut segments(&[1])), Err(Error::Late));
    let mut memory = [0; 64];
    let mut transfer = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
    assert_eq!(bounded(&mut transfer, &mut segments(&[1; 7])), Err(Error::TooLong));
}

#[test]
fn more_segments_than_announced_are_against_the_protocol() {
    let mut device = |request: [u8; 8]| match Request::parse(&request) {
        Some(Request::Upload(at)) => vec![Response::UploadSegmented(at, Some(10)).encode()],
        Some(Request::UploadSegment { toggle }) => {
            vec![
                Response::UploadedSegment(Segment { toggle, last: false, data: Bytes::new([1; 7], 7) })
                    .encode(),
            ]
        }
        _ => vec![],
    };
    let mut memory = [0; 64];
    let mut transfer = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
    assert_eq!(bounded(&mut transfer, &mut device), Err(Error::Unexpected));
}

#[test]
fn an_upload_with_wrong_sequence_numbers_ends() {
    for number in [2, 5, 127] {
        let segment =
            BlockSegment { last: number != 127, sequence: BlockSize::new(number).unwrap(), data: [0; 7] };
        let mut count = 0_u8;
        let mut device = |request: [u8; 8]| {
            count = count.wrapping_add(1);
            match Request::parse(&request) {
                Some(Request::BlockUpload { at, .. }) => {
                    vec![Response::BlockUpload { at, crc: true, size: None }.encode()]
                }
                _ => vec![BlockSegment { data: [count; 7], ..segment }.encode()],
            }
        };
        let mut memory = [0; 64];
        let mut transfer = BlockUpload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
        assert_eq!(bounded(&mut transfer, &mut device), Err(Error::Unexpected), "{number}");
    }
}

#[test]
fn a_download_without_an_acknowledged_segment_ends() {
    let mut device = |request: [u8; 8]| match request[0] {
        0xC6 => vec![Response::BlockDownload(OBJECT, BlockSize::new(1).unwrap()).encode()],
        _ => vec![Response::BlockAcknowledge(0, BlockSize::new(1).unwrap()).encode()],
    };
    let mut transfer = BlockDownload::new(NODE, OBJECT, &[1; 100], once());
    assert_eq!(bounded(&mut transfer, &mut device), Err(Error::Unexpected));
}

/// A server that answers each frame with the next of these answers.
fn parrot(answers: Vec<Vec<[u8; 8]>>) -> impl FnMut([u8; 8]) -> Vec<[u8; 8]> {
    let mut answers = answers.into_iter();
    move |_| answers.next().unwrap_or_default()
}

/// Random answers, often with a command byte that a client checks first.
fn answer() -> impl Strategy<Value = [u8; 8]> {
    let commands =
        prop_oneof![Just(0x60_u8), Just(0x41), Just(0x43), Just(0xA4), Just(0xA2), Just(0xC6), any::<u8>()];
    (commands, any::<bool>(), any::<[u8; 7]>()).prop_map(|(command, is_ours, rest)| {
        let [a, b, c, d, e, f, g] = rest;
        if is_ours { [command, 0x00, 0x20, 3, d, e, f, g] } else { [command, a, b, c, d, e, f, g] }
    })
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn any_answers_end_in_time(answers in vec(vec(answer(), 0..4), 0..200), len in 0..200_usize) {
        let data = vec![0x55; len];
        let mut memory = [0; 256];
        let _ = bounded(&mut Upload::new(NODE, OBJECT, Buffer::new(&mut memory), once()), &mut parrot(answers.clone()));
        let _ = bounded(&mut BlockUpload::new(NODE, OBJECT, Buffer::new(&mut memory), once()), &mut parrot(answers.clone()));
        let _ = bounded(&mut Download::new(NODE, OBJECT, &data, once()), &mut parrot(answers.clone()));
        let _ = bounded(&mut BlockDownload::new(NODE, OBJECT, &data, once()), &mut parrot(answers));
    }

    #[test]
    fn any_lss_answers_end_in_time(answers in vec(vec(any::<[u8; 8]>(), 0..4), 0..400)) {
        let mut parrot = parrot(answers);
        let options = lss::Options::default();
        let (_, end, _) = run(&mut lss::Fastscan::new(options), &mut parrot);
        prop_assert!(end.0 < 3 * 133 * 210_000);
        let (_, end, _) = run(&mut lss::store(options), &mut parrot);
        prop_assert!(end.0 < 400_000);
    }
}

/// A server that falls silent after the second answer of the first attempt.
fn silent_once(value: &[u8]) -> impl FnMut([u8; 8]) -> Vec<[u8; 8]> {
    let (mut server, mut attempts, mut answers) = (Server::new(value), 0, 0);
    move |request| {
        if let Some(Request::Upload(_) | Request::BlockUpload { .. }) = Request::parse(&request) {
            (attempts, answers) = (attempts + 1, 0);
        }
        answers += 1;
        let answer = server.answer(request);
        if attempts == 1 && answers > 2 { vec![] } else { answer }
    }
}

#[test]
fn a_retry_begins_without_the_data_of_the_first_attempt() {
    let value: Vec<u8> = (0..60).collect();
    let options = Options { retries: 1, block_size: BlockSize::new(2).unwrap(), ..once() };
    let mut memory = [0; 64];
    let mut transfer = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), options);
    assert_eq!(bounded(&mut transfer, &mut silent_once(&value)), Ok(()));
    assert_eq!(transfer.into_sink().as_slice(), value);
    let mut memory = [0; 64];
    let mut transfer = BlockUpload::new(NODE, OBJECT, Buffer::new(&mut memory), options);
    assert_eq!(bounded(&mut transfer, &mut silent_once(&value)), Ok(()));
    assert_eq!(transfer.into_sink().as_slice(), value);
}

#[test]
fn an_answer_of_another_protocol_is_no_silence() {
    let mut memory = [0; 64];
    let mut transfer = Upload::new(NODE, OBJECT, Buffer::new(&mut memory), once());
    let mut device = |_: [u8; 8]| vec![Response::DownloadedSegment { toggle: false }.encode()];
    assert_eq!(bounded(&mut transfer, &mut device), Err(Error::Unexpected));
    let mut transfer = Download::new(NODE, OBJECT, &[1], once());
    assert_eq!(bounded(&mut transfer, &mut |_: [u8; 8]| vec![]), Err(Error::NoAnswer));
}
