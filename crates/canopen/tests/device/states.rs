//! The frames that the device sends as states, of which a queue may drop all but the newest.

use canopen::lss::Request;
use canopen::{Duration, Frame};

use crate::bench::{Bench, ID, SENSOR_BREAK};

const HEARTBEAT: u16 = 0x700 + ID as u16;
const TPDO: u16 = 0x180 + ID as u16;

#[test]
fn a_heartbeat_is_one_and_the_boot_up_is_none() {
    let mut bench = Bench::booted();
    assert_eq!(bench.out.states, []);
    bench.run(Duration::from_millis(2500));
    assert_eq!(bench.out.states, [HEARTBEAT; 2]);
}

#[test]
fn a_pdo_is_one_whatever_sends_it() {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, 0x8000_0000 | u32::from(TPDO)).unwrap();
    bench.write(0x1800, 2, &[255]).unwrap();
    bench.write(0x1800, 3, &[0, 0]).unwrap();
    bench.write(0x1800, 5, &[0, 0]).unwrap();
    bench.write32(0x1800, 1, TPDO.into()).unwrap();
    bench.nmt(1);
    assert_eq!(bench.out.states, [TPDO]);
    bench.set_value(1, &[1, 2, 3, 4]);
    bench.receive(Frame::remote(TPDO, 4).unwrap());
    assert_eq!(bench.out.states, [TPDO; 3]);
}

/// The messages of one identifier concern different objects.
#[test]
fn a_multiplexed_pdo_is_none() {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, 0x8000_0000 | u32::from(TPDO)).unwrap();
    bench.write(0x1800, 5, &[0, 0]).unwrap();
    bench.write(0x1A00, 0, &[0xFF]).unwrap();
    bench.write32(0x1800, 1, TPDO.into()).unwrap();
    bench.nmt(1);
    assert!(bench.sent().iter().filter(|(id, _)| *id == TPDO).count() > 1);
    assert_eq!(bench.out.states, []);
}

#[test]
fn responses_and_single_reports_are_no_states() {
    let mut bench = Bench::booted();
    bench.raise(SENSOR_BREAK);
    bench.read(0x1008, 0).unwrap();
    bench.receive(Frame::new(0x7E5, &Request::SwitchGlobal { configuration: true }.encode()).unwrap());
    bench.receive(Frame::new(0x7E5, &Request::InquireNodeId.encode()).unwrap());
    let mut ids: Vec<_> = bench.sent().into_iter().map(|(id, _)| id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!((ids, &bench.out.states[..]), (vec![0x085, 0x7E4], &[][..]));
}

/// The application declares the frames of the TPDO as events, so the queue gets every one of them.
#[test]
fn a_pdo_of_events_is_none() {
    let mut bench = Bench::booted();
    bench.device.application_mut().event_tpdo = 1;
    bench.write32(0x1800, 1, 0x8000_0000 | u32::from(TPDO)).unwrap();
    bench.write(0x1800, 2, &[255]).unwrap();
    bench.write(0x1800, 3, &[0, 0]).unwrap();
    bench.write(0x1800, 5, &[0, 0]).unwrap();
    bench.write32(0x1800, 1, TPDO.into()).unwrap();
    bench.nmt(1);
    for value in 1..=5 {
        bench.set_value(1, &[value; 4]);
    }
    let sent: Vec<_> =
        bench.sent().into_iter().filter(|(id, _)| *id == TPDO).map(|(_, data)| data[0]).collect();
    assert_eq!((sent, &bench.out.states[..]), (vec![0, 1, 2, 3, 4, 5], &[][..]));
}
