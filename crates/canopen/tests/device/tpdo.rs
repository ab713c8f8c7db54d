//! TPDOs: transmission types, timers, remote frames.

use crate::bench::Bench;
use canopen::lss::BitRate;
use canopen::{Duration, Frame};

const TPDO: u16 = 0x185;
const MS: Duration = Duration::from_millis(1);

/// An operational device whose TPDO has this transmission type, inhibit time (100 us) and event timer (ms).
fn bench(transmission: u8, inhibit: u16, event: u16) -> Bench {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, 0x8000_0185).unwrap();
    bench.write(0x1800, 2, &[transmission]).unwrap();
    bench.write(0x1800, 3, &inhibit.to_le_bytes()).unwrap();
    bench.write(0x1800, 5, &event.to_le_bytes()).unwrap();
    bench.write32(0x1800, 1, 0x0000_0185).unwrap();
    bench.nmt(1);
    bench
}

fn sent(bench: &mut Bench) -> Vec<Vec<u8>> {
    bench.sent().into_iter().filter(|(id, _)| *id == TPDO).map(|(_, data)| data).collect()
}

fn request(bench: &mut Bench) {
    bench.receive(Frame::remote(TPDO, 4).unwrap());
}

#[test]
fn it_is_sent_on_entering_operational_and_by_its_event_timer() {
    for transmission in [254, 255] {
        let mut bench = bench(transmission, 0, 100);
        assert_eq!(sent(&mut bench), [[0; 4]]);
        bench.set_value(1, &[1, 2, 3, 4]);
        assert_eq!(bench.times_of(TPDO, Duration::from_millis(350)), [100_000, 200_000, 300_000]);
    }
}

/// A change every 50 us: three quarters of the bus at most, and services between the PDOs.
#[test]
fn a_queue_without_replacement_has_a_share_of_the_bus() {
    for kbit in [1000, 500, 125] {
        let mut bench = bench(255, 0, 0);
        bench.device.set_bus_bit_rate(BitRate::from_kbit(kbit).unwrap());
        bench.take();
        let (mut bits, mut last) = (0, vec![]);
        for number in 0..20_000_u32 {
            bench.set_value(1, &number.to_le_bytes());
            bench.run(Duration(50));
            for data in sent(&mut bench) {
                (bits, last) = (bits + 55 + 10 * data.len(), data);
            }
        }
        let may = usize::from(kbit) * 1000 * 3 / 4;
        assert!((may * 4 / 5..=may * 21 / 20).contains(&bits), "{kbit} kbit/s: {bits} bits in a second");
        bench.run(MS);
        last = sent(&mut bench).pop().unwrap_or(last);
        assert_eq!(last, 19_999_u32.to_le_bytes(), "{kbit} kbit/s: the newest value is sent at last");
    }
}

/// The application asks for it, without a change of a value.
#[test]
fn an_event_of_the_application_sends_one_of_types_254_and_255() {
    for (transmission, is_sent) in
        [(254, true), (255, true), (1, false), (0, false), (252, false), (253, false)]
    {
        let mut bench = bench(transmission, 100, 0);
        bench.run(Duration::from_millis(20));
        bench.take();
        for number in [0, 2, 513, u16::MAX] {
            let _ = bench.device.send_tpdo(number, bench.now, &mut bench.out);
        }
        assert_eq!(sent(&mut bench).len(), 0, "other numbers");
        let _ = bench.device.send_tpdo(1, bench.now, &mut bench.out);
        assert_eq!(sent(&mut bench).len(), usize::from(is_sent), "type {transmission}");
        // The inhibit time is 10 ms.
        let _ = bench.device.send_tpdo(1, bench.now, &mut bench.out);
        assert_eq!(sent(&mut bench).len(), 0, "type {transmission}");
        assert_eq!(bench.times_of(TPDO, Duration::from_millis(30)), vec![10_000; is_sent.into()]);
        bench.nmt(0x80);
        let _ = bench.device.send_tpdo(1, bench.now, &mut bench.out);
        assert_eq!(bench.times_of(TPDO, Duration::from_millis(30)), [], "in Pre-operational");
    }
}

