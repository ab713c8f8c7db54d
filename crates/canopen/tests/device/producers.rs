//! Services that a device starts: SYNCs and time stamps, NMT commands of the application, its node-ID.

use canopen::dictionary::{Access, Dictionary, Mapping, Object, Services, Type};
use canopen::nmt::{Command, State};
use canopen::sdo::Multiplexer;
use canopen::{Action, Application, Device, Duration, Frame, Instant, NodeId, TimeOfDay, objects};

use crate::exchange;
use crate::types::Sent;

const ID: u8 = 5;
const VALUE: Object =
    Object::new(0x6000, 0, "", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo).value(9);
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::sync_producer(10_000),
    [objects::time_stamp()],
    objects::identity(0, 1, 1),
    objects::with(objects::tpdo(1, &[VALUE]), 2, 1),
    [VALUE],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
/// No PDOs.
const ALONE: &[Object] = canopen::rows!(
    [objects::device_type(0)],
    objects::sync_producer(10_000),
    [objects::time_stamp()],
    objects::identity(0, 1, 1),
);
static ALONE_DICTIONARY: Dictionary = canopen::dictionary!(ALONE);

/// The received times, and the counters of SYNCs.
#[derive(Default)]
struct Log {
    times: Vec<TimeOfDay>,
    syncs: Vec<Option<u8>>,
}

impl Application for Log {
    fn time(&mut self, time: TimeOfDay, _: &mut [u8]) {
        self.times.push(time);
    }

    fn synchronised(&mut self, counter: Option<u8>, _: &mut [u8]) {
        self.syncs.push(counter);
    }
}

type Node = canopen::device!(Log, ROWS);

fn node() -> Node {
    let mut node = Device::new(&DICTIONARY, NodeId::new(ID), Log::default());
    let _ = node.start(Instant(0), &mut Sent::default());
    node
}

/// Polls at every deadline until `end`. Returns the frames with these CAN-IDs and their instants.
fn run(node: &mut Node, (begin, end): (u64, u64), ids: &[u16]) -> Vec<(u64, u16, Vec<u8>)> {
    let (mut found, mut now) = (vec![], begin);
    while now < end {
        let mut sent = Sent::default();
        let next = node.poll(Instant(now), &mut sent);
        assert!(next.action.is_some() || next.due() > Instant(now), "due in the past at {now}");
        found.extend(sent.0.iter().map(|frame| (now, frame.id(), frame.data().to_vec())));
        now = if next.action.is_some() { now } else { next.due().0 };
    }
    found.retain(|(_, id, _)| ids.contains(id));
    found
}

fn write(node: &mut Node, index: u16, bytes: &[u8], now: u64) -> Result<(), u32> {
    exchange::write(ID, Multiplexer { index, sub: 0 }, bytes, |request| {
        let mut sent = Sent::default();
        let _ = node.on_service_frame(&request, Instant(now), &mut sent);
        sent.0
    })
}

#[test]
fn the_producer_sends_a_sync_every_period_and_reacts_to_it() {
    let mut node = node();
    let syncs = run(&mut node, (1, 25_000), &[0x80, 0x185]);
    assert_eq!(syncs, [(1, 0x80, vec![]), (10_001, 0x80, vec![]), (20_001, 0x80, vec![])], "pre-operational");
    assert_eq!(node.application().syncs, []);
    let _ = node.nmt(Command::Start, Instant(25_000), &mut Sent::default());
    let frames = run(&mut node, (25_000, 45_000), &[0x80, 0x185]);
    let expected =
        [(30_001, 0x80, vec![]), (30_001, 0x185, vec![9]), (40_001, 0x80, vec![]), (40_001, 0x185, vec![9])];
    assert_eq!(frames, expected, "operational");
    assert_eq!(node.application().syncs, [None; 2]);
    let _ = node.nmt(Command::Stop, Instant(45_000), &mut Sent::default());
    assert_eq!(run(&mut node, (45_000, 90_000), &[0x80, 0x185]), [], "stopped");
    let _ = node.nmt(Command::EnterPreOperational, Instant(90_000), &mut Sent::default());
    assert_eq!(run(&mut node, (90_001, 100_000), &[0x80]).len(), 0, "the first SYNC came with the command");
}

#[test]
fn a_counter_begins_with_1_after_stopped() {
    let mut node = node();
    write(&mut node, 0x1006, &[0; 4], 1).unwrap();
    write(&mut node, 0x1019, &[3], 1).unwrap();
    write(&mut node, 0x1006, &10_000_u32.to_le_bytes(), 1).unwrap();
    let counters =
        |frames: Vec<(u64, u16, Vec<u8>)>| frames.into_iter().map(|(.., data)| data[0]).collect::<Vec<_>>();
    assert_eq!(counters(run(&mut node, (2, 45_000), &[0x80])), [1, 2, 3, 1, 2]);
    let _ = node.nmt(Command::Stop, Instant(45_000), &mut Sent::default());
    let mut sent = Sent::default();
    let _ = node.nmt(Command::EnterPreOperational, Instant(46_000), &mut sent);
    assert_eq!(sent.0[0].data(), [1]);
}

