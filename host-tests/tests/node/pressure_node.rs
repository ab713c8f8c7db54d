//! The complete pressure node: from converter readings to frames, the effect of parameters, faults.

use canopen::{Duration, Frame, Instant};
use host_tests::bench::{Bench, ID, Queue, intact, raw, setup};
use node::fault::UNEXPECTED_RESET;
use node::{Action, BusEvent, Measurement, Personality, Protocol, State};
use profiles::board::{Inputs, RawEncoder};

const TPDO1: u16 = 0x180 + ID as u16;
const EMCY: u16 = 0x080 + ID as u16;

fn operational() -> Bench {
    let mut bench = Bench::booted();
    bench.nmt(1);
    bench.take();
    bench
}

fn real(bench: &mut Bench, index: u16, sub: u8) -> f32 {
    f32::from_le_bytes(bench.read(index, sub).unwrap().try_into().unwrap())
}

/// EMCY messages sent since the last call, as code and error register.
fn emergencies(bench: &mut Bench) -> Vec<(u16, u8)> {
    let messages = bench.take().into_iter().filter(|(id, _)| *id == EMCY);
    messages.map(|(_, data)| (u16::from_le_bytes([data[0], data[1]]), data[2])).collect()
}

fn is_close(value: f32, expected: f32, tolerance: f32) -> bool {
    (value - expected).abs() <= tolerance
}

#[test]
fn tpdo1_carries_the_live_pressure_and_temperature() {
    let mut bench = operational();
    for pascal in [0.0, 250_000.0, 1_000_000.0] {
        bench.sample(&raw(pascal, 298.15));
        bench.take();
        (0..1000).for_each(|_| bench.sample(&raw(pascal, 298.15)));
        let frames: Vec<_> = bench.take().into_iter().filter(|(id, _)| *id == TPDO1).collect();
        let [(_, data)] = &frames[..] else { panic!("{frames:?}") };
        let bar = f32::from_le_bytes(data[..4].try_into().unwrap());
        let celsius = f32::from_le_bytes(data[4..].try_into().unwrap());
        // The tolerance is one step of the sum of 16 conversions.
        assert!(is_close(bar, pascal as f32 / 100_000.0, 10.0 / (0.8 * 64_000.0)), "{bar}");
        assert!(is_close(celsius, 25.0, 80.0 / (16.0 * 270.0)), "{celsius}");
    }
}

#[test]
fn a_node_started_at_its_boot_up_sends_its_first_measurement() {
    let setup = setup();
    let mut protocol = Protocol::new(&setup);
    let mut measurement = Measurement::new(setup.personality, &intact());
    let (mut out, now) = (Queue::default(), Instant(0));
    measurement.apply(&protocol.load_defaults());
    let analogue = raw(250_000.0, 298.15);
    let inputs = Inputs { analogue, position: RawEncoder::default(), digital: [false; 2] };
    measurement.update(&inputs, protocol.snapshot_mut());
    let _ = protocol.publish(now, &mut out);
    let _ = protocol.start(now, &mut out);
    let _ = protocol.on_process_frame(&Frame::new(0, &[1, ID]).unwrap(), now, &mut out);
    let last = out.0.last().unwrap();
    assert_eq!(last.id(), TPDO1);
    let bar = f32::from_le_bytes(last.data()[..4].try_into().unwrap());
    assert!(is_close(bar, 2.5, 0.001), "{bar}");
}

#[test]
fn parameters_act_from_the_next_sample_on() {
    let mut bench = Bench::booted();
    bench.write(0x6131, 1, &0x0322_0000_u32.to_le_bytes()).unwrap();
    bench.write(0x6126, 1, &2.0_f32.to_le_bytes()).unwrap();
    bench.write(0x6132, 1, &[1]).unwrap();
    bench.sample(&raw(500_000.0, 298.15));
    assert!(is_close(real(&mut bench, 0x6130, 1), 1000.0, 0.1));
    assert_eq!(bench.read(0x7130, 1), Ok(10_000_i16.to_le_bytes().to_vec()));
    assert_eq!(bench.read(0x9130, 1), Ok(10_000_i32.to_le_bytes().to_vec()));
    assert!(is_close(real(&mut bench, 0x6100, 1), 500_000.0, 1.0));
}