#[test]
fn leaving_operational_stops_it() {
    let mut bench = bench(255, 0, 10);
    bench.take();
    bench.nmt(0x80);
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(100)), []);
    bench.nmt(1);
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(25)), [0, 10_000, 20_000]);
}

#[test]
fn a_start_command_in_operational_sends_nothing() {
    let mut bench = bench(255, 0, 100);
    bench.take();
    bench.nmt(1);
    assert_eq!(sent(&mut bench), [[0; 0]; 0]);
}

#[test]
fn without_an_event_timer_every_change_is_sent() {
    let mut bench = bench(255, 0, 0);
    bench.take();
    bench.set_value(1, &[0; 4]);
    assert!(sent(&mut bench).is_empty());
    bench.set_value(1, &[1, 0, 0, 0]);
    bench.set_value(2, &[9, 9]);
    assert_eq!(sent(&mut bench), [[1, 0, 0, 0]]);
    bench.run(Duration::from_millis(5000));
    assert!(sent(&mut bench).is_empty());
}

#[test]
fn type_254_without_an_event_timer_is_sent_on_entering_operational_only() {
    let mut bench = bench(254, 0, 0);
    assert_eq!(sent(&mut bench), [[0; 4]]);
    bench.set_value(1, &[1, 0, 0, 0]);
    bench.run(Duration::from_millis(5000));
    assert!(sent(&mut bench).is_empty());
    request(&mut bench);
    assert_eq!(sent(&mut bench), [[1, 0, 0, 0]]);
    bench.nmt(0x80);
    bench.nmt(1);
    assert_eq!(sent(&mut bench), [[1, 0, 0, 0]]);
}

#[test]
fn within_the_inhibit_time_changes_wait_and_the_newest_wins() {
    let mut bench = bench(255, 50, 0);
    assert_eq!(sent(&mut bench).len(), 1);
    bench.set_value(1, &[1, 0, 0, 0]);
    bench.run(MS);
    bench.set_value(1, &[2, 0, 0, 0]);
    assert!(sent(&mut bench).is_empty());
    bench.run(Duration(3_999));
    assert!(sent(&mut bench).is_empty());
    bench.run(Duration(1));
    assert_eq!(sent(&mut bench), [[2, 0, 0, 0]]);
}

#[test]
fn the_inhibit_time_limits_the_event_timer() {
    let mut bench = bench(255, 50, 1);
    bench.take();
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(11)), [5_000, 10_000]);
}

#[test]
fn types_1_to_240_count_syncs() {
    for (transmission, syncs, expected) in [(1, 3, 3), (2, 5, 2), (240, 480, 2)] {
        let mut bench = bench(transmission, 0, 0);
        (0..syncs).for_each(|_| bench.sync());
        assert_eq!(sent(&mut bench).len(), expected);
    }
}

#[test]
fn type_0_is_sent_with_the_sync_after_a_change() {
    let mut bench = bench(0, 0, 0);
    bench.sync();
    assert_eq!(sent(&mut bench).len(), 1);
    bench.sync();
    assert!(sent(&mut bench).is_empty());
    bench.set_value(1, &[7, 0, 0, 0]);
    assert!(sent(&mut bench).is_empty());
    bench.sync();
    assert_eq!(sent(&mut bench), [[7, 0, 0, 0]]);
}

#[test]
fn synchronous_types_ignore_event_timer_and_remote_frames() {
    let mut bench = bench(1, 0, 5);
    request(&mut bench);
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(50)), []);
}

#[test]
fn type_252_sends_the_sample_of_the_sync_on_request() {
    let mut bench = bench(252, 0, 0);
    request(&mut bench);
    assert!(sent(&mut bench).is_empty());
    bench.set_value(1, &[1, 0, 0, 0]);
    bench.sync();
    bench.set_value(1, &[2, 0, 0, 0]);
    assert!(sent(&mut bench).is_empty());
    request(&mut bench);
    assert_eq!(sent(&mut bench), [[1, 0, 0, 0]]);
}