#[test]
fn an_equal_write_leaves_the_period_of_the_producer_alone() {
    for (index, value) in [(0x1007, 5000_u32), (0x1005, 0x4000_0080), (0x1006, 10_000)] {
        let mut node = node();
        assert_eq!(run(&mut node, (1, 5000), &[0x80]).len(), 1);
        write(&mut node, index, &value.to_le_bytes(), 5000).unwrap();
        let times: Vec<u64> = run(&mut node, (5000, 25_000), &[0x80]).iter().map(|(now, ..)| *now).collect();
        assert_eq!(times, [10_001, 20_001], "{index:04X}h");
    }
}

#[test]
fn no_pause_is_possible_while_a_sync_is_due() {
    let mut node = node();
    assert_eq!(run(&mut node, (1, 5000), &[0x80]).len(), 1);
    assert!(node.can_pause(Duration::from_millis(5), Instant(5000)));
    assert!(!node.can_pause(Duration::from_millis(6), Instant(5000)));
}

#[test]
fn bit_30_switches_the_production_and_fixes_the_can_id() {
    let mut node = node();
    assert_eq!(write(&mut node, 0x1005, &0x4000_0081_u32.to_le_bytes(), 1), Err(0x0609_0030));
    assert_eq!(write(&mut node, 0x1005, &0x81_u32.to_le_bytes(), 1), Ok(()));
    assert_eq!(run(&mut node, (1, 50_000), &[0x80, 0x81]), []);
    assert_eq!(write(&mut node, 0x1005, &0x4000_0081_u32.to_le_bytes(), 50_000), Ok(()));
    assert_eq!(run(&mut node, (50_000, 55_000), &[0x80, 0x81]), [(50_000, 0x81, vec![])]);
    assert_eq!(write(&mut node, 0x1005, &0x4000_0601_u32.to_le_bytes(), 55_000), Err(0x0609_0030));
}

#[test]
fn a_period_of_a_microsecond_is_never_due_in_the_past() {
    let mut node = node();
    write(&mut node, 0x1006, &1_u32.to_le_bytes(), 1).unwrap();
    let mut sent = Sent::default();
    for now in [2, 3, 900, 901] {
        let next = node.poll_process(Instant(now), &mut sent);
        assert_eq!(next.process, Instant(now + 1));
    }
}

#[test]
fn the_application_gets_and_sends_the_time() {
    let mut node = node();
    let time = TimeOfDay { days: 15_000, milliseconds: 43_200_000 };
    let [a, b, c, d, low, high] = time.encode();
    assert!(node.process_ids().any(|id| id.get() == 0x100));
    let stamp = Frame::new(0x100, &[a, b, c, d | 0xF0, low, high]).unwrap();
    let _ = node.on_frame(&stamp, Instant(1), &mut Sent::default());
    let _ = node.on_frame(&Frame::new(0x100, &[a, b, c, d, low]).unwrap(), Instant(1), &mut Sent::default());
    assert_eq!(node.application().times, [time], "five bytes are no time stamp");
    let mut sent = Sent::default();
    assert!(!node.send_time(time, Instant(2), &mut sent), "bit 30 is not set");
    assert_eq!(write(&mut node, 0x1012, &0x4000_0100_u32.to_le_bytes(), 3), Ok(()));
    assert_eq!(write(&mut node, 0x1012, &0x4000_0090_u32.to_le_bytes(), 3), Err(0x0609_0030));
    assert!(node.send_time(time, Instant(4), &mut sent));
    assert_eq!((sent.0[0].id(), sent.0[0].data()), (0x100, &time.encode()[..]));
    let _ = node.on_frame(&stamp, Instant(5), &mut Sent::default());
    assert_eq!(node.application().times.len(), 1, "bit 31 is not set");
    let _ = node.nmt(Command::Stop, Instant(6), &mut sent);
    assert!(!node.send_time(time, Instant(7), &mut sent), "stopped");
}

#[test]
fn a_device_without_pdos_produces_too() {
    let mut node: canopen::device!(Log, ALONE) =
        Device::new(&ALONE_DICTIONARY, NodeId::new(ID), Log::default());
    let mut sent = Sent::default();
    let _ = node.start(Instant(0), &mut sent);
    let _ = node.poll(Instant(1), &mut sent);
    let stamp = Frame::new(0x100, &[0; 6]).unwrap();
    let next = node.on_frame(&stamp, Instant(2), &mut sent);
    assert_eq!((next.process, node.application().times.len()), (Instant(10_001), 1));
    assert_eq!(sent.0.iter().map(Frame::id).collect::<Vec<_>>(), [0x705, 0x080], "the boot-up message first");
}

