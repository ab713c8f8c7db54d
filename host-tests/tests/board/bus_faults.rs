//! Faults of other bus participants, and a full bus.

use canbus::{Fault, Position, SeenBy, Time};
use chip::Peripherals;
use host_tests::thorough::either;

use crate::support::{
    Master, SDO_REQUEST, SDO_RESPONSE, SECOND, START_ALL, TPDO1, frame, run, running, world,
};

/// Interrupt enable of CAN1 (RM0390, 30.9.2).
const CAN1_IER: u32 = 0x4000_6414;
/// EMCY codes (CiA 301, table 26).
const OVERRUN: u16 = 0x8110;
const PASSIVE: u16 = 0x8120;
/// Errors in a row that make a transmitter error passive, and bus-off: each adds 8; the limits are 127 and 255.
const ENOUGH_TO_BE_PASSIVE: u64 = 17;

/// The EMCY codes that a node sends in this span.
fn emergencies(world: &mut sim::world::World, master: &Master, span: Time) -> Vec<u16> {
    master.heard(world, 0x081);
    world.run_until(world.now() + span);
    let heard = master.heard(world, 0x081);
    heard.iter().map(|frame| u16::from_le_bytes([frame.bytes()[0], frame.bytes()[1]])).collect()
}

/// The receive interrupts are delayed by 20 ms: the FIFO overflows, and the node reports the loss.
#[test]
fn frames_lost_by_the_fifo_are_reported() {
    let mut world = running();
    let master = Master::join(&mut world);
    let now = world.machine(0).now();
    let enabled = world.machine(0).peripherals_mut().read(CAN1_IER, 4, now).unwrap();
    world.machine(0).peripherals_mut().write(CAN1_IER, 4, 0, now).unwrap();
    for _ in 0..10 {
        master.send(&mut world, SDO_REQUEST, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
    }
    world.run_until(world.now() + Time::from_millis(20));
    let now = world.machine(0).now();
    world.machine(0).peripherals_mut().write(CAN1_IER, 4, enabled, now).unwrap();
    let codes = emergencies(&mut world, &master, SECOND);
    assert!(codes.contains(&OVERRUN), "{codes:04X?}");
    assert_eq!(codes.last(), Some(&0), "and that it is over: {codes:04X?}");
    master.send(&mut world, SDO_REQUEST, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
    world.run_until(world.now() + Time::from_millis(20));
    assert_eq!(master.heard(&mut world, SDO_RESPONSE).len(), 1, "it answers again");
}

/// The next frames are destroyed, too few for bus-off.
#[test]
fn an_error_passive_node_sends_an_emcy() {
    let mut world = running();
    let master = Master::join(&mut world);
    let next = world.bus().frames();
    for frame in next..next + ENOUGH_TO_BE_PASSIVE {
        let fault = Fault { frame, position: Position::Bit(30), seen_by: SeenBy::Everyone };
        world.bus().faults.schedule(fault);
    }
    let codes = emergencies(&mut world, &master, SECOND * 5);
    assert_eq!(codes.first(), Some(&PASSIVE), "{codes:04X?}");
    let after = run(&mut world, SECOND);
    assert_eq!(after.nodes[0].heard.boot_ups, 1, "{after}");
}

/// A participant with a wrong bit rate destroys frames until it is bus-off; the node must survive this.
#[test]
fn a_participant_with_a_wrong_bit_rate_is_outlived() {
    let mut world = running();
    let stranger = Master::join_at(&mut world, 500_000);
    for _ in 0..20 {
        stranger.send(&mut world, 0x123, &[0x55; 8]);
    }
    let during = run(&mut world, SECOND * 2);
    assert!(during.bus.errors > 20, "{during}");
    world.close_port(stranger.port);
    let before = run(&mut world, SECOND * 5).nodes[0].heard.clone();
    let after = run(&mut world, SECOND * 5);
    assert_eq!(after.nodes[0].heard.heartbeats - before.heartbeats, 5, "{after}");
    assert_eq!(after.nodes[0].heard.boot_ups, 1, "{after}");
    assert!(after.nodes[0].incidents.is_empty(), "{after}");
}

/// For half a minute (two minutes with `--thorough`) another participant sends only a frame that is more urgent than
/// all frames of the node. The node is silent for this time, but measures, and sends again in the first gap.
/// The frame in the mailbox and the newest one of its heartbeats and PDOs are kept.
#[test]
fn a_node_silenced_for_minutes_by_more_urgent_frames_recovers() {
    const BIT_RATE: u32 = 125_000;
    const MORE_URGENT: u16 = 0x001;
    let seconds = either(30, 120);
    /// Number of frames of eight bytes that take more than 100 ms.
    const FRAMES: usize = 120;
    const HEARTBEAT: u16 = 0x701;
    /// Longer than the whole queue takes, shorter than the period of heartbeat and PDO.
    const GAP: Time = Time::from_millis(50);
    let mut world = world("--bitrate 125");
    let babbler = Master::join_at(&mut world, BIT_RATE);
    world.run_until(SECOND);
    babbler.send(&mut world, START_ALL.0, &START_ALL.1);
    let before = run(&mut world, SECOND * 2).nodes[0].clone();
    for step in 0..seconds * 10 {
        let waiting = if step == 0 { 2 * FRAMES } else { FRAMES };
        (0..waiting).for_each(|_| babbler.send(&mut world, MORE_URGENT, &[0x55; 8]));
        world.run_until(world.now() + Time::from_millis(100));
    }
    let during = run(&mut world, Time::ZERO);
    let node = &during.nodes[0];
    assert_eq!(node.sampling.samples - before.sampling.samples, seconds * 1000, "{during}");
    assert!(node.heard.heartbeats - before.heard.heartbeats <= 1, "it found a gap: {during}");
    assert_eq!((node.receiving.lost, during.bus.errors), (0, 0), "{during}");
    world.close_port(babbler.port);
    world.take_frames();
    world.run_until(world.now() + GAP);
    let told = world.take_frames();
    for id in [TPDO1, HEARTBEAT].map(|id| frame(id, &[]).id()) {
        let count = told.iter().filter(|stamped| stamped.frame.id() == id).count();
        assert!((1..=2).contains(&count), "{count} of {id:?}: {during}");
    }
    let back = run(&mut world, SECOND * 2).nodes[0].clone();
    let after = run(&mut world, SECOND * 5);
    let node = &after.nodes[0];
    assert_eq!(node.heard.heartbeats - back.heard.heartbeats, 5, "{after}");
    assert!(node.heard.boot_ups == 1 && node.incidents.is_empty(), "{after}");
}

/// A babbling node leaves no gap on the bus for half a minute: the node's frames wait, and are delayed but not lost.
#[test]
fn a_node_on_a_full_bus_keeps_measuring() {
    let mut world = world("--bitrate 1000 --load 100");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    let before = run(&mut world, SECOND).nodes[0].clone();
    let after = run(&mut world, SECOND * 30);
    let node = &after.nodes[0];
    assert!(after.bus.load > 0.99, "{after}");
    assert_eq!(node.sampling.samples - before.sampling.samples, 30_000, "{after}");
    assert_eq!(node.heard.heartbeats - before.heard.heartbeats, 30, "{after}");
    assert_eq!((node.receiving.lost, node.heard.emcys), (0, 0), "{after}");
    assert!(node.incidents.is_empty(), "{after}");
}
