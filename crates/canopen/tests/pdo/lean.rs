//! Devices whose rows lack a service: what remains works, and the service is refused or ignored.

use canopen::dictionary::{Access, Dictionary, Group, Mapping, Object, Services, Sizes, Type};
use canopen::nmt::State;
use canopen::{
    Application, Condition, Definition, Device, ErrorClass, Frame, Instant, NodeId, Soundness, Stored,
    objects,
};

use crate::bench::{ID, Nothing, Sent, download};

const INPUT: Object =
    Object::new(0x6000, 0, "Input", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo);

/// A TPDO that does not answer remote frames, and an RPDO with the CAN-ID 202h.
const SILENT_ROWS: &[Object] = canopen::rows!(
    objects::without_remote(objects::tpdo(1, &[INPUT])),
    objects::rpdo(1, &[OUTPUT]),
    [INPUT, OUTPUT]
);
static SILENT: Dictionary = canopen::dictionary!(SILENT_ROWS);
const OUTPUT: Object =
    Object::new(0x6100, 0, "Output", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Rpdo);

const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::heartbeat_producer(0)],
    objects::error_field::<3>(),
    objects::error_behaviour(2),
    objects::tpdo(1, &[INPUT]),
    [INPUT],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The longest values in a multiplexed PDO.
const WIDE_INPUT: Object =
    Object::new(0x6001, 0, "", Type::Unsigned32, Access::ReadOnly).mappable(Mapping::Tpdo).value(0x0403_0201);
const WIDE_OUTPUT: Object =
    Object::new(0x6200, 0, "", Type::Unsigned32, Access::ReadWrite).mappable(Mapping::Rpdo);

const MULTIPLEXED_ROWS: &[Object] = canopen::rows!(
    objects::sync_consumer(),
    objects::emergency(),
    objects::store_parameters(),
    objects::multiplexed(objects::tpdo(1, &[INPUT])),
    objects::multiplexed(objects::rpdo(1, &[])),
    [INPUT, WIDE_INPUT, WIDE_OUTPUT],
);
static MULTIPLEXED: Dictionary = canopen::dictionary!(MULTIPLEXED_ROWS);

/// One fault, of the class of device errors.
struct Faulty;

impl Application for Faulty {
    const CONDITIONS: &'static [Condition] = &[Condition::new(0x5000).of_class(ErrorClass::DEVICE)];
}

type Lean<A> = canopen::device!(A, ROWS);

fn operational<A: Application>(application: A) -> (Lean<A>, Sent) {
    let (mut device, mut sent) = (Device::new(&DICTIONARY, NodeId::new(ID), application), Sent::default());
    let _ = device.start(Instant(0), &mut sent);
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(1), &mut sent);
    assert_eq!(device.state(), State::Operational);
    sent.0.clear();
    (device, sent)
}

#[test]
fn the_rows_decide_on_the_services() {
    let expected = Services::FAULTS.with(Services::REMOTE);
    assert_eq!((Services::of(ROWS), Sizes::of(ROWS).scanned), (expected, 0));
    let multiplexed = [expected, Services::SYNC, Services::EMCY, Services::STORE, Services::MULTIPLEXED_RPDO];
    let expected = multiplexed.into_iter().fold(Services::NONE, Services::with);
    assert_eq!((Services::of(MULTIPLEXED_ROWS), Sizes::of(MULTIPLEXED_ROWS).scanned), (expected, 2));
    let other = [Services::of(&[objects::start_up()]), Services::of(&[objects::program_control()[1]])];
    let expected = [Services::SELF_START, Services::PROGRAM_CONTROL].map(|own| own.with(Services::FAULTS));
    assert_eq!(other, expected);
}

#[test]
fn a_constant_number_of_mapped_objects_may_be_that_of_a_multiplexed_pdo() {
    for (count, scanned) in [(0xFD, 0), (0xFE, 1), (0xFF, 1)] {
        let number = Object::new(0x1A00, 0, "", Type::Unsigned8, Access::ReadOnly).value(count);
        assert_eq!(Sizes::of(&[number, INPUT]).scanned, scanned, "{count}");
    }
}

