//! Node guarding and life guarding (100Ch, 100Dh), and the states of monitored nodes (1016h).

use canopen::dictionary::{Dictionary, Object, Services};
use canopen::nmt::{Command, State};
use canopen::sdo::Multiplexer;
use canopen::{Application, Device, Fault, Frame, Instant, NodeId, QueueFull, Transmit, objects};

use crate::exchange;
use crate::types::Sent;

const ID: u8 = 5;
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::node_guarding(),
    objects::emergency(),
    objects::heartbeat_consumer::<3>(),
    [objects::heartbeat_producer(0)],
    objects::identity(0, 1, 1),
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

#[derive(Default)]
struct Log {
    states: Vec<(u8, State)>,
    faults: Vec<(Fault, bool)>,
}

impl Application for Log {
    fn node_state(&mut self, node: NodeId, state: State, _: &mut [u8]) {
        self.states.push((node.get(), state));
    }

    fn fault(&mut self, fault: Fault, active: bool, _: &mut [u8]) {
        self.faults.push((fault, active));
    }
}

type Node = canopen::device!(Log, ROWS);

fn node() -> Node {
    let mut node = Device::new(&DICTIONARY, NodeId::new(ID), Log::default());
    let _ = node.start(Instant(0), &mut Sent::default());
    node
}

fn write(node: &mut Node, (index, sub): (u16, u8), bytes: &[u8]) {
    let ask = |request: Frame| {
        let mut sent = Sent::default();
        let _ = node.on_service_frame(&request, Instant(1), &mut sent);
        sent.0
    };
    exchange::write(ID, Multiplexer { index, sub }, bytes, ask).unwrap();
}

/// The answers to a remote frame.
fn guard(node: &mut Node, id: u16, now: u64) -> Vec<Vec<u8>> {
    let mut sent = Sent::default();
    let next = node.on_frame(&Frame::remote(id, 1).unwrap(), Instant(now), &mut sent);
    assert!(next.due() > Instant(now));
    sent.0.iter().filter(|frame| frame.id() == 0x705).map(|frame| frame.data().to_vec()).collect()
}

#[test]
fn a_remote_frame_gets_the_state_with_a_toggle_bit() {
    let mut node = node();
    assert!(node.service_ids().any(|id| id.get() == 0x705));
    assert_eq!(guard(&mut node, 0x705, 2), [[0x7F]]);
    assert_eq!(guard(&mut node, 0x706, 2), Vec::<Vec<u8>>::new(), "another node");
    let _ = node.nmt(Command::Start, Instant(3), &mut Sent::default());
    assert_eq!(guard(&mut node, 0x705, 4), [[0x85]]);
    let _ = node.nmt(Command::Stop, Instant(5), &mut Sent::default());
    assert_eq!(guard(&mut node, 0x705, 6), [[0x04]]);
    let _ = node.start(Instant(7), &mut Sent::default());
    assert_eq!(guard(&mut node, 0x705, 8), [[0x7F]], "0 after a reset");
}

#[test]
fn a_device_with_a_heartbeat_is_not_guarded() {
    let mut node = node();
    write(&mut node, (0x1017, 0), &[100, 0]);
    assert_eq!(guard(&mut node, 0x705, 2), Vec::<Vec<u8>>::new());
}

#[test]
fn a_missing_master_is_an_error_until_the_next_remote_frame() {
    let mut node = node();
    write(&mut node, (0x100C, 0), &[100, 0]);
    write(&mut node, (0x100D, 0), &[3]);
    let mut sent = Sent::default();
    let next = node.poll(Instant(900_000), &mut sent);
    assert_eq!(
        (next.services, sent.0.len()),
        (Instant::NEVER, 0),
        "life guarding begins with a remote frame"
    );
    let _ = node.nmt(Command::Start, Instant(1_000_000), &mut sent);
    guard(&mut node, 0x705, 1_000_000);
    let next = node.poll(Instant(1_000_001), &mut sent);
    assert_eq!(next.services, Instant(1_300_000));
    sent.0.clear();
    let _ = node.poll(Instant(1_300_000), &mut sent);
    assert_eq!((sent.0[0].id(), sent.0[0].data()), (0x085, &[0x30, 0x81, 0x11, 0, 0, 0, 0, 0][..]));
    assert_eq!(node.state(), State::PreOperational, "1029h:1 has its default");
    guard(&mut node, 0x705, 1_400_000);
    assert_eq!(node.application().faults, [(Fault::LifeGuard, true), (Fault::LifeGuard, false)]);
    write(&mut node, (0x100D, 0), &[0]);
    let next = node.poll(Instant(9_000_000), &mut sent);
    assert_eq!(next.services, Instant::NEVER, "life guarding is off");
}

const fn guarded() -> [Object; 2] {
    let [time, factor] = objects::node_guarding();
    [time.value(100), factor.value(3)]
}