#[test]
fn values_that_cannot_be_parameters_are_refused() {
    let mut bench = Bench::booted();
    for (sub, code) in [(1, 0x002D_0000_u32), (2, 0x004E_0000), (1, 0x134E_0000), (1, 0x004E_0001)] {
        assert_eq!(bench.write(0x6131, sub, &code.to_le_bytes()), Err(0x0609_0030));
    }
    assert_eq!(bench.write(0x61A1, 1, &[0]), Err(0x0609_0032));
    assert_eq!(bench.write(0x6132, 2, &[39]), Err(0x0609_0031));
    assert_eq!(bench.write(0x61A0, 1, &[255]), Ok(()));
    assert_eq!(bench.write(0x6124, 1, &f32::NAN.to_le_bytes()), Err(0x0609_0030));
}

#[test]
fn autozero_moves_the_offset_until_the_value_is_zero() {
    let mut bench = Bench::booted();
    bench.write(0x6124, 1, &0.5_f32.to_le_bytes()).unwrap();
    bench.sample(&raw(123_456.0, 298.15));
    assert_eq!(bench.write(0x6125, 1, b"zerO"), Err(0x0800_0020));
    assert_eq!(bench.write(0x6125, 1, b"zero"), Ok(()));
    bench.sample(&raw(123_456.0, 298.15));
    assert!(is_close(real(&mut bench, 0x6130, 1), 0.0, 1e-6));
    assert!(is_close(real(&mut bench, 0x6124, 1), -1.23456, 1e-3));
    assert!(real(&mut bench, 0x6130, 2) > 20.0);
}

/// The former offset leaves no rest, however large the value is.
#[test]
fn autozero_gives_exactly_zero_after_an_old_offset() {
    let mut bench = Bench::booted();
    for offset in [123.0_f32, -0.1, 1e-3] {
        bench.write(0x6124, 1, &offset.to_le_bytes()).unwrap();
        bench.sample(&raw(876_543.0, 298.15));
        bench.write(0x6125, 1, b"zero").unwrap();
        bench.sample(&raw(876_543.0, 298.15));
        assert_eq!(real(&mut bench, 0x6130, 1), 0.0, "{offset}");
    }
}

fn span(bench: &mut Bench) -> (f32, f32) {
    (real(bench, 0x6148, 1), real(bench, 0x6149, 1))
}

/// CMP 8271 gives $PRESSURE MIN and $PRESSURE MAX as the defaults of 6148h and 6149h.
#[test]
fn the_default_span_is_the_range_of_the_transducer() {
    let mut bench = Bench::booted();
    assert_eq!(span(&mut bench), (0.0, 10.0));
    bench.write(0x2203, 0, b"cali").unwrap();
    bench.write(0x2200, 2, &40e6_f32.to_le_bytes()).unwrap();
    bench.write(0x2200, 1, &(-1e5_f32).to_le_bytes()).unwrap();
    assert_eq!(span(&mut bench), (-1.0, 400.0));
    bench.write(0x2204, 0, b"save").unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!(span(&mut bench), (-1.0, 400.0));
    bench.sample(&raw(250_000.0, 298.15));
    assert_eq!(bench.read(0x6150, 1).unwrap()[0], 0);

    // A span that a client has chosen stays.
    bench.write(0x6149, 1, &10_f32.to_le_bytes()).unwrap();
    bench.write(0x1010, 3, b"save").unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!(span(&mut bench), (-1.0, 10.0));
    bench.write(0x2203, 0, b"cali").unwrap();
    bench.write(0x2200, 2, &2e6_f32.to_le_bytes()).unwrap();
    assert_eq!(span(&mut bench), (-1.0, 10.0));
    bench.write(0x1011, 3, b"load").unwrap();
    let mut bench = bench.power_cycled();
    assert_eq!(span(&mut bench), (-1.0, 400.0), "2 MPa was not saved");
}

