//! SDO beside the default server: a second server (1201h) and a client (1280h).

use canopen::client::sdo::{Buffer, Options, Upload};
use canopen::client::{Service, Step};
use canopen::dictionary::{Access, Dictionary, Group, Object, Services, Sizes, Type};
use canopen::nmt::Command;
use canopen::sdo::{BlockSize, Multiplexer, Request};
use canopen::{Action, Definition, Device, Frame, Instant, NodeId, objects};

use crate::exchange;
use crate::service_device::Loader;
use crate::types::Sent;

const ID: u8 = 5;
const TEXT: &str = "a name of more than seven bytes";
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::device_name(TEXT)],
    objects::store_parameters(),
    objects::default_sdo_server(),
    objects::sdo_server(2),
    objects::sdo_server(3),
    objects::sdo_client(1),
    objects::identity(0, 1, 1),
    [
        Object::new(0x2000, 0, "", Type::Unsigned32, Access::ReadWrite).stored(Group::Application),
        Object::new(0x2001, 0, "", Type::Domain, Access::ReadWrite),
    ],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

type Node = canopen::device!(Loader, ROWS);

/// The channels of the device: the CAN-IDs of request and response.
const DEFAULT: (u16, u16) = (0x605, 0x585);
const SECOND: (u16, u16) = (0x6A0, 0x6B0);

fn node() -> Node {
    let mut node = Device::new(&DICTIONARY, NodeId::new(ID), Loader::default());
    let _ = node.start(Instant(0), &mut Sent::default());
    node
}

/// A node whose second channel is enabled.
fn with_two_channels() -> Node {
    let mut node = node();
    enable(&mut node, 0x1201, SECOND);
    node
}

fn enable(node: &mut Node, index: u16, (request, response): (u16, u16)) {
    assert_eq!(write(node, (index, 1), &u32::from(request).to_le_bytes()), Ok(()));
    assert_eq!(write(node, (index, 2), &u32::from(response).to_le_bytes()), Ok(()));
}

/// Writes over the default channel.
fn write(node: &mut Node, (index, sub): (u16, u8), bytes: &[u8]) -> Result<(), u32> {
    exchange::write(ID, Multiplexer { index, sub }, bytes, |request| {
        ask(node, DEFAULT, request.data(), 1)
            .iter()
            .map(|data| Frame::new(DEFAULT.1, data).unwrap())
            .collect()
    })
}

/// The responses on the same channel. No frame with another CAN-ID may be sent.
fn ask(node: &mut Node, (request, response): (u16, u16), data: &[u8], now: u64) -> Vec<[u8; 8]> {
    let mut sent = Sent::default();
    let next = node.on_service_frame(&Frame::new(request, data).unwrap(), Instant(now), &mut sent);
    assert!(next.services > Instant(now) || next.action.is_some() || next.services == Instant(0));
    assert!(sent.0.iter().all(|frame| frame.id() == response), "{:?}", sent.0);
    sent.0.iter().map(|frame| frame.data().try_into().unwrap()).collect()
}

const NAME: Multiplexer = Multiplexer { index: 0x1008, sub: 0 };

/// The bytes of an upload of the name, segment by segment.
struct Reading {
    channel: (u16, u16),
    toggle: bool,
    bytes: Vec<u8>,
}

impl Reading {
    fn begin(node: &mut Node, channel: (u16, u16)) -> Reading {
        assert_eq!(ask(node, channel, &Request::Upload(NAME).encode(), 2)[0][0], 0x41);
        Reading { channel, toggle: false, bytes: Vec::new() }
    }

    /// Whether the last segment has arrived.
    fn step(&mut self, node: &mut Node) -> bool {
        let segment = ask(node, self.channel, &Request::UploadSegment { toggle: self.toggle }.encode(), 3)[0];
        assert_eq!(segment[0] & 0xF0, u8::from(self.toggle) << 4, "{segment:X?}");
        self.bytes.extend_from_slice(&segment[1..8 - usize::from(segment[0] >> 1 & 7)]);
        self.toggle = !self.toggle;
        segment[0] & 1 != 0
    }
}

#[test]
fn the_servers_follow_from_the_rows() {
    assert_eq!(Sizes::of(ROWS).servers, 2);
    assert!(Services::of(ROWS).contains(Services::SDO_CLIENT));
    assert!(!Services::of(&objects::sdo_server(2)).contains(Services::SDO_CLIENT));
    assert_eq!(exchange_number(&node(), 0x1200, 1), 0x605);
    assert_eq!(exchange_number(&node(), 0x1200, 2), 0x585);
}

fn exchange_number(node: &Node, index: u16, sub: u8) -> u32 {
    DICTIONARY.field(index, sub).u32(node.image())
}

