//! RPDOs: time of acceptance, deadlines, lengths, dummy mapping.

use crate::bench::Bench;
use canopen::{Duration, Frame};

const RPDO1: u16 = 0x205;
const RPDO2: u16 = 0x305;
const VALUE: (u16, u8) = (0x6200, 0);
const TPDO1_OFF: u32 = 0x8000_0185;

/// An operational device with RPDO 1 of type 255 and RPDO 2 of type 1, both mapped to the value, and no TPDO.
fn bench() -> Bench {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, TPDO1_OFF).unwrap();
    bench.write32(0x1600, 1, 0x6200_0010).unwrap();
    bench.write(0x1600, 0, &[1]).unwrap();
    bench.write32(0x1400, 1, RPDO1.into()).unwrap();
    bench.write32(0x1401, 1, RPDO2.into()).unwrap();
    bench.nmt(1);
    bench.take();
    bench
}

fn send(bench: &mut Bench, id: u16, data: &[u8]) {
    bench.receive(Frame::new(id, data).unwrap());
}

fn value(bench: &mut Bench) -> Vec<u8> {
    bench.read(VALUE.0, VALUE.1).unwrap()
}

/// EMCY code and number of the PDO.
fn emergencies(bench: &mut Bench) -> Vec<(u16, u8)> {
    let messages = bench.sent().into_iter().filter(|(id, _)| *id == 0x085);
    messages.map(|(_, data)| (u16::from_le_bytes([data[0], data[1]]), data[3])).collect()
}

#[test]
fn type_255_takes_data_at_once() {
    let mut bench = bench();
    send(&mut bench, RPDO1, &[1, 2]);
    assert_eq!(value(&mut bench), [1, 2]);
    assert_eq!(bench.take(), []);
}

#[test]
fn a_synchronous_type_takes_the_newest_data_with_the_sync() {
    let mut bench = bench();
    send(&mut bench, RPDO2, &[1, 2]);
    send(&mut bench, RPDO2, &[3, 4]);
    assert_eq!(value(&mut bench), [0, 0]);
    bench.sync();
    assert_eq!(value(&mut bench), [3, 4]);
    bench.write(VALUE.0, VALUE.1, &[0, 0]).unwrap();
    bench.sync();
    assert_eq!(value(&mut bench), [0, 0]);
}

#[test]
fn outside_operational_data_is_ignored_and_waiting_data_is_dropped() {
    let mut bench = bench();
    send(&mut bench, RPDO2, &[3, 4]);
    bench.nmt(0x80);
    send(&mut bench, RPDO1, &[1, 2]);
    bench.nmt(1);
    bench.sync();
    assert_eq!(value(&mut bench), [0, 0]);
}

#[test]
fn data_after_the_synchronous_window_is_ignored() {
    let mut bench = bench();
    bench.write32(0x1007, 0, 1000).unwrap();
    bench.sync();
    bench.run(Duration(1001));
    send(&mut bench, RPDO2, &[3, 4]);
    send(&mut bench, RPDO1, &[1, 2]);
    bench.sync();
    assert_eq!(value(&mut bench), [1, 2]);
}

#[test]
fn a_short_pdo_is_not_processed_and_a_long_one_is_cut() {
    let mut bench = bench();
    send(&mut bench, RPDO1, &[1]);
    send(&mut bench, RPDO1, &[1]);
    assert_eq!((value(&mut bench), emergencies(&mut bench)), (vec![0, 0], vec![(0x8210, 1)]));
    send(&mut bench, RPDO1, &[1, 2, 3]);
    assert_eq!((value(&mut bench), emergencies(&mut bench)), (vec![1, 2], vec![(0, 0), (0x8220, 1)]));
    send(&mut bench, RPDO1, &[5, 6]);
    assert_eq!((value(&mut bench), emergencies(&mut bench)), (vec![5, 6], vec![(0, 0)]));
}

#[test]
fn each_deadline_is_signalled_and_cleared_on_its_own() {
    let mut bench = bench();
    bench.write(0x1400, 5, &[10, 0]).unwrap();
    bench.write(0x1401, 5, &[20, 0]).unwrap();
    bench.run(Duration::from_millis(100));
    assert_eq!(emergencies(&mut bench), []);
    send(&mut bench, RPDO1, &[1, 2]);
    send(&mut bench, RPDO2, &[1, 2]);
    bench.run(Duration::from_millis(19));
    assert_eq!(emergencies(&mut bench), [(0x8250, 1)]);
    bench.run(Duration::from_millis(1));
    assert_eq!(emergencies(&mut bench), [(0x8250, 2)]);
    send(&mut bench, RPDO2, &[1, 2]);
    assert_eq!(emergencies(&mut bench), []);
    send(&mut bench, RPDO1, &[1, 2]);
    assert_eq!(emergencies(&mut bench), [(0, 0)]);
}

#[test]
fn a_deadline_ends_with_the_pdo() {
    let mut bench = bench();
    bench.write(0x1400, 5, &[10, 0]).unwrap();
    send(&mut bench, RPDO1, &[1, 2]);
    bench.run(Duration::from_millis(10));
    assert_eq!(emergencies(&mut bench), [(0x8250, 1)]);
    bench.write32(0x1400, 1, 0x8000_0205).unwrap();
    assert_eq!(emergencies(&mut bench), [(0, 0)]);
    assert!(!bench.device.process_ids().any(|id| id.get() == RPDO1));
}