/// PDOs of one direction are enough for the rules of their objects.
#[test]
fn pdos_of_one_direction_have_the_interlocks_of_their_objects() {
    const RECEIVING: &[Object] = canopen::rows!(objects::rpdo(1, &[OUTPUT]), [OUTPUT]);
    static RECEIVING_DICTIONARY: Dictionary = canopen::dictionary!(RECEIVING);
    let (mut sending, _) = operational(Nothing);
    let mut receiving: canopen::device!(Nothing, RECEIVING) =
        Device::new(&RECEIVING_DICTIONARY, NodeId::new(ID), Nothing);
    let _ = receiving.start(Instant(0), &mut Sent::default());
    check(&mut sending, 0x1800, 0x6000_0008);
    check(&mut receiving, 0x1400, 0x6100_0008);

    fn check<D: Definition>(device: &mut Device<D>, at: u16, mapped: u32) {
        let mut write = |index, sub, value: &[u8]| download(device, (index, sub), value, Instant(10));
        let (off, on) = (0x8000_0201_u32.to_le_bytes(), 0x0000_0201_u32.to_le_bytes());
        let mapped = mapped.to_le_bytes();
        assert_eq!(write(at + 0x200, 0, &[0]), Err(0x0601_0000), "{at:04X}h is valid");
        assert_eq!(write(at, 1, &off), Ok(()));
        assert_eq!(write(at + 0x200, 1, &mapped), Err(0x0601_0000), "{at:04X}h maps an object");
        assert_eq!(write(at + 0x200, 0, &[0]), Ok(()));
        assert_eq!(write(at + 0x200, 1, &0x7000_0008_u32.to_le_bytes()), Err(0x0602_0000));
        assert_eq!(write(at + 0x200, 1, &mapped), Ok(()));
        assert_eq!(write(at + 0x200, 0, &[2]), Err(0x0602_0000), "{at:04X}h: the second is missing");
        assert_eq!(write(at, 1, &on), Err(0x0609_0030), "{at:04X}h maps nothing");
        assert_eq!(write(at + 0x200, 0, &[1]), Ok(()));
        assert_eq!(write(at, 1, &on), Ok(()));
    }
}

#[test]
fn without_remote_frames_none_is_answered_and_no_client_can_allow_them() {
    assert_eq!(Services::of(SILENT_ROWS), Services::FAULTS);
    let asked = objects::with(objects::without_remote(objects::tpdo(1, &[INPUT])), 2, 253);
    assert!(Services::of(&asked).contains(Services::REMOTE), "type 253 needs them");
    assert!(
        Services::of(&objects::tpdo(5, &[INPUT])).contains(Services::REMOTE),
        "also while it is not valid"
    );

    type Node = canopen::device!(Nothing, SILENT_ROWS);
    let (mut device, mut sent): (Node, _) = (Device::new(&SILENT, NodeId::new(ID), Nothing), Sent::default());
    let _ = device.start(Instant(0), &mut sent);
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(1), &mut sent);
    let _ = device.poll(Instant(2), &mut sent);
    sent.0.clear();
    let (tpdo, rpdo) = (0x180 + u16::from(ID), 0x200 + u16::from(ID));
    for id in [tpdo, rpdo] {
        let _ = device.on_frame(&Frame::remote(id, 1).unwrap(), Instant(3), &mut sent);
    }
    assert_eq!(sent.0, [], "no answer, and no EMCY about a short RPDO");
    assert!(!device.process_ids().any(|own| own.get() == tpdo));

    let mut write = |sub, value: &[u8]| download(&mut device, (0x1800, sub), value, Instant(4));
    assert_eq!(write(1, &u32::from(tpdo).to_le_bytes()), Err(0x0609_0030), "valid and allowed");
    assert_eq!(write(1, &(0x8000_0000 | u32::from(tpdo)).to_le_bytes()), Ok(()), "switched off");
    assert_eq!(write(1, &u32::from(tpdo).to_le_bytes()), Err(0x0609_0030), "valid again, and allowed");
    for kind in [252, 253] {
        assert_eq!(write(2, &[kind]), Err(0x0609_0030), "type {kind}");
    }
    assert_eq!(write(1, &(0x4000_0000 | u32::from(tpdo)).to_le_bytes()), Ok(()), "as it was");
}