/// An absolute pressure in Pa does not fit INTEGER16, but the sensor is well.
#[test]
fn autozero_is_possible_though_an_integer_is_clipped() {
    let mut bench = Bench::booted();
    bench.write(0x6131, 1, &0x0022_0000_u32.to_le_bytes()).unwrap();
    (0..4).for_each(|_| bench.sample(&raw(250_000.0, 298.15)));
    assert_eq!(bench.read(0x6150, 1).unwrap()[0] & 1, 1, "clipped");
    assert_eq!(bench.write(0x6125, 1, b"zero"), Ok(()));
    bench.sample(&raw(250_000.0, 298.15));
    assert!(is_close(real(&mut bench, 0x6130, 1), 0.0, 0.1));
    assert_eq!(bench.read(0x6150, 1).unwrap()[0] & 1, 0);
}

#[test]
fn autozero_needs_a_valid_value() {
    let mut bench = Bench::booted();
    let mut broken = raw(0.0, 298.15);
    broken.pressure = 100;
    bench.sample(&broken);
    assert_eq!(bench.write(0x6125, 1, b"zero"), Err(0x0800_0022));
    assert_eq!(bench.write(0x6125, 2, b"zero"), Ok(()));
}

#[test]
fn a_broken_sensor_is_found_within_a_second_and_signalled_everywhere() {
    let mut bench = operational();
    let intact = raw(100_000.0, 298.15);
    let mut broken = intact;
    broken.pressure = 100;
    bench.sample(&intact);
    (0..999).for_each(|_| bench.sample(&broken));
    assert_eq!(
        (emergencies(&mut bench), bench.read(0x6150, 1)),
        (vec![], Ok(vec![1 | 4])),
        "invalid at once"
    );
    bench.sample(&broken);
    assert_eq!(emergencies(&mut bench), [(0x5006, 1)]);
    assert_eq!(bench.read(0x6150, 1), Ok(vec![1 | 4]));
    assert_eq!(bench.read(0x3000, 1), Ok(vec![1 << 5, 0, 0, 0]));
    assert_eq!(bench.read(0x1002, 0), Ok(vec![5, 0, 0, 0]));
    assert_eq!(bench.read(0x1001, 0), Ok(vec![1]));
    assert_eq!(bench.read(0x1003, 1), Ok(vec![0x06, 0x50, 0, 0]));
    assert_eq!(bench.protocol.state(), State::PreOperational);
    (0..1000).for_each(|_| bench.sample(&intact));
    assert_eq!((emergencies(&mut bench), bench.read(0x6150, 1)), (vec![], Ok(vec![0])));
    (0..100).for_each(|_| bench.sample(&intact));
    assert_eq!(emergencies(&mut bench), [(0, 0)], "0.1 s after the fault");
    assert_eq!(bench.read(0x3000, 1), Ok(vec![0; 4]));
    assert_eq!(bench.read(0x1002, 0), Ok(vec![0; 4]));
    assert_eq!(bench.read(0x1003, 0), Ok(vec![1]));
}

#[test]
fn rails_are_found_at_once() {
    let mut bench = Bench::booted();
    bench.write(0x1029, 2, &[1]).unwrap();
    bench.nmt(1);
    bench.sample(&raw(0.0, 298.15));
    bench.take();
    let mut rail = raw(0.0, 298.15);
    (rail.pressure, rail.temperature) = (16 * 4095, 0);
    bench.sample(&rail);
    assert_eq!(emergencies(&mut bench), [(0x8002, 1), (0x8001, 1)]);
    assert_eq!(bench.read(0x3000, 1), Ok(vec![1 << 3 | 1 << 4, 0, 0, 0]));
    assert_eq!(bench.protocol.state(), State::Operational);
    bench.sample(&rail);
    assert!(real(&mut bench, 0x6100, 2).abs() < f32::EPSILON);
    assert_eq!(bench.read(0x7130, 2), Ok((-273_i16).to_le_bytes().to_vec()));
}

