//! The power fails at random instants, also during the start of the node, and the battery keeps the position.

use canbus::Time;
use fastrand::Rng;
use host_tests::thorough;
use sim::world::World;

use crate::encoder::{
    ALARMS, COUNTS, POSITION, POSITION_ERROR, PRESET, SENSOR_STATE, SENSOR_TYPE, STEPS, UNREFERENCED, start,
    start_absolute, stimulate, wait,
};
use crate::support::{Master, SECOND, read, run, write};

const PRESET_VALUE: u32 = 1000;
const SAVE: [u8; 8] = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];

/// Number of power cycles for each kind of encoder.
fn cycles() -> usize {
    thorough::either(25, 500)
}

fn revolutions(world: &mut World) -> f64 {
    let now = world.now();
    world.machine(0).peripherals().plant().revolutions(now)
}

/// The power fails now and returns after a random time. Sometimes it fails again during the start.
fn fail(world: &mut World, rng: &mut Rng) {
    loop {
        world.machine(0).power_off();
        world.run_until(world.now() + Time::from_micros(rng.u64(1..200_000)));
        let now = world.now();
        world.machine(0).power_on(now);
        if rng.u8(..) < 160 {
            break;
        }
        world.run_until(world.now() + Time::from_micros(rng.u64(1..300_000)));
    }
    let before = run(world, Time::ZERO).nodes[0].heard.boot_ups;
    let has_booted = (0..100).any(|_| run(world, Time::from_millis(10)).nodes[0].heard.boot_ups > before);
    assert!(has_booted, "the node comes back");
    wait(world, 30);
}

/// The power of a node with an absolute encoder fails while the encoder turns. After each start the position is the
/// preset position plus the way since the preset.
fn assert_preset_lasts(world: &mut World, master: &Master, rng: &mut Rng) {
    let zero = revolutions(world) * STEPS - f64::from(PRESET_VALUE);
    for cycle in 0..cycles() {
        stimulate(world, "shaft", &format!("rpm:{}", rng.i32(-600..600)));
        world.run_until(world.now() + Time::from_micros(rng.u64(1..100_000)));
        fail(world, rng);
        let rest = (revolutions(world) * STEPS).floor() / STEPS;
        stimulate(world, "shaft", &format!("const:{rest}"));
        wait(world, 10);
        let expected = (rest * STEPS - zero) as i64 as u32 & 0x1FF_FFFF;
        assert_eq!(read(world, master, POSITION), expected, "cycle {cycle}");
        assert_eq!(read(world, master, ALARMS), 0, "cycle {cycle}");
    }
}

/// The absolute encoder turns while the power fails and while it is off. The preset must hold after each start.
#[test]
fn an_absolute_encoder_keeps_its_preset_through_power_that_fails_at_any_moment() {
    let mut rng = Rng::with_seed(14);
    let (mut world, master) = start_absolute("--shaft const:7.125");
    write(&mut world, &master, PRESET, 4, PRESET_VALUE);
    assert_eq!(master.ask(&mut world, 1, &SAVE)[0], 0x60);
    assert_preset_lasts(&mut world, &master, &mut rng);
}

/// An incremental encoder at rest has its position again after the power-off, and is still referenced.
#[test]
fn an_incremental_encoder_at_rest_keeps_its_position_through_power_that_fails_at_any_moment() {
    let mut rng = Rng::with_seed(406);
    let mut turns = None;
    let (mut world, master) = start("--shaft rpm:600");
    wait(&mut world, 300);
    assert_eq!(read(&mut world, &master, SENSOR_STATE) & UNREFERENCED, 0);
    for cycle in 0..cycles() {
        let from = revolutions(&mut world);
        let rest = (from * COUNTS + f64::from(rng.i32(-20_000..20_000))).floor() / COUNTS;
        stimulate(&mut world, "shaft", &format!("ramp:{from},{rest},0.2"));
        // At rest for a tenth of a second: a shaft that turns when the power fails may turn on.
        wait(&mut world, 305);
        world.run_until(world.now() + Time::from_micros(rng.u64(1..5_000)));
        let at_rest = ((rest * COUNTS) as i64 + turns.unwrap_or_default()) as u32 & 0xFF_FFFF;
        if turns.is_none() {
            // The number of the first revolution depends on the position of the shaft when the node began to count.
            let ahead = i64::from(read(&mut world, &master, POSITION).wrapping_sub(at_rest).cast_signed());
            let whole = (ahead as f64 / COUNTS).round() as i64 * COUNTS as i64;
            assert!(ahead.abs_diff(whole) <= 1, "the index has referenced the position: {ahead}");
            turns = Some(whole);
        }
        fail(&mut world, &mut rng);
        let expected = ((rest * COUNTS) as i64 + turns.unwrap_or_default()) as u32 & 0xFF_FFFF;
        let found = read(&mut world, &master, POSITION);
        assert!(found.abs_diff(expected) <= 1, "cycle {cycle}: {found} instead of {expected}");
        assert_eq!(read(&mut world, &master, ALARMS), 0, "cycle {cycle}");
    }
}