#[test]
fn a_pdo_is_multiplexed_only_if_its_rows_allow_it() {
    let (mut device, _) = operational(Nothing);
    let mut off = |index, value: &[u8]| download(&mut device, (index, 0), value, Instant(2));
    assert_eq!(off(0x1A00, &[0xFF]), Err(0x0609_0031), "value too high");
    assert_eq!(off(0x1A00, &[0xFE]), Err(0x0609_0031));
    assert_eq!(off(0x1A00, &[9]), Err(0x0609_0031));

    type Node = canopen::device!(Nothing, MULTIPLEXED_ROWS);
    let (mut device, mut sent): (Node, _) =
        (Device::new(&MULTIPLEXED, NodeId::new(ID), Nothing), Sent::default());
    let _ = device.start(Instant(0), &mut sent);
    download(&mut device, (0x1800, 1), &0x8000_0185_u32.to_le_bytes(), Instant(1)).unwrap();
    download(&mut device, (0x1A00, 0), &[0xFF], Instant(2)).unwrap();
    download(&mut device, (0x1600, 0), &[0xFE], Instant(3)).unwrap();
}

#[test]
fn a_multiplexed_pdo_carries_a_value_of_four_bytes() {
    type Node = canopen::device!(Nothing, MULTIPLEXED_ROWS);
    let (mut device, mut sent): (Node, _) =
        (Device::new(&MULTIPLEXED, NodeId::new(ID), Nothing), Sent::default());
    let _ = device.start(Instant(0), &mut sent);
    for (index, id) in [(0x1800, 0x185_u32), (0x1400, 0x301)] {
        download(&mut device, (index, 1), &(0x8000_0000 | id).to_le_bytes(), Instant(1)).unwrap();
        download(&mut device, (index + 0x200, 0), &[0xFF], Instant(1)).unwrap();
        download(&mut device, (index, 1), &id.to_le_bytes(), Instant(1)).unwrap();
    }
    sent.0.clear();
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(2), &mut sent);
    let _ = device.poll(Instant(3), &mut sent);
    assert!(sent.0.iter().any(|frame| frame.data() == [0x80, 0x01, 0x60, 0, 1, 2, 3, 4]), "{:?}", sent.0);
    let write = Frame::new(0x301, &[0x80 | ID, 0x00, 0x62, 0, 5, 6, 7, 8]).unwrap();
    let _ = device.on_frame(&write, Instant(4), &mut sent);
    assert_eq!(MULTIPLEXED.field(0x6200, 0).u32(device.image()), 0x0807_0605);
}

#[test]
fn without_1005h_synchronous_types_are_refused_and_sync_is_ignored() {
    let (mut device, mut sent) = operational(Nothing);
    let mut write = |kind: u8| download(&mut device, (0x1800, 2), &[kind], Instant(2));
    for kind in [0, 1, 240, 252] {
        assert_eq!(write(kind), Err(0x0609_0030), "invalid value: type {kind}");
    }
    for kind in [253, 254, 255] {
        assert_eq!(write(kind), Ok(()), "type {kind}");
    }
    // The TPDO is sent once with its new type, and not with the SYNC.
    let _ = device.poll(Instant(2), &mut sent);
    sent.0.clear();
    let _ = device.on_frame(&Frame::new(0x80, &[]).unwrap(), Instant(3), &mut sent);
    assert_eq!(sent.0, []);
    assert!(device.process_ids().all(|id| id.get() != 0x80));
    let _ = device.publish(Instant(4), &mut sent, |_, image| image.fill(1));
    assert_eq!(sent.0.len(), 1, "the change sends TPDO 1");
}

#[test]
fn without_1014h_a_fault_sets_the_error_register_and_1029h_stops_the_node() {
    let (mut device, mut sent) = operational(Faulty);
    let register = DICTIONARY.field(0x1001, 0);
    let _ = device.set_condition(0, true, Instant(2));
    assert_eq!(register.u8(device.image()) & 1, 1);
    let next = device.poll(Instant(3), &mut sent);
    assert_eq!((device.state(), sent.0.as_slice()), (State::Stopped, [].as_slice()));
    // The change of the state has made the process data due: once more.
    assert!(next.services > Instant(3));
    assert_eq!(device.poll(Instant(3), &mut sent).due(), Instant::NEVER);
    let _ = device.set_condition(0, false, Instant(4));
    assert_eq!(register.u8(device.image()), 0);
    // The fault is still active after a reset, and its class counts again.
    let _ = device.set_condition(0, true, Instant(5));
    let _ = device.on_frame(&Frame::new(0, &[0x82, ID]).unwrap(), Instant(6), &mut sent);
    let _ = device.start(Instant(7), &mut sent);
    assert_eq!((register.u8(device.image()) & 1, device.state()), (1, State::Stopped));
}