#[test]
fn a_device_with_nothing_but_the_time_takes_it() {
    const ROWS: &[Object] =
        canopen::rows!([objects::device_type(0), objects::time_stamp()], objects::identity(0, 1, 1));
    static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
    let mut node: canopen::device!(Log, ROWS) = Device::new(&DICTIONARY, NodeId::new(ID), Log::default());
    let _ = node.start(Instant(0), &mut Sent::default());
    let _ = node.on_process_frame(&Frame::new(0x100, &[0; 6]).unwrap(), Instant(1), &mut Sent::default());
    assert_eq!(node.application().times.len(), 1);
}

#[test]
fn rows_without_these_services_do_not_have_their_code() {
    let of = |rows: &[Object]| Services::of(rows);
    assert!(of(ROWS).contains(Services::SYNC_PRODUCER.with(Services::TIME).with(Services::SYNC)));
    let consumer = of(&objects::sync_consumer());
    assert!(consumer.contains(Services::SYNC) && !consumer.contains(Services::SYNC_PRODUCER));
}

#[test]
fn a_command_of_the_application_is_one_of_the_master() {
    let mut node = node();
    let next = node.nmt(Command::Start, Instant(1), &mut Sent::default());
    assert_eq!((node.state(), next.action), (State::Operational, None));
    let next = node.nmt(Command::ResetNode, Instant(2), &mut Sent::default());
    assert_eq!((node.state(), next.action), (State::Initialising, Some(Action::ResetNode)));
    let _ = node.nmt(Command::Start, Instant(3), &mut Sent::default());
    assert_eq!(node.state(), State::Initialising, "not before the start");
}

#[test]
fn a_node_id_of_the_application_is_used_from_the_next_start() {
    let mut node = node();
    node.set_node_id(NodeId::new(9));
    assert_eq!(node.node_id(), NodeId::new(5));
    let mut sent = Sent::default();
    let _ = node.start(Instant(1), &mut sent);
    assert_eq!((node.node_id(), sent.0[0].id()), (NodeId::new(9), 0x709));
    node.set_node_id(None);
    let mut sent = Sent::default();
    let _ = node.start(Instant(2), &mut sent);
    assert_eq!((node.node_id(), sent.0.len()), (None, 0));
}

/// An application whose hook changes a mapped value: the statusword of a drive that follows the controlword.
#[derive(Default)]
struct Echo;

impl Application for Echo {
    fn state(&mut self, state: State, image: &mut [u8]) {
        DICTIONARY.field(0x6000, 0).set_u8(image, state.code());
    }
}

#[test]
fn publish_sends_changes_of_a_hook() {
    let mut node: canopen::device!(Echo, ROWS) = Device::new(&DICTIONARY, NodeId::new(ID), Echo);
    let mut sent = Sent::default();
    let _ = node.start(Instant(0), &mut sent);
    let [low, high] = 0x1800_u16.to_le_bytes();
    let event_driven = Frame::new(0x605, &[0x2F, low, high, 2, 255, 0, 0, 0]).unwrap();
    let _ = node.on_frame(&event_driven, Instant(1), &mut sent);
    let _ = node.publish(Instant(2), &mut sent, |_, _| ());
    let _ = node.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(3), &mut sent);
    let _ = node.publish(Instant(4), &mut sent, |_, _| ());
    let values: Vec<_> =
        sent.0.iter().filter(|frame| frame.id() == 0x185).map(|frame| frame.data()[0]).collect();
    assert_eq!(values.last(), Some(&5), "{values:?}");
}

#[test]
fn a_late_sync_does_not_shift_the_following_ones() {
    let mut node = node();
    assert_eq!(run(&mut node, (1, 5000), &[0x80]).len(), 1);
    let times: Vec<u64> = run(&mut node, (12_000, 35_000), &[0x80]).iter().map(|(now, ..)| *now).collect();
    assert_eq!(times, [12_000, 20_001, 30_001]);
}

#[test]
fn the_producer_keeps_its_period_for_minutes() {
    const SECOND: u64 = 1_000_000;
    let mut node = node();
    write(&mut node, 0x1006, &1_000_000_u32.to_le_bytes(), 1).unwrap();
    let syncs = run(&mut node, (1, 200 * SECOND), &[0x80]);
    let times: Vec<u64> = syncs.iter().map(|(now, ..)| *now).collect();
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == SECOND), "{times:?}");
    assert_eq!(times.len(), 200);
}

#[test]
fn after_a_delay_of_a_whole_period_one_sync_is_sent() {
    let mut node = node();
    assert_eq!(run(&mut node, (1, 5000), &[0x80]).len(), 1);
    let mut sent = Sent::default();
    for _ in 0..2 {
        let _ = node.poll(Instant(20_001), &mut sent);
    }
    assert_eq!(sent.0.iter().filter(|frame| frame.id() == 0x80).count(), 1);
    assert_eq!(node.poll(Instant(20_001), &mut sent).process, Instant(30_001));
}
