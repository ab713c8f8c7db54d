//! Every codec: parsing an encoded value gives the value back, and any bytes are either parsed or refused.

use canopen::emcy::Message;
use canopen::lss::{self, BitRate, Bound, Part};
use canopen::nmt::Command;
use canopen::pdo::{MappedObject, Transmission};
use canopen::sdo::{
    BlockEnd, BlockSegment, BlockSize, Bytes, Initiate, Multiplexer, Request, Response, Segment,
};
use canopen::{CanId, CobId, Frame, NodeId};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn repeatable() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() }
}

fn multiplexer() -> impl Strategy<Value = Multiplexer> {
    any::<(u16, u8)>().prop_map(|(index, sub)| Multiplexer { index, sub })
}

fn short() -> impl Strategy<Value = Bytes<4>> {
    (any::<[u8; 4]>(), 1..=4_u8).prop_map(|(data, len)| Bytes::new(data, len))
}

fn segment() -> impl Strategy<Value = Segment> {
    let data = (any::<[u8; 7]>(), 0..=7_u8).prop_map(|(data, len)| Bytes::new(data, len));
    (any::<bool>(), any::<bool>(), data).prop_map(|(toggle, last, data)| Segment { toggle, last, data })
}

fn initiate() -> impl Strategy<Value = Initiate> {
    prop_oneof![
        short().prop_map(Initiate::Expedited),
        any::<[u8; 4]>().prop_map(Initiate::Unsized),
        any::<Option<u32>>().prop_map(Initiate::Segmented),
    ]
}

fn block_size() -> impl Strategy<Value = BlockSize> {
    (1..=127_u8).prop_map(|size| BlockSize::new(size).unwrap())
}

fn block_end() -> impl Strategy<Value = BlockEnd> {
    (0..=7_u8, any::<u16>()).prop_map(|(unused, crc)| BlockEnd { unused, crc })
}

fn block_request() -> impl Strategy<Value = Request> {
    prop_oneof![
        (multiplexer(), any::<bool>(), any::<Option<u32>>())
            .prop_map(|(at, crc, size)| Request::BlockDownload { at, crc, size }),
        block_end().prop_map(Request::BlockDownloadEnd),
        (multiplexer(), any::<bool>(), any::<u8>(), any::<u8>()).prop_map(
            |(at, crc, block_size, threshold)| Request::BlockUpload { at, crc, block_size, threshold }
        ),
        Just(Request::BlockUploadStart),
        any::<(u8, u8)>()
            .prop_map(|(sequence, block_size)| Request::BlockAcknowledge { sequence, block_size }),
        Just(Request::BlockUploadEnded),
    ]
}

fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        (multiplexer(), initiate()).prop_map(|(at, initiate)| Request::Download(at, initiate)),
        segment().prop_map(Request::DownloadSegment),
        multiplexer().prop_map(Request::Upload),
        any::<bool>().prop_map(|toggle| Request::UploadSegment { toggle }),
        (multiplexer(), any::<u32>()).prop_map(|(at, code)| Request::Abort(at, code)),
        block_request(),
    ]
}

fn response() -> impl Strategy<Value = Response> {
    prop_oneof![
        multiplexer().prop_map(Response::Downloaded),
        any::<bool>().prop_map(|toggle| Response::DownloadedSegment { toggle }),
        (multiplexer(), short()).prop_map(|(at, data)| Response::Uploaded(at, data)),
        (multiplexer(), any::<Option<u32>>()).prop_map(|(at, size)| Response::UploadSegmented(at, size)),
        segment().prop_map(Response::UploadedSegment),
        (multiplexer(), any::<u32>()).prop_map(|(at, code)| Response::Abort(at, code)),
        (multiplexer(), block_size()).prop_map(|(at, size)| Response::BlockDownload(at, size)),
        (any::<u8>(), block_size()).prop_map(|(last, size)| Response::BlockAcknowledge(last, size)),
        Just(Response::BlockDownloaded),
        (multiplexer(), any::<bool>(), any::<Option<u32>>())
            .prop_map(|(at, crc, size)| Response::BlockUpload { at, crc, size }),
        block_end().prop_map(Response::BlockUploadEnd),
    ]
}

