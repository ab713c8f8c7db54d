//! The node in personality lift: its behaviour on the bus.

use std::collections::BTreeSet;

use canopen::Frame;
use canopen::pdo::{Address, Mpdo};
use canopen::sdo::Multiplexer;
use host_tests::bench::{Bench, ID, raw};
use host_tests::lift417::pdos;
use host_tests::tables::table;
use node::Personality;
use profiles::board::RawSample;
use profiles::lift::devices::Devices;
use profiles::lift::load::OVERLOAD;

const NO_OBJECT: u32 = 0x0602_0000;
const INVALID_VALUE: u32 = 0x0609_0030;

fn lift() -> Bench {
    Bench::booted_as(Personality::Lift)
}

/// An operational node as all virtual devices, after its first sample; the frames sent so far are dropped.
fn operational() -> Bench {
    let mut bench = lift();
    bench.write(0x2305, 0, &[Devices::ALL.0]).unwrap();
    bench.sample(&empty_car());
    bench.nmt(1);
    (0..200).for_each(|_| bench.sample(&empty_car()));
    bench.take();
    bench
}

/// The reading of 0 kg with the default calibration.
fn empty_car() -> RawSample {
    raw(0.0, 298.15)
}

fn number(bench: &mut Bench, index: u16, sub: u8) -> u32 {
    let bytes = bench.read(index, sub).unwrap();
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

fn position(bench: &mut Bench, counter: u16) -> Vec<(u16, Vec<u8>)> {
    bench.encoder.counter = counter;
    bench.sample(&empty_car());
    bench.take().into_iter().filter(|(id, _)| *id == 0x18C).collect()
}

/// All 290 rows. A PDO of the node is as in the table; a PDO that the node lacks does not exist under another number
/// either.
#[test]
fn every_pdo_of_the_table_is_in_the_node_or_is_not_there() {
    let mut bench = lift();
    let mut count = 0;
    for pdo in pdos() {
        let (communication, mapping) = (pdo.communication, pdo.mapping);
        if !pdo.is_of_the_node() {
            assert_eq!(bench.read(communication, 1), Err(NO_OBJECT), "{pdo:?}");
            assert_eq!(bench.read(mapping, 0), Err(NO_OBJECT), "{pdo:?}");
            continue;
        }
        assert_eq!(number(&mut bench, communication, 1), pdo.cob_id(ID) | pdo.flags(), "{pdo:?}");
        assert_eq!([2, 5].map(|sub| number(&mut bench, communication, sub)), [255, 0]);
        assert_eq!(bench.read(communication, 3).is_ok(), pdo.is_produced);
        assert_eq!(number(&mut bench, mapping, 0), u32::from(pdo.count()));
        for (sub, entry) in (1..).zip(pdo.entries()) {
            assert_eq!(number(&mut bench, mapping, sub), entry, "{pdo:?}");
        }
        count += 1;
    }
    assert_eq!(count, 7 + 8);
}

/// The profile's CAN-IDs lie within the pre-defined connection set of CiA 301, so the node has no PDO of that set.
#[test]
fn there_is_no_other_pdo() {
    let known: BTreeSet<u16> = pdos().flat_map(|pdo| [pdo.communication, pdo.mapping]).collect();
    let mut bench = lift();
    for index in (0x1400..=0x1BFF).filter(|index| !known.contains(index)) {
        assert_eq!(bench.read(index, 0), Err(NO_OBJECT), "{index:X}h");
    }
}

#[test]
fn can_ids_do_not_change_but_flags_do() {
    let mut bench = lift();
    for other in [0x4000_018D_u32, 0x4000_0180, 0x181 + u32::from(ID)] {
        assert_eq!(bench.write(0x1906, 1, &other.to_le_bytes()), Err(INVALID_VALUE), "{other:X}h");
    }
    for flags in [0xC000_0000, 0x8000_0000, 0, 0x4000_0000_u32] {
        assert_eq!(bench.write(0x1906, 1, &(flags | 0x18C).to_le_bytes()), Ok(()), "{flags:X}h");
    }
}

/// Each mapped object is sent in its TPDO, and an object without a TPDO in a multiplexed PDO. The objects of a disabled
/// TPDO are not sent, and neither are those of a unit that the node is not.
#[test]
fn every_object_that_can_be_mapped_is_sent_on_entering_operational() {
    let mut bench = lift();
    bench.write(0x2305, 0, &[Devices::ALL.0]).unwrap();
    bench.write(0x2320, 1, &[1; 6]).unwrap();
    bench.sample(&empty_car());
    bench.take();
    bench.nmt(1);
    let frames = bench.take();
    let mut sent: BTreeSet<(u16, u8)> = frames
        .iter()
        .filter(|(id, _)| *id == 0x500 + u16::from(ID))
        .map(|(_, data)| Mpdo::parse(data[..].try_into().unwrap()).unwrap().at)
        .map(|at| (at.index, at.sub))
        .collect();
    let on =
        pdos().filter(|pdo| pdo.is_produced && frames.iter().any(|(id, _)| u32::from(*id) == pdo.cob_id(ID)));
    sent.extend(on.flat_map(|pdo| pdo.objects).map(|(index, sub, _)| (index, sub)));
    let off: Vec<_> = [0x2303, 0x6383, 0x63C0, 0x63C5]
        .into_iter()
        .flat_map(|index| (2..=4).map(move |sub| (index, sub)))
        .chain((0x63B1..=0x63B3).map(|index| (index, 1)))
        // Each change of a speed would be a frame.
        .chain((1..=4).map(|sub| (0x6390, sub)))
        .collect();
    let rows = table(Personality::Lift).into_iter().filter(|row| row.mapping == "tpdo");
    let expected: BTreeSet<_> = rows.map(|row| (row.index, row.sub)).filter(|at| !off.contains(at)).collect();
    assert_eq!(sent, expected);
}

/// The rule of the profile for transmission type 255.
#[test]
fn a_change_is_sent_at_once_or_with_the_event_timer_only() {
    let mut bench = operational();
    assert_eq!(position(&mut bench, 2048), [(0x18C, vec![100, 0, 0, 0])]);
    assert_eq!(position(&mut bench, 2048), [], "no change");
    bench.write(0x1906, 5, &20_u16.to_le_bytes()).unwrap();
    bench.take();
    let frames: Vec<_> = (1..=100).flat_map(|step| position(&mut bench, 2048 + step * 41)).collect();
    assert_eq!(frames.len(), 5, "100 changes in 100 ms");
}

/// The node sends EMCY 5006h and the PDO, and stays Operational.
#[test]
fn a_broken_load_sensor_is_an_overload_that_is_sent() {
    let mut bench = operational();
    bench.write(0x6483, 4, &600_u16.to_le_bytes()).unwrap();
    bench.sample(&empty_car());
    bench.take();
    bench.sample(&RawSample { pressure: 0, ..empty_car() });
    let frames = bench.take();
    assert!(frames.contains(&(0x188, vec![OVERLOAD, 0xFF, 0xFF])), "{frames:X?}");
    let emergency = frames.iter().find(|(id, _)| *id == 0x80 + u16::from(ID)).unwrap();
    assert_eq!(emergency.1[..2], [0x06, 0x50]);
    assert_eq!(number(&mut bench, 0x2313, 2), 1);
}

#[test]
fn each_button_sends_its_words() {
    let mut bench = operational();
    for (sub, word) in (1..).zip([0x11_u8, 0x12, 0x21, 0x22]) {
        bench.write(0x2320, sub, &[word, 0, 0, 0, 0, 1]).unwrap();
    }
    bench.nmt(0x80);
    bench.nmt(1);
    let mut press = |buttons| {
        bench.buttons = buttons;
        (0..3).for_each(|_| bench.sample(&empty_car()));
        let frames = bench.take().into_iter().filter(|(id, _)| *id == 0x480 + u16::from(ID));
        frames.map(|(_, data)| (data.len(), data[0])).collect::<Vec<_>>()
    };
    assert_eq!(press([false, false]), [(6, 0x11), (6, 0x21)], "all of them at the start");
    assert_eq!(press([true, true]), [(6, 0x12), (6, 0x22)], "one after the other");
    assert_eq!(press([false, true]), [(6, 0x11)]);
    assert_eq!(press([false, false]), [(6, 0x21)]);
}

#[test]
fn lamps_follow_the_virtual_output_a_multiplexed_pdo_and_a_client() {
    let mut bench = operational();
    for (sub, word) in (1..).zip([0x10_u8, 0x11, 0x20, 0x21]) {
        bench.write(0x2321, sub, &[word, 0, 0, 0, 0, 1]).unwrap();
    }
    let output = |bench: &mut Bench, word| {
        bench.receive(&Frame::new(0x400, &[word, 0, 0, 0, 0, 1]).unwrap());
        bench.protocol.outputs().digital
    };
    assert_eq!(output(&mut bench, 0x11), [true, false]);
    assert_eq!(output(&mut bench, 0x21), [true, true]);
    assert_eq!(output(&mut bench, 0x77), [true, true], "another panel's");
    assert_eq!(output(&mut bench, 0x10), [false, true]);
    let at = Multiplexer { index: 0x2322, sub: 1 };
    let lamp = Mpdo { address: Address::Destination(None), at, data: [1, 0, 0, 0] };
    bench.receive(&Frame::new(0x503, &lamp.encode()).unwrap());
    assert_eq!(bench.protocol.outputs().digital, [true, true]);
    bench.write(0x6011, 0, &[0x20, 0, 0, 0, 0, 1]).unwrap();
    assert_eq!(bench.protocol.outputs().digital, [true, false]);
}

/// Two nodes as delivered may be on one bus: PDOs with a CAN-ID common to both are not sent, whatever the nodes
/// measure.
#[test]
fn a_node_as_delivered_sends_no_pdo() {
    let mut bench = lift();
    bench.sample(&empty_car());
    bench.take();
    bench.nmt(1);
    for step in 0..100 {
        bench.buttons = [step % 20 == 0, step % 30 == 0];
        bench.encoder.counter = step * 41;
        bench.sample(&raw(f64::from(step) * 1000.0, 298.15));
    }
    bench.sample(&RawSample { pressure: 0, ..empty_car() });
    let sent: BTreeSet<u16> = bench.take().into_iter().map(|(id, _)| id).collect();
    assert_eq!(sent, [].into(), "no fault either: there may be no sensor");
    assert_eq!(number(&mut bench, 0x1000, 0), 0x1A1);
}

/// Values saved with the choice are present after the next start; the choice is in force at once.
#[test]
fn the_choice_of_virtual_devices_is_stored() {
    let mut bench = lift();
    bench.sample(&empty_car());
    bench.nmt(1);
    bench.take();
    bench.write(0x2305, 0, &[Devices::POSITION.0]).unwrap();
    bench.sample(&empty_car());
    assert!(bench.take().iter().any(|(id, _)| *id == 0x18C), "valid now: the first is sent");
    bench.write(0x1010, 1, b"save").unwrap();
    let mut bench = bench.power_cycled();
    bench.sample(&empty_car());
    bench.nmt(1);
    let sent: BTreeSet<u16> = bench.take().into_iter().map(|(id, _)| id).collect();
    assert_eq!(sent, [0x18C, 0x500 + u16::from(ID)].into());
    assert_eq!(number(&mut bench, 0x1000, 0), 0x0600_01A1);
    assert_eq!([0, 1].map(|sub| number(&mut bench, 0x6000, sub)), [1, 0x0600]);
}

/// The TPDO of position 2, which does not exist, is enabled and disabled: no multiplexed PDO is sent for this.
#[test]
fn a_write_to_a_cob_id_sends_no_multiplexed_pdo() {
    let mut bench = operational();
    for cob_id in [0x4000_018D_u32, 0xC000_018D] {
        bench.write(0x1907, 1, &cob_id.to_le_bytes()).unwrap();
        bench.sample(&empty_car());
    }
    let multiplexed = bench.take().into_iter().filter(|(id, _)| *id == 0x500 + u16::from(ID));
    assert_eq!(multiplexed.count(), 0);
}

#[test]
fn a_lamp_follows_a_word_that_comes_again() {
    let mut bench = operational();
    bench.write(0x2321, 2, &[0x11, 0, 0, 0, 0, 1]).unwrap();
    let output = Frame::new(0x400, &[0x11, 0, 0, 0, 0, 1]).unwrap();
    for _ in 0..2 {
        bench.receive(&output);
        assert_eq!(bench.protocol.outputs().digital, [true, false]);
        bench.write(0x2322, 1, &[0]).unwrap();
        assert_eq!(bench.protocol.outputs().digital, [false, false]);
    }
}

/// The sequences in which calls were lost in the past, on a fast bus: buttons 1 and 2 with their words.
fn panel(inhibit: u16, event_timer: u16) -> Bench {
    let mut bench = lift();
    bench.write(0x2305, 0, &[Devices::INPUT_PANEL.0]).unwrap();
    bench.write(0x6100, 1, &[5, 4, 1, 0, 1, 0]).unwrap();
    bench.write(0x6100, 2, &[2, 1, 1, 4, 1, 0]).unwrap();
    bench.write(0x1881, 1, &(0xC000_0480 | u32::from(ID)).to_le_bytes()).unwrap();
    bench.write(0x1881, 3, &inhibit.to_le_bytes()).unwrap();
    bench.write(0x1881, 5, &event_timer.to_le_bytes()).unwrap();
    bench.write(0x1881, 1, &(0x4000_0480 | u32::from(ID)).to_le_bytes()).unwrap();
    bench.sample(&empty_car());
    bench.take();
    bench
}

/// Lets `millis` milliseconds pass with these buttons; returns the words that the panel sends: basic function and
/// state.
fn hold(bench: &mut Bench, buttons: [bool; 2], millis: u32) -> Vec<(u8, u8)> {
    bench.buttons = buttons;
    (0..millis).for_each(|_| bench.sample(&empty_car()));
    let frames = bench.take().into_iter().filter(|(id, _)| *id == 0x480 + u16::from(ID));
    frames.map(|(_, data)| (data[0], data[5])).collect()
}

#[test]
fn no_call_is_lost_within_the_inhibit_time() {
    let mut bench = panel(2000, 0);
    bench.nmt(1);
    assert_eq!(hold(&mut bench, [false, false], 1000), [(5, 0), (2, 0)], "all inputs at the start");
    let mut told = vec![];
    for buttons in [[true, false], [true, true], [false, true], [false, false]] {
        told.extend(hold(&mut bench, buttons, 30));
    }
    told.extend(hold(&mut bench, [false, false], 1000));
    assert_eq!(told, [(5, 1), (2, 1), (5, 0), (2, 0)]);
}

#[test]
fn a_press_between_two_events_of_the_timer_is_sent() {
    let mut bench = panel(0, 500);
    bench.nmt(1);
    hold(&mut bench, [false, false], 720);
    let mut told = hold(&mut bench, [true, false], 150);
    told.extend(hold(&mut bench, [false, false], 250));
    assert_eq!(told, [(5, 1), (5, 0)]);
}

#[test]
fn a_button_held_before_the_start_is_reported_at_the_start() {
    let mut bench = panel(0, 0);
    assert_eq!(hold(&mut bench, [true, true], 50), []);
    bench.nmt(1);
    assert_eq!(hold(&mut bench, [true, true], 50), [(5, 1), (2, 1)]);
}

#[test]
fn the_call_controller_asks_for_all_inputs() {
    let mut bench = panel(0, 0);
    bench.nmt(1);
    hold(&mut bench, [true, false], 50);
    bench.receive(&Frame::new(0x400, &[0, 0, 1, 0xFF, 0xFF, 1]).unwrap());
    assert_eq!(hold(&mut bench, [true, false], 5), [(5, 1), (2, 0)]);
}

/// The multiplexed PDO with which the node `producer` sets an object of other nodes.
fn set(bench: &mut Bench, producer: u16, (index, sub): (u16, u8), value: u32) {
    let at = Multiplexer { index, sub };
    let mpdo = Mpdo { address: Address::Destination(None), at, data: value.to_le_bytes() };
    bench.receive(&Frame::new(0x500 + producer, &mpdo.encode()).unwrap());
}

#[test]
fn multiplexed_pdos_of_all_nodes_are_taken() {
    let mut bench = operational();
    for producer in 1..=127 {
        set(&mut bench, producer, (0x2322, 1), producer.into());
        assert_eq!(number(&mut bench, 0x2322, 1), u32::from(producer));
    }
    bench.write(0x1401, 1, &0x8000_0501_u32.to_le_bytes()).unwrap();
    for (producer, lamp) in [(8, 127), (127, 127), (1, 127), (2, 2)] {
        set(&mut bench, producer, (0x2322, 1), producer.into());
        assert_eq!(number(&mut bench, 0x2322, 1), lamp, "node {producer}: 1401h is off, 1402h has its own");
    }
}

/// Limits of the load and a preset can be set without SDO.
#[test]
fn objects_of_the_profile_are_set_by_a_multiplexed_pdo() {
    let mut bench = operational();
    set(&mut bench, 20, (0x6483, 4), 650);
    assert_eq!(number(&mut bench, 0x6483, 4), 650);
    set(&mut bench, 20, (0x6382, 1), 5000);
    bench.poll();
    position(&mut bench, 0);
    assert_eq!(number(&mut bench, 0x6383, 1), 5000);
    set(&mut bench, 20, (0x6382, 2), 5000);
    assert_eq!(number(&mut bench, 0x6383, 2), 0, "there is no unit 2: left out");
}

#[test]
fn a_position_outlives_a_power_cut_in_which_the_car_has_not_moved() {
    let mut bench = operational();
    position(&mut bench, 40_000);
    let (position, bench) = (number(&mut bench, 0x6383, 1), bench);
    let mut bench = bench.power_cycled();
    // The counter of the board starts at 0.
    bench.encoder.counter = 0;
    bench.sample(&empty_car());
    assert_eq!(number(&mut bench, 0x6383, 1), position);
}

/// The lift shares the stored calibration of the input with the transmitter.
#[test]
fn the_calibration_is_that_of_the_transmitter() {
    let mut bench = lift();
    bench.write(0x2203, 0, b"cali").unwrap();
    bench.write(0x2200, 2, &4.0e6_f32.to_le_bytes()).unwrap();
    bench.write(0x2204, 0, b"save").unwrap();
    bench.write(0x2000, 0, &[Personality::Pressure.number()]).unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!(bench.read(0x2200, 2), Ok(4.0e6_f32.to_le_bytes().to_vec()));
    bench.write(0x2000, 0, &[Personality::Lift.number()]).unwrap();
    let mut bench = bench.power_cycled();
    (0..200).for_each(|_| bench.sample(&raw(1.0e5, 298.15)));
    assert_eq!(number(&mut bench, 0x6480, 1), 400, "10 % of 40 bar, and 100 kg a bar");
}