#[test]
fn type_253_samples_and_sends_on_request() {
    let mut bench = bench(253, 0, 0);
    bench.sync();
    bench.set_value(1, &[2, 0, 0, 0]);
    assert!(sent(&mut bench).is_empty());
    request(&mut bench);
    assert_eq!(sent(&mut bench), [[2, 0, 0, 0]]);
}

#[test]
fn event_types_answer_a_remote_frame_unless_forbidden() {
    let mut bench = bench(255, 0, 0);
    bench.take();
    request(&mut bench);
    assert_eq!(sent(&mut bench).len(), 1);
    bench.write32(0x1800, 1, 0x4000_0185).unwrap();
    bench.take();
    request(&mut bench);
    assert!(sent(&mut bench).is_empty());
}

#[test]
fn remote_frames_and_syncs_outside_operational_are_ignored() {
    let mut bench = bench(253, 0, 0);
    bench.nmt(0x80);
    bench.take();
    request(&mut bench);
    bench.sync();
    assert_eq!(bench.sent(), []);
}

#[test]
fn a_remote_frame_with_the_identifier_of_sync_is_no_sync() {
    let mut bench = bench(1, 0, 0);
    bench.receive(Frame::remote(0x80, 0).unwrap());
    assert!(sent(&mut bench).is_empty());
}

#[test]
fn sync_follows_its_cob_id() {
    let mut bench = bench(1, 0, 0);
    for refused in [0x4000_0080, 0x2000_0080, 0x880, 0x000, 0x601] {
        assert_eq!(bench.write32(0x1005, 0, refused), Err(0x0609_0030));
    }
    bench.write32(0x1005, 0, 0x8000_0090).unwrap();
    assert!(bench.device.process_ids().any(|id| id.get() == 0x90));
    bench.sync();
    assert!(sent(&mut bench).is_empty());
    bench.receive(Frame::new(0x90, &[]).unwrap());
    assert_eq!(sent(&mut bench).len(), 1);
}

#[test]
fn a_full_queue_is_tried_again_with_the_values_of_then() {
    let mut bench = bench(1, 0, 0);
    bench.out.room = 0;
    bench.set_value(1, &[1, 0, 0, 0]);
    bench.sync();
    bench.set_value(1, &[2, 0, 0, 0]);
    bench.out.room = 5;
    bench.run(MS);
    assert_eq!((sent(&mut bench), bench.out.room), (vec![vec![2, 0, 0, 0]], 4), "four are left for services");
    bench.run(Duration::from_millis(50));
    assert!(sent(&mut bench).is_empty());
}

#[test]
fn an_event_timer_changed_in_operational_starts_over() {
    let mut bench = bench(255, 0, 100);
    bench.run(Duration::from_millis(50));
    bench.write(0x1800, 5, &[20, 0]).unwrap();
    bench.take();
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(45)), [20_000, 40_000]);
}

#[test]
fn the_event_timer_has_a_second_name() {
    let mut bench = bench(255, 0, 100);
    assert_eq!(bench.read(0x6105, 0), Ok(vec![100, 0]));
    bench.take();
    bench.write(0x6105, 0, &[20, 0]).unwrap();
    assert_eq!(bench.read(0x1800, 5), Ok(vec![20, 0]));
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(45)), [0, 20_000, 40_000]);
    assert_eq!(bench.write(0x6105, 0, &[1, 2, 3]), Err(0x0607_0012));
}

