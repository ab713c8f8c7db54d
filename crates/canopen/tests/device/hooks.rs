//! Calls of the application by the device, and RPDOs whose objects have limits or rules.

use crate::bench::{Bench, Told};
use canopen::nmt::State;
use canopen::sdo::Multiplexer;
use canopen::{BusEvent, Duration, ErrorClass, Fault, Frame};

const START: u8 = 1;

/// An operational device whose RPDO 1 writes these mapped objects at once.
fn mapped(objects: &[u32]) -> Bench {
    let mut bench = Bench::operational();
    bench.write(0x1600, 0, &[0]).unwrap();
    for (sub, &object) in (1..).zip(objects) {
        bench.write32(0x1600, sub, object).unwrap();
    }
    bench.write(0x1600, 0, &[objects.len().try_into().unwrap()]).unwrap();
    bench.write32(0x1400, 1, 0x205).unwrap();
    bench.told();
    bench
}

fn value(bench: &Bench, index: u16) -> Vec<u8> {
    crate::bench::DICTIONARY.field(index, 0).get(bench.device.image()).to_vec()
}

fn receive(bench: &mut Bench, data: &[u8]) {
    bench.receive(Frame::new(0x205, data).unwrap());
}

#[test]
fn nmt_states_are_reported_once_each() {
    let mut bench = Bench::booted();
    assert_eq!(bench.told(), [Told::State(State::PreOperational)]);
    bench.nmt(START);
    bench.nmt(START);
    assert_eq!(bench.told(), [Told::State(State::Operational)]);
}

#[test]
fn an_sdo_write_is_reported_after_the_value_is_stored() {
    let mut bench = Bench::booted();
    bench.told();
    bench.write(0x6100, 0, &[3, 0]).unwrap();
    bench.write(0x6100, 0, &[9, 0]).unwrap_err();
    assert_eq!(bench.told(), [Told::Written(0x6100, 0)]);
}

#[test]
fn an_rpdo_is_reported_after_its_values_are_stored() {
    let mut bench = mapped(&[0x6200_0010]);
    receive(&mut bench, &[7, 0]);
    assert_eq!((bench.told(), value(&bench, 0x6200)), (vec![Told::Received(1)], vec![7, 0]));
    receive(&mut bench, &[8]);
    assert_eq!(bench.told(), [Told::Fault(Fault::RpdoTooShort(1), true)]);
    receive(&mut bench, &[8, 0]);
    assert_eq!(bench.told(), [Told::Received(1), Told::Fault(Fault::RpdoTooShort(1), false)]);
}

#[test]
fn a_synchronous_rpdo_is_reported_before_its_sync() {
    let mut bench = mapped(&[0x6200_0010]);
    bench.write32(0x1400, 1, 0x8000_0205).unwrap();
    bench.write(0x1400, 2, &[1]).unwrap();
    bench.write32(0x1400, 1, 0x205).unwrap();
    bench.told();
    receive(&mut bench, &[7, 0]);
    assert_eq!(bench.told(), []);
    bench.sync();
    assert_eq!(bench.told(), [Told::Received(1), Told::Sync(None)]);
}

#[test]
fn an_rpdo_skips_values_refused_by_limits_and_rules() {
    let mut bench = mapped(&[0x6201_0008, 0x6203_0010]);
    let values = |bench: &Bench| [0x6201, 0x6203].map(|index| value(bench, index));
    receive(&mut bench, &[12, 5, 0]);
    assert_eq!(values(&bench), [vec![12], vec![5, 0]]);
    assert!(bench.take_parameters(), "an object with a rule may be a parameter");
    receive(&mut bench, &[13, 4, 0]);
    assert_eq!(values(&bench), [vec![12], vec![4, 0]], "13 is refused by the application");
    receive(&mut bench, &[11, 6, 0]);
    assert_eq!(values(&bench), [vec![11], vec![4, 0]], "6 is beyond the limit");
}

#[test]
fn an_rpdo_brings_a_boolean_in_a_byte() {
    let mut bench = mapped(&[0x6202_0008]);
    for (sent, held) in [(1, 1), (2, 1), (0, 0)] {
        receive(&mut bench, &[sent]);
        assert_eq!(value(&bench, 0x6202), [held]);
    }
}