#[test]
fn a_chip_without_calibration_measures_no_temperature() {
    let mut bench = Bench::booted_without_chip_calibration();
    bench.sample(&raw(0.0, 298.15));
    assert_eq!(emergencies(&mut bench), [(0x8001, 1)]);
    assert!(real(&mut bench, 0x6100, 2).abs() < f32::EPSILON);
    assert_eq!(bench.read(0x7130, 2), Ok((-273_i16).to_le_bytes().to_vec()));
}

#[test]
fn a_transducer_without_supply_is_a_break_and_not_a_division_by_zero() {
    let mut bench = Bench::booted();
    let mut dead = raw(0.0, 298.15);
    (dead.supply, dead.reference) = (0, 0);
    bench.sample(&dead);
    assert!(real(&mut bench, 0x6130, 1).is_finite() && real(&mut bench, 0x6130, 2).is_finite());
    assert_eq!(emergencies(&mut bench), [(0x5006, 1), (0x8001, 1)]);
}

#[test]
fn the_span_sets_the_overload_bits() {
    let mut bench = Bench::booted();
    for (pascal, status) in [(-10_000.0, 4), (10_000.0, 0), (1_050_000.0, 2)] {
        bench.sample(&raw(pascal, 298.15));
        assert_eq!(bench.read(0x6150, 1), Ok(vec![status]));
    }
}

#[test]
fn flags_survive_a_reset_with_their_faults() {
    let mut bench = Bench::booted();
    bench.set_fault(UNEXPECTED_RESET, true);
    assert_eq!(emergencies(&mut bench), [(0x6101, 1)]);
    bench.nmt(0x81);
    while bench.take_action().is_some_and(|action| action != Action::ResetNode) {}
    bench.restart();
    assert_eq!(emergencies(&mut bench), [(0x6101, 1)]);
    assert_eq!(bench.read(0x3000, 3), Ok(vec![1 << 6, 0, 0, 0]));
    assert_eq!(bench.read(0x1002, 0), Ok(vec![4, 0, 0, 0]));
}

#[test]
fn bus_off_applies_the_communication_error_behaviour_and_is_reported_afterwards() {
    let mut bench = operational();
    bench.bus_event(BusEvent::Passive);
    assert_eq!(emergencies(&mut bench), [(0x8120, 1)]);
    bench.bus_event(BusEvent::BusOff);
    assert_eq!(bench.protocol.state(), State::PreOperational);
    bench.bus_event(BusEvent::Recovered);
    assert_eq!(emergencies(&mut bench), [(0x8140, 1), (0, 0)]);
}

/// The manual of the CMP 8271 has only bit 0; the "overall error" of 1002h includes communication.
#[test]
fn a_missing_heartbeat_sets_bit_0_of_the_error_register_only() {
    let mut bench = operational();
    bench.write(0x1016, 1, &0x0005_0005_u32.to_le_bytes()).unwrap();
    bench.receive(&Frame::new(0x705, &[5]).unwrap());
    (0..10).for_each(|_| bench.sample(&raw(100_000.0, 298.15)));
    assert_eq!(emergencies(&mut bench), [(0x8130, 1)]);
    assert_eq!(bench.read(0x1001, 0), Ok(vec![1]));
    assert_eq!(bench.read(0x1002, 0), Ok(vec![4, 0, 0, 0]));
    bench.receive(&Frame::new(0x705, &[5]).unwrap());
    assert_eq!(bench.read(0x1002, 0), Ok(vec![0; 4]));
}

