//! The calibration of a transmitter by SDO: locked, checked, in force from the next sample on, and stored.

use host_tests::bench::{Bench, raw};
use node::Personality;
use profiles::board::RawSample;

const DEVICE_STATE: u32 = 0x0800_0022;
const PARAMETER: u32 = 0x0604_0043;
const INVALID_VALUE: u32 = 0x0609_0030;
const TOO_HIGH: u32 = 0x0609_0031;
const NOT_STORED: u32 = 0x0800_0020;

const RESET_NODE: u8 = 0x81;
const RESET_COMMUNICATION: u8 = 0x82;

fn unlocked(personality: Personality) -> Bench {
    let mut bench = Bench::booted_as(personality);
    bench.write(0x2203, 0, b"cali").unwrap();
    bench
}

fn real(bench: &mut Bench, index: u16, sub: u8) -> f32 {
    f32::from_le_bytes(bench.read(index, sub).unwrap().try_into().unwrap())
}

fn write_real(bench: &mut Bench, index: u16, sub: u8, value: f32) -> Result<(), u32> {
    bench.write(index, sub, &value.to_le_bytes())
}

/// The field value of a channel.
fn measured(bench: &mut Bench, raw: &RawSample, sub: u8) -> f32 {
    bench.sample(raw);
    real(bench, 0x6100, sub)
}

fn is_close(value: f32, expected: f32, tolerance: f32) -> bool {
    (value - expected).abs() <= tolerance
}

fn reset(bench: &mut Bench, command: u8) {
    bench.nmt(command);
    bench.restart();
}

#[test]
fn the_lock_opens_with_its_key_until_the_node_is_reset() {
    let mut bench = Bench::booted();
    assert_eq!(write_real(&mut bench, 0x2200, 3, 0.11), Err(DEVICE_STATE));
    for wrong in [*b"Cali", *b"save", [1, 0, 0, 0]] {
        assert_eq!(bench.write(0x2203, 0, &wrong), Err(NOT_STORED));
        assert_eq!(write_real(&mut bench, 0x2200, 3, 0.11), Err(DEVICE_STATE));
    }
    bench.write(0x2203, 0, b"cali").unwrap();
    assert_eq!(bench.write(0x2203, 0, b"ilac"), Err(NOT_STORED), "a wrong key does not close it");
    assert_eq!(write_real(&mut bench, 0x2200, 3, 0.11), Ok(()));
    assert_eq!(bench.write(0x2202, 1, &[1, 0, 0, 0]), Ok(()));
    reset(&mut bench, RESET_COMMUNICATION);
    assert_eq!(bench.write(0x2202, 1, &[2, 0, 0, 0]), Ok(()));
    bench.write(0x2203, 0, &[0; 4]).unwrap();
    assert_eq!(bench.write(0x2202, 1, &[3, 0, 0, 0]), Err(DEVICE_STATE));
    bench.write(0x2203, 0, b"cali").unwrap();
    reset(&mut bench, RESET_NODE);
    assert_eq!(bench.write(0x2202, 1, &[4, 0, 0, 0]), Err(DEVICE_STATE));
    assert_eq!(bench.read(0x2203, 0), Ok(vec![0; 4]));
}

