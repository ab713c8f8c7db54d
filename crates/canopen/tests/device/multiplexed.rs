//! Multiplexed PDOs, in both directions and in both modes.

use crate::bench::{Bench, DICTIONARY, ID, Told};
use crate::exchange;
use crate::types::Sent;
use canopen::dictionary::{Access, Dictionary, Mapping, Object, Type};
use canopen::sdo::Multiplexer;
use canopen::{Device, Duration, Frame, Instant, NodeId, objects};

const TPDO: u16 = 0x500 + ID as u16;
const RPDO: u16 = 0x205;
const EMCY: u16 = 0x085;
const SOURCE: u8 = 0xFE;
const DESTINATION: u8 = 0xFF;

/// Makes TPDO 1 a multiplexed PDO.
fn sender(count: u8) -> Bench {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, 0x8000_0000 | u32::from(TPDO)).unwrap();
    bench.write(0x1800, 5, &[0, 0]).unwrap();
    bench.write(0x1A00, 0, &[count]).unwrap();
    bench.write32(0x1800, 1, TPDO.into()).unwrap();
    bench.take();
    bench
}

/// Makes RPDO 1 a multiplexed PDO, in Operational.
fn receiver(count: u8) -> Bench {
    let mut bench = Bench::operational();
    bench.write(0x1600, 0, &[count]).unwrap();
    bench.write32(0x1400, 1, RPDO.into()).unwrap();
    bench.take();
    bench
}

fn mpdos(bench: &mut Bench) -> Vec<Vec<u8>> {
    bench.sent().into_iter().filter(|(id, _)| *id == TPDO).map(|(_, data)| data).collect()
}

fn value(bench: &Bench) -> u16 {
    DICTIONARY.field(0x6200, 0).u16(bench.device.image())
}

fn errors(bench: &mut Bench) -> Vec<u16> {
    let emcys = bench.sent().into_iter().filter(|(id, _)| *id == EMCY);
    emcys.map(|(_, data)| u16::from_le_bytes([data[0], data[1]])).filter(|&code| code != 0).collect()
}

#[test]
fn in_destination_mode_objects_outside_tpdos_are_sent_to_all_nodes() {
    let mut bench = sender(DESTINATION);
    bench.nmt(1);
    let first = mpdos(&mut bench);
    assert_eq!(first, [1, 2, 3].map(|sub| vec![0x80, 0x00, 0x60, sub, 0, 0, 0, 0]));
    bench.set_value(2, &[0x34, 0x12]);
    assert_eq!(mpdos(&mut bench), [[0x80, 0x00, 0x60, 2, 0x34, 0x12, 0, 0]]);
    bench.set_value(2, &[0x34, 0x12]);
    assert_eq!(mpdos(&mut bench), [[0; 8]; 0], "only changes");
}

#[test]
fn in_source_mode_the_scanner_list_is_sent_under_the_own_node_id() {
    let mut bench = sender(SOURCE);
    bench.write32(0x1FA0, 1, 0x0260_0002).unwrap();
    bench.write(0x1FA0, 0, &[1]).unwrap();
    bench.nmt(1);
    assert_eq!(mpdos(&mut bench), [2, 3].map(|sub| vec![ID, 0x00, 0x60, sub, 0, 0, 0, 0]));
    bench.set_value(1, &[1, 0, 0, 0]);
    assert_eq!(mpdos(&mut bench), [[0; 8]; 0], "not in the list");
    bench.set_value(3, &[1, 2, 3, 4]);
    assert_eq!(mpdos(&mut bench), [[ID, 0x00, 0x60, 3, 1, 2, 3, 4]]);
}

#[test]
fn the_inhibit_time_separates_the_frames_and_nothing_is_lost() {
    let mut bench = sender(DESTINATION);
    bench.write32(0x1800, 1, 0x8000_0000 | u32::from(TPDO)).unwrap();
    bench.write(0x1800, 3, &[50, 0]).unwrap();
    bench.write32(0x1800, 1, TPDO.into()).unwrap();
    bench.nmt(1);
    let times = bench.times_of(TPDO, Duration::from_millis(30));
    assert_eq!(times, [0, 5_000, 10_000]);
}

