//! Every codec: parse of encode is the identity, and any bytes parse or are refused.

use canopen::emcy::Message;
use canopen::nmt::Command;
use canopen::pdo::{MappedObject, Transmission};
use canopen::sdo::{
    BlockEnd, BlockSegment, BlockSize, Bytes, Initiate, Multiplexer, Request, Response, Segment,
};
use canopen::{CobId, NodeId};
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

proptest! {
    #![proptest_config(repeatable())]

    #[test]
    fn sdo_requests(request in request()) {
        prop_assert_eq!(Request::parse(request.encode()), Some(request));
    }

    #[test]
    fn sdo_responses(response in response()) {
        prop_assert_eq!(Response::parse(response.encode()), Some(response));
    }

    /// What was accepted means the same after a round trip, whatever its reserved bits were.
    #[test]
    fn any_eight_bytes_parse_or_are_refused(frame in any::<[u8; 8]>()) {
        if let Some(request) = Request::parse(frame) {
            prop_assert_eq!(Request::parse(request.encode()), Some(request));
        }
        if let Some(response) = Response::parse(frame) {
            prop_assert_eq!(Response::parse(response.encode()), Some(response));
        }
        match BlockSegment::parse(frame) {
            Some(segment) => prop_assert_eq!(segment.encode(), frame),
            None => prop_assert_eq!(frame[0] & 0x7F, 0),
        }
        prop_assert_eq!(Message::parse(frame).encode(), frame);
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
