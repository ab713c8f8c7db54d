//! A wrong position is reported: as an alarm, as an EMCY, and by the NMT state that 1029h:2 selects.

use sim::world::World;

use crate::encoder::{
    ALARMS, COUNTS, IMPLAUSIBLE, OPERATING, POSITION, POSITION_ERROR, PRESET, SENSOR_STATE, SENSOR_TYPE,
    STEPS, TPDO2, UNREFERENCED, cycle_power, shaft, start, stimulate, wait,
};
use crate::support::{Master, START_ALL, SYNC, read, write};

const ACKNOWLEDGE: (u16, u8) = (0x2109, 0);
const ERROR_REGISTER: (u16, u8) = (0x1001, 0);
const ON_DEVICE_ERROR: (u16, u8) = (0x1029, 2);
const RESOLUTION: (u16, u8) = (0x2101, 1);
const OFFSET: (u16, u8) = (0x6509, 0);
const DIAGNOSTIC: (u16, u8) = (0x210C, 1);
/// The choice of virtual devices: the car position unit.
const DEVICES: (u16, u8) = (0x2305, 0);
const EMCY: u16 = 0x081;
/// EMCY of a wrong position: the code of a broken sensor, the generic bit of the error register, and 2 in the detail.
const WRONG: [u8; 8] = [0x06, 0x50, 1, 2, 0, 0, 0, 0];

const INDEX: u32 = 1 << 4;

/// The EMCY messages since the last call.
fn emcys(world: &mut World, master: &Master) -> Vec<Vec<u8>> {
    master.heard(world, EMCY).iter().map(|frame| frame.bytes().to_vec()).collect()
}

/// Whether the node is Operational: only then does a SYNC sample a TPDO.
fn is_operational(world: &mut World, master: &Master) -> bool {
    master.heard(world, TPDO2);
    master.send(world, SYNC, &[]);
    wait(world, 2);
    !master.heard(world, TPDO2).is_empty()
}

fn go_operational(world: &mut World, master: &Master) {
    master.send(world, START_ALL.0, &START_ALL.1);
    wait(world, 5);
    assert!(is_operational(world, master));
}

/// Checks that a wrong position is reported in every way.
fn assert_told(world: &mut World, master: &Master, state: u32, stays_operational: bool) {
    assert_eq!(emcys(world, master), [WRONG]);
    assert_eq!(read(world, master, SENSOR_STATE), state | POSITION_ERROR);
    assert_eq!((read(world, master, ALARMS), read(world, master, ERROR_REGISTER)), (1, 1));
    assert_eq!(is_operational(world, master), stays_operational, "1029h:2");
}

/// Checks that the position is right again; the alarm stays until it is read.
fn assert_well(world: &mut World, master: &Master) {
    let all = emcys(world, master);
    assert_eq!(all.last().map(|bytes| bytes[..3].to_vec()), Some(vec![0, 0, 0]), "{all:x?}");
    assert_eq!((read(world, master, SENSOR_STATE), read(world, master, ALARMS)), (0, 1));
    write(world, master, ACKNOWLEDGE, 2, 1);
    wait(world, 25);
    assert_eq!((read(world, master, ALARMS), read(world, master, ERROR_REGISTER)), (0, 0));
}

#[test]
fn an_index_lost_after_the_first_one_is_reported_every_time() {
    for behaviour in [0, 1] {
        let (mut world, master) =
            start("--shaft rpm:600 --fault missing-index@2..3 --fault missing-index@6..7");
        write(&mut world, &master, ON_DEVICE_ERROR, 1, behaviour);
        // A fault that recurs within 2 s would last a second longer.
        for second in [2, 6] {
            go_operational(&mut world, &master);
            assert_eq!(read(&mut world, &master, SENSOR_STATE), 0);
            emcys(&mut world, &master);
            // The fault is detected after a turn and a quarter, which takes 125 ms.
            world.run_until(canbus::Time::from_millis(second * 1000 + 300));
            assert_told(&mut world, &master, INDEX, behaviour == 1);
            world.run_until(canbus::Time::from_millis(second * 1000 + 1500));
            assert_well(&mut world, &master);
        }
    }
}

/// The shaft has 4096 steps per revolution, but the parameter says 4000, so each index is 96 steps off.
#[test]
fn a_displaced_index_is_reported() {
    let (mut world, master) = start("");
    write(&mut world, &master, RESOLUTION, 4, 4000);
    go_operational(&mut world, &master);
    emcys(&mut world, &master);
    stimulate(&mut world, "shaft", "rpm:600");
    wait(&mut world, 500);
    assert_told(&mut world, &master, INDEX, false);
    wait(&mut world, 2000);
    assert_eq!(emcys(&mut world, &master), [[0_u8; 8]; 0], "once, as long as it lasts");
}

