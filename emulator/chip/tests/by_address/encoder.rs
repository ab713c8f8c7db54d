//! The encoder: TIM4 in encoder mode, the index on PB5.

use canbus::Time;
use chip::plant::{Motion, Signal};

use crate::support::{AHB1ENR, APB1ENR, APB2ENR, Rig};

const TIM3: u32 = 0x4000_0400;
const TIM4: u32 = 0x4000_0800;
const GPIOB: u32 = 0x4002_0400;
const EXTICR2: u32 = 0x4001_3800 + 0x0C;
const EXTI: u32 = 0x4001_3C00;
const TIM4_IRQ: u8 = 30;
const EXTI9_5_IRQ: u8 = 23;
const CR1: u32 = 0x00;
const SMCR: u32 = 0x08;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const CCMR1: u32 = 0x18;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const ARR: u32 = 0x2C;

fn rig() -> Rig {
    let mut rig = Rig::new();
    rig.set(AHB1ENR, 1 << 1);
    rig.set(APB1ENR, 1 << 1 | 1 << 2);
    rig.set(APB2ENR, 1 << 14);
    // PB6 and PB7 to TIM4.
    rig.set(GPIOB, 0b10 << 12 | 0b10 << 14);
    rig.write(GPIOB + 0x20, 2 << 24 | 2 << 28);
    rig
}

fn counting() -> Rig {
    let mut rig = rig();
    rig.write(TIM4 + CCMR1, 1 | 1 << 8);
    rig.write(TIM4 + SMCR, 3);
    rig.write(TIM4 + CR1, 1);
    rig
}

fn turn(rig: &mut Rig, motion: Motion) {
    let now = rig.now;
    rig.chip.plant_mut(now).set_shaft(motion, now);
}

fn place(rig: &mut Rig, revolutions: f64) {
    turn(rig, Motion::Angle(Signal::Constant(revolutions)));
}

#[test]
fn the_count_is_exact_at_6000_rpm_both_ways_over_the_wrap() {
    for rpm in [6000.0, -6000.0, 60_000.0] {
        let mut rig = counting();
        turn(&mut rig, Motion::Rpm(rpm));
        let start = rig.now;
        for millis in [1, 7, 160, 161, 1000, 60_000] {
            rig.run_to(start + Time::from_millis(millis));
            // 4096 counts in a revolution.
            let counts = (rpm * 4096.0 * millis as f64 / 60_000.0).floor() as i64;
            assert_eq!(rig.read(TIM4 + CNT), counts.rem_euclid(65_536) as u32, "{rpm} rpm, {millis} ms");
            assert_eq!(rig.read(TIM4 + CR1) >> 4 & 1, u32::from(rpm < 0.0), "DIR");
        }
    }
}

#[test]
fn the_wrap_is_an_update_in_both_directions() {
    let mut rig = counting();
    place(&mut rig, -0.5);
    assert_eq!(rig.read(TIM4 + CNT), 65_536 - 2048);
    assert_eq!(rig.read(TIM4 + SR) & 1, 1);
    rig.write(TIM4 + SR, 0);
    place(&mut rig, 0.25);
    assert_eq!(rig.read(TIM4 + CNT), 1024);
    assert_eq!(rig.read(TIM4 + SR) & 1, 1);
}

#[test]
fn the_interrupt_of_the_wrap_comes_at_the_edge() {
    let mut rig = counting();
    rig.write(TIM4 + ARR, 4095);
    rig.write(TIM4 + DIER, 1);
    turn(&mut rig, Motion::Rpm(6000.0));
    let start = rig.now;
    for n in 1..4 {
        assert_eq!(rig.run_to_irq(TIM4_IRQ, Time::from_millis(20)), Some(start + Time::from_millis(10 * n)));
        rig.write(TIM4 + SR, 0);
    }
}

#[test]
fn other_modes_count_the_edges_of_one_input() {
    for (mode, counts) in [(1, 512), (2, 512), (3, 1024)] {
        let mut rig = rig();
        rig.write(TIM4 + SMCR, mode);
        rig.write(TIM4 + CR1, 1);
        place(&mut rig, 0.25);
        assert_eq!(rig.read(TIM4 + CNT), counts, "mode {mode}");
    }
}

#[test]
fn one_inverted_input_turns_the_direction_around() {
    let mut rig = counting();
    rig.write(TIM4 + CCER, 1 << 1);
    place(&mut rig, 0.25);
    assert_eq!(rig.read(TIM4 + CNT), 65_536 - 1024);
}

#[test]
fn without_its_pins_or_stopped_the_timer_sees_nothing() {
    let mut rig = counting();
    rig.write(GPIOB + 0x20, 0);
    place(&mut rig, 0.25);
    assert_eq!(rig.read(TIM4 + CNT), 0);
    let mut rig = counting();
    rig.write(TIM4 + CR1, 0);
    place(&mut rig, 0.25);
    rig.write(TIM4 + CR1, 1);
    assert_eq!(rig.read(TIM4 + CNT), 0);
}

#[test]
fn the_phases_can_be_read_as_pins() {
    let mut rig = counting();
    let mut levels = Vec::new();
    for quarter in 0..4 {
        place(&mut rig, f64::from(quarter) / 4096.0);
        levels.push(rig.read(GPIOB + 0x10) >> 5 & 7);
    }
    // Bits: index, A, B. The index is high in the first quarter only.
    assert_eq!(levels, [0b001, 0b010, 0b110, 0b100]);
}

