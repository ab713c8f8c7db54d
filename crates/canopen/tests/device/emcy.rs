//! EMCY: messages, error register, the list 1003h and the COB-ID 1014h.

use crate::bench::{Bench, ID, PRESSURE_RAIL, SENSOR_BREAK, TEMPERATURE_RAIL};
use crate::types::Sent;
use canopen::dictionary::{Dictionary, Object};
use canopen::emcy::Message;
use canopen::nmt::{Command, State};
use canopen::{
    Application, BusEvent, Condition, Device, Duration, ErrorClass, Frame, Instant, NodeId, objects,
};

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
fn the_list_has_the_signalled_errors_newest_first() {
    let mut bench = Bench::booted();
    assert_eq!(bench.read(0x1003, 0), Ok(vec![0]));
    assert_eq!(bench.read(0x1003, 1), Err(0x0800_0024));
    bench.raise(SENSOR_BREAK);
    bench.raise(PRESSURE_RAIL);
    bench.poll();
    assert_eq!(bench.read(0x1003, 0), Ok(vec![2]));
    assert_eq!(bench.read(0x1003, 1), Ok(vec![0x02, 0x80, 0, 0]));
    assert_eq!(bench.read(0x1003, 2), Ok(vec![0x06, 0x50, 0, 0]));
}

#[test]
fn the_list_is_cleared_by_a_zero_and_by_nothing_else() {
    let mut bench = Bench::booted();
    bench.raise(SENSOR_BREAK);
    bench.poll();
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
    bench.run(Duration::from_millis(1));
    let expected: Vec<_> = (0..4).flat_map(|_| [emcy(0x5006, 1), emcy(0, 0)]).collect();
    assert_eq!(bench.sent(), expected);
}

