//! The service device alone: NMT, SDO, heartbeat and LSS, without the other services.

use canopen::dictionary::{Access, Dictionary, Group, Mapping, Object, Type};
use canopen::nmt::State;
use canopen::sdo::{Abort, Multiplexer, Request, Response};
use canopen::{
    Action, Application, Frame, Instant, NodeId, Part, QueueFull, ServiceDevice, Transmit, objects,
};

use crate::exchange;

const ID: u8 = 126;
const DOMAIN: Multiplexer = Multiplexer { index: 0x2000, sub: 0 };
const VALUE: Object =
    Object::new(0x2001, 0, "", Type::Unsigned32, Access::ReadWrite).mappable(Mapping::Tpdo).value(7);

/// With objects of services that the device does not have.
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0x0001_0191), objects::error_register(), objects::heartbeat_producer(0)],
    objects::identity(1, 2, 3),
    objects::emergency(),
    objects::store_parameters(),
    objects::default_sdo_server(),
    objects::tpdo(1, &[VALUE]),
    [
        Object::new(0x2000, 0, "", Type::Domain, Access::ReadWrite),
        VALUE,
        Object::new(0x2002, 0, "", Type::Unsigned8, Access::ReadWrite).stored(Group::Application).value(4),
    ],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// An application that keeps a domain.
#[derive(Default)]
pub(super) struct Loader(pub(super) Vec<u8>);

impl Application for Loader {
    fn read_domain(&self, _: Multiplexer) -> Result<&[u8], Abort> {
        Ok(&self.0)
    }

    fn write_domain(&mut self, _: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        match part {
            Part::Begin(_) => self.0.clear(),
            Part::Data(_, bytes) => self.0.extend_from_slice(bytes),
            Part::End(_) => (),
        }
        Ok(())
    }
}

/// A short queue: eight frames at a time.
#[derive(Default)]
struct Sent(Vec<Frame>);

const ROOM: usize = 8;

impl Transmit for Sent {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        if self.room() == 0 {
            return Err(QueueFull);
        }
        self.0.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        ROOM - self.0.len()
    }
}

struct Bench {
    device: canopen::service_device!(Loader, ROWS),
    now: Instant,
}

impl Bench {
    fn booted() -> Bench {
        let device = ServiceDevice::new(&DICTIONARY, NodeId::new(ID), Loader::default());
        let mut bench = Bench { device, now: Instant(1_000_000) };
        let mut out = Sent::default();
        let _ = bench.device.start(bench.now, &mut out);
        let boot_up = Frame::new(0x700 + u16::from(ID), &[0]).unwrap();
        assert_eq!(out.0, [boot_up]);
        assert_eq!(bench.device.state(), State::PreOperational);
        bench
    }

    fn receive(&mut self, frame: Frame) -> Vec<Frame> {
        let mut out = Sent::default();
        let _ = self.device.on_frame(&frame, self.now, &mut out);
        out.0
    }

    fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        exchange::read(ID, Multiplexer { index, sub }, |request| self.receive(request))
    }

    fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<(), u32> {
        exchange::write(ID, Multiplexer { index, sub }, value, |request| self.receive(request))
    }

    fn nmt(&mut self, command: u8) -> Vec<Frame> {
        self.receive(Frame::new(0, &[command, ID]).unwrap())
    }
}

#[test]
fn values_and_domains_are_read_and_written() {
    let mut bench = Bench::booted();
    assert_eq!(bench.read(0x1018, 2), Ok(vec![2, 0, 0, 0]));
    assert_eq!(bench.write(0x2001, 0, &[1, 2, 3, 4]), Ok(()));
    assert_eq!(bench.read(0x2001, 0), Ok(vec![1, 2, 3, 4]));
    let content: Vec<u8> = (0..200).collect();
    assert_eq!(bench.write(DOMAIN.index, DOMAIN.sub, &content), Ok(()));
    assert_eq!(bench.read(DOMAIN.index, DOMAIN.sub), Ok(content));
}

#[test]
fn a_heartbeat_begins_when_its_time_is_written() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write(0x1017, 0, &[100, 0]), Ok(()));
    let mut out = Sent::default();
    // Actions that wait for the caller are returned first.
    while bench.device.poll(bench.now, &mut out).action.is_some() {}
    out.0.clear();
    let heartbeat = Frame::new(0x700 + u16::from(ID), &[0x7F]).unwrap();
    for sent in 1..=3 {
        let due = bench.device.poll(bench.now, &mut out).due();
        assert_eq!(due.0 - bench.now.0, 100_000);
        bench.now = due;
        let _ = bench.device.poll(bench.now, &mut out);
        assert_eq!(out.0, vec![heartbeat; sent]);
    }
}

#[test]
fn nmt_changes_its_state_and_no_pdo_is_sent() {
    let mut bench = Bench::booted();
    assert_eq!(bench.nmt(1), []);
    assert_eq!(bench.device.state(), State::Operational);
    assert_eq!(bench.receive(Frame::new(0x80, &[]).unwrap()), []);
    assert_eq!(bench.write(0x2001, 0, &[9, 0, 0, 0]), Ok(()));
    let mut out = Sent::default();
    assert_eq!(bench.device.poll(bench.now, &mut out).process, Instant::NEVER);
    assert_eq!(out.0, []);
    bench.nmt(2);
    let upload = Request::Upload(DOMAIN).encode();
    assert_eq!(bench.receive(Frame::new(0x600 + u16::from(ID), &upload).unwrap()), [], "no SDO in Stopped");
}