#[test]
fn an_impossible_calibration_is_refused_and_the_old_one_stays() {
    let mut bench = unlocked(Personality::Pressure);
    let bad: [(u16, u8, f32); 12] = [
        (0x2200, 1, 1_000_000.0), // no range
        (0x2200, 2, -1.0),        // falls
        (0x2200, 6, 0.0),         // no span
        (0x2200, 6, -0.8),        // falls
        (0x2200, 6, 1e-38),       // infinitely steep
        (0x2200, 7, -0.01),       // falls when hot
        (0x2200, 9, 500.0),       // beyond the temperatures of the device
        (0x2200, 10, 0.975),      // always broken
        (0x2201, 2, 0.0),         // the temperature never changes
        (0x2201, 5, -0.0002),     // a thermistor of the other kind
        (0x2201, 7, 0.0),         // no resistor
        (0x2201, 8, 0.99),        // always broken
    ];
    for (index, sub, value) in bad {
        let before = bench.read(index, sub);
        assert_eq!(write_real(&mut bench, index, sub, value), Err(PARAMETER), "{index:X}h:{sub} {value}");
        assert_eq!(bench.read(index, sub), before);
    }
    // NaN and infinity are invalid for every REAL32.
    assert_eq!(write_real(&mut bench, 0x2200, 6, f32::NAN), Err(INVALID_VALUE));
    assert_eq!(write_real(&mut bench, 0x2201, 3, f32::INFINITY), Err(INVALID_VALUE));
    assert_eq!(bench.write(0x2201, 1, &[2]), Err(TOO_HIGH));
    assert!(is_close(measured(&mut bench, &raw(500_000.0, 298.15), 1), 500_000.0, 10.0));
}

#[test]
fn a_calibration_acts_from_the_next_sample_on() {
    let mut bench = unlocked(Personality::Pressure);
    // 10 % to 90 % are now -1 to 24 bar, and the span decreases by 0.05 % per kelvin from 25 degC on.
    for (sub, value) in [(1, -100_000.0), (2, 2_400_000.0), (7, -4e-4)] {
        write_real(&mut bench, 0x2200, sub, value).unwrap();
    }
    for (kelvin, shrunk) in [(298.15, 1.0_f32), (338.15, 0.98), (278.15, 1.01)] {
        let expected = -100_000.0 + 2_500_000.0 * 0.5 / shrunk;
        let got = measured(&mut bench, &raw(500_000.0, kelvin), 1);
        // A step is 19 mK of the temperature, and 49 Pa of the pressure.
        assert!(is_close(got, expected, 60.0), "{got} for {expected} at {kelvin} K");
    }
    write_real(&mut bench, 0x2201, 3, -1.5).unwrap();
    assert!(is_close(measured(&mut bench, &raw(0.0, 298.15), 2), 296.65, 0.02));
}

#[test]
fn a_parameter_selects_the_thermistor() {
    let mut bench = unlocked(Personality::Pressure);
    let warm = RawSample { thermistor: 16 * 1024, ..raw(0.0, 250.0) };
    assert!(is_close(measured(&mut bench, &warm, 2), 250.0, 0.02));
    bench.write(0x2201, 1, &[1]).unwrap();
    // A quarter of the supply means a third of 10 kohm, which with beta 3950 K is 1/(1/298.15 - ln 3 / 3950) K.
    assert!(is_close(measured(&mut bench, &warm, 2), 325.109, 0.001), "{}", real(&mut bench, 0x6100, 2));
    for thermistor in [0, 16 * 30, 16 * 4070, 16 * 4095] {
        let broken = RawSample { thermistor, ..warm };
        assert!(is_close(measured(&mut bench, &broken, 2), 0.0, 0.0), "{thermistor}");
        assert_eq!(bench.read(0x3000, 1), Ok(vec![1 << 3, 0, 0, 0]), "temperature rail");
        assert_eq!(bench.read(0x6150, 2).unwrap()[0] & 1, 1);
    }
}

#[test]
fn the_calibration_is_saved_by_its_own_command_and_by_nothing_else() {
    let mut bench = unlocked(Personality::Pressure);
    write_real(&mut bench, 0x2200, 3, 0.125).unwrap();
    bench.write(0x2202, 2, &20_251_231_u32.to_le_bytes()).unwrap();
    bench.write(0x1010, 1, b"save").unwrap();
    let mut bench = bench.power_cycled();
    assert!(is_close(real(&mut bench, 0x2200, 3), 0.1, 0.0), "1010h does not save it");

    bench.write(0x2203, 0, b"cali").unwrap();
    write_real(&mut bench, 0x2200, 3, 0.125).unwrap();
    bench.write(0x2202, 2, &20_251_231_u32.to_le_bytes()).unwrap();
    assert_eq!(bench.write(0x2204, 0, b"load"), Err(NOT_STORED));
    bench.write(0x2204, 0, b"save").unwrap();
    bench.write(0x6132, 1, &[3]).unwrap();
    let mut bench = bench.power_cycled();
    assert!(is_close(real(&mut bench, 0x2200, 3), 0.125, 0.0));
    assert_eq!(bench.read(0x2202, 2), Ok(20_251_231_u32.to_le_bytes().to_vec()));
    assert_eq!(bench.read(0x6132, 1), Ok(vec![0]), "2204h saves nothing else");

    bench.write(0x1011, 1, b"load").unwrap();
    let mut bench = bench.power_cycled();
    assert!(is_close(real(&mut bench, 0x2200, 3), 0.125, 0.0), "1011h does not touch it");
}