#[test]
fn with_an_event_timer_the_timer_alone_sends() {
    let mut bench = sender(DESTINATION);
    bench.write(0x1800, 5, &[20, 0]).unwrap();
    bench.nmt(1);
    assert_eq!(mpdos(&mut bench).len(), 3, "entering Operational");
    bench.set_value(1, &[9, 9, 9, 9]);
    assert_eq!(mpdos(&mut bench).len(), 0);
    assert_eq!(
        bench.times_of(TPDO, Duration::from_millis(41)),
        [20_000, 20_000, 20_000, 40_000, 40_000, 40_000]
    );
}

#[test]
fn a_full_queue_delays_and_leaving_operational_drops() {
    let mut bench = sender(DESTINATION);
    bench.out.room = 13;
    bench.nmt(1);
    assert_eq!(mpdos(&mut bench).len(), 1);
    bench.out.room = 20;
    bench.run(Duration::from_millis(2));
    assert_eq!(mpdos(&mut bench).len(), 2);
    bench.nmt(0x80);
    bench.set_value(1, &[7, 0, 0, 0]);
    bench.run(Duration::from_millis(10));
    assert_eq!(mpdos(&mut bench).len(), 0);
}

#[test]
fn an_object_of_another_tpdo_is_not_sent_twice() {
    let mut bench = Bench::operational();
    // TPDO 1 carries 6000h:1. No second TPDO is multiplexed, so nothing is sent with this CAN-ID.
    bench.set_value(2, &[1, 0]);
    assert!(bench.sent().iter().all(|(id, _)| *id != TPDO));
}

#[test]
fn one_for_this_node_or_for_all_is_taken() {
    for address in [0x80 | ID, 0x80] {
        let mut bench = receiver(DESTINATION);
        bench.receive(Frame::new(RPDO, &[address, 0x00, 0x62, 0, 0x34, 0x12, 0, 0]).unwrap());
        assert_eq!(value(&bench), 0x1234);
        assert_eq!(errors(&mut bench), []);
    }
}

#[test]
fn one_for_another_node_or_by_source_is_not() {
    for address in [0x80 | (ID + 1), ID, 0x00, 0x7F] {
        let mut bench = receiver(DESTINATION);
        bench.receive(Frame::new(RPDO, &[address, 0x00, 0x62, 0, 0x34, 0x12, 0, 0]).unwrap());
        assert_eq!((value(&bench), errors(&mut bench)), (0, vec![]));
    }
}

/// Makes RPDO 1 a multiplexed PDO that takes the frames of all nodes.
fn receiver_of_all() -> Bench {
    let mut bench = Bench::operational();
    bench.device.application_mut().all_nodes_rpdo = 1;
    bench.write(0x1600, 0, &[DESTINATION]).unwrap();
    bench.write32(0x1400, 1, RPDO.into()).unwrap();
    bench.take();
    bench
}

#[test]
fn the_rpdo_for_all_nodes_takes_its_function_code_from_each_of_127_nodes() {
    let mut bench = receiver_of_all();
    for node in 1..=127 {
        bench.receive(Frame::new(0x200 + u16::from(node), &[0x80, 0x00, 0x62, 0, node, 0, 0, 0]).unwrap());
        assert_eq!(value(&bench), node.into());
    }
    let ids: Vec<u16> = bench.device.process_ids().map(canopen::CanId::get).collect();
    assert!((0x201..=0x27F).all(|id| ids.contains(&id)), "{ids:03X?}");
    assert!(!ids.contains(&0x280) && !ids.contains(&0x200), "{ids:03X?}");
    let filters = bench.device.process_filters().map(|(id, mask)| (id.get(), mask));
    assert_eq!(filters.filter(|&(_, mask)| mask != 0x7FF).collect::<Vec<_>>(), [(RPDO, 0x780)]);
}

/// Whatever bits the CAN-ID shares with the one of the RPDO. Node-ID 0 is no node.
#[test]
fn the_rpdo_for_all_nodes_takes_no_other_function_code_and_no_other_pdo() {
    for id in [0x085, 0x105, 0x185, 0x200, 0x285, 0x305, 0x385, 0x405, 0x505, 0x705] {
        let mut bench = receiver_of_all();
        bench.receive(Frame::new(id, &[0x80, 0x00, 0x62, 0, 0x34, 0x12, 0, 0]).unwrap());
        assert_eq!(value(&bench), 0, "{id:03X}h");
    }
    // RPDO 2 has this CAN-ID, and its mapping takes nothing from it.
    let mut bench = receiver_of_all();
    bench.write32(0x1401, 1, 0x210).unwrap();
    bench.receive(Frame::new(0x210, &[0x80, 0x00, 0x62, 0, 0x34, 0x12, 0, 0]).unwrap());
    assert_eq!(value(&bench), 0);
}

