//! The encoders on the emulated board: from the shaft to the bus.

use canbus::Time;
use sim::stimuli::Stimulus;
use sim::world::World;

use crate::support::{Master, SECOND, START_ALL, SYNC, read, run, world, write};

/// TPDO 2, which carries the position with every SYNC.
pub(crate) const TPDO2: u16 = 0x281;
/// Steps in a revolution: of the incremental encoder, and of the absolute one.
pub(crate) const COUNTS: f64 = 4096.0;
pub(crate) const STEPS: f64 = 8192.0;

pub(crate) const POSITION: (u16, u8) = (0x6004, 0);
pub(crate) const PRESET: (u16, u8) = (0x6003, 0);
pub(crate) const ALARMS: (u16, u8) = (0x6503, 0);
pub(crate) const OPERATING: (u16, u8) = (0x6000, 0);
const PER_REVOLUTION: (u16, u8) = (0x6001, 0);
const SPEED: (u16, u8) = (0x6030, 1);
pub(crate) const SENSOR_TYPE: (u16, u8) = (0x2100, 1);
pub(crate) const FASTEST: (u16, u8) = (0x2104, 1);
pub(crate) const SENSOR_STATE: (u16, u8) = (0x210B, 1);

/// Code of a sensor type, as in the device type (object 1000h).
pub(crate) const MULTI_TURN: u32 = 2;
/// Bit of the operating parameters: scaling is enabled.
const SCALING: u32 = 1 << 2;
/// Bits of the sensor state.
pub(crate) const NO_SIGNAL: u32 = 1 << 0;
pub(crate) const IMPLAUSIBLE: u32 = 1 << 3;
pub(crate) const UNREFERENCED: u32 = 1 << 5;
pub(crate) const POSITION_ERROR: u32 = 1 << 7;

/// A node with an encoder, a second after power-on.
pub(crate) fn start(flags: &str) -> (World, Master) {
    let mut world = world(&format!("--node 1:encoder --bitrate 1000 {flags}"));
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    (world, master)
}

pub(crate) fn stimulate(world: &mut World, kind: &str, spec: &str) {
    world.apply(&Stimulus::parse(kind, spec).unwrap()).unwrap();
}

pub(crate) fn wait(world: &mut World, millis: u64) {
    world.run_until(world.now() + Time::from_millis(millis));
}

/// The position of the shaft, in steps.
pub(crate) fn shaft(world: &mut World, at: Time, steps: f64) -> i64 {
    (world.machine(0).peripherals().plant().revolutions(at) * steps).floor() as i64
}

pub(crate) fn position(tpdo: &[u8]) -> i64 {
    i64::from(u32::from_le_bytes(tpdo[..4].try_into().unwrap()))
}

/// The age of a position at the SYNC that samples it, in microseconds, computed from the received position. The range
/// of positions has `range` steps, and the shaft moves `per_second` steps a second.
fn age(shaft: i64, position: i64, range: i64, per_second: f64) -> f64 {
    let behind = (shaft - position + range / 2).rem_euclid(range) - range / 2;
    behind as f64 / per_second * 1e6
}

/// The ages of the positions that a thousand SYNCs sample: the least and the most.
pub(crate) fn ages(
    world: &mut World,
    master: &Master,
    steps: f64,
    range: i64,
    per_second: f64,
) -> (f64, f64) {
    let (mut least, mut most) = (f64::MAX, f64::MIN);
    for _ in 0..1000 {
        // A SYNC lasts 44 to 56 us at 1 Mbit/s; the node samples at its end.
        let end = world.now() + Time::from_micros(50);
        let expected = shaft(world, end, steps);
        master.send(world, SYNC, &[]);
        world.run_until(world.now() + Time::from_micros(997));
        let tpdos = master.heard(world, TPDO2);
        assert_eq!(tpdos.len(), 1);
        let age = age(expected, position(tpdos[0].bytes()), range, per_second);
        (least, most) = (least.min(age), most.max(age));
    }
    (least, most)
}

/// The shaft turns at 6000 rpm, 410 counts a millisecond: the timer wraps every 160 ms. The position for a SYNC is at
/// most one sample old, the speed is right, and each index is accepted.
#[test]
fn a_fast_shaft_is_followed_both_ways_across_the_wrap() {
    for rpm in [6000, -6000] {
        let (mut world, master) = start("");
        assert_eq!(read(&mut world, &master, SENSOR_STATE), UNREFERENCED);
        stimulate(&mut world, "shaft", &format!("rpm:{rpm}"));
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        wait(&mut world, 20);
        master.heard(&mut world, TPDO2);
        let per_second = COUNTS * f64::from(rpm) / 60.0;
        let (least, most) = ages(&mut world, &master, COUNTS, 1 << 24, per_second);
        println!("{rpm} rpm: positions are {least:.0} to {most:.0} us old");
        assert!(least > 0.0 && most < 1200.0, "{rpm} rpm: {least} to {most} us");
        assert_eq!(
            read(&mut world, &master, SENSOR_STATE),
            0,
            "no step is lost and the index is in its place"
        );
        // With 64 units per revolution, the speed fits into 6030h.
        write(&mut world, &master, PER_REVOLUTION, 4, 64);
        write(&mut world, &master, OPERATING, 2, SCALING);
        wait(&mut world, 10);
        let speed = read(&mut world, &master, SPEED) as u16 as i16;
        let expected = rpm / 60 * 64;
        assert!((i32::from(speed) - expected).abs() <= expected.abs() / 100, "{speed} instead of {expected}");
        let summary = run(&mut world, Time::from_millis(1));
        assert!(summary.nodes[0].incidents.is_empty() && summary.nodes[0].unmodelled.is_empty(), "{summary}");
        // A lock may delay the first and the last start: a microsecond in the seconds between them.
        assert!((summary.nodes[0].sampling.rate - 1000.0).abs() < 1e-3, "{summary}");
        println!("{summary}");
    }
}