#[test]
fn a_further_server_is_silent_until_both_cob_ids_are_enabled() {
    let mut node = node();
    let upload = Request::Upload(NAME).encode();
    assert_eq!(ask(&mut node, SECOND, &upload, 2), Vec::<[u8; 8]>::new());
    assert_eq!(write(&mut node, (0x1201, 1), &u32::from(SECOND.0).to_le_bytes()), Ok(()));
    assert_eq!(ask(&mut node, SECOND, &upload, 2), Vec::<[u8; 8]>::new());
    assert!(!node.service_ids().any(|id| id.get() == SECOND.0));
    assert_eq!(write(&mut node, (0x1201, 2), &u32::from(SECOND.1).to_le_bytes()), Ok(()));
    assert!(node.service_ids().any(|id| id.get() == SECOND.0));
    assert_eq!(ask(&mut node, SECOND, &upload, 2).len(), 1);
    let other = Frame::new(SECOND.0, &upload[..7]).unwrap();
    let mut sent = Sent::default();
    let _ = node.on_service_frame(&other, Instant(3), &mut sent);
    assert_eq!(sent.0, [], "a request has eight bytes");
}

#[test]
fn two_clients_have_their_transfers_at_the_same_time() {
    let mut node = with_two_channels();
    enable(&mut node, 0x1202, (0x6A1, 0x6B1));
    let mut all = [DEFAULT, SECOND, (0x6A1, 0x6B1)].map(|channel| Reading::begin(&mut node, channel));
    while all.iter_mut().map(|reading| reading.step(&mut node)).filter(|last| *last).count() < 3 {}
    for reading in all {
        assert_eq!(reading.bytes, TEXT.as_bytes(), "{:X?}", reading.channel);
    }
}

#[test]
fn a_transfer_of_a_further_server_times_out_by_itself() {
    let mut node = with_two_channels();
    let mut first = Reading::begin(&mut node, DEFAULT);
    Reading::begin(&mut node, SECOND);
    let mut sent = Sent::default();
    first.step(&mut node);
    let next = node.poll(Instant(1_000_001), &mut sent);
    assert_eq!(next.services, Instant(1_000_002), "the deadline of the second transfer");
    assert_eq!(sent.0, []);
    let next = node.poll(Instant(1_000_002), &mut sent);
    assert_eq!(next.services, Instant(1_000_003), "the first transfer has made progress since");
    let abort = Request::Abort(NAME, 0x0504_0000).encode();
    assert_eq!(sent.0, [Frame::new(SECOND.1, &abort).unwrap()]);
}

#[test]
fn a_block_goes_through_a_further_server() {
    let mut node = with_two_channels();
    let at = Multiplexer { index: 0x2001, sub: 0 };
    let content: Vec<u8> = (0..100).collect();
    let begin = Request::BlockDownload { at, crc: false, size: Some(100) };
    assert_eq!(ask(&mut node, SECOND, &begin.encode(), 2)[0][0], 0xA4);
    for (number, bytes) in (1..).zip(content.chunks(7)) {
        let mut segment = [number; 8];
        segment[0] |= if number == 15 { 0x80 } else { 0 };
        segment[1..=bytes.len()].copy_from_slice(bytes);
        let answers = ask(&mut node, SECOND, &segment, 2);
        assert_eq!(answers, if number == 15 { vec![[0xA2, 15, 127, 0, 0, 0, 0, 0]] } else { vec![] });
    }
    assert_eq!(ask(&mut node, SECOND, &[0xC1 | 5 << 2, 0, 0, 0, 0, 0, 0, 0], 2)[0][0], 0xA1);
    assert_eq!(node.application().0, content);
    let begin = Request::BlockUpload { at, crc: true, block_size: 127, threshold: 0 };
    assert_eq!(ask(&mut node, SECOND, &begin.encode(), 3)[0][0], 0xC6);
    let segments = ask(&mut node, SECOND, &Request::BlockUploadStart.encode(), 3);
    assert_eq!(segments.len(), 15);
    assert_eq!(segments[14], [15 | 0x80, 98, 99, 0, 0, 0, 0, 0]);
}

#[test]
fn every_client_of_a_job_gets_its_answer() {
    let mut node = with_two_channels();
    let mut out = Sent::default();
    while node.poll(Instant(1), &mut out).action.is_some() {}
    let save = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
    assert_eq!(ask(&mut node, SECOND, &save, 2), Vec::<[u8; 8]>::new());
    assert_eq!(ask(&mut node, DEFAULT, &save, 2), Vec::<[u8; 8]>::new(), "an equal request");
    let mut sent = Sent::default();
    let _ = node.finish(Ok(()), Instant(3), &mut sent);
    if sent.0.is_empty() {
        // The values may have changed since the handover: the job runs again.
        assert!(matches!(node.poll(Instant(4), &mut sent).action, Some(Action::Store(_))));
        let _ = node.finish(Ok(()), Instant(5), &mut sent);
    }
    let mut ids: Vec<_> = sent.0.iter().map(|frame| (frame.id(), frame.data()[0])).collect();
    ids.sort_unstable();
    assert_eq!(ids, [(DEFAULT.1, 0x60), (SECOND.1, 0x60)]);
}