#[test]
fn a_reset_is_left_to_the_caller() {
    let mut bench = Bench::booted();
    let mut out = Sent::default();
    while bench.device.poll(bench.now, &mut out).action.is_some() {}
    let next = bench.device.on_frame(&Frame::new(0, &[0x82, ID]).unwrap(), bench.now, &mut out);
    assert_eq!((next.action, bench.device.state()), (Some(Action::ResetCommunication), State::Initialising));
    let _ = bench.device.start(bench.now, &mut out);
    assert_eq!(bench.device.state(), State::PreOperational);
}

#[test]
fn an_unsupported_store_is_not_reported_as_stored() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write(0x1010, 1, b"save"), Err(Abort::NotStored.code()));
    assert_eq!(bench.read(0x1010, 1), Ok(vec![1, 0, 0, 0]));
}

#[test]
fn lss_reports_the_identity() {
    let mut bench = Bench::booted();
    bench.receive(Frame::new(0x7E5, &[4, 1, 0, 0, 0, 0, 0, 0]).unwrap());
    let answers = bench.receive(Frame::new(0x7E5, &[0x5A, 0, 0, 0, 0, 0, 0, 0]).unwrap());
    assert_eq!(answers, [Frame::new(0x7E4, &[0x5A, 1, 0, 0, 0, 0, 0, 0]).unwrap()]);
}

#[test]
fn a_block_upload_goes_through_a_short_queue() {
    let mut bench = Bench::booted();
    let content: Vec<u8> = (0..84).collect();
    assert_eq!(bench.write(DOMAIN.index, DOMAIN.sub, &content), Ok(()));
    let id = 0x600 + u16::from(ID);
    let begin = Request::BlockUpload { at: DOMAIN, crc: true, block_size: 127, threshold: 0 };
    bench.receive(Frame::new(id, &begin.encode()).unwrap());
    let mut frames = bench.receive(Frame::new(id, &Request::BlockUploadStart.encode()).unwrap());
    while frames.len() < 12 {
        assert!(bench.now < Instant(1_100_000), "only {} of 12 segments", frames.len());
        let mut out = Sent::default();
        bench.now = bench.device.poll(bench.now, &mut out).due().max(bench.now);
        frames.extend(out.0);
    }
    let data: Vec<u8> = frames.iter().flat_map(|frame| frame.data()[1..].to_vec()).collect();
    assert_eq!(data, content);
}

#[test]
fn an_unknown_command_is_refused() {
    let mut bench = Bench::booted();
    let answers = bench.receive(Frame::new(0x600 + u16::from(ID), &[0xE0, 0, 0, 0, 0, 0, 0, 0]).unwrap());
    let data = answers[0].data().try_into().unwrap();
    assert!(matches!(Response::parse(data), Some(Response::Abort(_, 0x0504_0001))));
}

#[test]
fn a_reset_of_the_communication_keeps_the_values_of_the_application() {
    let mut bench = Bench::booted();
    let before_and_after = |bench: &mut Bench, command| {
        bench.write(0x2002, 0, &[9]).unwrap();
        bench.write(0x1014, 0, &[0x85, 0, 0, 0]).unwrap();
        bench.nmt(command);
        let _ = bench.device.start(bench.now, &mut Sent::default());
        (bench.read(0x2002, 0).unwrap(), bench.read(0x1014, 0).unwrap())
    };
    let default = vec![0x80 + ID, 0, 0, 0];
    assert_eq!(before_and_after(&mut bench, 0x82), (vec![9], default.clone()));
    assert_eq!(before_and_after(&mut bench, 0x81), (vec![4], default));
}

#[test]
fn a_default_cob_id_includes_the_node_id() {
    let mut bench = Bench::booted();
    assert_eq!(bench.read(0x1200, 1), Ok((0x600 + u32::from(ID)).to_le_bytes().to_vec()));
}

/// Objects of services that a service device lacks, with rules for their values.
const UNUSED: &[Object] = canopen::rows!(
    [objects::device_type(0x0001_0191), objects::error_register(), objects::time_stamp()],
    objects::error_field::<3>(),
    objects::sync_consumer(),
    objects::heartbeat_consumer::<3>(),
    objects::identity(1, 2, 3),
    objects::emcy_consumer::<3>(),
    objects::sdo_server(2),
    objects::sdo_client(1),
    objects::tpdo(1, &[VALUE]),
    [VALUE],
);
static UNUSED_DICTIONARY: Dictionary = canopen::dictionary!(UNUSED);

/// A device that has the service would refuse each of these values.
#[test]
fn rows_of_other_services_hold_any_value_and_there_is_no_list_of_errors() {
    let mut device: canopen::service_device!((), UNUSED) =
        ServiceDevice::new(&UNUSED_DICTIONARY, NodeId::new(ID), ());
    let _ = device.start(Instant(0), &mut Sent::default());
    let mut answer = |request: Frame| {
        let mut out = Sent::default();
        let _ = device.on_frame(&request, Instant(1), &mut out);
        out.0
    };
    let cob_id = 0x701_u32.to_le_bytes();
    let values: [(u16, u8, &[u8]); 7] = [
        (0x1012, 0, &cob_id),
        (0x1016, 1, &0x0109_0064_u32.to_le_bytes()),
        (0x1019, 0, &[1]),
        (0x1028, 1, &cob_id),
        (0x1201, 1, &cob_id),
        (0x1280, 1, &cob_id),
        (0x1A00, 0, &[0]),
    ];
    for (index, sub, value) in values {
        let at = Multiplexer { index, sub };
        assert_eq!(exchange::write(ID, at, value, &mut answer), Ok(()), "{index:X}h");
        assert_eq!(exchange::read(ID, at, &mut answer), Ok(value.to_vec()), "{index:X}h");
    }
    for sub in [0, 1] {
        let at = Multiplexer { index: 0x1003, sub };
        assert_eq!(exchange::read(ID, at, &mut answer), Err(Abort::NoData.code()));
    }
}
