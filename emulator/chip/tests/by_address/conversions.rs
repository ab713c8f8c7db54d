//! TIM3, ADC1 and DMA2 with the settings of the firmware: four channels at 16 kHz into a circular buffer.

use canbus::Time;
use chip::Peripherals;
use chip::plant::{Fault, FaultKind, Signal};

use crate::support::{AHB1ENR, APB1ENR, APB2ENR, Rig};

const TIM3: u32 = 0x4000_0400;
const ADC: u32 = 0x4001_2000;
const SR: u32 = ADC;
const CR1: u32 = ADC + 0x04;
const CR2: u32 = ADC + 0x08;
const SMPR1: u32 = ADC + 0x0C;
const SMPR2: u32 = ADC + 0x10;
const SQR1: u32 = ADC + 0x2C;
const SQR3: u32 = ADC + 0x34;
const DR: u32 = ADC + 0x4C;
const CCR: u32 = ADC + 0x304;
const DMA2: u32 = 0x4002_6400;
const LISR: u32 = DMA2;
const LIFCR: u32 = DMA2 + 0x08;
const S0CR: u32 = DMA2 + 0x10;
const S0NDTR: u32 = DMA2 + 0x14;
const S0PAR: u32 = DMA2 + 0x18;
const S0M0AR: u32 = DMA2 + 0x1C;
const S0M1AR: u32 = DMA2 + 0x20;

const BUFFER: u32 = 0x2000_4000;
const DMA_IRQ: u8 = 56;
const ADC_IRQ: u8 = 18;
/// One cycle of the ADC clock: PCLK2 of 72 MHz over 4.
const CYCLE: u64 = 56_000;
/// The sampling period: 16 kHz.
const PERIOD: u64 = Time::PER_SECOND / 16_000;
/// End of the sample time of channels 0, 1, 18 and 17: 28, 28, 480 and 480 cycles of sampling, 12 of conversion each.
const SAMPLED: [u64; 4] = [28, 40 + 28, 80 + 480, 80 + 492 + 480];
/// Cycles from the trigger to the start of the sequence.
const LATENCY: u64 = 2;
const ADON: u32 = 1;
const SWSTART: u32 = 1 << 30;

const CIRCULAR: u32 = 1 << 11 | 1 << 13 | 1 << 10 | 1 << 8;
const HALF_AND_FULL: u32 = 1 << 3 | 1 << 4;
const ERROR: u32 = 1 << 2;

fn rig() -> Rig {
    let mut rig = Rig::new();
    rig.firmware_clocks();
    rig.set(AHB1ENR, 1 << 22);
    rig.set(APB1ENR, 1 << 1);
    rig.set(APB2ENR, 1 << 8);
    rig.write(CCR, 1 << 16 | 1 << 23);
    rig.write(CR2, ADON);
    rig.wait(Time::from_micros(10));
    rig
}

/// Starts sampling with `items` in the buffer; returns the start of the timer.
fn start(rig: &mut Rig, items: u32, stream: u32) -> Time {
    rig.write(SMPR1, 7 << 21 | 7 << 24);
    rig.write(SMPR2, 2 | 2 << 3);
    rig.write(SQR1, 3 << 20);
    rig.write(SQR3, 1 << 5 | 18 << 10 | 17 << 15);
    rig.write(CR1, 1 << 8);
    rig.write(S0PAR, DR);
    rig.write(S0M0AR, BUFFER);
    rig.write(S0NDTR, items);
    rig.write(S0CR, stream | 1);
    rig.write(CR2, ADON | 1 << 8 | 1 << 9 | 8 << 24 | 1 << 28);
    rig.write(TIM3 + 0x2C, 4499);
    rig.write(TIM3 + 0x04, 2 << 4);
    rig.write(TIM3, 1);
    rig.now
}

/// The instant at which conversion `n` samples its voltage.
fn sampled(start: Time, n: u64) -> Time {
    start + Time(PERIOD * (n / 4 + 1) + (LATENCY + SAMPLED[(n % 4) as usize]) * CYCLE)
}

/// The code of a ratio of the transducer's supply, at 5 V and behind the divider.
fn divided(ratio: f64) -> u16 {
    code(ratio * 5.0 * 0.6 / 3.3)
}