#[test]
fn an_object_can_be_in_pdos_of_both_directions() {
    let mut bench = mapped(&[0x6204_0040]);
    bench.write32(0x1800, 1, 0x8000_0185).unwrap();
    bench.write(0x1A00, 0, &[0]).unwrap();
    bench.write32(0x1A00, 1, 0x6204_0040).unwrap();
    bench.write(0x1A00, 0, &[1]).unwrap();
    bench.write(0x1800, 5, &[0, 0]).unwrap();
    bench.write32(0x1800, 1, 0x185).unwrap();
    bench.take();
    receive(&mut bench, &[1, 2, 3, 4, 5, 6, 7, 8]);
    let next = bench.device.publish(bench.now, &mut bench.out, |_, _| ());
    assert!(next.due() > bench.now);
    assert_eq!(bench.sent(), [(0x185, vec![1, 2, 3, 4, 5, 6, 7, 8])]);
}

#[test]
fn a_boolean_is_0_or_1() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write(0x6202, 0, &[1]), Ok(()));
    assert_eq!(bench.write(0x6202, 0, &[2]), Err(0x0609_0031));
    assert_eq!(bench.read(0x6202, 0), Ok(vec![1]));
}

#[test]
fn a_missing_heartbeat_and_bus_off_are_communication_errors() {
    let mut bench = Bench::operational();
    bench.write32(0x1016, 1, 0x0009_0064).unwrap();
    bench.receive(Frame::new(0x709, &[5]).unwrap());
    bench.told();
    bench.run(Duration::from_millis(200));
    bench.poll();
    let lost = [
        Told::Fault(Fault::Heartbeat(0), true),
        Told::Error(ErrorClass::COMMUNICATION),
        Told::State(State::PreOperational),
    ];
    assert_eq!(bench.told(), lost);
    bench.bus(BusEvent::BusOff);
    assert_eq!(bench.told(), [Told::Error(ErrorClass::COMMUNICATION)]);
    bench.bus(BusEvent::Recovered);
    assert_eq!(
        bench.told(),
        [Told::Fault(Fault::BusOffRecovered, true), Told::Fault(Fault::BusOffRecovered, false)]
    );
}

#[test]
fn the_process_half_leaves_waiting_frames_to_the_services() {
    let mut bench = Bench::operational();
    let reset = Frame::new(0, &[0x81, 0]).unwrap();
    let next = bench.device.on_process_frame(&reset, bench.now, &mut bench.out);
    assert_eq!((next.action, next.services <= bench.now), (None, true));
    let next = bench.device.poll_services(bench.now, &mut bench.out);
    assert_eq!(next.action, Some(canopen::Action::ResetNode));
    assert!(next.services > bench.now, "nothing else waits");
}

#[test]
fn the_application_writes_the_objects_of_pdos() {
    let mut bench = Bench::operational();
    let mut write = |index, sub, bytes: &[u8]| {
        let before = *bench.device.image();
        let is_written = bench.device.write_value(Multiplexer { index, sub }, bytes);
        assert!(is_written || *bench.device.image() == before, "{index:X}h:{sub}: refused without effect");
        is_written
    };
    assert!(write(0x6201, 0, &[12]));
    assert!(write(0x6203, 0, &[5, 0]));
    assert!(!write(0x6203, 0, &[6, 0]), "beyond its limits");
    assert!(!write(0x6201, 0, &[13]), "refused by the application");
    let served: [(u16, u8, &[u8]); 7] = [
        (0x1005, 0, &[0, 7, 0, 0]),
        (0x1016, 1, &[10, 0, 7, 0]),
        (0x1017, 0, &[50, 0]),
        (0x1400, 1, &[0x33, 3, 0, 0]),
        (0x1A00, 0, &[7]),
        (0x6105, 0, &[50, 0]),
        (0x5F00, 0, &[1]),
    ];
    for (index, sub, bytes) in served {
        assert!(!write(index, sub, bytes), "{index:X}h has a service");
    }
}
