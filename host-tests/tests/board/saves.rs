//! Saves while an absolute encoder turns. The flash stops the core for 16 us with every word, longer than a byte of the
//! encoder lasts, but no reading may be lost.

use canbus::{Stamped, Time};
use host_tests::thorough;
use sim::world::World;

use crate::encoder::{ALARMS, FASTEST, MULTI_TURN, SENSOR_STATE, SENSOR_TYPE, STEPS, TPDO2};
use crate::support::{Master, SECOND, START_ALL, SYNC, frame, read, run, world, write};

const BIT_RATES: [u16; 8] = [1000, 800, 500, 250, 125, 50, 20, 10];
const RPM: f64 = 6000.0;
/// Number of steps in the range of the encoder.
const RANGE: i64 = 1 << 25;

/// The count of incomplete words from the absolute encoder.
const LOST_WORDS: (u16, u8) = (0x2001, 4);
/// A value without effect on the measurement: the limit of the operating time.
const SAVED: (u16, u8) = (0x2106, 5);
/// 1010h:3, save the application parameters.
const SAVE: [u8; 8] = [0x23, 0x10, 0x10, 3, b's', b'a', b'v', b'e'];
const DONE: u8 = 0x60;
/// Number of saves before the node is restarted: a start frees a page for the next saves.
const SAVES_A_START: u32 = 20;

/// An operational node with a turning multi-turn encoder.
fn start(bit_rate: u16) -> (World, Master) {
    let mut world = world(&format!("--node 1:encoder --bitrate {bit_rate} --shaft rpm:{RPM}"));
    let master = Master::join_at(&mut world, u32::from(bit_rate) * 1000);
    world.run_until(SECOND);
    write(&mut world, &master, SENSOR_TYPE, 1, MULTI_TURN);
    write(&mut world, &master, FASTEST, 4, 1000);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    world.run_until(world.now() + Time::from_millis(100));
    (world, master)
}

/// The greatest and the least age of the received positions, each at the SYNC before it, in microseconds.
fn ages(world: &mut World, frames: &[Stamped]) -> Vec<f64> {
    let (sync, tpdo) = (frame(SYNC, &[]).id(), frame(TPDO2, &[]).id());
    let mut sampled = None;
    let mut ages = Vec::new();
    for stamped in frames {
        if stamped.frame.id() == sync {
            sampled = Some(stamped.at);
        } else if stamped.frame.id() == tpdo {
            let at = sampled.take().expect("a SYNC before each position");
            let shaft = (world.machine(0).peripherals().plant().revolutions(at) * STEPS).floor() as i64;
            let position = i64::from(u32::from_le_bytes(stamped.frame.bytes()[..4].try_into().unwrap()));
            let behind = (shaft - position + RANGE / 2).rem_euclid(RANGE) - RANGE / 2;
            ages.push(behind as f64 / (STEPS * RPM / 60.0) * 1e6);
        }
    }
    ages
}

/// Saves once. SYNCs are sent as fast as the bus allows, until some time after the answer. Returns the ages of the
/// positions.
fn save(world: &mut World, master: &Master, bit_rate: u16, value: u32) -> Vec<f64> {
    write(world, master, SAVED, 4, value);
    world.take_frames();
    master.heard(world, 0x581);
    master.send(world, 0x601, &SAVE);
    // A SYNC, a TPDO of eight bytes and other frames: 300 bits.
    let beat = Time::from_micros(300_000 / u64::from(bit_rate)).max(Time::from_micros(997));
    let mut answer = None;
    let mut after = 0;
    while answer.is_none() || after < 3 {
        master.send(world, SYNC, &[]);
        world.run_until(world.now() + beat);
        answer = answer.or_else(|| master.heard(world, 0x581).first().map(|frame| frame.bytes()[0]));
        after += u32::from(answer.is_some());
    }
    assert_eq!(answer, Some(DONE), "save {value} at {bit_rate} kbit/s");
    let frames = world.take_frames();
    ages(world, &frames)
}

/// A word is started with one sample and read with the next one, and the following word then replaces it: no position
/// is older than two milliseconds plus the time for which the core was stopped.
#[test]
fn saves_cost_no_reading_of_the_absolute_encoder() {
    let saves = thorough::either(25, 200);
    for bit_rate in BIT_RATES {
        let (mut world, master) = start(bit_rate);
        let (mut least, mut most, mut count) = (f64::MAX, f64::MIN, 0);
        for number in 1..=saves {
            for age in save(&mut world, &master, bit_rate, number) {
                (least, most, count) = (least.min(age), most.max(age), count + 1);
            }
            if number % SAVES_A_START == 0 {
                assert_eq!(read(&mut world, &master, ALARMS), 0, "at {bit_rate} kbit/s");
                restart(&mut world, &master);
            }
        }
        println!("{bit_rate} kbit/s: {saves} saves, {count} positions, {least:.0} to {most:.0} us old");
        assert!(least > 900.0 && most < 2200.0, "{bit_rate} kbit/s: {least} to {most} us");
        assert_eq!(read(&mut world, &master, SENSOR_STATE), 0, "at {bit_rate} kbit/s");
        let summary = run(&mut world, Time::from_millis(1));
        assert_eq!(summary.nodes[0].heard.emcys, 0, "{summary}");
        assert!(summary.nodes[0].unmodelled.is_empty(), "{summary}");
        assert_eq!(summary.nodes[0].incidents.len(), (saves / SAVES_A_START) as usize, "{summary}");
        assert_eq!(read(&mut world, &master, LOST_WORDS), 0, "at {bit_rate} kbit/s");
    }
}

/// Resets the node, which then has the saved values, and starts it again.
fn restart(world: &mut World, master: &Master) {
    master.send(world, 0x000, &[0x81, 1]);
    world.run_until(world.now() + SECOND);
    master.send(world, START_ALL.0, &START_ALL.1);
    world.run_until(world.now() + Time::from_millis(100));
}
