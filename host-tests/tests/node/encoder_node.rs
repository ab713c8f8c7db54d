//! The complete encoder node: from the count of the timer to frames, the effect of commands and parameters, faults, and
//! the state after a loss of power.

use canopen::Frame;
use host_tests::bench::{Bench, ID, raw};
use node::{Personality, State};
use profiles::board::Board;

const TPDO1: u16 = 0x180 + ID as u16;
const TPDO2: u16 = 0x280 + ID as u16;
const EMCY: u16 = 0x080 + ID as u16;

/// A node that allows jumps of the shaft, by 2104h.
fn booted() -> Bench {
    let mut bench = Bench::booted_as(Personality::Encoder);
    bench.write(0x2104, 1, &[0; 4]).unwrap();
    bench
}

fn operational() -> Bench {
    let mut bench = booted();
    turn_to(&mut bench, 0);
    bench.nmt(1);
    bench.take();
    bench
}

/// Passes a millisecond, with the timer at `counter`.
fn turn_to(bench: &mut Bench, counter: u16) {
    bench.encoder.counter = counter;
    bench.sample(&raw(0.0, 298.15));
}

fn wait(bench: &mut Bench, milliseconds: usize) {
    let counter = bench.encoder.counter;
    (0..milliseconds).for_each(|_| turn_to(bench, counter));
}

fn number(bench: &mut Bench, index: u16, sub: u8) -> u32 {
    let mut bytes = bench.read(index, sub).unwrap();
    bytes.resize(4, 0);
    u32::from_le_bytes(bytes.try_into().unwrap())
}

/// The positions in this TPDO since the last call.
fn positions(bench: &mut Bench, id: u16) -> Vec<u32> {
    let frames = bench.take().into_iter().filter(|(sent, _)| *sent == id);
    frames.map(|(_, data)| u32::from_le_bytes(data.try_into().unwrap())).collect()
}

/// EMCY messages sent since the last call, as code, error register and the first byte of the detail.
fn emergencies(bench: &mut Bench) -> Vec<(u16, u8, u8)> {
    let messages = bench.take().into_iter().filter(|(id, _)| *id == EMCY);
    messages.map(|(_, data)| (u16::from_le_bytes([data[0], data[1]]), data[2], data[3])).collect()
}

#[test]
fn tpdo1_carries_the_position_on_entering_operational_and_then_by_its_timer_alone() {
    let mut bench = booted();
    turn_to(&mut bench, 0);
    turn_to(&mut bench, 1234);
    bench.take();
    bench.nmt(1);
    assert_eq!(positions(&mut bench, TPDO1), [1234]);
    turn_to(&mut bench, 1300);
    wait(&mut bench, 10);
    assert_eq!(positions(&mut bench, TPDO1), [0; 0], "the cyclic timer is 0");
    bench.nmt(0x80);
    bench.nmt(1);
    assert_eq!(positions(&mut bench, TPDO1), [1300]);
    bench.write(0x6200, 0, &10_u16.to_le_bytes()).unwrap();
    bench.take();
    wait(&mut bench, 20);
    assert_eq!(positions(&mut bench, TPDO1), [1300, 1300], "whether it changes or not");
}

#[test]
fn a_self_starting_node_sends_only_measured_positions() {
    let mut bench = operational();
    // A shaft that turns at a reset has lost its turns.
    (0..=100).for_each(|_| turn_to(&mut bench, 1234));
    bench.write(0x1F80, 0, &8_u32.to_le_bytes()).unwrap();
    bench.write(0x1010, 1, b"save").unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!((bench.protocol.state(), positions(&mut bench, TPDO1)), (State::PreOperational, vec![]));
    turn_to(&mut bench, 0);
    assert_eq!((bench.protocol.state(), positions(&mut bench, TPDO1)), (State::Operational, vec![1234]));
}

#[test]
fn a_shaft_that_turns_is_seen_in_the_same_millisecond_in_both_directions() {
    let mut bench = operational();
    // The TPDO is sent with every change.
    bench.write(0x1800, 2, &[255]).unwrap();
    bench.take();
    let revolution = 4096 * 4096;
    for (counter, position) in [(100, 100), (250, 250), (100, 100), (65_500, revolution - 36)] {
        turn_to(&mut bench, counter);
        assert_eq!(positions(&mut bench, TPDO1), [position]);
    }
    assert_eq!(number(&mut bench, 0x6020, 1), revolution - 36);
}

#[test]
fn tpdo2_answers_every_sync() {
    let mut bench = operational();
    for counter in [7, 8, 8] {
        turn_to(&mut bench, counter);
        bench.take();
        bench.receive(&Frame::new(0x80, &[]).unwrap());
        assert_eq!(positions(&mut bench, TPDO2), [u32::from(counter)]);
    }
}