/// Without an index, the zero of a revolution is unknown.
#[test]
fn an_index_that_does_not_come_is_missed() {
    let (mut world, master) = start("--shaft rpm:600 --fault missing-index@0..2");
    wait(&mut world, 900);
    assert_eq!(read(&mut world, &master, SENSOR_STATE), UNREFERENCED);
    wait(&mut world, 300);
    assert_eq!(read(&mut world, &master, SENSOR_STATE), 0);
}

/// Configures the sensor of the node as absolute.
pub(crate) fn start_absolute(flags: &str) -> (World, Master) {
    let (mut world, master) = start(flags);
    write(&mut world, &master, SENSOR_TYPE, 1, MULTI_TURN);
    write(&mut world, &master, FASTEST, 4, 1000);
    wait(&mut world, 10);
    (world, master)
}

#[test]
fn the_absolute_encoder_measures_the_position_of_the_shaft() {
    let (mut world, master) = start_absolute("--shaft const:1234.5");
    assert_eq!(f64::from(read(&mut world, &master, POSITION)), 1234.5 * STEPS);
    assert_eq!(read(&mut world, &master, SENSOR_STATE), 0);
}

/// A word is started with one sample and read with the next one: its position is up to two milliseconds old.
#[test]
fn the_absolute_encoder_follows_a_fast_shaft_both_ways_over_its_zero() {
    for rpm in [6000, -6000] {
        let (mut world, master) = start_absolute("");
        stimulate(&mut world, "shaft", &format!("rpm:{rpm}"));
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        wait(&mut world, 20);
        master.heard(&mut world, TPDO2);
        let per_second = STEPS * f64::from(rpm) / 60.0;
        let (least, most) = ages(&mut world, &master, STEPS, 1 << 25, per_second);
        println!("{rpm} rpm: positions are {least:.0} to {most:.0} us old");
        assert!(least > 900.0 && most < 2200.0, "{rpm} rpm: {least} to {most} us");
        assert_eq!(read(&mut world, &master, SENSOR_STATE), 0);
        println!("{}", run(&mut world, Time::from_millis(1)));
    }
}

#[test]
fn faults_of_the_absolute_encoder_are_reported() {
    let (mut world, master) =
        start_absolute("--shaft const:2.25 --fault open-ssi@2..3 --fault wrong-code@4..5");
    // Half a revolution then takes four seconds, and is implausible for that time.
    write(&mut world, &master, FASTEST, 4, 1);
    let (open, wrong) = (NO_SIGNAL | POSITION_ERROR, IMPLAUSIBLE | POSITION_ERROR);
    for (at, state) in [(1500, 0), (2500, open), (3500, 0), (4500, wrong), (5500, 0)] {
        world.run_until(Time::from_millis(at));
        assert_eq!(read(&mut world, &master, SENSOR_STATE), state, "at {at} ms");
        let position = f64::from(read(&mut world, &master, POSITION));
        assert_eq!(position, 2.25 * STEPS, "the last good one, at {at} ms");
    }
}

/// Switches the board off for a second, and on again.
pub(crate) fn cycle_power(world: &mut World) {
    let now = world.now();
    world.machine(0).power_off();
    world.run_until(now + SECOND);
    let now = world.now();
    world.machine(0).power_on(now);
    world.run_until(now + SECOND);
}

#[test]
fn the_turns_are_kept_through_a_loss_of_power() {
    let (mut world, master) = start("");
    let mut before = 0.0;
    for turns in [37.25, -3.5] {
        stimulate(&mut world, "shaft", &format!("ramp:{before},{turns},0.5"));
        before = turns;
        wait(&mut world, 600);
        let expected = (turns * COUNTS) as i64 as u32 & 0xFF_FFFF;
        assert_eq!(read(&mut world, &master, POSITION), expected);
        cycle_power(&mut world);
        assert_eq!(read(&mut world, &master, POSITION), expected);
    }
}

#[test]
fn without_a_battery_the_count_restarts() {
    let (mut world, master) = start("--fault battery-empty@0");
    stimulate(&mut world, "shaft", "rpm:600");
    wait(&mut world, 1000);
    stimulate(&mut world, "shaft", "const:10");
    wait(&mut world, 10);
    assert_eq!(f64::from(read(&mut world, &master, POSITION)), 10.0 * COUNTS);
    cycle_power(&mut world);
    assert_eq!(read(&mut world, &master, POSITION), 0);
    assert_eq!(
        read(&mut world, &master, SENSOR_STATE),
        UNREFERENCED | POSITION_ERROR,
        "and says that it is lost"
    );
}