fn lss_request() -> impl Strategy<Value = lss::Request> {
    use lss::Request;
    let part = || prop::sample::select(Part::ALL.to_vec());
    let bit = prop_oneof![4 => 0..32_u8, 1 => Just(Request::CONFIRM)];
    prop_oneof![
        any::<bool>().prop_map(|configuration| Request::SwitchGlobal { configuration }),
        (part(), any::<u32>()).prop_map(|(part, value)| Request::Select(part, value)),
        any::<u8>().prop_map(Request::NodeId),
        any::<(u8, u8)>().prop_map(|(table, index)| Request::BitTiming { table, index }),
        any::<u16>().prop_map(|delay| Request::Activate { delay }),
        Just(Request::Store),
        (prop::sample::select(Bound::ALL.to_vec()), any::<u32>())
            .prop_map(|(bound, value)| Request::Identify(bound, value)),
        Just(Request::IdentifyUnconfigured),
        (any::<u32>(), bit, 0..4_u8, 0..4_u8).prop_map(|(value, bit, part, next)| Request::Fastscan {
            value,
            bit,
            part,
            next
        }),
        part().prop_map(Request::Inquire),
        Just(Request::InquireNodeId),
    ]
}

fn lss_response() -> impl Strategy<Value = lss::Response> {
    use lss::Response;
    let part = prop::sample::select(Part::ALL.to_vec());
    prop_oneof![
        Just(Response::Selected),
        any::<u8>().prop_map(Response::NodeId),
        any::<u8>().prop_map(Response::BitTiming),
        any::<u8>().prop_map(Response::Stored),
        Just(Response::Identified),
        Just(Response::Unconfigured),
        (part, any::<u32>()).prop_map(|(part, value)| Response::Identity(part, value)),
        any::<u8>().prop_map(Response::NodeIdIs),
    ]
}