#[test]
fn a_warning_says_nothing_and_an_overrun_is_an_event() {
    let mut bench = operational();
    bench.bus_event(BusEvent::Warning);
    assert_eq!(emergencies(&mut bench), []);
    bench.bus_event(BusEvent::Overrun);
    assert_eq!(emergencies(&mut bench), [(0x8110, 1)]);
    bench.now = bench.now + Duration::from_millis(500);
    bench.poll();
    assert_eq!(emergencies(&mut bench), [(0, 0)], "no frame was lost for half a second");
    assert_eq!(bench.protocol.state(), State::Operational);
}

#[test]
fn the_device_returns_the_actions_of_the_firmware() {
    let mut bench = Bench::booted();
    assert_eq!(bench.take_action(), Some(Action::Identifiers));
    assert_eq!(bench.take_action(), None);
    bench.write(0x1005, 0, &[0x90, 0, 0, 0]).unwrap();
    assert_eq!(bench.take_action(), Some(Action::Identifiers));
    bench.nmt(0x82);
    assert_eq!(bench.take_action(), Some(Action::ResetCommunication));
    assert_eq!(bench.take_action(), None);
}

#[test]
fn identifiers_are_those_of_the_services_that_exist() {
    let bench = Bench::booted();
    assert_eq!(bench.protocol.process_ids().collect::<Vec<_>>(), [0, 0x80, TPDO1]);
    assert_eq!(bench.protocol.service_ids().collect::<Vec<_>>(), [0x7E5, 0x600 + u16::from(ID)]);
}

#[test]
fn a_remote_frame_is_answered_with_the_live_values() {
    let mut bench = operational();
    bench.sample(&raw(250_000.0, 298.15));
    bench.take();
    bench.receive(&Frame::remote(TPDO1, 8).unwrap());
    let frames = bench.take();
    let pressure = bench.read(0x6130, 1).unwrap();
    assert!(matches!(&frames[..], [(TPDO1, data)] if data[..4] == pressure[..]), "{frames:?}");
}

fn bits(bench: &mut Bench, index: u16, sub: u8) -> u8 {
    bench.read(index, sub).unwrap()[0]
}

fn measure(bench: &mut Bench, bar: f64) {
    bench.sample(&raw(bar * 100_000.0, 298.15));
}

#[test]
fn a_tare_is_subtracted_until_the_next_autozero() {
    let mut bench = Bench::booted();
    bench.write(0x6124, 1, &0.1_f32.to_le_bytes()).unwrap();
    measure(&mut bench, 3.3);
    assert_eq!(bench.write(0x6139, 1, b"zero"), Err(0x0800_0020));
    bench.write(0x6139, 1, b"tare").unwrap();
    measure(&mut bench, 3.3);
    assert_eq!(real(&mut bench, 0x6130, 1), 0.0);
    assert!(is_close(real(&mut bench, 0x2210, 1), 3.4, 1e-3) && real(&mut bench, 0x6124, 1) == 0.1);
    measure(&mut bench, 4.3);
    assert!(is_close(real(&mut bench, 0x6130, 1), 1.0, 1e-3));
    bench.write(0x6125, 1, b"zero").unwrap();
    measure(&mut bench, 4.3);
    assert_eq!((real(&mut bench, 0x6130, 1), real(&mut bench, 0x2210, 1)), (0.0, 0.0));
}

