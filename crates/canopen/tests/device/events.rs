//! TPDOs that send events: each event once, in order, whatever the inhibit time, the event timer and the queue.

use crate::bench::Bench;
use canopen::{Duration, Frame};

const TPDO: u16 = 0x185;
const MS: Duration = Duration::from_millis(1);

/// A device whose TPDO 1 sends events, with this transmission type, inhibit time (100 us) and event timer (ms).
fn configured(transmission: u8, inhibit: u16, event: u16) -> Bench {
    let mut bench = Bench::booted();
    bench.device.application_mut().event_tpdo = 1;
    bench.write32(0x1800, 1, 0x8000_0185).unwrap();
    bench.write(0x1800, 2, &[transmission]).unwrap();
    bench.write(0x1800, 3, &inhibit.to_le_bytes()).unwrap();
    bench.write(0x1800, 5, &event.to_le_bytes()).unwrap();
    bench.write32(0x1800, 1, 0x0000_0185).unwrap();
    bench.take();
    bench
}

/// The same in Operational, after the event of the start.
fn operational(transmission: u8, inhibit: u16, event: u16) -> Bench {
    let mut bench = configured(transmission, inhibit, event);
    bench.nmt(1);
    bench.run(Duration::from_millis(1000));
    bench.take();
    bench
}

fn push(bench: &mut Bench, events: impl IntoIterator<Item = u8>) {
    let events = events.into_iter().map(|event| [event, 0, 0, 0]);
    bench.device.application_mut().events.extend(events);
    publish(bench);
}

fn publish(bench: &mut Bench) {
    let last = bench.device.application().last_event.unwrap_or_default();
    bench.set_value(1, &last);
}

fn told(bench: &mut Bench) -> Vec<u8> {
    bench.sent().into_iter().filter(|(id, _)| *id == TPDO).map(|(_, data)| data[0]).collect()
}

#[test]
fn the_start_asks_for_how_things_are() {
    let mut bench = configured(255, 0, 0);
    bench.set_value(1, &[9, 0, 0, 0]);
    push(&mut bench, [3]);
    assert_eq!(told(&mut bench), [0; 0], "not yet operational");
    assert_eq!(bench.device.application().events.len(), 1, "nor asked for");
    bench.device.application_mut().events.clear();
    bench.set_value(1, &[9, 0, 0, 0]);
    bench.nmt(1);
    assert_eq!(told(&mut bench), [9], "the one that the application tells");
    bench.write32(0x1800, 1, 0x8000_0185).unwrap();
    bench.write32(0x1800, 1, 0x0000_0185).unwrap();
    assert_eq!(told(&mut bench), [9], "valid again");
}

#[test]
fn the_inhibit_time_delays_events_and_loses_none() {
    let mut bench = operational(255, 2000, 0);
    push(&mut bench, [1, 2, 1, 2]);
    assert_eq!(told(&mut bench), [1]);
    for expected in [2, 1, 2] {
        bench.run(Duration::from_millis(199));
        assert_eq!(told(&mut bench), [0; 0]);
        bench.run(MS);
        assert_eq!(told(&mut bench), [expected]);
    }
    bench.run(Duration::from_millis(1000));
    assert_eq!(told(&mut bench), [0; 0]);
}

#[test]
fn the_event_timer_sends_all_waiting_events_or_the_last_one_again() {
    for transmission in [254, 255] {
        let mut bench = operational(transmission, 0, 500);
        bench.run(Duration::from_millis(100));
        push(&mut bench, [1, 2]);
        assert_eq!(told(&mut bench), [0; 0]);
        bench.run(Duration::from_millis(500));
        assert_eq!(told(&mut bench), [1, 2]);
        bench.run(Duration::from_millis(1000));
        assert_eq!(told(&mut bench), [2, 2]);
    }
}

#[test]
fn with_both_times_the_inhibit_time_separates_frames_of_the_timer() {
    let mut bench = operational(255, 1000, 500);
    push(&mut bench, [1, 2, 3]);
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(900)), [500_000, 600_000, 700_000]);
}

#[test]
fn events_leave_room_in_the_queue_and_wait_with_the_application() {
    let mut bench = operational(255, 0, 0);
    bench.out.room = 14;
    push(&mut bench, 1..=5);
    assert_eq!(told(&mut bench), [1, 2]);
    bench.run(Duration::from_millis(10));
    assert_eq!((told(&mut bench), bench.out.room), (vec![], 12));
    bench.out.room = 50;
    bench.run(MS);
    assert_eq!(told(&mut bench), [3, 4, 5], "without another call of the application");
}

#[test]
fn a_sync_sends_one_event() {
    for transmission in [0, 1, 2] {
        let mut bench = operational(transmission, 0, 0);
        bench.receive(Frame::new(0x80, &[]).unwrap());
        bench.receive(Frame::new(0x80, &[]).unwrap());
        bench.take();
        push(&mut bench, [1, 2]);
        assert_eq!(told(&mut bench), [0; 0]);
        let mut all = vec![];
        for _ in 0..4 {
            bench.receive(Frame::new(0x80, &[]).unwrap());
            all.extend(told(&mut bench));
        }
        assert_eq!(all, [1, 2], "type {transmission}");
    }
}