#[test]
fn the_cyclic_timer_is_the_event_timer_in_both_directions() {
    let mut bench = booted();
    bench.write(0x6200, 0, &10_u16.to_le_bytes()).unwrap();
    assert_eq!(bench.read(0x1800, 5), Ok(vec![10, 0]));
    turn_to(&mut bench, 0);
    bench.nmt(1);
    bench.take();
    // Only the timer sends: 1 of 10 changes.
    (1..=30).for_each(|counter| turn_to(&mut bench, counter));
    assert_eq!(positions(&mut bench, TPDO1), [10, 20, 30]);
    bench.write(0x1800, 5, &5_u16.to_le_bytes()).unwrap();
    assert_eq!(bench.read(0x6200, 0), Ok(vec![5, 0]));
    bench.take();
    (31..=40).for_each(|counter| turn_to(&mut bench, counter));
    assert_eq!(positions(&mut bench, TPDO1).len(), 2);
}

#[test]
fn the_cyclic_timer_is_saved_with_the_communication_parameters() {
    let mut bench = booted();
    bench.write(0x6200, 0, &10_u16.to_le_bytes()).unwrap();
    bench.write(0x1010, 3, b"save").unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!(number(&mut bench, 0x6200, 0), 0);
    bench.write(0x6200, 0, &10_u16.to_le_bytes()).unwrap();
    bench.write(0x1010, 2, b"save").unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!([number(&mut bench, 0x6200, 0), number(&mut bench, 0x1800, 5)], [10, 10]);
}

#[test]
fn a_preset_is_the_next_position_and_outlives_a_loss_of_power() {
    let mut bench = operational();
    bench.write(0x1800, 2, &[255]).unwrap();
    turn_to(&mut bench, 1000);
    bench.take();
    bench.write(0x6003, 0, &77_u32.to_le_bytes()).unwrap();
    wait(&mut bench, 1);
    assert_eq!(positions(&mut bench, TPDO1), [77]);
    assert_eq!(number(&mut bench, 0x6509, 0).cast_signed(), 77 - 1000);
    // The bench stores a preset before the sample that computes its offset; on the board the order is that of the
    // firmware.
    bench.write(0x1010, 3, b"save").unwrap();
    turn_to(&mut bench, 1001);
    // The shaft is at rest while the power is off, and the timer starts at 0 again.
    let mut bench = bench.power_cycled();
    turn_to(&mut bench, 0);
    turn_to(&mut bench, 2);
    assert_eq!(number(&mut bench, 0x6004, 0), 80);
}

#[test]
fn scaling_is_saved_and_acts_after_a_loss_of_power() {
    let mut bench = booted();
    bench.write(0x6001, 0, &360_u32.to_le_bytes()).unwrap();
    bench.write(0x6002, 0, &3600_u32.to_le_bytes()).unwrap();
    bench.write(0x6000, 0, &4_u16.to_le_bytes()).unwrap();
    bench.write(0x1010, 1, b"save").unwrap();
    let mut bench = bench.power_cycled();
    turn_to(&mut bench, 0);
    turn_to(&mut bench, 2048);
    assert_eq!(number(&mut bench, 0x6004, 0), 180);
    assert_eq!(number(&mut bench, 0x6500, 0), 6);
}

/// The default is one incremental encoder.
#[test]
fn the_device_type_and_the_mapping_follow_the_sensors_at_the_next_reset() {
    let mut bench = booted();
    assert_eq!(number(&mut bench, 0x1000, 0), 0x0005_0196);
    bench.write(0x2100, 2, &[7]).unwrap();
    bench.write(0x1010, 3, b"save").unwrap();
    assert_eq!(number(&mut bench, 0x1000, 0), 0x0005_0196, "a device does not change while it runs");
    let mut bench = bench.power_cycled();
    assert_eq!(number(&mut bench, 0x1000, 0), 0x000A_0196);
    assert_eq!([number(&mut bench, 0x1A00, 1), number(&mut bench, 0x1A01, 1)], [0x6020_0120; 2]);
    turn_to(&mut bench, 0);
    turn_to(&mut bench, 55);
    bench.take();
    bench.nmt(1);
    assert_eq!(positions(&mut bench, TPDO1), [55]);
}

/// Both entries have the same bits, but what was saved is there after a reset.
#[test]
fn a_saved_mapping_stays_when_a_second_sensor_is_chosen() {
    let mut bench = booted();
    bench.write(0x2100, 2, &[7]).unwrap();
    bench.write(0x1010, 1, b"save").unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!(number(&mut bench, 0x1000, 0), 0x000A_0196);
    assert_eq!([number(&mut bench, 0x1A00, 1), number(&mut bench, 0x1A01, 1)], [0x6004_0020; 2]);
}