#[test]
fn lowest_and_highest_value_are_kept_until_they_are_restarted() {
    let mut bench = Bench::booted();
    for bar in [2.0, 5.0, 1.0, 3.0] {
        measure(&mut bench, bar);
    }
    let mut broken = raw(0.0, 298.15);
    broken.pressure = 0;
    bench.sample(&broken);
    let extremes = |bench: &mut Bench| (real(bench, 0x2211, 1).round(), real(bench, 0x2212, 1).round());
    assert_eq!(extremes(&mut bench), (1.0, 5.0), "a value at a rail does not count");
    (0..1100).for_each(|_| measure(&mut bench, 3.0));
    bench.write(0x2213, 0, &[1]).unwrap();
    measure(&mut bench, 4.0);
    assert_eq!(extremes(&mut bench), (4.0, 4.0));
    bench.write(0x6131, 1, &0x0322_0000_u32.to_le_bytes()).unwrap();
    measure(&mut bench, 4.0);
    measure(&mut bench, 4.0);
    assert!(real(&mut bench, 0x2211, 1) >= 4.0, "another unit begins anew");
}

/// 2211h and 2212h of a channel.
fn extremes_of(bench: &mut Bench, sub: u8) -> [f32; 2] {
    [0x2211, 0x2212].map(|index| real(bench, index, sub).round())
}

/// A restart, and a write to a parameter of a process value, concern the channels that they name: the other one keeps its
/// extremes.
#[test]
fn a_restart_of_the_extremes_of_one_channel_keeps_those_of_the_other_one() {
    let real = |value: f32| value.to_le_bytes().to_vec();
    for (personality, shift, id) in
        [(Personality::Pressure, 0, 1), (Personality::Combined, 0x800, 77), (Personality::Pressure, 0, 127)]
    {
        let mut writes = vec![
            (0x2213, 0, vec![0], [true, true]),
            (0x2213, 0, vec![1], [false, true]),
            (0x2213, 0, vec![2], [true, false]),
            (0x2213, 0, vec![3], [false, false]),
        ];
        for (sub, kept) in [(1, [false, true]), (2, [true, false])] {
            writes.extend([
                (0x6124 + shift, sub, real(0.0), kept),
                (0x6126 + shift, sub, real(1.0), kept),
                (0x6127 + shift, sub, real(0.0), kept),
                (0x2210, sub, real(0.0), kept),
                (0x6125 + shift, sub, b"zero".to_vec(), kept),
                (0x6139 + shift, sub, b"tare".to_vec(), kept),
            ]);
        }
        writes.push((0x6131 + shift, 1, 0x004E_0000_u32.to_le_bytes().to_vec(), [false, true]));
        writes.push((0x6131 + shift, 2, 0x002D_0000_u32.to_le_bytes().to_vec(), [true, false]));
        for (index, sub, bytes, kept) in writes {
            let mut bench = Bench::booted_at(personality, id);
            for (bar, kelvin) in [(3.0, 298.15), (5.0, 330.15), (3.0, 298.15), (2.0, 290.15), (3.0, 298.15)] {
                (0..5).for_each(|_| bench.sample(&raw(bar * 1e5, kelvin)));
            }
            let before = [1, 2].map(|sub| extremes_of(&mut bench, sub));
            assert!(before.iter().all(|[low, high]| low < high), "{before:?}");
            bench.write(index, sub, &bytes).unwrap();
            (0..10).for_each(|_| bench.sample(&raw(3e5, 298.15)));
            for (channel, (before, kept)) in (1..).zip(before.into_iter().zip(kept)) {
                let after = extremes_of(&mut bench, channel);
                let name = format!("{personality:?}, {index:X}h:{sub} = {bytes:?}, channel {channel}");
                if kept {
                    assert_eq!(after, before, "{name}");
                } else {
                    assert_eq!(after[0], after[1], "{name}");
                }
            }
        }
    }
}