#[test]
fn an_sdo_request_does_not_delay_due_process_data() {
    let (mut device, mut sent) = operational(Nothing);
    download(&mut device, (0x1800, 5), &10_u16.to_le_bytes(), Instant(2)).unwrap();
    let _ = device.poll(Instant(2), &mut sent);
    sent.0.clear();
    let upload = Frame::new(0x600 | u16::from(ID), &[0x40, 0, 0x10, 0, 0, 0, 0, 0]).unwrap();
    let _ = device.on_frame(&upload, Instant(10_002), &mut sent);
    assert_eq!(sent.0.iter().map(Frame::id).collect::<Vec<_>>(), [0x185, 0x585]);
}

/// An application that leaves out what CiA 301 and CiA 305 leave to the device.
struct Short;

impl Application for Short {
    const BLOCK_UPLOAD: bool = false;
    const BLOCK_DOWNLOAD: bool = false;
    const LSS: bool = false;
}

#[test]
fn block_transfers_and_lss_can_be_left_out() {
    let (mut device, mut sent) = operational(Short);
    let mut answer = |id, data: [u8; 8]| {
        sent.0.clear();
        let _ = device.on_frame(&Frame::new(id, &data).unwrap(), Instant(5), &mut sent);
        sent.0.iter().map(|frame| frame.data().to_vec()).collect::<Vec<_>>()
    };
    let refused = |index: u16| {
        let [low, high] = index.to_le_bytes();
        vec![vec![0x80, low, high, 0, 0x01, 0, 0x04, 0x05]]
    };
    let request = 0x600 + u16::from(ID);
    assert_eq!(answer(request, [0xC6, 0x17, 0x10, 0, 2, 0, 0, 0]), refused(0x1017), "block download");
    assert_eq!(answer(request, [0xA4, 0x00, 0x10, 0, 127, 0, 0, 0]), refused(0x1000), "block upload");
    assert_eq!(answer(0x7E5, [0x04, 1, 0, 0, 0, 0, 0, 0]), Vec::<Vec<u8>>::new(), "LSS: configuration state");
    assert_eq!(answer(0x7E5, [0x5E, 0, 0, 0, 0, 0, 0, 0]), Vec::<Vec<u8>>::new(), "LSS: node-ID");
    assert_eq!(answer(request, [0x40, 0x00, 0x10, 0, 0, 0, 0, 0])[0][..4], [0x43, 0x00, 0x10, 0]);
    assert!(device.service_ids().all(|id| id.get() != 0x7E5));
}

/// Stored values of a firmware whose TPDO answered remote frames.
struct Older;

impl Application for Older {
    fn stored(&self, group: Group) -> Stored<'_> {
        const TPDO_1: &[u8] = &[0x00, 0x18, 1, 1, 4, 0x90, 0x01, 0x00, 0x00];
        let packed = if group == Group::Communication { TPDO_1 } else { &[] };
        Stored { packed, soundness: Soundness::Whole }
    }
}

#[test]
fn without_remote_frames_a_stored_cob_id_that_allows_them_asks_for_none() {
    let (mut device, mut sent): (canopen::device!(Older, SILENT_ROWS), _) =
        (Device::new(&SILENT, NodeId::new(ID), Older), Sent::default());
    let _ = device.start(Instant(0), &mut sent);
    assert_eq!(SILENT.field(0x1800, 1).u32(device.image()), 0x190, "the value is loaded");
    let ids: Vec<u16> = device.process_ids().map(canopen::CanId::get).collect();
    assert_eq!(ids, [0x000, 0x205]);
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(1), &mut sent);
    let _ = device.poll(Instant(2), &mut sent);
    sent.0.clear();
    let _ = device.on_frame(&Frame::remote(0x190, 1).unwrap(), Instant(3), &mut sent);
    assert_eq!(sent.0, []);
}