#[test]
fn a_disabled_channel_forgets_its_transfer() {
    let mut node = with_two_channels();
    Reading::begin(&mut node, SECOND);
    assert_eq!(write(&mut node, (0x1201, 1), &(0x8000_0000 | u32::from(SECOND.0)).to_le_bytes()), Ok(()));
    let mut sent = Sent::default();
    let next = node.poll(Instant(2_000_000), &mut sent);
    assert_eq!((sent.0, next.services), (vec![], Instant::NEVER));
}

#[test]
fn stopped_has_no_further_server_and_no_client() {
    let mut node = with_two_channels();
    enable(&mut node, 0x1280, (0x609, 0x589));
    let mut sent = Sent::default();
    Reading::begin(&mut node, SECOND);
    let _ = node.nmt(Command::Stop, Instant(3), &mut sent);
    assert_eq!(ask(&mut node, SECOND, &Request::Upload(NAME).encode(), 4), Vec::<[u8; 8]>::new());
    assert_eq!(node.sdo_client(1), None);
    let next = node.poll(Instant(2_000_000), &mut sent);
    assert_eq!((sent.0, next.services), (vec![], Instant::NEVER), "the transfer is forgotten");
    let _ = node.nmt(Command::EnterPreOperational, Instant(2_000_001), &mut Sent::default());
    assert_eq!(
        ask(&mut node, SECOND, &Request::UploadSegment { toggle: false }.encode(), 2_000_002)[0][0],
        0x80
    );
}

/// CiA 301, 7.5.2.34 and 7.5.2.35: the CAN-ID changes only while the entry is disabled, and is not a restricted one.
#[test]
fn the_cob_ids_of_a_channel_follow_the_rules() {
    const REFUSED: Result<(), u32> = Err(0x0609_0030);
    let cases = [
        (0x1201, 1, 0x0000_0601, REFUSED),
        (0x1201, 1, 0x0000_0080, Ok(())),
        (0x1201, 1, 0x4000_0680, REFUSED),
        (0x1201, 1, 0x2000_0680, REFUSED),
        (0x1201, 1, 0x0000_0800, REFUSED),
        (0x1201, 1, 0x0000_0000, REFUSED),
        (0x1201, 1, 0x8000_0601, Ok(())),
        (0x1280, 1, 0x0000_0609, Ok(())),
        (0x1280, 1, 0x0000_0605, REFUSED),
        (0x1280, 1, 0x0000_0600, Ok(())),
        (0x1280, 1, 0x0000_0680, Ok(())),
        (0x1280, 1, 0x0000_0589, REFUSED),
        (0x1280, 2, 0x0000_0589, Ok(())),
        (0x1280, 2, 0x0000_0609, REFUSED),
        (0x1280, 2, 0x0000_0705, REFUSED),
    ];
    for (index, sub, value, expected) in cases {
        let mut node = node();
        let value = u32::to_le_bytes(value);
        assert_eq!(write(&mut node, (index, sub), &value), expected, "{index:X}h:{sub} {value:X?}");
    }
    for index in [0x1201, 0x1280] {
        let mut node = node();
        enable(&mut node, index, SECOND);
        assert_eq!(write(&mut node, (index, 1), &0x0000_06A2_u32.to_le_bytes()), REFUSED);
        assert_eq!(write(&mut node, (index, 1), &0x8000_06A0_u32.to_le_bytes()), Ok(()));
        assert_eq!(write(&mut node, (index, 1), &0x8000_06A2_u32.to_le_bytes()), Ok(()));
        assert_eq!(write(&mut node, (index, 1), &0x0000_06A2_u32.to_le_bytes()), Ok(()));
        assert_eq!(write(&mut node, (index, 3), &[9]), Ok(()));
    }
    assert_eq!(write(&mut node(), (0x1200, 1), &[0; 4]), Err(0x0601_0002));
}

const OF_SERVER: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::sdo_server(2),
    objects::identity(0, 1, 1)
);
const OF_CLIENT: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::sdo_client(1),
    objects::identity(0, 1, 1)
);