#[test]
fn a_missing_object_is_an_error_for_the_addressed_node_only() {
    for (address, expected) in [(0x80 | ID, vec![0x8230]), (0x80, vec![])] {
        for object in [[0x00, 0x70, 0], [0x00, 0x62, 1], [0x00, 0x60, 1], [0x17, 0x10, 0]] {
            let mut bench = receiver(DESTINATION);
            let [low, high, sub] = object;
            bench.receive(Frame::new(RPDO, &[address, low, high, sub, 1, 2, 3, 4]).unwrap());
            assert_eq!(errors(&mut bench), expected, "{object:x?}");
        }
    }
}

#[test]
fn rejected_multiplexed_pdos_are_one_fault_until_a_quiet_half_second() {
    let mut bench = receiver(DESTINATION);
    for _ in 0..100 {
        bench.receive(Frame::new(RPDO, &[0x80 | ID, 0x00, 0x70, 0, 1, 2, 3, 4]).unwrap());
        bench.run(Duration::from_millis(10));
    }
    let emcys = |bench: &mut Bench| bench.take().iter().filter(|frame| frame.id() == 0x085).count();
    assert_eq!(emcys(&mut bench), 1);
    bench.run(Duration::from_millis(490));
    assert_eq!(emcys(&mut bench), 1, "the end");
}

/// 6203h accepts -5 to 5, and the application rejects 13 at 6201h.
#[test]
fn a_rejected_value_is_an_error_for_the_addressed_node() {
    for (object, value) in [([0x03, 0x62, 0], 6), ([0x01, 0x62, 0], 13)] {
        for (address, expected) in [(0x80 | ID, vec![0x8230]), (0x80, vec![])] {
            let mut bench = receiver(DESTINATION);
            let [low, high, sub] = object;
            bench.receive(Frame::new(RPDO, &[address, low, high, sub, value, 0, 0, 0]).unwrap());
            assert_eq!(errors(&mut bench), expected, "{object:x?}");
        }
    }
}

#[test]
fn a_short_one_is_a_length_error() {
    let mut bench = receiver(DESTINATION);
    bench.receive(Frame::new(RPDO, &[0x80, 0x00, 0x62, 0, 1]).unwrap());
    assert_eq!((value(&bench), errors(&mut bench)), (0, vec![0x8210]));
}

#[test]
fn the_dispatching_list_says_where_the_objects_of_others_go() {
    let line = |size: u8, local_sub: u8, remote_sub: u8, node: u8| {
        [node, remote_sub, 0x34, 0x71, local_sub, 0x00, 0x62, size]
    };
    for (line, is_taken) in [
        (line(1, 0, 5, 9), true),
        (line(1, 0, 5, 8), false),
        (line(1, 0, 4, 9), false),
        (line(0, 0, 5, 9), false),
        (line(2, 1, 5, 9), false),
    ] {
        let mut bench = receiver(SOURCE);
        bench.device.show(|_, image| DICTIONARY.field(0x1FD0, 1).set(image, &line));
        bench.write(0x1FD0, 0, &[1]).unwrap();
        bench.receive(Frame::new(RPDO, &[9, 0x34, 0x71, 5, 0xCD, 0xAB, 0, 0]).unwrap());
        assert_eq!(value(&bench) == 0xABCD, is_taken, "{line:x?}");
        assert_eq!(errors(&mut bench), []);
    }
}

#[test]
fn a_multiplexed_pdo_is_one_of_events() {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, 0x8000_0505).unwrap();
    bench.write(0x1800, 2, &[1]).unwrap();
    bench.write(0x1A00, 0, &[DESTINATION]).unwrap();
    assert_eq!(bench.write32(0x1800, 1, 0x505), Err(0x0609_0030));
    bench.write(0x1800, 2, &[254]).unwrap();
    assert_eq!(bench.write32(0x1800, 1, 0x505), Ok(()));
    assert_eq!(bench.write(0x1800, 2, &[1]), Err(0x0609_0030));
    assert_eq!(bench.write(0x1800, 2, &[255]), Ok(()));
}

#[test]
fn a_count_between_the_slots_and_the_modes_is_too_high() {
    let mut bench = Bench::booted();
    bench.write32(0x1800, 1, 0x8000_0185).unwrap();
    for count in [5, 8, 64, 200, 253] {
        assert_eq!(bench.write(0x1A00, 0, &[count]), Err(0x0609_0031));
    }
}