fn code(ratio: f64) -> u16 {
    (ratio * 4096.0).round() as u16
}

#[test]
fn a_block_holds_the_value_of_each_conversion_s_own_instant() {
    let mut rig = rig();
    let ramp = Signal::Ramp { from: 0.0, to: 1_000_000.0, seconds: 0.004 };
    let set = rig.now;
    rig.chip.plant_mut(set).set_pressure(ramp.clone(), set);
    let start = start(&mut rig, 128, CIRCULAR | HALF_AND_FULL);
    let half = rig.run_to_irq(DMA_IRQ, Time::from_millis(5)).expect("the half transfer");
    assert_eq!(half, sampled(start, 63) + Time(12 * CYCLE), "the end of conversion 64");
    for n in 0..64 {
        let value = rig.half_word(BUFFER + n as u32 * 2);
        let expected = match n % 4 {
            0 => divided(0.1 + 0.8 * ramp.at(sampled(start, n) - set) / 1_000_000.0),
            1 => divided(1.0),
            2 => (959.0_f64 - 5.0 * 248.0 / 80.0).round() as u16,
            _ => 1502,
        };
        assert_eq!(value, expected, "conversion {n}");
    }
    assert_eq!(rig.half_word(BUFFER + 128), 0xFFFF, "the second half is still empty");
    assert_eq!(rig.chip.unmodelled(), []);
}

#[test]
fn half_and_full_transfers_come_every_millisecond() {
    let mut rig = rig();
    let start = start(&mut rig, 128, CIRCULAR | HALF_AND_FULL);
    let first = sampled(start, 63) + Time(12 * CYCLE);
    for n in 0..10 {
        assert_eq!(rig.run_to_irq(DMA_IRQ, Time::from_millis(5)), Some(first + Time::from_millis(n)));
        let flags = rig.read(LISR);
        assert_eq!(flags, if n % 2 == 0 { 1 << 4 } else { 1 << 5 }, "half and full in turn");
        assert_eq!(rig.read(S0NDTR), if n % 2 == 0 { 64 } else { 128 });
        rig.write(LIFCR, flags);
        assert!(!rig.irq(DMA_IRQ));
    }
}

#[test]
fn only_half_and_full_transfers_wake_the_chip() {
    let mut rig = rig();
    let start = start(&mut rig, 128, CIRCULAR | HALF_AND_FULL);
    let mut deadlines = 0;
    while rig.now < start + Time::from_millis(100) {
        let next = rig.chip.deadline();
        rig.run_to(next);
        rig.write(LIFCR, 0x3D);
        deadlines += 1;
    }
    assert!(deadlines <= 102, "{deadlines} in 100 ms");
}

#[test]
fn to_look_more_often_changes_nothing() {
    let run = |look: bool| {
        let mut rig = rig();
        let noise = Signal::Noise { mean: 500_000.0, sigma: 50_000.0, seed: 1 };
        rig.chip.plant_mut(rig.now).set_pressure(noise, rig.now);
        let end = start(&mut rig, 128, CIRCULAR | HALF_AND_FULL) + Time::from_micros(2500);
        let mut raised = Vec::new();
        while rig.now < end {
            let step = if look { Time(13_777) } else { Time::NEVER };
            let next = rig.chip.deadline().min(rig.now + step).min(end);
            rig.run_to(next);
            if rig.irq(DMA_IRQ) {
                raised.push(rig.now);
                rig.write(LIFCR, 0x3D);
            }
            if look {
                rig.read(S0NDTR);
                rig.read(SR);
                rig.read(TIM3 + 0x24);
            }
        }
        rig.read(S0NDTR);
        (raised, rig.memory.0)
    };
    let (raised, memory) = run(false);
    assert_eq!(raised.len(), 2);
    assert_eq!((raised, memory), run(true));
}

#[test]
fn a_stimulus_changed_on_the_way_changes_later_conversions_only() {
    let mut rig = rig();
    let start = start(&mut rig, 128, CIRCULAR | HALF_AND_FULL);
    rig.run_to(start + Time(PERIOD * 8 + PERIOD / 2));
    let now = rig.now;
    rig.chip.plant_mut(now).set_pressure(Signal::Constant(1_000_000.0), now);
    rig.run_to_irq(DMA_IRQ, Time::from_millis(5));
    let values: Vec<u16> = (0..16).map(|n| rig.half_word(BUFFER + n * 8)).collect();
    assert_eq!(values[..8], [divided(0.1); 8]);
    assert_eq!(values[8..], [divided(0.9); 8]);
}