/// The service identifiers of a device with one channel, which is enabled.
fn service_ids<D: Definition<Application = Loader>>(dictionary: &'static Dictionary, index: u16) -> Vec<u16> {
    let mut node: Device<D> = Device::new(dictionary, NodeId::new(ID), Loader::default());
    let _ = node.start(Instant(0), &mut Sent::default());
    for (sub, id) in [(1, SECOND.0), (2, SECOND.1)] {
        let written =
            exchange::write(ID, Multiplexer { index, sub }, &u32::from(id).to_le_bytes(), |request| {
                let mut sent = Sent::default();
                let _ = node.on_service_frame(&request, Instant(1), &mut sent);
                sent.0
            });
        assert_eq!(written, Ok(()));
    }
    node.service_ids().map(canopen::CanId::get).collect()
}

#[test]
fn a_device_with_one_kind_of_channel_receives_its_frames() {
    static SERVER: Dictionary = canopen::dictionary!(OF_SERVER);
    static CLIENT: Dictionary = canopen::dictionary!(OF_CLIENT);
    assert!(service_ids::<canopen::definition!(Loader, OF_SERVER)>(&SERVER, 0x1201).contains(&SECOND.0));
    assert!(service_ids::<canopen::definition!(Loader, OF_CLIENT)>(&CLIENT, 0x1280).contains(&SECOND.1));
}

#[test]
fn the_identifiers_change_with_a_channel() {
    let mut node = node();
    while node.poll(Instant(1), &mut Sent::default()).action.is_some() {}
    for (index, id) in [(0x1201, 0x6A0), (0x1280, 0x6B0)] {
        for (sub, id) in [(1, 0x6A0_u32), (2, 0x6B0)] {
            let [low, high] = u16::to_le_bytes(index);
            let [a, b, c, d] = id.to_le_bytes();
            let frame = Frame::new(DEFAULT.0, &[0x23, low, high, sub, a, b, c, d]).unwrap();
            let next = node.on_frame(&frame, Instant(2), &mut Sent::default());
            assert_eq!(next.action, Some(Action::Identifiers), "{index:X}h:{sub}");
        }
        assert!(node.service_ids().any(|own| own.get() == id), "{index:X}h");
    }
}

/// The client of the device reads the name of another device.
#[test]
fn the_application_reads_another_node_by_its_client_object() {
    let mut master = node();
    assert_eq!(master.sdo_client(1), None, "disabled by default");
    assert_eq!(master.sdo_client(0), None);
    assert_eq!(master.sdo_client(2), None, "no such object");
    assert_eq!(master.sdo_client(200), None);
    enable(&mut master, 0x1280, (0x609, 0x589));
    let channel = master.sdo_client(1).unwrap();
    assert_eq!((channel.to_server.get(), channel.from_server.get()), (0x609, 0x589));
    let mut other: Node = Device::new(&DICTIONARY, NodeId::new(9), Loader::default());
    let _ = other.start(Instant(0), &mut Sent::default());
    let mut memory = [0; 64];
    let options = Options { block_size: BlockSize::MAX, ..Options::default() };
    let mut upload = Upload::new(channel, NAME, Buffer::new(&mut memory), options);
    loop {
        match upload.next(Instant(1)) {
            Step::Send(request) => {
                let mut sent = Sent::default();
                let _ = other.on_frame(&request, Instant(1), &mut sent);
                for answer in sent.0 {
                    let _ = upload.on_frame(&answer, Instant(1));
                }
            }
            Step::Wait(_) => panic!("no answer"),
            Step::Done(result) => break assert_eq!(result, Ok(())),
        }
    }
    assert_eq!(upload.into_sink().as_slice(), TEXT.as_bytes());
}

/// A queue without room.
struct Full;

impl canopen::Transmit for Full {
    fn send(&mut self, _: Frame) -> Result<(), canopen::QueueFull> {
        Err(canopen::QueueFull)
    }

    fn room(&self) -> usize {
        0
    }
}

/// A node sends nothing before its boot-up message.
#[test]
fn a_client_waits_for_the_boot_up_message() {
    let mut node: Node = Device::new(&DICTIONARY, NodeId::new(ID), Loader::default());
    let _ = node.start(Instant(0), &mut Full);
    node.show(|_, image| {
        DICTIONARY.field(0x1280, 1).set_u32(image, 0x609);
        DICTIONARY.field(0x1280, 2).set_u32(image, 0x589);
    });
    assert_eq!(node.sdo_client(1), None);
    let _ = node.poll(Instant(2000), &mut Sent::default());
    assert!(node.sdo_client(1).is_some());
}

#[test]
fn the_identifiers_have_the_requests_of_each_server() {
    let mut node = with_two_channels();
    enable(&mut node, 0x1202, (0x6A1, 0x6B1));
    let ids: Vec<u16> = node.service_ids().map(canopen::CanId::get).collect();
    assert!([DEFAULT.0, SECOND.0, 0x6A1].iter().all(|id| ids.contains(id)), "{ids:03X?}");
}