/// With the parameters as delivered. While the code is wrong, the position stays at its last right value.
#[test]
fn a_jump_of_an_absolute_encoder_is_reported_and_rejected() {
    let (mut world, master) = start("--shaft rpm:60 --fault wrong-code@3..6");
    write(&mut world, &master, SENSOR_TYPE, 1, 2);
    wait(&mut world, 10);
    go_operational(&mut world, &master);
    emcys(&mut world, &master);
    world.run_until(canbus::Time::from_millis(3100));
    assert_told(&mut world, &master, IMPLAUSIBLE, false);
    let held = f64::from(read(&mut world, &master, POSITION));
    assert!((held - 3.0 * STEPS).abs() < 30.0, "{held}");
    wait(&mut world, 2500);
    assert_eq!(f64::from(read(&mut world, &master, POSITION)), held);
    world.run_until(canbus::Time::from_millis(6500));
    assert_well(&mut world, &master);
    let (now, position) = (world.now(), f64::from(read(&mut world, &master, POSITION)));
    let here = shaft(&mut world, now, STEPS) as f64;
    assert!((position - here).abs() < 100.0, "{position} and not {here}");
}

#[test]
fn the_diagnostic_at_rest_sees_a_jump_with_the_parameters_as_delivered() {
    let (mut world, master) = start("--shaft const:2.25 --fault wrong-code@3..4");
    write(&mut world, &master, SENSOR_TYPE, 1, 2);
    write(&mut world, &master, OPERATING, 2, 2);
    world.run_until(canbus::Time::from_millis(2900));
    assert_eq!(read(&mut world, &master, DIAGNOSTIC), 2, "a second was good");
    world.run_until(canbus::Time::from_millis(3100));
    assert_eq!(read(&mut world, &master, DIAGNOSTIC), 0x81);
}

/// A preset is "calculated and stored" (CiA 406, 7.2.4) without a command to 1010h and without a battery.
#[test]
fn a_preset_is_stored_by_itself() {
    let (mut world, master) = start("--shaft const:10.5 --fault battery-empty@0");
    write(&mut world, &master, SENSOR_TYPE, 1, 2);
    wait(&mut world, 10);
    write(&mut world, &master, PRESET, 4, 1000);
    let offset = read(&mut world, &master, OFFSET);
    assert_eq!(offset as i32, 1000 - (10.5 * STEPS) as i32);
    for _ in 0..2 {
        cycle_power(&mut world);
        assert_eq!(read(&mut world, &master, POSITION), 1000);
        assert_eq!((read(&mut world, &master, OFFSET), read(&mut world, &master, ALARMS)), (offset, 0));
    }
}

/// A position that only the memory holds is lost with the memory; the node reports this until the position is preset.
#[test]
fn a_count_lost_with_the_memory_is_reported_until_a_preset() {
    let (mut world, master) = start("--fault battery-empty@0");
    stimulate(&mut world, "shaft", "ramp:0,37.25,0.5");
    wait(&mut world, 600);
    assert_eq!(read(&mut world, &master, ALARMS), 0, "a new board has nothing to lose");
    let expected = (37.25 * COUNTS) as u32;
    assert!(read(&mut world, &master, POSITION).abs_diff(expected) <= 1);
    emcys(&mut world, &master);
    cycle_power(&mut world);
    assert_told(&mut world, &master, UNREFERENCED, false);
    // A reset of the node does not restore the position.
    master.send(&mut world, 0, &[0x81, 1]);
    wait(&mut world, 1000);
    emcys(&mut world, &master);
    assert_eq!(read(&mut world, &master, SENSOR_STATE), UNREFERENCED | POSITION_ERROR);
    write(&mut world, &master, PRESET, 4, expected);
    wait(&mut world, 250);
    assert_eq!(emcys(&mut world, &master).last().unwrap()[..3], [0, 0, 0]);
    assert_eq!(read(&mut world, &master, POSITION), expected);
    assert_eq!(read(&mut world, &master, SENSOR_STATE), UNREFERENCED, "the index comes with the next turn");
}