proptest! {
    #![proptest_config(repeatable())]

    #[test]
    fn sdo_requests(request in request()) {
        prop_assert_eq!(Request::parse(&request.encode()), Some(request));
    }

    #[test]
    fn sdo_responses(response in response()) {
        prop_assert_eq!(Response::parse(response.encode()), Some(response));
    }

    /// An accepted frame means the same after a round trip, whatever its reserved bits.
    #[test]
    fn any_eight_bytes_parse_or_are_refused(frame in any::<[u8; 8]>()) {
        if let Some(request) = Request::parse(&frame) {
            prop_assert_eq!(Request::parse(&request.encode()), Some(request));
        }
        if let Some(response) = Response::parse(frame) {
            prop_assert_eq!(Response::parse(response.encode()), Some(response));
        }
        match BlockSegment::parse(frame) {
            Some(segment) => prop_assert_eq!(segment.encode(), frame),
            None => prop_assert_eq!(frame[0] & 0x7F, 0),
        }
        if let Some(request) = lss::Request::parse(frame) {
            prop_assert_eq!(lss::Request::parse(request.encode()), Some(request));
        }
        if let Some(response) = lss::Response::parse(frame) {
            prop_assert_eq!(lss::Response::parse(response.encode()), Some(response));
        }
        prop_assert_eq!(Message::parse(frame).encode(), frame);
    }

    #[test]
    fn lss_requests(request in lss_request()) {
        prop_assert_eq!(lss::Request::parse(request.encode()), Some(request));
    }

    #[test]
    fn lss_responses(response in lss_response()) {
        prop_assert_eq!(lss::Response::parse(response.encode()), Some(response));
    }

    #[test]
    fn bit_rates(index in 0..12_u8, kbit in any::<u16>()) {
        if let Some(rate) = BitRate::from_index(index) {
            prop_assert_eq!((rate.index(), BitRate::from_kbit(rate.kbit())), (index, Some(rate)));
        }
        prop_assert!(BitRate::from_kbit(kbit).is_none_or(|rate| rate.kbit() == kbit));
    }

    #[test]
    fn block_segments(last in any::<bool>(), sequence in block_size(), data in any::<[u8; 7]>()) {
        let segment = BlockSegment { last, sequence, data };
        prop_assert_eq!(BlockSegment::parse(segment.encode()), Some(segment));
    }

    #[test]
    fn emcy_messages(code in any::<u16>(), register in any::<u8>(), detail in any::<[u8; 5]>()) {
        let message = Message { code, register, detail };
        prop_assert_eq!(Message::parse(message.encode()), message);
    }

    /// Only base frames of at most eight bytes are frames, and only 11 bits are a CAN-ID.
    #[test]
    fn frames(id in 0..0x900_u16, data in prop::collection::vec(any::<u8>(), 0..=9)) {
        let is_valid = id <= 0x7FF && data.len() <= 8;
        let frame = Frame::new(id, &data);
        prop_assert_eq!(frame.map(|frame| frame.is_empty()), is_valid.then_some(data.is_empty()));
        prop_assert_eq!(frame.map(|frame| (frame.id(), frame.data().to_vec())), is_valid.then_some((id, data)));
        prop_assert_eq!(CanId::new(id).map(CanId::get), (id <= 0x7FF).then_some(id));
    }

    #[test]
    fn nmt_commands(data in prop::collection::vec(any::<u8>(), 0..=8), id in 1..=127_u8) {
        let own = NodeId::new(id).unwrap();
        if let Some(command) = Command::parse(&data, own) {
            let node = Some(own).filter(|_| data[1] != 0);
            prop_assert_eq!(command.encode(node).to_vec(), data);
        }
    }

    #[test]
    fn cob_ids(value in any::<u32>()) {
        match CobId::parse(value) {
            Some(cob_id) => prop_assert_eq!(cob_id.encode(), value),
            None => prop_assert!(value & 0x3FFF_F800 != 0),
        }
    }

    #[test]
    fn mapped_objects(value in any::<u32>()) {
        prop_assert_eq!(MappedObject::parse(value).encode(), value);
    }

    #[test]
    fn transmission_types(value in any::<u8>()) {
        prop_assert_eq!(Transmission::parse(value).is_none(), (241..=251).contains(&value));
    }
}

proptest! {
    #![proptest_config(repeatable())]

    #[test]
    fn any_multiplexed_pdo_encodes_to_its_own_bytes(frame: [u8; 8]) {
        use canopen::pdo::Mpdo;
        if let Some(mpdo) = Mpdo::parse(frame) {
            prop_assert_eq!(mpdo.encode(), frame);
        } else {
            prop_assert_eq!(frame[0], 0);
        }
    }
}

#[test]
fn a_fastscan_with_a_field_out_of_range_is_refused() {
    let parse = |bit, part, next| lss::Request::parse([0x51, 1, 2, 3, 4, bit, part, next]);
    for (bit, part, next) in [(31, 3, 3), (lss::Request::CONFIRM, 0, 0)] {
        assert_eq!(
            parse(bit, part, next),
            Some(lss::Request::Fastscan { value: 0x0403_0201, bit, part, next })
        );
    }
    for (bit, part, next) in [(32, 0, 0), (127, 0, 0), (0, 4, 0), (0, 0, 4), (32, 4, 4)] {
        assert_eq!(parse(bit, part, next), None, "bit {bit}, part {part}, next {next}");
    }
}

#[test]
fn a_frame_is_shown_with_its_identifier_its_kind_and_its_data() {
    let shown = |frame: Option<Frame>| format!("{:?}", frame.unwrap());
    assert_eq!(shown(Frame::new(0x123, &[1, 2])), "Frame { id: 291, remote: false, len: 2, data: [1, 2] }");
    assert_eq!(shown(Frame::remote(0x7FF, 8)), "Frame { id: 2047, remote: true, len: 8, data: [] }");
}