#[test]
fn faults_of_the_sensor_reach_the_converter() {
    let mut rig = rig();
    let now = rig.now;
    for fault in ["open-sensor@1..2", "rail-high@2..3", "rail-low@3"] {
        rig.chip.plant_mut(now).add_fault(fault.parse::<Fault>().expect("a fault"));
    }
    let reading = |rig: &mut Rig, millis| {
        rig.run_to(Time::from_millis(millis));
        rig.write(CR2, ADON | SWSTART);
        rig.wait(Time::from_micros(10));
        rig.read(DR)
    };
    let values = [500, 1500, 2500, 3500].map(|millis| reading(&mut rig, millis));
    assert_eq!(values, [372, 0, 3724, 0]);
}

#[test]
fn a_low_supply_shows_on_both_inputs() {
    let mut rig = rig();
    let now = rig.now;
    rig.chip.plant_mut(now).rails.transducer = 4.5;
    rig.chip.plant_mut(now).set_pressure(Signal::Constant(500_000.0), now);
    rig.write(CR2, ADON | SWSTART);
    rig.wait(Time::from_micros(10));
    assert_eq!(rig.read(DR), divided(0.5 * 0.9).into());
    rig.write(SQR3, 1);
    rig.write(CR2, ADON | SWSTART);
    rig.wait(Time::from_micros(10));
    assert_eq!(rig.read(DR), divided(0.9).into());
}

#[test]
fn a_thermistor_divides_vdda_and_may_be_broken() {
    let mut rig = rig();
    let now = rig.now;
    let after = |millis| now + Time::from_millis(millis);
    for (kind, from, until) in [(FaultKind::OpenThermistor, 10, 20), (FaultKind::ShortedThermistor, 20, 30)] {
        rig.chip.plant_mut(now).add_fault(Fault { kind, from: after(from), until: after(until) });
    }
    rig.write(SQR3, 12);
    // The thermistor has 10 kohm at 25 degrees Celsius; with beta 3950 K it has 33.6 kohm at 0 degrees.
    for (kelvin, ratio, millis) in [
        (298.15, 0.5, 1),
        (273.15, 0.770_751, 2),
        (298.15, 4095.0 / 4096.0, 15),
        (298.15, 0.0, 25),
        (298.15, 0.5, 35),
    ] {
        rig.wait(after(millis) - rig.now);
        let now = rig.now;
        rig.chip.plant_mut(now).set_thermistor(Signal::Constant(kelvin), now);
        rig.write(CR2, ADON | SWSTART);
        rig.wait(Time::from_micros(10));
        assert_eq!(rig.read(DR), code(ratio).into(), "after {millis} ms");
    }
}

#[test]
fn a_conversion_takes_its_cycles_and_raises_its_interrupt() {
    let mut rig = rig();
    rig.write(CR1, 1 << 5);
    rig.write(SMPR2, 3);
    rig.write(CR2, ADON | SWSTART);
    let start = rig.now;
    assert_eq!(rig.read(SR), 1 << 4, "STRT");
    assert_eq!(rig.run_to_irq(ADC_IRQ, Time::from_millis(1)), Some(start + Time((56 + 12) * CYCLE)));
    assert_eq!(rig.read(SR) >> 1 & 1, 1, "EOC");
    rig.read(DR);
    assert_eq!(rig.read(SR) >> 1 & 1, 0, "reading DR clears EOC");
    assert!(!rig.irq(ADC_IRQ));
    assert_eq!(rig.chip.unmodelled(), []);
}

#[test]
fn resolution_and_alignment_shape_the_code() {
    let mut rig = rig();
    let now = rig.now;
    rig.chip.plant_mut(now).set_pressure(Signal::Constant(500_000.0), now);
    rig.write(CR1, 2 << 24);
    rig.write(CR2, ADON | SWSTART);
    rig.wait(Time((3 + 8) * CYCLE));
    assert_eq!(rig.read(SR) >> 1 & 1, 1, "eight bits take eight cycles");
    assert_eq!(rig.read(DR), 116);
    rig.write(CR1, 0);
    rig.write(CR2, ADON | SWSTART | 1 << 11);
    rig.wait(Time::from_micros(10));
    assert_eq!(rig.read(DR), 1862 << 4);
}