#[test]
fn the_calibration_is_that_of_the_device_in_every_personality() {
    let mut bench = unlocked(Personality::Pressure);
    write_real(&mut bench, 0x2200, 2, 500_000.0).unwrap();
    bench.write(0x2204, 0, b"save").unwrap();
    bench.write(0x2000, 0, &[Personality::Encoder.number()]).unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!(bench.read(0x2200, 2), Err(0x0602_0000));
    bench.write(0x2000, 0, &[Personality::Combined.number()]).unwrap();
    let mut bench = bench.power_cycled();
    assert!(is_close(real(&mut bench, 0x2200, 2), 500_000.0, 0.0));
    bench.sample(&raw(1_000_000.0, 298.15));
    assert!(is_close(real(&mut bench, 0x6900, 1), 500_000.0, 10.0));
}

#[test]
fn a_damaged_calibration_is_an_emergency() {
    let mut bench = unlocked(Personality::Pressure);
    let value = 500_000.0_f32.to_le_bytes();
    bench.write(0x2200, 2, &value).unwrap();
    bench.write(0x2204, 0, b"save").unwrap();
    let mut flash = bench.store.into_flash().0;
    let place = flash.windows(4).position(|bytes| bytes == value).expect("it is in the flash");
    flash[place + 2] = 0;
    let mut bench = Bench::with_flash(flash);
    assert!(is_close(real(&mut bench, 0x2200, 2), 1_000_000.0, 0.0), "the default holds");
    assert_eq!(bench.read(0x1003, 1), Ok(vec![0x00, 0x63, 0, 0]));
    assert_eq!(bench.read(0x3000, 1), Ok(vec![1, 0, 0, 0]), "the sensor is not set up as it should");
    assert_eq!(bench.read(0x1F57, 1), Ok(vec![3 << 1, 0, 0, 0]));
}

/// The default parameters are those of the front end that is in the file of each board.
#[test]
fn the_defaults_are_those_of_the_front_end_of_every_board() {
    let mut bench = Bench::booted();
    for (name, board) in bsp::boards::ALL {
        let bsp::boards::FrontEnd { transducer, thermistor, .. } = board.front_end;
        let expected = |value: u32| value as f32;
        assert_eq!(real(&mut bench, 0x2200, 1), 0.0, "{name}");
        assert_eq!(real(&mut bench, 0x2200, 2), expected(transducer.range), "{name}");
        let zero = expected(transducer.zero) / 1000.0;
        let span = expected(transducer.full - transducer.zero) / 1000.0;
        assert!(is_close(real(&mut bench, 0x2200, 3), zero, 1e-6), "{name}");
        assert!(is_close(real(&mut bench, 0x2200, 6), span, 1e-6), "{name}");
        // 1/T = A + B ln(R): the coefficients of a resistance at 25 degC and a beta.
        let b = 1.0 / expected(thermistor.beta);
        let a = 1.0 / 298.15 - expected(thermistor.ohms).ln() * b;
        assert!(is_close(real(&mut bench, 0x2201, 4), a, 1e-8), "{name}");
        assert!(is_close(real(&mut bench, 0x2201, 5), b, 1e-9), "{name}");
        assert_eq!(real(&mut bench, 0x2201, 6), 0.0, "{name}");
        assert_eq!(real(&mut bench, 0x2201, 7), expected(thermistor.series), "{name}");
    }
}
