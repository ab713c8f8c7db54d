//! The SDO server: transfers, and an abort code for every possible error.

use crate::bench::Bench;
use canopen::sdo::{Bytes, Initiate, Multiplexer, Request, Response, Segment};
use canopen::{Duration, Frame};

const NAME: &[u8] = b"a name of twenty-six chars";
const TEXT: Multiplexer = Multiplexer { index: 0x6103, sub: 0 };

fn segment(toggle: bool, last: bool, bytes: &[u8]) -> Request {
    Request::DownloadSegment(Segment { toggle, last, data: Bytes::from_slice(bytes) })
}

fn begin_download(bench: &mut Bench, size: Option<u32>) -> Option<Response> {
    bench.ask(Request::Download(TEXT, Initiate::Segmented(size)))
}

fn abort(at: Multiplexer, code: u32) -> Option<Response> {
    Some(Response::Abort(at, code))
}

#[test]
fn expedited_upload_on_the_wire() {
    let mut bench = Bench::booted();
    bench.receive(Frame::new(0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]).unwrap());
    assert_eq!(bench.sent(), [(0x585, vec![0x43, 0x00, 0x10, 0, 0x94, 0x01, 0x02, 0x00])]);
    bench.receive(Frame::new(0x605, &[0x40, 0x01, 0x10, 0, 0, 0, 0, 0]).unwrap());
    assert_eq!(bench.sent(), [(0x585, vec![0x4F, 0x01, 0x10, 0, 0, 0, 0, 0])]);
}

#[test]
fn expedited_download_on_the_wire() {
    let mut bench = Bench::booted();
    bench.receive(Frame::new(0x605, &[0x2B, 0x17, 0x10, 0, 0x00, 0x00, 0, 0]).unwrap());
    assert_eq!(bench.sent(), [(0x585, vec![0x60, 0x17, 0x10, 0, 0, 0, 0, 0])]);
}

#[test]
fn without_a_size_the_type_says_it() {
    let mut bench = Bench::booted();
    assert!(bench.ask_raw([0x22, 0x00, 0x61, 0, 3, 0, 0xAA, 0xAA]).is_some());
    assert_eq!(bench.read(0x6100, 0), Ok(vec![3, 0]));
}

#[test]
fn segmented_upload_of_a_string() {
    let mut bench = Bench::booted();
    assert_eq!(bench.read(0x1008, 0), Ok(NAME.to_vec()));
}

#[test]
fn segmented_download_and_back() {
    let mut bench = Bench::booted();
    for size in [Some(16), None] {
        assert_eq!(begin_download(&mut bench, size), Some(Response::Downloaded(TEXT)));
        for (toggle, last, part) in
            [(false, false, "seven b"), (true, false, "ytes an"), (false, true, "d 2")]
        {
            let response = bench.ask(segment(toggle, last, part.as_bytes()));
            let expected = if size.is_some() && last {
                Response::Abort(TEXT, 0x0607_0012)
            } else {
                Response::DownloadedSegment { toggle }
            };
            assert_eq!(response, Some(expected));
        }
    }
    assert_eq!(bench.read(0x6103, 0), Ok(b"seven bytes and 2".to_vec()));
}

#[test]
fn a_short_value_can_come_in_a_segment() {
    let mut bench = Bench::booted();
    let at = Multiplexer { index: 0x6100, sub: 0 };
    bench.ask(Request::Download(at, Initiate::Segmented(Some(2))));
    assert_eq!(bench.ask(segment(false, true, &[4, 0])), Some(Response::DownloadedSegment { toggle: false }));
    assert_eq!(bench.read(0x6100, 0), Ok(vec![4, 0]));
}