#[test]
fn a_full_queue_is_shown_in_words() {
    assert_eq!(canopen::QueueFull.to_string(), "the transmit queue is full");
}

#[test]
fn an_lss_request_with_one_byte_is_parsed_and_a_reserved_mode_is_refused() {
    let parse = |command, first| lss::Request::parse([command, first, 0, 0, 0, 0, 0, 0]);
    assert_eq!(parse(0x04, 0), Some(lss::Request::SwitchGlobal { configuration: false }));
    assert_eq!(parse(0x04, 1), Some(lss::Request::SwitchGlobal { configuration: true }));
    assert_eq!(parse(0x04, 2), None);
    assert_eq!(parse(0x5E, 0), Some(lss::Request::InquireNodeId));
}

#[test]
fn a_block_upload_has_a_crc_if_its_bit_is_set() {
    let at = Multiplexer { index: 0x1008, sub: 2 };
    for (command, crc) in [(0xA0, false), (0xA4, true)] {
        let request = Request::BlockUpload { at, crc, block_size: 7, threshold: 9 };
        assert_eq!(Request::parse(&[command, 0x08, 0x10, 2, 7, 9, 0, 0]), Some(request));
    }
}

/// Bit 0 of a command says that there is a size, bit 1 that the data is in the frame.
#[test]
fn the_two_lowest_bits_of_a_command_say_what_the_four_data_bytes_are() {
    let at = Multiplexer { index: 0x1008, sub: 2 };
    let frame = |command| [command, 0x08, 0x10, 2, 1, 2, 3, 4];
    let size = Some(0x0403_0201);
    for (command, initiate) in [
        (0x20, Initiate::Segmented(None)),
        (0x21, Initiate::Segmented(size)),
        (0x22, Initiate::Unsized([1, 2, 3, 4])),
        (0x2B, Initiate::Expedited(Bytes::from_slice(&[1, 2]))),
    ] {
        assert_eq!(Request::parse(&frame(command)), Some(Request::Download(at, initiate)), "{command:X}h");
    }
    for (command, response) in [
        (0x40, Response::UploadSegmented(at, None)),
        (0x41, Response::UploadSegmented(at, size)),
        (0x42, Response::Uploaded(at, Bytes::from_slice(&[1, 2, 3, 4]))),
        (0x4B, Response::Uploaded(at, Bytes::from_slice(&[1, 2]))),
    ] {
        assert_eq!(Response::parse(frame(command)), Some(response), "{command:X}h");
    }
}

#[test]
fn a_remote_frame_has_a_can_id_and_at_most_eight_bytes() {
    for (id, len, is_valid) in [
        (0, 0, true),
        (0x7FF, 8, true),
        (0x800, 0, false),
        (0x800, 8, false),
        (0x7FF, 9, false),
        (0, 9, false),
    ] {
        let frame = Frame::remote(id, len).map(|frame| (frame.id(), frame.len(), frame.is_remote()));
        assert_eq!(frame, is_valid.then_some((id, len.into(), true)), "{id:X}h, {len}");
    }
}

#[test]
fn a_cob_id_has_eleven_bits_and_two_flags() {
    for bits in [0, 0x4000_0000, 0x8000_0000] {
        assert_eq!(CobId::parse(bits | 0x7FF).map(CobId::encode), Some(bits | 0x7FF));
        for wrong in [0x800, 0x2000_0000] {
            assert_eq!(CobId::parse(bits | wrong), None, "{:08X}h", bits | wrong);
        }
    }
}

#[test]
fn an_abort_is_shown_with_its_meaning_and_its_code() {
    let text = canopen::sdo::Abort::NoObject.to_string();
    assert_eq!(text, "object does not exist in the object dictionary (06020000h)");
}