/// Values that were sent are not sent again when another PDO is configured.
#[test]
fn a_write_to_another_pdo_sends_nothing() {
    let mut bench = sender(DESTINATION);
    bench.nmt(1);
    mpdos(&mut bench);
    bench.write32(0x1600, 1, 0x6200_0010).unwrap();
    bench.write(0x1600, 0, &[1]).unwrap();
    for cob_id in [u32::from(RPDO), 0x8000_0000 | u32::from(RPDO)] {
        bench.write32(0x1400, 1, cob_id).unwrap();
        bench.write(0x1400, 5, &[100, 0]).unwrap();
    }
    assert_eq!(mpdos(&mut bench), [[0; 8]; 0]);
    bench.set_value(3, &[1, 0, 0, 0]);
    assert_eq!(mpdos(&mut bench), [[0x80, 0x00, 0x60, 3, 1, 0, 0, 0]]);
}

/// The parts of a device may change: an object that is sent to all nodes again is sent once, whatever its value.
#[test]
fn the_application_leaves_out_missing_objects() {
    let mut bench = sender(DESTINATION);
    bench.device.application_mut().not_told = Some(Multiplexer { index: 0x6000, sub: 2 });
    bench.write(0x6201, 0, &[1]).unwrap();
    bench.nmt(1);
    assert_eq!(mpdos(&mut bench), [1, 3].map(|sub| vec![0x80, 0x00, 0x60, sub, 0, 0, 0, 0]));
    bench.set_value(2, &[1, 0]);
    assert_eq!(mpdos(&mut bench), [[0; 8]; 0]);
    bench.set_value(2, &[0, 0]);
    bench.device.application_mut().not_told = None;
    bench.write(0x6201, 0, &[1]).unwrap();
    bench.set_value(1, &[0; 4]);
    assert_eq!(mpdos(&mut bench), [[0x80, 0x00, 0x60, 2, 0, 0, 0, 0]]);
}

/// A receiver may have lost the value meanwhile.
#[test]
fn an_object_that_is_selected_again_is_sent_with_its_former_value() {
    let mut bench = sender(DESTINATION);
    bench.nmt(1);
    assert_eq!(mpdos(&mut bench).len(), 3, "entering Operational");
    let second = Multiplexer { index: 0x6000, sub: 2 };
    for (not_told, expected) in [(Some(second), vec![]), (None, vec![[0x80, 0x00, 0x60, 2, 0, 0, 0, 0]])] {
        bench.device.application_mut().not_told = not_told;
        bench.write(0x6201, 0, &[1]).unwrap();
        bench.run(Duration::from_millis(1));
        assert_eq!(mpdos(&mut bench), expected);
    }
}

#[test]
fn reconfiguration_does_not_shorten_the_inhibit_time() {
    let mut bench = sender(DESTINATION);
    bench.write32(0x1800, 1, 0x8000_0000 | u32::from(TPDO)).unwrap();
    bench.write(0x1800, 3, &5000_u16.to_le_bytes()).unwrap();
    bench.write32(0x1800, 1, TPDO.into()).unwrap();
    bench.nmt(1);
    assert_eq!(mpdos(&mut bench).len(), 1);
    bench.run(Duration::from_millis(100));
    bench.write(0x1800, 5, &[100, 0]).unwrap();
    bench.nmt(0x80);
    bench.nmt(1);
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(450)), [400_000]);
}

#[test]
fn the_application_learns_of_an_accepted_value() {
    let mut bench = receiver(DESTINATION);
    bench.told();
    for (object, is_taken) in [(0x6200_u16, true), (0x6000, false)] {
        let [low, high] = object.to_le_bytes();
        bench.receive(Frame::new(RPDO, &[0x80 | ID, low, high, 0, 1, 0, 0, 0]).unwrap());
        assert_eq!(bench.told().contains(&Told::Received(1)), is_taken, "{object:04X}h");
    }
}

/// An RPDO whose deadline runs is not touched by a new line of the scanner list.
#[test]
fn a_write_to_the_scanner_list_leaves_other_pdos_alone() {
    let mut bench = Bench::booted();
    bench.write32(0x1600, 1, 0x6200_0010).unwrap();
    bench.write(0x1600, 0, &[1]).unwrap();
    bench.write(0x1400, 5, &[100, 0]).unwrap();
    bench.write32(0x1400, 1, RPDO.into()).unwrap();
    bench.nmt(1);
    bench.receive(Frame::new(RPDO, &[1, 2]).unwrap());
    bench.write32(0x1FA0, 1, 0).unwrap();
    bench.take();
    bench.run(Duration::from_millis(150));
    assert_eq!(errors(&mut bench), [0x8250]);
}