#[test]
fn an_alarm_has_a_hysteresis_and_a_latched_alarm_stays_until_its_reset() {
    let mut bench = Bench::booted();
    assert_eq!(bench.write(0x6503, 1, &0x6150_0108_u32.to_le_bytes()), Err(0x0609_0030));
    for (alarm, kind, action, limit) in [(1, 1, 0, 5.0_f32), (2, 1, 1, 5.0), (3, 2, 0, 2.0)] {
        bench.write(0x6503, alarm, &0x6130_0120_u32.to_le_bytes()).unwrap();
        bench.write(0x6508, alarm, &[kind]).unwrap();
        bench.write(0x6509, alarm, &[action]).unwrap();
        bench.write(0x650A, alarm, &limit.to_le_bytes()).unwrap();
        bench.write(0x650B, alarm, &0.5_f32.to_le_bytes()).unwrap();
    }
    for (bar, states) in [(4.9, 0), (5.1, 3), (4.6, 3), (4.4, 2), (4.9, 2), (1.9, 6), (2.4, 6), (2.6, 2)] {
        measure(&mut bench, bar);
        assert_eq!(bits(&mut bench, 0x6600, 1), states, "{bar}");
        assert_eq!(
            [1, 2, 3, 4].map(|n| bits(&mut bench, 0x650D, n)),
            [1, 2, 4, 8].map(|b| u8::from(states & b != 0))
        );
    }
    assert_eq!(bits(&mut bench, 0x6602, 0), 1);
    bench.write(0x650E, 2, &[1]).unwrap();
    measure(&mut bench, 2.6);
    assert_eq!((bits(&mut bench, 0x6600, 1), bits(&mut bench, 0x6602, 0)), (0, 0));
    for (index, sub, value) in [(0x6610, 0, 1), (0x6611, 1, 2)] {
        measure(&mut bench, 6.0);
        bench.write(index, sub, &[value]).unwrap();
        measure(&mut bench, 6.0);
        assert_eq!(bits(&mut bench, 0x6600, 1), 3, "a reset does not end what is still there");
        measure(&mut bench, 3.0);
        bench.write(index, sub, &[value]).unwrap();
        measure(&mut bench, 3.0);
        assert_eq!(bits(&mut bench, 0x6600, 1), 0, "{index:X}h");
    }
}

#[test]
fn a_threshold_and_a_hysteresis_are_not_negative() {
    for (personality, shift) in [(Personality::Pressure, 0), (Personality::Combined, 0x800)] {
        let mut bench = Bench::booted_as(personality);
        for (index, subs) in [(0x6133, 2), (0x650B, 4)] {
            for sub in 1..=subs {
                let at = (index + shift, sub);
                let before = bench.read(at.0, at.1);
                for value in [-1.0_f32, -1e-30, f32::NAN] {
                    let result = bench.write(at.0, at.1, &value.to_le_bytes());
                    assert_eq!(result, Err(0x0609_0030), "{at:X?} {value}");
                }
                assert_eq!(bench.read(at.0, at.1), before);
                for value in [0.0_f32, 0.5] {
                    assert_eq!(bench.write(at.0, at.1, &value.to_le_bytes()), Ok(()), "{at:X?} {value}");
                }
            }
        }
    }
}

/// 6133h: TPDO 1 of type 255 without its event timer.
#[test]
fn a_tpdo_waits_for_the_interrupt_delta() {
    let mut bench = Bench::booted();
    bench.write(0x1800, 5, &[0, 0]).unwrap();
    for sub in 1..=2 {
        bench.write(0x6133, sub, &0.25_f32.to_le_bytes()).unwrap();
    }
    measure(&mut bench, 1.0);
    bench.nmt(1);
    measure(&mut bench, 1.0);
    bench.take();
    let sent = |bench: &mut Bench| bench.take().iter().filter(|(id, _)| *id == TPDO1).count();
    for step in 0..=20 {
        measure(&mut bench, 1.0 + f64::from(step) * 0.01);
    }
    assert_eq!(sent(&mut bench), 0);
    measure(&mut bench, 1.26);
    assert_eq!(sent(&mut bench), 1);
    measure(&mut bench, 1.1);
    assert_eq!((sent(&mut bench), (real(&mut bench, 0x6130, 1) * 10.0).round()), (0, 11.0));
}
