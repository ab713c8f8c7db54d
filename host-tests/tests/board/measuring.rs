//! Measured values on the bus: their accuracy and their age.

use canbus::Time;
use sim::stimuli::Stimulus;
use sim::world::World;

use crate::support::{Master, SECOND, START_ALL, SYNC, TPDO1, read, world, write};

/// A value is the mean of one millisecond, published at the end of that millisecond, and the next SYNC comes within
/// another one. So the reported pressure occurred at some instant of the two milliseconds before the SYNC.
const WINDOW: Time = Time::from_micros(2_050);
/// A constant signal gives 16 equal conversions, so the sum has the resolution of one conversion: one step of 12 bits
/// for the output of the transducer, which gives 80 % of its supply over 1 MPa. The measurement of the supply adds a
/// fifth.
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

/// Sends one SYNC; returns the pressure in the answer in Pa, and the least and the greatest true pressure in the
/// window.
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

/// The greatest error over `syncs` SYNCs in Pa, and the greatest change of the signal within one window.
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

const FIELD_VALUE: (u16, u8) = (0x6100, 2);
const STATUS: (u16, u8) = (0x6150, 2);
const FLAGS: (u16, u8) = (0x3000, 1);
const THERMOMETER: (u16, u8) = (0x2201, 1);
const LOCK: (u16, u8) = (0x2203, 0);

/// The chip is at 300 K, the thermistor has another temperature: the node measures the one that the parameter selects.
#[test]
fn a_parameter_selects_the_sensor_of_the_chip_or_the_thermistor() {
    let mut world = world("--bitrate 1000 --temperature const:300 --thermistor const:350");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    let measured = |world: &mut World| f32::from_bits(read(world, &master, FIELD_VALUE));
    let chip = measured(&mut world);
    assert!((chip - 300.0).abs() < 0.4, "{chip} K");
    write(&mut world, &master, LOCK, 4, u32::from_le_bytes(*b"cali"));
    write(&mut world, &master, THERMOMETER, 1, 1);
    for kelvin in [350.0, 298.15, 240.0] {
        let now = world.now();
        world.apply(&Stimulus::parse("thermistor", &format!("const:{kelvin}")).unwrap()).unwrap();
        world.run_until(now + Time::from_millis(5));
        let thermistor = measured(&mut world);
        // A step of the converter is 0.02 K at 25 degC, and 0.13 K at 240 K.
        assert!((thermistor - kelvin).abs() < 0.15, "{thermistor} K for {kelvin} K");
    }
    let summary = world.summary(1.0, 0);
    assert!(summary.nodes[0].unmodelled.is_empty() && summary.nodes[0].incidents.is_empty(), "{summary}");
}

#[test]
fn a_broken_thermistor_is_reported() {
    const EMCY: u16 = 0x081;
    // A fault that recurs within 2 s would last a second longer.
    let mut world = world("--bitrate 1000 --fault open-thermistor@2..3 --fault shorted-thermistor@6..7");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    write(&mut world, &master, LOCK, 4, u32::from_le_bytes(*b"cali"));
    write(&mut world, &master, THERMOMETER, 1, 1);
    for (millis, is_broken) in [(1500, false), (2500, true), (3500, false), (6500, true), (7500, false)] {
        master.heard(&mut world, EMCY);
        world.run_until(Time::from_millis(millis));
        let codes: Vec<_> =
            master.heard(&mut world, EMCY).iter().map(|frame| frame.bytes()[..2].to_vec()).collect();
        let expected: &[[u8; 2]] = match (millis, is_broken) {
            (1500, _) => &[],
            // EMCY code 8001h, or 0000h after the end of the fault.
            (_, true) => &[[0x01, 0x80]],
            (_, false) => &[[0, 0]],
        };
        assert_eq!(codes, expected, "at {millis} ms");
        assert_eq!(read(&mut world, &master, FLAGS), u32::from(is_broken) << 3, "at {millis} ms");
        assert_eq!(read(&mut world, &master, STATUS) & 1, u32::from(is_broken), "at {millis} ms");
        let kelvin = f32::from_bits(read(&mut world, &master, FIELD_VALUE));
        let expected = if is_broken { 0.0 } else { 298.15 };
        assert!((kelvin - expected).abs() < 0.05, "{kelvin} K at {millis} ms");
    }
}