#[test]
fn a_new_number_of_the_scanner_list_applies_at_once() {
    let mut bench = sender(SOURCE);
    bench.nmt(1);
    bench.write32(0x1FA0, 1, 0x0260_0002).unwrap();
    bench.take();
    bench.write(0x1FA0, 0, &[1]).unwrap();
    assert_eq!(mpdos(&mut bench), [2, 3].map(|sub| vec![ID, 0x00, 0x60, sub, 0, 0, 0, 0]));
    bench.set_value(2, &[7, 0]);
    assert_eq!(mpdos(&mut bench), [[ID, 0x00, 0x60, 2, 7, 0, 0, 0]]);
    bench.write(0x1FA0, 0, &[0]).unwrap();
    bench.set_value(2, &[8, 0]);
    assert_eq!(mpdos(&mut bench), [[0; 8]; 0], "no line is left");
}

/// Another use of the same function code: shorter frames, and frames that name no object of this device.
#[test]
fn a_frame_that_is_no_multiplexed_pdo_is_no_error_of_the_rpdo_for_all_nodes() {
    for data in [&[1, 2][..], &[], &[0x80 | ID, 0x00, 0x70, 0, 1, 2, 3, 4]] {
        let mut bench = receiver_of_all();
        bench.receive(Frame::new(0x210, data).unwrap());
        assert_eq!((value(&bench), errors(&mut bench)), (0, vec![]), "{data:x?}");
    }
}

#[test]
fn leaving_operational_ends_the_event_timer() {
    let mut bench = sender(DESTINATION);
    bench.write(0x1800, 5, &[20, 0]).unwrap();
    bench.nmt(1);
    assert_eq!(mpdos(&mut bench).len(), 3);
    for command in [0x80, 2] {
        bench.nmt(command);
        assert_eq!(bench.times_of(TPDO, Duration::from_millis(100)), [], "{command:X}h");
    }
    bench.nmt(1);
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(30)), [0, 0, 0, 20_000, 20_000, 20_000]);
}

#[test]
fn leaving_operational_discards_what_waits_for_the_inhibit_time() {
    let mut bench = sender(DESTINATION);
    bench.write32(0x1800, 1, 0x8000_0000 | u32::from(TPDO)).unwrap();
    bench.write(0x1800, 3, &[50, 0]).unwrap();
    bench.write32(0x1800, 1, TPDO.into()).unwrap();
    bench.nmt(1);
    assert_eq!(mpdos(&mut bench).len(), 1, "two wait");
    bench.nmt(0x80);
    assert_eq!(bench.times_of(TPDO, Duration::from_millis(100)), []);
}

#[test]
fn a_reset_ends_the_inhibit_time() {
    let mut bench = Bench::booted();
    for command in [0x81, 0x82] {
        bench.write32(0x1800, 1, 0x8000_0000 | u32::from(TPDO)).unwrap();
        bench.write(0x1800, 3, &50_000_u16.to_le_bytes()).unwrap();
        bench.write(0x1800, 5, &[0, 0]).unwrap();
        bench.write(0x1A00, 0, &[DESTINATION]).unwrap();
        bench.write32(0x1800, 1, TPDO.into()).unwrap();
        bench.nmt(1);
        assert_eq!(mpdos(&mut bench).len(), 1, "before {command:X}h");
        bench.nmt(command);
        bench.start();
        bench.run(Duration::from_millis(1));
    }
}

#[test]
fn an_rpdo_takes_the_frames_of_all_nodes_only_if_it_is_multiplexed_and_the_application_says_so() {
    for (all_nodes_rpdo, count) in [(0, DESTINATION), (1, 1)] {
        let mut bench = Bench::operational();
        bench.device.application_mut().all_nodes_rpdo = all_nodes_rpdo;
        bench.write32(0x1600, 1, 0x6200_0010).unwrap();
        bench.write(0x1600, 0, &[count]).unwrap();
        bench.write32(0x1400, 1, RPDO.into()).unwrap();
        bench.take();
        bench.receive(Frame::new(RPDO + 1, &[0x80, 0x00, 0x62, 0, 0x34, 0x12, 0, 0]).unwrap());
        assert_eq!((value(&bench), errors(&mut bench)), (0, vec![]), "{count}");
        assert!(bench.device.process_ids().all(|id| id.get() != RPDO + 1), "{count}");
        assert!(bench.device.process_filters().all(|(_, mask)| mask == 0x7FF), "{count}");
    }
}

