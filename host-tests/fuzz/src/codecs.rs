//! The codecs: eight arbitrary bytes are refused, or have the same meaning after decoding and encoding.

use canopen::emcy::Message;
use canopen::pdo::{MappedObject, Transmission};
use canopen::sdo::{BlockSegment, Request, Response};
use canopen::{CanId, CobId, Frame, NodeId, lss, nmt};

/// Decodes and encodes frames of eight bytes.
pub fn run(data: &[u8]) {
    for frame in data.as_chunks::<8>().0 {
        services(*frame);
        values(*frame);
    }
    frame(data);
}

fn services(frame: [u8; 8]) {
    again(frame, |frame| Request::parse(&frame), |request| request.encode());
    again(frame, Response::parse, |response| response.encode());
    again(frame, BlockSegment::parse, |segment| segment.encode());
    again(frame, lss::Request::parse, |request| request.encode());
    again(frame, lss::Response::parse, |response| response.encode());
    again(frame, |frame| Some(Message::parse(frame)), |message| message.encode());
}

fn values(frame: [u8; 8]) {
    let [a, b, c, d, e, f, ..] = frame;
    let word = u32::from_le_bytes([a, b, c, d]);
    if let Some(cob_id) = CobId::parse(word) {
        assert_eq!(CobId::parse(cob_id.encode()), Some(cob_id));
    }
    let mapped = MappedObject::parse(word);
    assert_eq!(MappedObject::parse(mapped.encode()), mapped);
    assert_eq!(CanId::new(u16::from_le_bytes([a, b])).is_some(), u16::from_le_bytes([a, b]) <= 0x7FF);
    let _ = Transmission::parse(e);
    if let Some(own) = NodeId::new(f) {
        let _ = nmt::Command::parse(&[a, b], own);
    }
}

fn frame(data: &[u8]) {
    let [low, high, bytes @ ..] = data else { return };
    let id = u16::from_le_bytes([*low, *high]);
    match Frame::new(id, bytes) {
        Some(frame) => assert_eq!((frame.id(), frame.data()), (id, bytes)),
        None => assert!(id > 0x7FF || bytes.len() > 8),
    }
}

/// An accepted message has the same meaning after a round trip, whatever the values of its reserved bits.
fn again<T: PartialEq + std::fmt::Debug>(
    frame: [u8; 8],
    parse: impl Fn([u8; 8]) -> Option<T>,
    encode: impl Fn(&T) -> [u8; 8],
) {
    if let Some(value) = parse(frame) {
        assert_eq!(parse(encode(&value)), Some(value));
    }
}