/// Without a battery, the position of an absolute encoder follows from the stored offset.
#[test]
fn an_absolute_encoder_without_a_battery_keeps_its_preset() {
    let mut rng = Rng::with_seed(24);
    let (mut world, master) = start_absolute("--shaft const:7.125 --fault battery-empty@0");
    write(&mut world, &master, PRESET, 4, PRESET_VALUE);
    assert_preset_lasts(&mut world, &master, &mut rng);
}

/// The reset takes three turns at 3000 rpm. The node has seen the shaft turn, so it does not vouch for the count.
#[test]
fn a_count_is_lost_when_the_shaft_turns_at_a_reset_though_the_battery_is_good() {
    for (kind, rpm) in [(3, 1000), (3, -3000), (5, 60), (5, 6000)] {
        let (mut world, master) = start(&format!("--shaft rpm:{rpm}"));
        write(&mut world, &master, SENSOR_TYPE, 1, kind);
        wait(&mut world, 10);
        write(&mut world, &master, PRESET, 4, PRESET_VALUE);
        assert_eq!(master.ask(&mut world, 1, &SAVE)[0], 0x60);
        wait(&mut world, 300);
        assert_eq!(read(&mut world, &master, ALARMS), 0, "type {kind}");
        master.send(&mut world, 0, &[0x81, 1]);
        wait(&mut world, 1500);
        let (state, alarms) = (read(&mut world, &master, SENSOR_STATE), read(&mut world, &master, ALARMS));
        assert_eq!((state & POSITION_ERROR, alarms), (POSITION_ERROR, 1), "type {kind} at {rpm} rpm");
        write(&mut world, &master, PRESET, 4, PRESET_VALUE);
        wait(&mut world, 2500);
        assert_eq!(read(&mut world, &master, SENSOR_STATE) & POSITION_ERROR, 0, "after a preset");
    }
}

/// Without a battery, no start knows the counted position: each start reports this, until the position is preset.
#[test]
fn an_incremental_encoder_without_a_battery_never_shows_a_wrong_position_as_right() {
    let mut rng = Rng::with_seed(25);
    let (mut world, master) = start("--shaft rpm:600 --fault battery-empty@0");
    wait(&mut world, 300);
    for cycle in 0..cycles() {
        world.run_until(world.now() + Time::from_micros(rng.u64(1..100_000)));
        fail(&mut world, &mut rng);
        let (state, alarms) = (read(&mut world, &master, SENSOR_STATE), read(&mut world, &master, ALARMS));
        assert_eq!((state & POSITION_ERROR, alarms), (POSITION_ERROR, 1), "cycle {cycle}");
        // The index gives the position within the revolution, but not the number of the revolution.
        wait(&mut world, rng.u64(0..250));
        assert_ne!(read(&mut world, &master, SENSOR_STATE) & POSITION_ERROR, 0, "cycle {cycle}");
        if rng.bool() {
            write(&mut world, &master, PRESET, 4, 5000);
            wait(&mut world, 2);
            assert_eq!(read(&mut world, &master, SENSOR_STATE) & POSITION_ERROR, 0, "cycle {cycle}");
        }
    }
}

/// The first start reports that the memory was lost, and the next one reports that it was kept.
#[test]
fn the_log_of_a_start_states_whether_the_battery_has_kept_the_memory() {
    for (flags, said) in [("", "the battery has kept"), ("--fault battery-empty@0", "no battery has kept")] {
        let (mut world, _): (World, Master) = start(flags);
        world.take_log();
        let now = world.now();
        world.machine(0).power_off();
        world.run_until(now + SECOND);
        let now = world.now();
        world.machine(0).power_on(now);
        world.run_until(now + SECOND);
        let log: Vec<String> = world.take_log().into_iter().map(|line| line.text).collect();
        assert!(log.concat().contains(said), "{log:?}");
    }
}