const GUARDED: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    guarded(),
    objects::identity(0, 1, 1),
);

#[test]
fn life_guarding_has_its_stored_times_after_a_start() {
    static DICTIONARY: Dictionary = canopen::dictionary!(GUARDED);
    let mut sent = Sent::default();
    let mut node: canopen::device!(Log, GUARDED) = Device::new(&DICTIONARY, NodeId::new(ID), Log::default());
    let _ = node.start(Instant(0), &mut sent);
    let _ = node.on_frame(&Frame::remote(0x705, 1).unwrap(), Instant(1_000_000), &mut sent);
    let _ = node.poll(Instant(1_299_999), &mut sent);
    assert_eq!(node.application().faults, []);
    let _ = node.poll(Instant(1_300_000), &mut sent);
    assert_eq!(node.application().faults, [(Fault::LifeGuard, true)]);
}

#[test]
fn the_application_gets_the_states_of_monitored_nodes() {
    let mut node = node();
    write(&mut node, (0x1016, 1), &0x0009_0064_u32.to_le_bytes());
    let beat = |node: &mut Node, id, code, now| {
        let _ = node.on_frame(&Frame::new(id, &[code]).unwrap(), Instant(now), &mut Sent::default());
    };
    let nine = NodeId::new(9).unwrap();
    assert_eq!(node.state_of(nine), None);
    for (id, code) in [(0x709, 0), (0x709, 0), (0x709, 0x7F), (0x709, 0x7F), (0x70A, 5), (0x709, 5)] {
        beat(&mut node, id, code, 10);
    }
    let expected = [State::Initialising, State::Initialising, State::PreOperational, State::Operational];
    assert_eq!(node.application().states, expected.map(|state| (9, state)), "each boot-up, each new state");
    assert_eq!(node.state_of(nine), Some(State::Operational));
    let _ = node.poll(Instant(200_000), &mut Sent::default());
    assert_eq!(node.state_of(nine), None, "the heartbeat is missing");
    beat(&mut node, 0x709, 5, 200_001);
    assert_eq!(node.application().states.len(), 5);
}

#[test]
fn rows_without_100ch_have_no_guarding() {
    assert!(Services::of(ROWS).contains(Services::GUARDING));
    assert!(!Services::of(&objects::emergency()).contains(Services::GUARDING));
}

/// A device has either a heartbeat or guarding (CiA 301, 7.2.8.2).
#[test]
fn the_heartbeat_ends_life_guarding() {
    let mut node = node();
    write(&mut node, (0x100C, 0), &[100, 0]);
    write(&mut node, (0x100D, 0), &[3]);
    guard(&mut node, 0x705, 2);
    write(&mut node, (0x1017, 0), &[50, 0]);
    let mut sent = Sent::default();
    for now in (1..20).map(|time| Instant(time * 50_000)) {
        let _ = node.poll(now, &mut sent);
    }
    assert!(node.application().faults.is_empty());
    assert!(sent.0.iter().all(|frame| frame.id() == 0x705));
}

struct Full;

impl Transmit for Full {
    fn send(&mut self, _: Frame) -> Result<(), QueueFull> {
        Err(QueueFull)
    }

    fn room(&self) -> usize {
        0
    }
}

/// The toggle bit alternates between two consecutive responses (CiA 301, 7.2.8.3.2.1).
#[test]
fn an_answer_dropped_in_a_full_queue_leaves_the_toggle_bit() {
    let mut node = node();
    assert_eq!(guard(&mut node, 0x705, 2), [[0x7F]]);
    let _ = node.on_frame(&Frame::remote(0x705, 1).unwrap(), Instant(3), &mut Full);
    assert_eq!(guard(&mut node, 0x705, 4), [[0xFF]]);
    assert_eq!(guard(&mut node, 0x705, 5), [[0x7F]]);
}

#[test]
fn a_missing_master_is_reported_again_when_emcy_is_switched_on() {
    let mut node = node();
    write(&mut node, (0x100C, 0), &[100, 0]);
    write(&mut node, (0x100D, 0), &[3]);
    write(&mut node, (0x1014, 0), &0x8000_0085_u32.to_le_bytes());
    guard(&mut node, 0x705, 2);
    let mut sent = Sent::default();
    let _ = node.poll(Instant(300_002), &mut sent);
    assert_eq!((sent.0.len(), &node.application().faults[..]), (0, &[(Fault::LifeGuard, true)][..]));
    let switch_on = Frame::new(0x605, &[0x23, 0x14, 0x10, 0, 0x85, 0, 0, 0]).unwrap();
    let _ = node.on_service_frame(&switch_on, Instant(300_003), &mut sent);
    let emcys: Vec<_> = sent.0.iter().filter(|frame| frame.id() == 0x085).map(Frame::data).collect();
    assert_eq!(emcys, [[0x30, 0x81, 0x11, 0, 0, 0, 0, 0]]);
}
