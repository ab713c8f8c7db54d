//! What the sensors see arrives on the bus, and how old it is then.

use canbus::Time;
use sim::world::World;

use crate::support::{Master, SECOND, START_ALL, SYNC, TPDO1, world};

/// A value is the mean of one millisecond, published at its end, and the next SYNC comes within another: so the pressure
/// that it tells was there at some moment of the two milliseconds before the SYNC.
const WINDOW: Time = Time::from_micros(2_050);
/// A signal that stands still gives 16 equal conversions, so a sum is no finer than one of them: one step of 12 bits for the
/// output of the transducer, which gives 80 % of its supply over 1 MPa, and a fifth more for that of the supply.
const RESOLUTION: f64 = 1.2 * 1_000_000.0 / 0.8 / 4096.0;

/// A node whose TPDO 1 answers every SYNC.
fn synchronous(flags: &str) -> (World, Master) {
    let mut world = world(&format!("--bitrate 1000 {flags}"));
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    assert_eq!(master.ask(&mut world, 1, &[0x2F, 0x00, 0x18, 0x02, 1, 0, 0, 0])[0], 0x60);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    world.run_until(world.now() + Time::from_millis(20));
    (world, master)
}

/// One SYNC; the pressure in Pa that answers it, and what the sensor saw at that time: least and most.
fn ask(world: &mut World, master: &Master) -> (f64, f64, f64) {
    master.heard(world, TPDO1);
    let sync = world.now();
    master.send(world, SYNC, &[]);
    world.run_until(sync + Time::from_micros(1_013));
    let [frame] = master.heard(world, TPDO1)[..] else { panic!("one TPDO for one SYNC") };
    let bar = f32::from_le_bytes(frame.bytes()[..4].try_into().unwrap());
    let plant = world.machine(0).peripherals().plant();
    let seen = (0..=40).map(|i| plant.pressure(sync - WINDOW + Time::from_micros(2_050 * i / 40)));
    let (least, most) = seen.fold((f64::MAX, f64::MIN), |(least, most), p| (least.min(p), most.max(p)));
    (f64::from(bar) * 100_000.0, least, most)
}

/// The widest miss of what was seen, over so many SYNCs, in Pa; and how far the signal moved within one window at most.
fn worst(flags: &str, syncs: usize) -> (f64, f64) {
    let (mut world, master) = synchronous(flags);
    (0..syncs).map(|_| ask(&mut world, &master)).fold((0.0, 0.0), |(miss, moved), (told, least, most)| {
        (f64::max(miss, (least - told).max(told - most)), f64::max(moved, most - least))
    })
}

#[test]
fn a_step_a_sine_and_a_ramp_arrive_at_most_one_sample_old() {
    for (flags, moves) in [
        ("--pressure step:100000,900000,1.5", 100_000.0),
        ("--pressure sine:500000,300000,10", 10_000.0),
        ("--pressure ramp:100000,900000,3", 500.0),
    ] {
        let (miss, moved) = worst(flags, 1_500);
        println!("{flags}: {miss:.0} Pa off at most, while it moves by up to {moved:.0} Pa in two samples");
        assert!(miss <= RESOLUTION, "{flags}: {miss} Pa");
        assert!(moved > moves, "{flags}: a signal that stands still would show nothing: {moved} Pa");
    }
}