#[test]
fn unmodelled_functions_of_the_converter_are_recorded() {
    let mut rig = rig();
    rig.write(CR1, 1 << 23);
    rig.write(CR2, ADON | 1 << 22);
    rig.write(ADC + 0x38, 0);
    let names: Vec<String> = rig.chip.unmodelled().into_iter().map(|entry| entry.name).collect();
    assert_eq!(names, ["ADC1+0x04", "ADC1+0x08", "ADC1+0x38"]);
}

#[test]
fn without_tsvrefe_the_internal_sensors_are_silent() {
    let mut rig = rig();
    rig.write(CCR, 1 << 16);
    rig.write(SQR3, 17);
    rig.write(CR2, ADON | SWSTART);
    rig.wait(Time::from_micros(30));
    assert_eq!(rig.read(DR), 0);
}

#[test]
fn an_unread_value_is_an_overrun() {
    let mut rig = rig();
    start(&mut rig, 6, CIRCULAR & !(1 << 8));
    rig.wait(Time::from_millis(1));
    assert_eq!(rig.read(S0CR) & 1, 0, "the stream ended after six");
    assert_eq!(rig.read(SR) >> 5 & 1, 1, "OVR");
    assert_eq!(rig.read(LISR), 1 << 4 | 1 << 5);
}

#[test]
fn an_overrun_ends_when_cleared_and_the_stream_runs_again() {
    let mut rig = rig();
    start(&mut rig, 4, CIRCULAR & !(1 << 8));
    rig.wait(Time::from_millis(1));
    rig.write(LIFCR, 0x3D);
    rig.write(S0NDTR, 8);
    rig.write(S0CR, CIRCULAR | 1);
    rig.write(SR, 0);
    rig.wait(Time::from_millis(1));
    assert_eq!(rig.read(SR) >> 5 & 1, 0);
    assert_eq!(rig.read(LISR), 1 << 4 | 1 << 5);
}

#[test]
fn without_dds_requests_end_with_the_stream() {
    let mut rig = rig();
    start(&mut rig, 8, CIRCULAR);
    rig.write(CR2, ADON | 1 << 8 | 8 << 24 | 1 << 28);
    rig.wait(Time::from_millis(1));
    assert_eq!(rig.read(S0NDTR), 8, "one round");
    assert_eq!(rig.read(SR) >> 5 & 1, 1, "what follows is not fetched");
}

#[test]
fn double_buffer_mode_swaps_the_memories() {
    let mut rig = rig();
    let second = BUFFER + 0x1000;
    rig.write(S0M1AR, second);
    start(&mut rig, 4, CIRCULAR | HALF_AND_FULL | 1 << 18);
    rig.wait(Time(PERIOD * 2));
    assert_eq!(rig.read(S0CR) >> 19 & 1, 1, "CT");
    assert_eq!((rig.half_word(BUFFER + 6), rig.half_word(second)), (1502, 0xFFFF));
    rig.wait(Time(PERIOD));
    assert_eq!(rig.half_word(second + 6), 1502);
    assert_eq!(rig.read(S0CR) >> 19 & 1, 0);
}

#[test]
fn a_transfer_to_nowhere_is_a_transfer_error() {
    let mut rig = rig();
    let start = start(&mut rig, 128, 0);
    rig.write(S0CR, 0);
    rig.write(LIFCR, 0x3D);
    // The CCM of the F405; no memory at all on the F446.
    rig.write(S0M0AR, 0x1000_0000);
    rig.write(S0CR, CIRCULAR | ERROR | 1);
    assert_eq!(rig.run_to_irq(DMA_IRQ, Time::from_millis(1)), Some(sampled(start, 0) + Time(12 * CYCLE)));
    assert_eq!(rig.read(LISR), 1 << 3);
    assert_eq!(rig.read(S0CR) & 1, 0);
}

#[test]
fn a_stream_stopped_by_software_says_so() {
    let mut rig = rig();
    start(&mut rig, 128, CIRCULAR);
    rig.write(S0CR, CIRCULAR);
    assert_eq!(rig.read(LISR), 1 << 5);
}
