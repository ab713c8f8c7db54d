//! Times beyond 32 bits of microseconds: no deadline of a device is early, late or in the past.

use canopen::dictionary::{Access, Dictionary, Mapping, Object, Type};
use canopen::sdo::{Initiate, Multiplexer, Request};
use canopen::{Application, BusEvent, Device, Duration, Fault, Frame, Instant, NodeId, objects};

use crate::bench::Bench;
use crate::exchange;
use crate::types::Sent;

const ID: u8 = 5;
const VALUE: Object = Object::new(0x6000, 0, "", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo);
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::heartbeat_producer(1000)],
    objects::node_guarding(),
    objects::emergency(),
    objects::identity(0, 1, 1),
    objects::with(objects::tpdo(1, &[VALUE]), 5, 60_000),
    [VALUE],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

const SECOND: u64 = 1_000_000;
const HOUR: u64 = 3600 * SECOND;

/// Counts the losses of the guarding master.
#[derive(Default)]
struct Losses(u32);

impl Application for Losses {
    fn fault(&mut self, fault: Fault, active: bool, _: &mut [u8]) {
        self.0 += u32::from(fault == Fault::LifeGuard && active);
    }
}

type Node = canopen::device!(Losses, ROWS);

fn operational(start: u64) -> Node {
    let mut node = Device::new(&DICTIONARY, NodeId::new(ID), Losses::default());
    let _ = node.start(Instant(start), &mut Sent::default());
    let _ = node.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(start), &mut Sent::default());
    node
}

/// Polls at every deadline. Returns the instants of the frames with a CAN-ID.
fn times(node: &mut Node, (begin, end): (u64, u64), id: u16) -> Vec<u64> {
    let (mut times, mut now) = (vec![], begin);
    while now < end {
        let mut sent = Sent::default();
        let next = node.poll(Instant(now), &mut sent);
        times.extend(sent.0.iter().filter(|frame| frame.id() == id).map(|_| now));
        assert!(next.action.is_some() || next.due() > Instant(now), "due in the past at {now}");
        now = if next.action.is_some() { now } else { next.due().0 };
    }
    times
}

#[test]
fn heartbeats_and_event_timers_keep_their_periods_for_hours() {
    for start in [0, 31 * SECOND, u64::from(u32::MAX) - 5, 1 << 45] {
        let end = start + 3 * HOUR;
        let heartbeats = times(&mut operational(start), (start, end), 0x705);
        assert_eq!(heartbeats.len(), 3 * 3600 - 1, "from {start}");
        assert!(heartbeats.windows(2).all(|pair| pair[1] - pair[0] == SECOND));
        let events = times(&mut operational(start), (start, end), 0x185);
        assert_eq!(events.len(), 3 * 60 - 1, "from {start}");
        assert!(events.windows(2).all(|pair| pair[1] - pair[0] == 60 * SECOND));
    }
}

#[test]
fn after_a_long_pause_the_next_heartbeat_is_a_period_away() {
    let mut node = operational(0);
    for pause in [34 * SECOND, 2 * HOUR, 100 * 24 * HOUR] {
        let mut sent = Sent::default();
        let next = node.poll(Instant(pause), &mut sent);
        assert_eq!(sent.0.iter().filter(|frame| frame.id() == 0x705).count(), 1, "{pause}");
        assert_eq!(next.services, Instant(pause + SECOND));
    }
}

#[test]
fn the_longest_life_time_ends_after_four_and_a_half_hours() {
    let mut node = operational(0);
    let mut write = |index, bytes: &[u8]| {
        let ask = |request: Frame| {
            let mut sent = Sent::default();
            let _ = node.on_service_frame(&request, Instant(1), &mut sent);
            sent.0
        };
        exchange::write(ID, canopen::sdo::Multiplexer { index, sub: 0 }, bytes, ask).unwrap();
    };
    write(0x1017, &[0, 0]);
    write(0x100C, &[0xFF, 0xFF]);
    write(0x100D, &[0xFF]);
    let begin = 2 * SECOND;
    let _ = node.on_frame(&Frame::remote(0x705, 1).unwrap(), Instant(begin), &mut Sent::default());
    let end = begin + 65_535 * 255 * 1000;
    times(&mut node, (begin, end), 0x705);
    assert_eq!(node.application().0, 0, "the life time is not over");
    let _ = node.poll(Instant(end), &mut Sent::default());
    assert_eq!(node.application().0, 1);
}

/// The longest time of a device is 71 minutes. A check for the last of them would cost flash in every call.
#[test]
fn until_71_minutes_before_the_end_of_64_bits_no_deadline_is_in_the_past() {
    let (start, end) = (u64::MAX - 3 * HOUR, u64::MAX - u64::from(u32::MAX));
    let mut node = operational(start);
    let _ = node.on_frame(&Frame::remote(0x705, 1).unwrap(), Instant(start), &mut Sent::default());
    let _ = node.set_condition(0, true, Instant(start));
    let _ = node.on_bus(BusEvent::Overrun, Instant(start));
    let heartbeats = times(&mut node, (start, end), 0x705);
    assert!(heartbeats.windows(2).all(|pair| pair[1] - pair[0] == SECOND));
}

#[test]
fn the_inhibit_time_of_an_emcy_ends_in_time_for_hours() {
    for pause in [34 * SECOND, HOUR, 100 * 24 * HOUR] {
        let mut node = operational(0);
        let ask = |request: Frame| {
            let mut sent = Sent::default();
            let _ = node.on_service_frame(&request, Instant(1), &mut sent);
            sent.0
        };
        let at = canopen::sdo::Multiplexer { index: 0x1015, sub: 0 };
        exchange::write(ID, at, &60_000_u16.to_le_bytes(), ask).unwrap();
        let _ = node.on_bus(BusEvent::Overrun, Instant(2));
        times(&mut node, (2, 3), 0x85);
        times(&mut node, (3, pause), 0x85);
        let _ = node.on_bus(BusEvent::Overrun, Instant(pause));
        assert_eq!(
            times(&mut node, (pause, pause + 7 * SECOND), 0x85),
            [pause, pause + 6 * SECOND],
            "{pause}"
        );
    }
}

#[test]
fn a_silent_node_and_a_silent_client_are_noticed_in_time_at_any_instant() {
    let mut bench = Bench::booted();
    let at = Multiplexer { index: 0x6103, sub: 0 };
    bench.write32(0x1016, 1, 0x0009_03E8).unwrap();
    // EMCYs and abort messages: an error code, and the command.
    let reports = |bench: &mut Bench| -> Vec<(u16, u8)> {
        let mut sent = bench.sent();
        sent.retain(|(id, _)| [0x085, 0x585].contains(id));
        sent.into_iter().map(|(id, data)| (id, data[0])).collect()
    };
    for second in 0..100 {
        bench.receive(Frame::new(0x709, &[5]).unwrap());
        assert!(bench.ask(Request::Download(at, Initiate::Segmented(None))).is_some());
        reports(&mut bench);
        bench.run(Duration(999_999));
        assert_eq!(reports(&mut bench), [], "from {second} s on");
        bench.run(Duration(1));
        assert_eq!(reports(&mut bench), [(0x085, 0x30), (0x585, 0x80)], "from {second} s on");
    }
}