#[test]
fn faults_of_an_access_have_their_abort_codes() {
    let mut bench = Bench::booted();
    assert_eq!(bench.read(0x2000, 0), Err(0x0602_0000));
    assert_eq!(bench.read(0x1800, 4), Err(0x0609_0011));
    assert_eq!(bench.read(0x1013, 0), Err(0x0602_0000));
    assert_eq!(bench.read(0x6102, 0), Err(0x0601_0001));
    assert_eq!(bench.write32(0x2000, 0, 0), Err(0x0602_0000));
    assert_eq!(bench.write32(0x1800, 7, 0), Err(0x0609_0011));
    assert_eq!(bench.write32(0x1000, 0, 0), Err(0x0601_0002));
    assert_eq!(bench.write32(0x1008, 0, 0), Err(0x0601_0002));
    assert_eq!(bench.write32(0x6100, 0, 0), Err(0x0607_0012));
    assert_eq!(bench.write(0x6100, 0, &[1]), Err(0x0607_0013));
    assert_eq!(bench.write(0x6100, 0, &[6, 0]), Err(0x0609_0031));
    assert_eq!(bench.write(0x6100, 0, &[0xFA, 0xFF]), Err(0x0609_0032));
    assert_eq!(bench.write32(0x6101, 0, f32::NAN.to_bits()), Err(0x0609_0030));
    assert_eq!(bench.write32(0x6101, 0, f32::INFINITY.to_bits()), Err(0x0609_0030));
}

#[test]
fn the_application_decides_on_its_own_objects() {
    let mut bench = Bench::booted();
    bench.take_parameters();
    assert_eq!(bench.write32(0x6102, 0, 4712), Err(0x0800_0020));
    assert!(!bench.take_parameters());
    assert_eq!(bench.write32(0x6102, 0, 4711), Ok(()));
    assert!(bench.take_parameters());
    assert!(!bench.take_parameters());
}

#[test]
fn a_segment_without_a_transfer_is_no_valid_command() {
    let mut bench = Bench::booted();
    let nothing = Multiplexer::default();
    assert_eq!(bench.ask(Request::UploadSegment { toggle: false }), abort(nothing, 0x0504_0001));
    assert_eq!(bench.ask(segment(false, true, &[1])), abort(nothing, 0x0504_0001));
    assert_eq!(bench.ask_raw([0xE0, 0, 0, 0, 0, 0, 0, 0]), abort(nothing, 0x0504_0001));
}

#[test]
fn the_abort_of_an_unknown_command_names_the_object_of_the_frame() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write32(0x6102, 0, 4711), Ok(()));
    let at = Multiplexer { index: 0x1017, sub: 3 };
    assert_eq!(bench.ask_raw([0xE0, 0x17, 0x10, 3, 0, 0, 0, 0]), abort(at, 0x0504_0001));
}

#[test]
fn an_unknown_command_ends_the_transfer_under_way_and_names_its_object() {
    let mut bench = Bench::booted();
    let at = Multiplexer { index: 0x1008, sub: 0 };
    bench.ask(Request::Upload(at));
    assert_eq!(bench.ask_raw([0xE0, 0x17, 0x10, 3, 0, 0, 0, 0]), abort(at, 0x0504_0001));
    assert_eq!(bench.ask(Request::UploadSegment { toggle: false }), abort(at, 0x0504_0001));
}

#[test]
fn the_toggle_bit_must_alternate() {
    let mut bench = Bench::booted();
    let at = Multiplexer { index: 0x1008, sub: 0 };
    bench.ask(Request::Upload(at));
    assert_eq!(bench.ask(Request::UploadSegment { toggle: true }), abort(at, 0x0503_0000));
    assert_eq!(bench.ask(Request::UploadSegment { toggle: false }), abort(at, 0x0504_0001));
    begin_download(&mut bench, None);
    assert_eq!(bench.ask(segment(true, false, b"1234567")), abort(TEXT, 0x0503_0000));
}

#[test]
fn a_download_must_have_the_announced_length() {
    let mut bench = Bench::booted();
    assert_eq!(begin_download(&mut bench, Some(21)), abort(TEXT, 0x0607_0012));
    assert_eq!(begin_download(&mut bench, Some(u32::MAX)), abort(TEXT, 0x0607_0012));
    begin_download(&mut bench, Some(9));
    assert_eq!(bench.ask(segment(false, true, b"1234567")), abort(TEXT, 0x0607_0013));
    begin_download(&mut bench, None);
    for toggle in [false, true] {
        bench.ask(segment(toggle, false, b"1234567"));
    }
    assert_eq!(bench.ask(segment(false, true, b"1234567")), abort(TEXT, 0x0607_0012));
}