#[test]
fn the_serial_number_is_that_of_the_identity() {
    let mut bench = booted();
    assert_eq!(number(&mut bench, 0x650B, 0), number(&mut bench, 0x1018, 4));
    bench.nmt(0x82);
    bench.restart();
    assert_eq!(number(&mut bench, 0x650B, 0), number(&mut bench, 0x1018, 4));
}

#[test]
fn a_supply_out_of_its_limits_and_a_damaged_memory_are_emergencies() {
    let good = Board { supply: Some(5000), current: Some(100), ..Board::default() };
    let cases = [
        (Board { current: Some(201), ..good }, (0x2110, 0b0011)),
        (Board { supply: Some(4499), ..good }, (0x3110, 0b0101)),
        (Board { memory_error: true, ..good }, (0x5100, 0b0001)),
    ];
    for (bad, (code, register)) in cases {
        let mut bench = operational();
        bench.encoder.board = good;
        wait(&mut bench, 20);
        assert_eq!(emergencies(&mut bench), []);
        bench.encoder.board = bad;
        wait(&mut bench, 20);
        assert_eq!(emergencies(&mut bench), [(code, register, 0)]);
        assert_eq!(number(&mut bench, 0x1001, 0), u32::from(register));
        assert_eq!(number(&mut bench, 0x1003, 1), u32::from(code));
        assert_eq!(bench.protocol.state(), State::PreOperational, "1029h:2 is 0");
        bench.encoder.board = good;
        wait(&mut bench, 120);
        assert_eq!(emergencies(&mut bench), [(0, 0, 0)]);
    }
}

#[test]
fn an_encoder_that_does_not_answer_is_an_emergency_and_an_alarm() {
    let mut bench = booted();
    bench.write(0x1029, 2, &[1]).unwrap();
    bench.write(0x2100, 1, &[2]).unwrap();
    bench.nmt(1);
    bench.take();
    wait(&mut bench, 5);
    assert_eq!(emergencies(&mut bench), [(0x5006, 1, 1)]);
    assert_eq!(number(&mut bench, 0x6503, 0), 1);
    assert_eq!(bench.protocol.state(), State::Operational, "1029h:2 is 1");
}

/// TPDO 1 as type 255 with a threshold of 100 units: it is sent when the position is 100 units from the last one sent,
/// and 6004h is right in between.
#[test]
fn a_tpdo_of_type_255_waits_for_the_change_threshold() {
    let mut bench = booted();
    turn_to(&mut bench, 0);
    bench.write(0x1800, 2, &[255]).unwrap();
    bench.write(0x2112, 1, &100_u32.to_le_bytes()).unwrap();
    bench.nmt(1);
    turn_to(&mut bench, 0);
    bench.take();
    for counter in (1..=250_u16).chain((1..250).rev()) {
        turn_to(&mut bench, counter);
        assert_eq!(number(&mut bench, 0x6004, 0), u32::from(counter));
    }
    assert_eq!(positions(&mut bench, TPDO1), [100, 200, 100]);
    bench.write(0x2112, 1, &[0; 4]).unwrap();
    turn_to(&mut bench, 2);
    turn_to(&mut bench, 3);
    assert_eq!(positions(&mut bench, TPDO1), [2, 3], "each change");
}

/// The preset of 6003h by a button: once a press, stored, and not by a button that was pressed before.
#[test]
fn a_digital_input_makes_a_preset_that_outlives_a_loss_of_power() {
    let mut bench = booted();
    turn_to(&mut bench, 0);
    bench.buttons = [true, false];
    turn_to(&mut bench, 500);
    bench.write(0x2115, 1, &[1]).unwrap();
    bench.write(0x6003, 0, &7000_u32.to_le_bytes()).unwrap();
    turn_to(&mut bench, 500);
    turn_to(&mut bench, 600);
    wait(&mut bench, 5);
    assert_eq!(number(&mut bench, 0x6004, 0), 7100, "it was pressed when it was chosen");
    bench.buttons = [false, false];
    wait(&mut bench, 5);
    // As in the firmware, the store waits for the sample that has the new offset.
    bench.stores_later = true;
    bench.buttons = [true, true];
    turn_to(&mut bench, 700);
    wait(&mut bench, 150);
    let job = bench.begin_store().expect("a preset is stored");
    bench.end_store(job);
    assert_eq!((number(&mut bench, 0x6004, 0), number(&mut bench, 0x6020, 1)), (7000, 7000));
    turn_to(&mut bench, 750);
    wait(&mut bench, 150);
    assert_eq!(number(&mut bench, 0x6004, 0), 7050);
    let mut bench = bench.power_cycled();
    wait(&mut bench, 5);
    assert_eq!((number(&mut bench, 0x6004, 0), number(&mut bench, 0x6503, 0)), (7050, 0));
}