/// CiA 301, table 71: the indices of the data types, with their lengths.
#[test]
fn every_dummy_entry_has_the_length_of_its_type() {
    for (index, bits) in [(2_u32, 8_u32), (3, 16), (4, 32), (5, 8), (6, 16), (7, 32)] {
        let mut bench = Bench::operational();
        bench.write(0x1600, 0, &[0]).unwrap();
        bench.write32(0x1600, 2, 0x6200_0010).unwrap();
        for wrong in [8, 16, 32].into_iter().filter(|wrong| *wrong != bits) {
            assert!(bench.write32(0x1600, 1, index << 16 | wrong).is_err(), "{index:04X}h with {wrong} bits");
        }
        bench.write32(0x1600, 1, index << 16 | bits).unwrap();
        bench.write(0x1600, 0, &[2]).unwrap();
        bench.write32(0x1400, 1, RPDO1.into()).unwrap();
        let data = [vec![0xFF; bits as usize / 8], vec![9, 0]].concat();
        send(&mut bench, RPDO1, &data);
        assert_eq!(value(&mut bench), [9, 0], "{index:04X}h");
    }
}

#[test]
fn dummy_entries_skip_bytes() {
    let mut bench = bench();
    bench.write32(0x1400, 1, 0x8000_0205).unwrap();
    bench.write(0x1600, 0, &[0]).unwrap();
    assert_eq!(bench.write32(0x1600, 1, 0x0005_0010), Err(0x0604_0041));
    assert_eq!(bench.write32(0x1600, 1, 0x0001_0001), Err(0x0602_0000));
    bench.write32(0x1600, 1, 0x0007_0020).unwrap();
    bench.write32(0x1600, 2, 0x6200_0010).unwrap();
    bench.write(0x1600, 0, &[2]).unwrap();
    bench.write32(0x1400, 1, RPDO1.into()).unwrap();
    let before = bench.device.image().to_vec();
    send(&mut bench, RPDO1, &[9, 9, 9, 9, 7, 8]);
    assert_eq!(value(&mut bench), [7, 8]);
    let changed = bench.device.image().iter().zip(&before).filter(|(a, b)| a != b).count();
    assert_eq!(changed, 2);
}

#[test]
fn objects_without_rpdo_mapping_cannot_be_mapped() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write32(0x1600, 1, 0x6000_0120), Err(0x0604_0041));
    assert_eq!(bench.write32(0x1600, 1, 0x6100_0010), Err(0x0604_0041));
    for refused in [241, 251, 252, 253] {
        assert_eq!(bench.write(0x1400, 2, &[refused]), Err(0x0609_0030));
    }
    assert_eq!(bench.write32(0x1400, 1, RPDO1.into()), Err(0x0609_0030));
}

#[test]
fn a_remote_frame_is_no_data() {
    let mut bench = bench();
    bench.receive(Frame::remote(RPDO1, 2).unwrap());
    assert_eq!((value(&mut bench), bench.take()), (vec![0, 0], vec![]));
}

#[test]
fn the_identifiers_are_those_of_nmt_sync_rpdos_and_requests_for_tpdos() {
    let mut bench = bench();
    let ids = |bench: &Bench| bench.device.process_ids().map(canopen::CanId::get).collect::<Vec<_>>();
    assert_eq!(ids(&bench), [0x000, 0x080, RPDO1, RPDO2]);
    bench.write32(0x1800, 1, 0x185).unwrap();
    assert_eq!(ids(&bench), [0x000, 0x080, RPDO1, RPDO2, 0x185]);
    let filters = bench.device.process_filters().map(|(id, mask)| (id.get(), mask));
    assert!(filters.eq(ids(&bench).into_iter().map(|id| (id, 0x7FF))));
}

/// 6201h is handled by the application, which may change its parameters; 6200h and 6203h are plain values, and 6203h has
/// limits.
#[test]
fn a_value_for_the_application_may_change_parameters_and_another_one_does_not() {
    for (mapped, is_reported) in [(0x6200_0010, false), (0x6201_0008, true), (0x6203_0010, false)] {
        let mut bench = bench();
        bench.write32(0x1400, 1, 0x8000_0205).unwrap();
        bench.write(0x1600, 0, &[0]).unwrap();
        bench.write32(0x1600, 1, mapped).unwrap();
        bench.write(0x1600, 0, &[1]).unwrap();
        bench.write32(0x1400, 1, RPDO1.into()).unwrap();
        bench.take_parameters();
        send(&mut bench, RPDO1, &[1, 0][..usize::from(mapped.to_le_bytes()[0] / 8)]);
        assert_eq!(bench.take_parameters(), is_reported, "{mapped:X}h");
    }
}

#[test]
fn a_deadline_keeps_its_length_for_minutes() {
    let mut bench = bench();
    bench.write(0x1400, 5, &20_000_u16.to_le_bytes()).unwrap();
    for _ in 0..8 {
        send(&mut bench, RPDO1, &[1, 2]);
        bench.take();
        assert_eq!(bench.times_of(0x085, Duration::from_millis(21_000)), [20_000_000]);
    }
}