/// The lift's position unit reports the same in 2303h (bit 4), and keeps its preset without a command to 1010h.
#[test]
fn a_position_unit_of_a_lift_keeps_its_preset_and_says_when_its_count_is_lost() {
    const STATE: (u16, u8) = (0x2303, 1);
    const UNIT_PRESET: (u16, u8) = (0x6382, 1);
    const UNIT_POSITION: (u16, u8) = (0x6383, 1);
    for (kind, lost) in [(2, 0), (5, 1 << 4)] {
        let mut world =
            crate::support::world("--node 1:lift --bitrate 1000 --shaft const:10.5 --fault battery-empty@0");
        let master = Master::join(&mut world);
        world.run_until(crate::support::SECOND);
        write(&mut world, &master, DEVICES, 1, 1);
        write(&mut world, &master, SENSOR_TYPE, 1, kind);
        wait(&mut world, 10);
        write(&mut world, &master, UNIT_PRESET, 4, 5000);
        wait(&mut world, 10);
        assert_eq!((read(&mut world, &master, UNIT_POSITION), read(&mut world, &master, STATE)), (5000, 0));
        emcys(&mut world, &master);
        cycle_power(&mut world);
        let told = emcys(&mut world, &master);
        assert_eq!(read(&mut world, &master, STATE), lost);
        if lost == 0 {
            assert_eq!(read(&mut world, &master, UNIT_POSITION), 5000);
            continue;
        }
        assert_eq!(told, [WRONG]);
        write(&mut world, &master, UNIT_PRESET, 4, 5000);
        wait(&mut world, 10);
        assert_eq!((read(&mut world, &master, UNIT_POSITION), read(&mut world, &master, STATE)), (5000, 0));
    }
}

/// The code of a lift's sensor jumps: the position stays, and a preset at the new place is accepted.
#[test]
fn a_jump_of_a_lift_s_sensor_is_reported_and_rejected() {
    const STATE: (u16, u8) = (0x2303, 1);
    let mut world =
        crate::support::world("--node 1:lift --bitrate 1000 --shaft const:2.25 --fault wrong-code@3..100");
    let master = Master::join(&mut world);
    world.run_until(crate::support::SECOND);
    write(&mut world, &master, DEVICES, 1, 1);
    write(&mut world, &master, SENSOR_TYPE, 1, 2);
    wait(&mut world, 10);
    assert_eq!((read(&mut world, &master, (0x6383, 1)), read(&mut world, &master, STATE)), (450, 0));
    emcys(&mut world, &master);
    world.run_until(canbus::Time::from_millis(5000));
    assert_eq!(emcys(&mut world, &master), [WRONG]);
    assert_eq!((read(&mut world, &master, (0x6383, 1)), read(&mut world, &master, STATE)), (450, 0x18));
    write(&mut world, &master, (0x6382, 1), 4, 700);
    wait(&mut world, 10);
    assert_eq!((read(&mut world, &master, (0x6383, 1)), read(&mut world, &master, STATE)), (700, 0));
}

/// 6301h and 6302h by RPDO (CiA 406, table of objects: PDO mapping optional); 6506h states what is supported; 6507h is
/// 100Ah.
#[test]
fn cams_are_switched_by_rpdo_and_objects_claim_only_what_the_board_measures() {
    let (mut world, master) = start("--shaft const:0.5");
    write(&mut world, &master, PRESET, 4, 2000);
    write(&mut world, &master, (0x6320, 1), 4, 3000);
    // A cam enabled by SDO works.
    write(&mut world, &master, (0x6301, 1), 1, 1);
    wait(&mut world, 25);
    assert_eq!(read(&mut world, &master, (0x6300, 1)), 1);
    write(&mut world, &master, (0x1400, 1), 4, 0x8000_0201);
    write(&mut world, &master, (0x1600, 0), 1, 0);
    write(&mut world, &master, (0x1600, 1), 4, 0x6301_0108);
    write(&mut world, &master, (0x1600, 2), 4, 0x6302_0108);
    write(&mut world, &master, (0x1600, 0), 1, 2);
    write(&mut world, &master, (0x1400, 1), 4, 0x201);
    go_operational(&mut world, &master);
    for (data, cams) in [([0x01, 0x00], 0x01), ([0x01, 0x01], 0x00), ([0x03, 0x02], 0x03), ([0, 0], 0)] {
        master.send(&mut world, 0x201, &data);
        wait(&mut world, 30);
        assert_eq!(read(&mut world, &master, (0x6301, 1)), u32::from(data[0]));
        assert_eq!(read(&mut world, &master, POSITION), 2000);
        assert_eq!(read(&mut world, &master, (0x6302, 1)), u32::from(data[1]));
        // Cam 2 is not at 0, and its inverted state is shown.
        assert_eq!(read(&mut world, &master, (0x6300, 1)), cams, "{data:x?}");
    }
    assert_eq!(read(&mut world, &master, (0x6506, 0)), 0x102D, "speed of 6030h, neither light nor battery");
    assert_eq!(read(&mut world, &master, (0x6507, 0)), 0x0010_0300, "0.1.0 as 100Ah, profile 3.0");
    write(&mut world, &master, (0x6001, 0), 4, u32::MAX);
    write(&mut world, &master, (0x6002, 0), 4, u32::MAX);
}