#[test]
fn a_remote_frame_gets_the_last_event_if_there_was_one() {
    let mut bench = operational(255, 0, 0);
    push(&mut bench, [7]);
    bench.take();
    bench.receive(Frame::remote(TPDO, 4).unwrap());
    assert_eq!(told(&mut bench), [7]);
}

#[test]
fn the_application_switches_pdos() {
    let mut bench = Bench::operational();
    bench.write(0x1600, 0, &[1]).unwrap_err();
    bench.write32(0x1600, 1, 0x6200_0010).unwrap();
    bench.write(0x1600, 0, &[1]).unwrap();
    let listens = |bench: &Bench| bench.device.process_ids().any(|id| id.get() == 0x205);
    for (command, on) in [(15, true), (14, false), (15, true)] {
        bench.take();
        bench.write(0x6201, 0, &[command]).unwrap();
        bench.run(Duration::from_millis(250));
        assert_eq!(!told(&mut bench).is_empty(), on, "{command}");
        assert_eq!(listens(&bench), on);
    }
}

/// A queue that is short for one moment must not make another event-driven TPDO due in the past (K21).
#[test]
fn a_short_queue_leaves_no_deadline_in_the_past_for_any_tpdo() {
    for room in 0..=9 {
        let mut bench = operational(255, 0, 0);
        bench.out.room = room;
        push(&mut bench, 1..=5);
        bench.run(Duration::from_millis(20));
        bench.out.room = usize::MAX;
        bench.run(Duration::from_millis(20));
        assert_eq!(told(&mut bench), [1, 2, 3, 4, 5], "room for {room}");
    }
}

#[test]
fn the_start_sends_the_present_state_at_once_and_starts_the_event_timer() {
    for transmission in [254, 255] {
        let mut bench = configured(transmission, 0, 500);
        bench.set_value(1, &[9, 0, 0, 0]);
        bench.nmt(1);
        assert_eq!(told(&mut bench), [9], "type {transmission}");
        let start = bench.times_of(TPDO, Duration::from_millis(1000));
        assert_eq!(start, [500_000, 1_000_000], "type {transmission}");
    }
}

/// A device with two events, of which the first one has found no room in the queue at a SYNC.
fn without_room(transmission: u8) -> Bench {
    let mut bench = operational(transmission, 0, 0);
    bench.sync();
    bench.take();
    bench.device.application_mut().events.extend([[1, 0, 0, 0], [2, 0, 0, 0]]);
    bench.out.room = 0;
    bench.sync();
    bench
}

#[test]
fn an_event_of_a_sync_waits_for_room_in_the_queue() {
    for transmission in [0, 1] {
        let mut bench = without_room(transmission);
        bench.out.room = usize::MAX;
        bench.run(MS);
        assert_eq!(told(&mut bench), [1], "without another call of the application");
        bench.sync();
        assert_eq!(told(&mut bench), [2]);
    }
}

/// The application is asked after `publish`, and otherwise only when the inhibit time or the event timer is over.
#[test]
fn a_call_before_the_deadline_asks_for_no_event() {
    let mut bench = operational(255, 0, 0);
    bench.device.application_mut().events.push_back([7, 0, 0, 0]);
    for _ in 0..3 {
        let next = bench.device.poll_process(bench.now, &mut bench.out);
        assert!(next.process > bench.now, "nothing is due");
    }
    bench.run(MS);
    assert_eq!(told(&mut bench), [0; 0]);
    publish(&mut bench);
    assert_eq!(told(&mut bench), [7]);
}

#[test]
fn an_event_outlasts_the_synchronous_window() {
    for transmission in [0, 1] {
        let mut bench = operational(transmission, 0, 0);
        bench.write32(0x1007, 0, 500).unwrap();
        bench.sync();
        bench.take();
        bench.device.application_mut().events.push_back([1, 0, 0, 0]);
        bench.out.room = 0;
        bench.sync();
        bench.run(Duration::from_millis(20));
        bench.out.room = usize::MAX;
        bench.run(MS);
        assert_eq!(told(&mut bench), [1], "type {transmission}");
    }
}

#[test]
fn a_sync_asks_for_no_event_of_an_event_driven_type() {
    for transmission in [254, 255] {
        let mut bench = operational(transmission, 2000, 0);
        push(&mut bench, [1, 2]);
        assert_eq!(told(&mut bench), [1]);
        bench.sync();
        assert_eq!(told(&mut bench), [0; 0], "type {transmission}: the inhibit time");
        bench.run(Duration::from_millis(200));
        assert_eq!(told(&mut bench), [2], "type {transmission}");
    }
}

#[test]
fn a_sync_asks_for_no_event_while_another_one_waits_for_room() {
    for transmission in [0, 1] {
        let mut bench = without_room(transmission);
        bench.sync();
        assert_eq!(bench.device.application().events.len(), 1, "type {transmission}");
        bench.out.room = usize::MAX;
        bench.run(MS);
        bench.sync();
        assert_eq!(told(&mut bench), [1, 2], "type {transmission}");
    }
}