#[test]
fn the_identifiers_are_those_of_the_own_frames_and_then_of_each_of_127_nodes() {
    let bench = receiver_of_all();
    let ids = bench.device.process_ids().map(canopen::CanId::get);
    let expected = [0x000, 0x080, RPDO, 0x185].into_iter().chain(0x201..=0x27F);
    assert!(ids.eq(expected), "{:03X?}", bench.device.process_ids().collect::<Vec<_>>());
}

#[test]
fn the_event_timer_and_the_inhibit_time_keep_their_length_for_minutes() {
    let mut bench = sender(DESTINATION);
    bench.write32(0x1800, 1, 0x8000_0000 | u32::from(TPDO)).unwrap();
    bench.write(0x1800, 3, &30_000_u16.to_le_bytes()).unwrap();
    bench.write(0x1800, 5, &20_000_u16.to_le_bytes()).unwrap();
    bench.write32(0x1800, 1, TPDO.into()).unwrap();
    bench.nmt(1);
    let times = bench.times_of(TPDO, Duration::from_millis(130_000));
    let expected = (0..=6).flat_map(|round| [0, 3, 6].map(|after| (round * 20 + after) * 1_000_000));
    assert_eq!(times, expected.collect::<Vec<u64>>());
}

#[test]
fn an_rpdo_of_mapped_objects_takes_no_frames_of_other_nodes() {
    let mut bench = Bench::operational();
    bench.device.application_mut().all_nodes_rpdo = 1;
    bench.write32(0x1600, 1, 0x6200_0010).unwrap();
    bench.write(0x1600, 0, &[1]).unwrap();
    bench.write32(0x1400, 1, RPDO.into()).unwrap();
    bench.receive(Frame::new(0x210, &[0x80, 0x00, 0x62, 0, 0x34, 0x12, 0, 0]).unwrap());
    assert_eq!(value(&bench), 0);
    let ids: Vec<u16> = bench.device.process_ids().map(canopen::CanId::get).collect();
    assert!(ids.contains(&RPDO) && !ids.contains(&0x210), "{ids:03X?}");
    assert!(bench.device.process_filters().all(|(_, mask)| mask == 0x7FF));
}

/// A multiplexed TPDO is valid, but none of those that send values.
#[test]
fn a_write_that_may_switch_pdos_leaves_the_identifiers_of_a_multiplexed_tpdo() {
    let mut bench = sender(DESTINATION);
    while bench.take_action().is_some() {}
    bench.write(0x6201, 0, &[12]).unwrap();
    assert_eq!(bench.take_action(), None);
}

const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0)],
    objects::identity(0, 1, 1),
    objects::multiplexed(objects::rpdo(1, &[])),
    [Object::new(0x6200, 0, "", Type::Unsigned16, Access::ReadWrite).mappable(Mapping::Rpdo)],
);
static RPDO_DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

#[test]
fn a_multiplexed_rpdo_takes_the_frames_of_one_can_id_by_default() {
    let mut device: canopen::device!((), ROWS) = Device::new(&RPDO_DICTIONARY, NodeId::new(ID), ());
    let mut sent = Sent::default();
    let _ = device.start(Instant(0), &mut sent);
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(0), &mut sent);
    for (index, sub, bytes) in [(0x1600, 0, &[DESTINATION][..]), (0x1400, 1, &[0x05, 0x02, 0, 0])] {
        let written = exchange::write(ID, Multiplexer { index, sub }, bytes, |request| {
            let mut sent = Sent::default();
            let _ = device.on_service_frame(&request, Instant(0), &mut sent);
            sent.0
        });
        assert_eq!(written, Ok(()), "{index:04X}h:{sub}");
    }
    for (id, expected) in [(RPDO + 1, 0), (RPDO, 0x1234)] {
        let frame = Frame::new(id, &[0x80, 0x00, 0x62, 0, 0x34, 0x12, 0, 0]).unwrap();
        let _ = device.on_frame(&frame, Instant(1), &mut sent);
        assert_eq!(RPDO_DICTIONARY.field(0x6200, 0).u16(device.image()), expected, "{id:03X}h");
    }
}