#[test]
fn each_index_pulse_is_an_interrupt() {
    let mut rig = counting();
    rig.write(EXTICR2, 1 << 4);
    rig.write(EXTI + 0x08, 1 << 5);
    rig.write(EXTI, 1 << 5);
    turn(&mut rig, Motion::Rpm(6000.0));
    let start = rig.now;
    for n in 1..=3 {
        assert_eq!(
            rig.run_to_irq(EXTI9_5_IRQ, Time::from_millis(50)),
            Some(start + Time::from_millis(10 * n))
        );
        assert_eq!(rig.read(TIM4 + CNT), 4096 * n as u32, "at the very edge");
        rig.write(EXTI + 0x14, 1 << 5);
        assert!(!rig.irq(EXTI9_5_IRQ));
    }
    rig.chip.plant_mut(rig.now).add_fault("missing-index@0".parse().expect("a fault"));
    assert_eq!(rig.run_to_irq(EXTI9_5_IRQ, Time::from_millis(50)), None);
}

const DMA1: u32 = 0x4002_6000;
const BUFFER: u32 = 0x2000_4000;

/// A stream of DMA1 on channel 5 that copies the count to memory, item by item and round again.
fn copy_count(rig: &mut Rig, stream: u32, items: u32) {
    rig.set(AHB1ENR, 1 << 21);
    let base = DMA1 + 0x10 + 0x18 * stream;
    rig.write(base + 4, items);
    rig.write(base + 8, TIM4 + CNT);
    rig.write(base + 0x0C, BUFFER);
    rig.write(base, 5 << 25 | 1 << 13 | 1 << 11 | 1 << 10 | 1 << 8 | 1);
}

#[test]
fn dma_copies_the_count_at_the_index() {
    for rpm in [6000.0, -6000.0] {
        let mut rig = counting();
        rig.set(GPIOB, 0b10 << 10);
        rig.set(GPIOB + 0x20, 2 << 20);
        copy_count(&mut rig, 5, 1);
        rig.write(TIM3 + CCMR1, 1 << 8);
        rig.write(TIM3 + CCER, 1 << 4);
        rig.write(TIM3 + DIER, 1 << 10);
        turn(&mut rig, Motion::Rpm(rpm));
        rig.wait(Time::from_millis(1));
        rig.write(DMA1 + 0x0C, 0x3D << 6);
        for turns in 1..=20_i32 {
            rig.wait(Time::from_millis(10));
            assert_eq!(rig.read(DMA1 + 4) >> 6 & 0x20, 0x20, "TCIF5");
            let zero = (turns * 4096 * rpm.signum() as i32) as u16;
            // Backwards the index rises at the other end of its quarter period.
            assert_eq!(rig.half_word(BUFFER), zero, "{rpm} rpm, turn {turns}");
            rig.write(DMA1 + 0x0C, 0x3D << 6);
        }
        assert!(rig.chip.unmodelled().is_empty());
    }
}

#[test]
fn dma_copies_the_count_whenever_the_adc_is_triggered() {
    let mut rig = counting();
    rig.set(APB2ENR, 1 << 8);
    // Updates of TIM3 every 100 us start the ADC; nothing reads its results.
    rig.write(0x4001_2000 + 8, 1 << 28 | 8 << 24 | 1);
    copy_count(&mut rig, 2, 8);
    rig.write(TIM3 + 4, 2 << 4);
    rig.write(TIM3 + ARR, 1599);
    rig.write(TIM3 + DIER, 1 << 8);
    turn(&mut rig, Motion::Rpm(6000.0));
    rig.write(TIM3 + CR1, 1);
    rig.wait(Time::from_millis(1));
    rig.read(TIM3 + CNT);
    // 40.96 counts in 100 us; the ninth and tenth copy overwrite the first two.
    let expected = [9, 10, 3, 4, 5, 6, 7, 8].map(|n| n * 4096 / 100);
    let copied: Vec<u16> = (0..8).map(|n| rig.half_word(BUFFER + 2 * n)).collect();
    assert_eq!(copied, expected);
    assert!(rig.chip.unmodelled().is_empty());
}

#[test]
fn the_index_can_be_captured() {
    let mut rig = counting();
    rig.set(GPIOB, 0b10 << 10);
    rig.set(GPIOB + 0x20, 2 << 20);
    rig.write(TIM3 + 0x28, 15);
    rig.write(TIM3 + 0x14, 1);
    rig.write(TIM3 + CCMR1, 1 << 8);
    rig.write(TIM3 + CCER, 1 << 4);
    rig.write(TIM3 + CR1, 1);
    turn(&mut rig, Motion::Rpm(6000.0));
    rig.wait(Time::from_millis(12));
    assert_eq!(rig.read(TIM3 + 0x38), 10_000, "at 1 MHz");
    assert_eq!(rig.read(TIM3 + SR) & 1 << 2, 1 << 2);
    rig.wait(Time::from_millis(10));
    assert_eq!(rig.read(TIM3 + SR) >> 10 & 1, 1, "the second one came before the first was cleared: CC2OF");
}
