//! EMCY: messages, error register, the list 1003h and the COB-ID 1014h.

use crate::bench::{Bench, PRESSURE_RAIL, SENSOR_BREAK, TEMPERATURE_RAIL};
use canopen::BusEvent;
use canopen::emcy::Message;

fn emcy(code: u16, register: u8) -> (u16, Vec<u8>) {
    (0x085, Message { code, register, detail: [0; 5] }.encode().to_vec())
}

#[test]
fn a_fault_is_signalled_once_and_the_last_one_gone_is_signalled() {
    let mut bench = Bench::booted();
    bench.raise(SENSOR_BREAK);
    bench.raise(SENSOR_BREAK);
    bench.bus(BusEvent::Passive);
    bench.clear(SENSOR_BREAK);
    bench.clear(SENSOR_BREAK);
    bench.bus(BusEvent::Recovered);
    bench.poll();
    assert_eq!(bench.sent(), [emcy(0x5006, 0x01), emcy(0x8120, 0x11), emcy(0, 0)]);
}

#[test]
fn the_error_register_follows() {
    let mut bench = Bench::booted();
    bench.bus(BusEvent::Passive);
    assert_eq!(bench.read(0x1001, 0), Ok(vec![0x11]));
    bench.bus(BusEvent::Recovered);
    assert_eq!(bench.read(0x1001, 0), Ok(vec![0]));
}

#[test]
fn the_list_has_what_was_signalled_newest_first() {
    let mut bench = Bench::booted();
    assert_eq!(bench.read(0x1003, 0), Ok(vec![0]));
    assert_eq!(bench.read(0x1003, 1), Err(0x0800_0024));
    bench.raise(SENSOR_BREAK);
    bench.raise(PRESSURE_RAIL);
    assert_eq!(bench.read(0x1003, 0), Ok(vec![2]));
    assert_eq!(bench.read(0x1003, 1), Ok(vec![0x02, 0x80, 0, 0]));
    assert_eq!(bench.read(0x1003, 2), Ok(vec![0x06, 0x50, 0, 0]));
}

#[test]
fn the_list_is_cleared_by_a_zero_and_by_nothing_else() {
    let mut bench = Bench::booted();
    bench.raise(SENSOR_BREAK);
    assert_eq!(bench.write(0x1003, 0, &[1]), Err(0x0609_0030));
    assert_eq!(bench.write32(0x1003, 1, 0), Err(0x0601_0002));
    assert_eq!(bench.write(0x1003, 0, &[0]), Ok(()));
    assert_eq!(bench.read(0x1003, 0), Ok(vec![0]));
    assert_eq!(bench.read(0x1003, 1), Err(0x0800_0024));
    assert_eq!(bench.read(0x1001, 0), Ok(vec![1]));
}

#[test]
fn messages_wait_for_room_in_order_and_the_oldest_are_kept() {
    let mut bench = Bench::booted();
    bench.out.room = 0;
    for _ in 0..6 {
        bench.raise(SENSOR_BREAK);
        bench.clear(SENSOR_BREAK);
    }
    bench.poll();
    assert_eq!(bench.sent(), []);
    bench.out.room = 100;
    bench.run(canopen::Duration::from_millis(1));
    let expected: Vec<_> = (0..4).flat_map(|_| [emcy(0x5006, 1), emcy(0, 0)]).collect();
    assert_eq!(bench.sent(), expected);
}

#[test]
fn a_fault_that_is_still_there_after_a_reset_is_news_again() {
    let mut bench = Bench::booted();
    bench.raise(SENSOR_BREAK);
    bench.raise(PRESSURE_RAIL);
    bench.clear(PRESSURE_RAIL);
    bench.nmt(0x82);
    bench.take();
    bench.start();
    assert_eq!(bench.sent(), [(0x705, vec![0]), emcy(0x5006, 1)]);
    assert_eq!(bench.read(0x1003, 0), Ok(vec![1]));
    assert_eq!(bench.read(0x1001, 0), Ok(vec![1]));
}

#[test]
fn its_identifier_changes_only_while_it_does_not_exist() {
    let mut bench = Bench::booted();
    assert_eq!(bench.read(0x1014, 0), Ok(vec![0x85, 0, 0, 0]));
    for refused in [0x86, 0x4000_0085, 0x2000_0085, 0x0000_0885, 0x8000_0005 | 0x600] {
        assert_eq!(bench.write32(0x1014, 0, refused), Err(0x0609_0030));
    }
    bench.write32(0x1014, 0, 0x8000_0085).unwrap();
    bench.raise(SENSOR_BREAK);
    bench.poll();
    assert_eq!(bench.sent(), []);
    bench.write32(0x1014, 0, 0x0000_00A0).unwrap();
    bench.raise(PRESSURE_RAIL);
    bench.poll();
    assert_eq!(bench.sent(), [(0x0A0, vec![0x02, 0x80, 1, 0, 0, 0, 0, 0])]);
}

#[test]
fn the_inhibit_time_separates_messages() {
    let mut bench = Bench::booted();
    bench.write(0x1015, 0, &[50, 0]).unwrap();
    bench.raise(SENSOR_BREAK);
    bench.raise(PRESSURE_RAIL);
    bench.raise(TEMPERATURE_RAIL);
    assert_eq!(bench.times_of(0x085, canopen::Duration::from_millis(30)), [0, 5_000, 10_000]);
    bench.clear(SENSOR_BREAK);
    bench.raise(SENSOR_BREAK);
    assert_eq!(bench.times_of(0x085, canopen::Duration::from_millis(30)), [0]);
    bench.bus(BusEvent::Overrun);
    assert_eq!(bench.times_of(0x085, canopen::Duration::from_millis(30)), [0]);
}