#[test]
fn an_active_fault_is_reported_again_after_a_reset() {
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
fn the_identifier_changes_only_while_emcy_is_not_valid() {
    let mut bench = Bench::booted();
    assert_eq!(bench.read(0x1014, 0), Ok(vec![0x85, 0, 0, 0]));
    for refused in [0x86, 0x4000_0085, 0x2000_0085, 0x0000_0885] {
        assert_eq!(bench.write32(0x1014, 0, refused), Err(0x0609_0030));
    }
    for without_emcy in [0x8000_0000, 0x8000_0605, 0x8000_0085] {
        assert_eq!(bench.write32(0x1014, 0, without_emcy), Ok(()), "the CAN-ID is not used");
        assert_eq!(bench.read(0x1014, 0), Ok(without_emcy.to_le_bytes().to_vec()));
    }
    for restricted in [0, 0x605] {
        assert_eq!(bench.write32(0x1014, 0, restricted), Err(0x0609_0030));
    }
    bench.raise(SENSOR_BREAK);
    bench.poll();
    assert_eq!(bench.sent(), []);
    bench.write32(0x1014, 0, 0x0000_00A0).unwrap();
    bench.raise(PRESSURE_RAIL);
    bench.poll();
    let told = [[0x06, 0x50, 1, 0, 0, 0, 0, 0], [0x02, 0x80, 1, 0, 0, 0, 0, 0]];
    assert_eq!(bench.sent(), told.map(|data| (0x0A0, data.to_vec())));
}

/// The codes in 1003h, newest first.
fn listed(bench: &mut Bench) -> Vec<u16> {
    let count = bench.read(0x1003, 0).unwrap()[0].min(2);
    let entry = |sub| bench.read(0x1003, sub).unwrap();
    (1..=count).map(entry).map(|entry| u16::from_le_bytes([entry[0], entry[1]])).collect()
}

#[test]
fn an_unsent_error_is_not_listed() {
    let mut bench = Bench::booted();
    bench.write32(0x1014, 0, 0x8000_0085).unwrap();
    bench.raise(SENSOR_BREAK);
    bench.run(Duration::from_millis(10));
    assert_eq!(listed(&mut bench), [], "EMCY is switched off");
    bench.write32(0x1014, 0, 0x85).unwrap();
    bench.run(Duration::from_millis(10));
    assert_eq!(listed(&mut bench), [0x5006], "switched on during the fault");

    bench.write(0x1015, 0, &10_000_u16.to_le_bytes()).unwrap();
    bench.raise(PRESSURE_RAIL);
    bench.run(Duration::from_millis(900));
    assert_eq!(listed(&mut bench), [0x5006], "the inhibit time holds the message back");
    bench.run(Duration::from_millis(200));
    assert_eq!(listed(&mut bench), [0x8002, 0x5006]);
}

#[test]
fn enabling_1014h_reports_the_active_faults() {
    let mut bench = Bench::booted();
    bench.write32(0x1014, 0, 0x8000_0085).unwrap();
    bench.write32(0x1600, 1, 0x6200_0010).unwrap();
    bench.write(0x1600, 0, &[1]).unwrap();
    bench.write32(0x1400, 1, 0x205).unwrap();
    bench.write32(0x1016, 2, 0x0009_000A).unwrap();
    bench.nmt(1);
    for frame in [(0x709, &[5][..]), (0x205, &[1])] {
        bench.receive(Frame::new(frame.0, frame.1).unwrap());
    }
    bench.raise(SENSOR_BREAK);
    bench.raise(PRESSURE_RAIL);
    bench.clear(PRESSURE_RAIL);
    bench.run(Duration::from_millis(20));
    bench.take();
    bench.write32(0x1014, 0, 0x85).unwrap();
    bench.poll();
    let codes: Vec<_> = bench.sent().into_iter().filter(|(id, _)| *id == 0x085).collect();
    let codes = codes.iter().map(|(_, data)| (u16::from_le_bytes([data[0], data[1]]), data[3]));
    assert_eq!(codes.collect::<Vec<_>>(), [(0x5006, 0), (0x8130, 2), (0x8210, 1)]);
}

#[test]
fn a_shorter_inhibit_time_releases_a_waiting_message() {
    for (inhibit, expected) in [(0_u16, vec![0]), (2000, vec![100_000])] {
        let mut bench = Bench::booted();
        bench.write(0x1015, 0, &10_000_u16.to_le_bytes()).unwrap();
        bench.raise(SENSOR_BREAK);
        bench.raise(PRESSURE_RAIL);
        bench.run(Duration::from_millis(100));
        bench.take();
        bench.write(0x1015, 0, &inhibit.to_le_bytes()).unwrap();
        let mut times = vec![0; bench.take().iter().filter(|frame| frame.id() == 0x085).count()];
        times.extend(bench.times_of(0x085, Duration::from_millis(3000)));
        assert_eq!(times, expected, "1015h = {inhibit}");
    }
}

#[test]
fn the_inhibit_time_separates_messages() {
    let mut bench = Bench::booted();
    bench.write(0x1015, 0, &[50, 0]).unwrap();
    bench.raise(SENSOR_BREAK);
    bench.raise(PRESSURE_RAIL);
    bench.raise(TEMPERATURE_RAIL);
    assert_eq!(bench.times_of(0x085, Duration::from_millis(30)), [0, 5_000, 10_000]);
    bench.clear(SENSOR_BREAK);
    bench.raise(SENSOR_BREAK);
    assert_eq!(bench.times_of(0x085, Duration::from_millis(30)), [0]);
    bench.bus(BusEvent::Overrun);
    assert_eq!(bench.times_of(0x085, Duration::from_millis(30)), [0]);
}

/// The error codes of the EMCYs since the last call.
fn codes(bench: &mut Bench) -> Vec<u16> {
    let emcys = bench.sent().into_iter().filter(|(id, _)| *id == 0x085);
    emcys.map(|(_, data)| u16::from_le_bytes([data[0], data[1]])).collect()
}

/// Two EMCYs for each lost frame would fill the bus that has already too many frames, and the list of errors.
#[test]
fn lost_frames_are_one_fault_until_a_quiet_half_second() {
    let mut bench = Bench::booted();
    for _ in 0..1000 {
        bench.bus(BusEvent::Overrun);
        bench.run(Duration::from_millis(1));
    }
    assert_eq!(codes(&mut bench), [0x8110]);
    assert_eq!(bench.read(0x1001, 0), Ok(vec![0x11]));
    bench.run(Duration(498_999));
    assert_eq!(codes(&mut bench), []);
    bench.run(Duration(1));
    assert_eq!(codes(&mut bench), [0]);
    assert_eq!((bench.read(0x1001, 0), bench.read(0x1003, 0)), (Ok(vec![0]), Ok(vec![1])));
    bench.bus(BusEvent::Overrun);
    assert_eq!(codes(&mut bench), [0x8110]);
}

#[test]
fn the_quiet_time_of_lost_frames_ends_in_every_nmt_state() {
    for command in [1, 2, 0x80] {
        let mut bench = Bench::booted();
        bench.bus(BusEvent::Overrun);
        bench.nmt(command);
        bench.run(Duration::from_millis(500));
        bench.nmt(0x80);
        assert_eq!(codes(&mut bench), [0x8110, 0], "command {command:02X}h");
    }
    let mut bench = Bench::booted();
    bench.bus(BusEvent::Overrun);
    bench.nmt(0x82);
    bench.run(Duration::from_millis(1000));
    bench.start();
    bench.run(Duration::from_millis(1));
    assert_eq!(codes(&mut bench), [0x8110, 0x8110, 0], "the reset reports the active faults again");
}

#[test]
fn an_active_fault_of_the_bus_is_reported_again_after_a_reset() {
    let mut bench = Bench::booted();
    bench.bus(BusEvent::Passive);
    bench.nmt(0x82);
    bench.take();
    bench.start();
    assert_eq!(bench.sent(), [(0x705, vec![0]), emcy(0x8120, 0x11)]);
}

#[test]
fn every_one_of_many_faults_is_reported() {
    let mut bench = Bench::booted();
    for _ in 0..20 {
        bench.raise(SENSOR_BREAK);
        bench.poll();
        bench.clear(SENSOR_BREAK);
        bench.poll();
        assert_eq!(bench.sent(), [emcy(0x5006, 1), emcy(0, 0)]);
    }
}

#[test]
fn enabling_1014h_reports_the_faults_of_syncs_and_of_multiplexed_pdos() {
    let mut bench = Bench::operational();
    bench.write(0x1600, 0, &[0xFF]).unwrap();
    bench.write32(0x1400, 1, 0x205).unwrap();
    bench.write32(0x1006, 0, 10_000).unwrap();
    bench.sync();
    bench.run(Duration::from_millis(20));
    bench.receive(Frame::new(0x080, &[1]).unwrap());
    bench.receive(Frame::new(0x205, &[0x85, 0x00, 0x70, 0, 1, 2, 3, 4]).unwrap());
    assert_eq!(codes(&mut bench), [0x8100, 0x8240, 0x8230]);
    bench.write32(0x1014, 0, 0x8000_0085).unwrap();
    bench.write32(0x1014, 0, 0x85).unwrap();
    bench.poll();
    assert_eq!(codes(&mut bench), [0x8100, 0x8240, 0x8230]);
}

#[test]
fn an_equal_value_of_1014h_reports_no_fault_again() {
    let mut bench = Bench::booted();
    bench.raise(SENSOR_BREAK);
    bench.poll();
    assert_eq!(codes(&mut bench), [0x5006]);
    bench.write32(0x1014, 0, 0x85).unwrap();
    bench.poll();
    assert_eq!((codes(&mut bench), bench.read(0x1003, 0)), (vec![], Ok(vec![1])));
}

const PLAIN_ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::identity(0, 1, 1),
    objects::error_behaviour(0),
);
static PLAIN_DICTIONARY: Dictionary = canopen::dictionary!(PLAIN_ROWS);

