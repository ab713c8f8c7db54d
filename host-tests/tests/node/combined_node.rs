//! Encoder and transmitter in one node: both measure, and each has its own objects, PDOs and faults.

use canopen::Frame;
use host_tests::bench::{Bench, ID, raw};
use node::Personality;

fn booted() -> Bench {
    Bench::booted_as(Personality::Combined)
}

/// A millisecond with 2.5 bar and the timer at 300.
fn measure(bench: &mut Bench) {
    bench.encoder.counter = 0;
    bench.sample(&raw(250_000.0, 298.15));
    bench.encoder.counter = 300;
    bench.sample(&raw(250_000.0, 298.15));
}

/// The sent TPDOs by number.
fn sent(bench: &mut Bench) -> Vec<(u16, Vec<u8>)> {
    let own = u16::from(ID);
    bench.take().into_iter().map(|(id, data)| ((id - own - 0x80) >> 8, data)).collect()
}

#[test]
fn each_device_sends_its_values_by_event_and_with_sync() {
    let mut bench = booted();
    measure(&mut bench);
    bench.take();
    let process_values = [bench.read(0x6930, 1).unwrap(), bench.read(0x6930, 2).unwrap()].concat();
    let position = 300_u32.to_le_bytes().to_vec();
    bench.nmt(1);
    assert_eq!(sent(&mut bench), [(1, position.clone()), (3, process_values.clone())]);
    bench.receive(&Frame::new(0x80, &[]).unwrap());
    assert_eq!(sent(&mut bench), [(2, position), (4, process_values)]);
}

#[test]
fn the_parameters_of_each_device_act_on_its_own_values() {
    let mut bench = booted();
    // Unit kPa with one decimal digit, and the opposite counting direction.
    bench.write(0x6931, 1, &0x0322_0000_u32.to_le_bytes()).unwrap();
    bench.write(0x6932, 1, &[1]).unwrap();
    bench.write(0x6000, 0, &[1, 0]).unwrap();
    (0..2).for_each(|_| measure(&mut bench));
    let kilopascal = i32::from_le_bytes(bench.read(0x9930, 1).unwrap().try_into().unwrap());
    assert!((kilopascal - 2500).abs() <= 1, "{kilopascal}");
    // In the opposite direction the first step has the highest position.
    assert_eq!(bench.read(0x6004, 0), Ok((4096_u32 * 4096 - 1 - 300).to_le_bytes().to_vec()));
    assert_eq!(bench.write(0x6925, 1, b"zero"), Ok(()));
    measure(&mut bench);
    let bar = f32::from_le_bytes(bench.read(0x6930, 1).unwrap().try_into().unwrap());
    assert!(bar.abs() < 1e-3, "{bar}");
    assert_eq!(bench.write(0x6931, 2, &0x004E_0000_u32.to_le_bytes()), Err(0x0609_0030));
}

#[test]
fn each_device_has_its_type_and_that_of_the_encoder_follows_its_sensor() {
    let mut bench = booted();
    bench.write(0x2100, 1, &[8]).unwrap();
    bench.write(0x1010, 1, b"save").unwrap();
    let mut bench = bench.power_cycled();
    let types = [0x1000, 0x67FF, 0x6FFF].map(|index| bench.read(index, 0).unwrap());
    assert_eq!(types, [0xFFFF_0196_u32, 0x0008_0196, 0x0002_0194].map(|code| code.to_le_bytes().to_vec()));
}

#[test]
fn a_broken_sensor_of_each_device_has_its_own_flag() {
    let mut bench = booted();
    let mut broken = raw(0.0, 298.15);
    broken.pressure = 100;
    bench.sample(&broken);
    assert_eq!(bench.read(0x3000, 1), Ok(vec![1 << 5, 0, 0, 0]));
    // An SSI encoder without readings.
    bench.write(0x2100, 1, &[2]).unwrap();
    (0..5).for_each(|_| bench.sample(&broken));
    assert_eq!(bench.read(0x3000, 1), Ok(vec![1 << 5, 1, 0, 0]));
    assert_eq!(bench.read(0x1002, 0), Ok(vec![5, 0, 0, 0]));
    let details: Vec<u8> =
        bench.take().iter().filter(|(id, _)| *id == 0x80 + u16::from(ID)).map(|(_, data)| data[3]).collect();
    assert_eq!(details, [0, 1], "both are 5006h");
}