/// The inhibit time separates two frames of an event-driven TPDO, whatever asks for the second one.
#[test]
fn nothing_shortens_the_inhibit_time() {
    type Cause = fn(&mut Bench);
    let causes: [(&str, Cause); 7] = [
        ("remote frame", request),
        ("event timer", |bench| bench.write(0x1800, 5, &[200, 0]).unwrap()),
        ("transmission type", |bench| bench.write(0x1800, 2, &[254]).unwrap()),
        ("bit 30", |bench| bench.write32(0x1800, 1, 0x4000_0185).unwrap()),
        ("off and on", |bench| {
            bench.write32(0x1800, 1, 0x8000_0185).unwrap();
            bench.write32(0x1800, 1, 0x0000_0185).unwrap();
        }),
        ("other inhibit time", |bench| {
            bench.write32(0x1800, 1, 0x8000_0185).unwrap();
            bench.write(0x1800, 3, &6000_u16.to_le_bytes()).unwrap();
            bench.write32(0x1800, 1, 0x0000_0185).unwrap();
        }),
        ("NMT", |bench| {
            bench.nmt(0x80);
            bench.nmt(1);
        }),
    ];
    for (name, cause) in causes {
        for transmission in [254, 255] {
            let mut bench = bench(transmission, 5000, 0);
            assert_eq!(sent(&mut bench).len(), 1);
            bench.run(MS);
            for _ in 0..20 {
                cause(&mut bench);
                bench.run(Duration::from_millis(20));
                assert_eq!(sent(&mut bench).len(), 0, "{name}");
            }
            let rest = if name == "other inhibit time" { 199 } else { 99 };
            assert_eq!(bench.times_of(TPDO, Duration::from_millis(250)), [rest * 1000], "{name}");
        }
    }
}

#[test]
fn a_node_reset_ends_the_inhibit_time() {
    let mut bench = bench(255, 50_000, 0);
    bench.take();
    bench.nmt(0x82);
    bench.start();
    bench.take();
    bench.nmt(1);
    assert_eq!(sent(&mut bench).len(), 1);
}

/// CiA 301, 7.5.2.35: the inhibit time is one of the types 254 and 255.
#[test]
fn the_inhibit_time_delays_no_answer_of_type_253() {
    let mut bench = bench(253, 5000, 0);
    for _ in 0..3 {
        request(&mut bench);
        assert_eq!(sent(&mut bench).len(), 1);
    }
}

#[test]
fn a_full_queue_after_the_inhibit_time_is_tried_again_each_millisecond() {
    let mut bench = bench(255, 50, 0);
    bench.run(Duration::from_millis(100));
    bench.take();
    bench.out.room = 0;
    bench.set_value(1, &[1, 0, 0, 0]);
    for _ in 0..3 {
        let due = bench.poll();
        assert_eq!(due, bench.now + MS);
        bench.now = due;
    }
    bench.out.room = 10;
    bench.poll();
    assert_eq!(sent(&mut bench), [[1, 0, 0, 0]]);
}

/// The ticks of a device count from an epoch, which moves 2^25 us after the last one.
#[test]
fn the_bus_share_counts_the_time_across_a_move_of_the_epoch() {
    let mut bench = bench(255, 0, 0);
    bench.device.set_bus_bit_rate(BitRate::from_kbit(10).unwrap());
    let limit = 1 << 25;
    bench.run(Duration(limit - 10_000 - bench.now.0));
    bench.take();
    let burst = (1..100).take_while(|&number| {
        bench.set_value(1, &[number, 0, 0, 0]);
        !sent(&mut bench).is_empty()
    });
    assert_eq!(burst.count(), 2, "the rest waits for its share");
    bench.now.0 = limit + 50_000;
    bench.poll();
    assert_eq!(sent(&mut bench), [[3, 0, 0, 0]], "after 60 ms, the share is full");
}

#[test]
fn type_253_has_no_inhibit_time_after_operational_was_left_either() {
    let mut bench = bench(253, 50_000, 0);
    request(&mut bench);
    assert_eq!(sent(&mut bench).len(), 1);
    bench.nmt(0x80);
    bench.nmt(1);
    request(&mut bench);
    assert_eq!(sent(&mut bench).len(), 1);
}

#[test]
fn a_stored_inhibit_time_does_not_begin_before_a_reset() {
    let mut bench = Bench::unstarted();
    // 1800h:3, 5 s.
    bench.device.application_mut().stored[0] = vec![0x00, 0x18, 3, 1, 2, 0x50, 0xC3];
    for _ in 0..2 {
        bench.start();
        bench.take();
        bench.nmt(1);
        assert_eq!(sent(&mut bench).len(), 1);
        bench.nmt(0x82);
    }
}