#[test]
fn a_silent_client_times_out() {
    let mut bench = Bench::booted();
    begin_download(&mut bench, None);
    bench.run(Duration::from_millis(999));
    assert!(!bench.sent().iter().any(|(id, _)| *id == 0x585));
    bench.run(Duration::from_millis(1));
    assert!(bench.sent().contains(&(0x585, vec![0x80, 0x03, 0x61, 0, 0, 0, 0x04, 0x05])));
    assert_eq!(bench.ask(segment(false, true, b"x")), abort(TEXT, 0x0504_0001));
}

#[test]
fn a_repeated_segment_after_the_time_out_is_too_late() {
    let mut bench = Bench::booted();
    let at = Multiplexer { index: 0x1008, sub: 0 };
    bench.ask(Request::Upload(at));
    let again = Request::UploadSegment { toggle: false };
    assert!(matches!(bench.ask(again), Some(Response::UploadedSegment(_))));
    bench.run(Duration::from_millis(1000));
    assert_eq!(bench.ask(again), abort(at, 0x0504_0001));
}

#[test]
fn an_abort_of_the_client_ends_the_transfer_without_an_answer() {
    let mut bench = Bench::booted();
    begin_download(&mut bench, None);
    assert_eq!(bench.ask(Request::Abort(TEXT, 0x0800_0000)), None);
    bench.take();
    bench.run(Duration::from_millis(900));
    assert_eq!(bench.sent(), []);
    assert_eq!(bench.ask(Request::Abort(TEXT, 0x0800_0000)), None);
}

#[test]
fn a_new_request_replaces_a_transfer() {
    let mut bench = Bench::booted();
    begin_download(&mut bench, None);
    assert_eq!(bench.read(0x1008, 0), Ok(NAME.to_vec()));
    assert_eq!(bench.read(0x6103, 0), Ok(vec![0]));
}

#[test]
fn a_response_waits_for_room_in_the_queue() {
    let mut bench = Bench::booted();
    bench.out.room = 0;
    assert_eq!(bench.ask_raw([0x40, 0x01, 0x10, 0, 0, 0, 0, 0]), None);
    bench.out.room = 1;
    bench.run(Duration::from_millis(1));
    assert_eq!(bench.sent(), [(0x585, vec![0x4F, 0x01, 0x10, 0, 0, 0, 0, 0])]);
}

#[test]
fn a_request_has_eight_bytes() {
    let mut bench = Bench::booted();
    bench.receive(Frame::new(0x605, &[0x40, 0x00, 0x10, 0]).unwrap());
    bench.receive(Frame::remote(0x605, 8).unwrap());
    assert_eq!(bench.sent(), []);
}

#[test]
fn a_repeated_segment_is_answered_again_and_counts_once() {
    let mut bench = Bench::booted();
    let at = Multiplexer { index: 0x1008, sub: 0 };
    bench.ask(Request::Upload(at));
    let first = bench.ask(Request::UploadSegment { toggle: false });
    assert_eq!(bench.ask(Request::UploadSegment { toggle: false }), first);
    assert!(matches!(
        bench.ask(Request::UploadSegment { toggle: true }),
        Some(Response::UploadedSegment(segment)) if segment.data.as_slice() == &NAME[7..14]
    ));
    begin_download(&mut bench, Some(9));
    for (toggle, last, part) in [(false, false, "seven b"), (true, true, "yt")] {
        for _ in 0..2 {
            let response = bench.ask(segment(toggle, last, part.as_bytes()));
            assert_eq!(response, Some(Response::DownloadedSegment { toggle }));
        }
    }
    assert_eq!(bench.read(0x6103, 0), Ok(b"seven byt".to_vec()));
}

#[test]
fn another_segment_with_the_same_toggle_bit_is_no_repetition() {
    let mut bench = Bench::booted();
    begin_download(&mut bench, None);
    bench.ask(segment(false, false, b"1234567"));
    assert_eq!(bench.ask(segment(false, false, b"1234568")), abort(TEXT, 0x0503_0000));
}

#[test]
fn no_transfer_outlives_a_reset() {
    for command in [0x81, 0x82] {
        let mut bench = Bench::booted();
        assert_eq!(begin_download(&mut bench, Some(16)), Some(Response::Downloaded(TEXT)));
        bench.nmt(command);
        bench.start();
        bench.take();
        let response = bench.ask(segment(false, false, b"seven b"));
        assert_eq!(response, abort(Multiplexer { index: 0, sub: 0 }, 0x0504_0001), "{command:02X}h");
    }
}