/// A device without EMCY, with a condition of each kind.
struct Plain;

impl Application for Plain {
    const CONDITIONS: &'static [Condition] = &[
        Condition { register: 0b0100, ..Condition::new(0x3110) },
        Condition { register: 0b1000, ..Condition::new(0x4210) },
        Condition::new(0x5003).of_class(ErrorClass::DEVICE),
    ];
}

fn plain() -> canopen::device!(Plain, PLAIN_ROWS) {
    let mut device = Device::new(&PLAIN_DICTIONARY, NodeId::new(ID), Plain);
    let _ = device.start(Instant(0), &mut Sent::default());
    let _ = device.nmt(Command::Start, Instant(0), &mut Sent::default());
    device
}

#[test]
fn each_condition_has_its_own_bits_of_the_error_register() {
    let mut device = plain();
    for (number, register) in [(1, 0b1001), (0, 0b1101)] {
        let _ = device.set_condition(number, true, Instant(1));
        assert_eq!(PLAIN_DICTIONARY.field(0x1001, 0).u8(device.image()), register);
    }
}

#[test]
fn without_emcy_a_fault_is_an_error_once_and_its_end_is_none() {
    let mut device = plain();
    let mut set = |number, active| {
        let _ = device.set_condition(number, active, Instant(1));
        let _ = device.poll(Instant(1), &mut Sent::default());
        let state = device.state();
        let _ = device.nmt(Command::Start, Instant(1), &mut Sent::default());
        state
    };
    assert_eq!(set(2, true), State::PreOperational);
    assert_eq!(set(2, true), State::Operational, "the same fault");
    assert_eq!(set(0, true), State::Operational, "a fault without a class");
    assert_eq!(set(2, false), State::Operational);
}
