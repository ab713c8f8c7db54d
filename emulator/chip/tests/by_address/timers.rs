//! Timers: instants to the cycle, preloads, flags.

use canbus::Time;

use crate::support::{APB1ENR, Rig};

const TIM2: u32 = 0x4000_0000;
const TIM3: u32 = 0x4000_0400;
const CR1: u32 = 0x00;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const CCR1: u32 = 0x34;
const TIM2_IRQ: u8 = 28;
const TIM3_IRQ: u8 = 29;

/// One cycle of the timers on APB1: 72 MHz.
const CYCLE: Time = Time::of_cycle(72_000_000);

fn rig() -> Rig {
    let mut rig = Rig::new();
    rig.firmware_clocks();
    rig.set(APB1ENR, 0b11);
    rig
}

/// TIM2 as the time base of the firmware: 1 MHz, 32 bits, free running.
fn time_base(rig: &mut Rig) -> Time {
    rig.write(TIM2 + PSC, 71);
    rig.write(TIM2 + EGR, 1);
    rig.write(TIM2 + SR, 0);
    rig.write(TIM2 + CR1, 1);
    rig.now
}

#[test]
fn a_free_running_counter_counts_microseconds() {
    let mut rig = rig();
    let start = time_base(&mut rig);
    rig.run_to(start + Time(Time::PER_MICRO * 5 - 1));
    assert_eq!(rig.read(TIM2 + CNT), 4);
    rig.run_to(start + Time::from_micros(5));
    assert_eq!(rig.read(TIM2 + CNT), 5);
    rig.run_to(start + Time::from_micros(4_294_967_296 + 7));
    assert_eq!(rig.read(TIM2 + CNT), 7, "32 bits");
    assert_eq!(rig.read(TIM2 + SR) & 1, 1, "UIF");
}

#[test]
fn a_compare_interrupt_comes_at_its_very_instant() {
    let mut rig = rig();
    let start = time_base(&mut rig);
    rig.write(TIM2 + CCR1, 1000);
    rig.write(TIM2 + CCR1 + 4, 1500);
    rig.write(TIM2 + DIER, 0b110);
    assert_eq!(rig.run_to_irq(TIM2_IRQ, Time::from_millis(10)), Some(start + Time::from_micros(1000)));
    assert_eq!(rig.read(TIM2 + SR) & 0b110, 0b010);
    rig.write(TIM2 + SR, !0b010);
    assert!(!rig.irq(TIM2_IRQ));
    assert_eq!(rig.run_to_irq(TIM2_IRQ, Time::from_millis(10)), Some(start + Time::from_micros(1500)));
}

#[test]
fn a_compare_value_that_has_passed_waits_for_the_next_round() {
    let mut rig = rig();
    let start = time_base(&mut rig);
    rig.write(TIM2 + CNT, 2000);
    rig.write(TIM2 + CCR1, 1999);
    rig.write(TIM2 + DIER, 0b10);
    let round = Time::from_micros(4_294_967_296 - 2000 + 1999);
    assert_eq!(rig.run_to_irq(TIM2_IRQ, Time::from_millis(5_000_000)), Some(start + round));
}

#[test]
fn a_compare_value_above_the_top_is_reached_at_the_overflow() {
    let mut rig = rig();
    rig.write(TIM3 + ARR, 999);
    rig.write(TIM3 + CCR1, 5000);
    rig.write(TIM3 + DIER, 0b10);
    rig.write(TIM3 + CR1, 1);
    let start = rig.now;
    for n in 1..3 {
        assert_eq!(rig.run_to_irq(TIM3_IRQ, Time::from_millis(1)), Some(start + Time(CYCLE.0 * 1000 * n)));
        rig.write(TIM3 + SR, 0);
    }
    rig.write(TIM3 + SR, 0);
    rig.wait(Time(CYCLE.0 * 5000));
    assert_eq!(rig.read(TIM3 + SR) & 0b10, 0b10, "over several rounds at once too");
}

#[test]
fn a_compare_event_by_software_raises_the_interrupt() {
    let mut rig = rig();
    time_base(&mut rig);
    rig.write(TIM2 + DIER, 0b100);
    rig.write(TIM2 + EGR, 0b100);
    assert!(rig.irq(TIM2_IRQ));
    assert_eq!(rig.read(TIM2 + CNT), 0);
}

#[test]
fn updates_come_at_the_period_and_only_zeros_clear_flags() {
    let mut rig = rig();
    rig.write(TIM3 + ARR, 4499);
    rig.write(TIM3 + DIER, 1);
    rig.write(TIM3 + CR1, 1);
    let start = rig.now;
    for n in 1..4 {
        let due = start + Time(CYCLE.0 * 4500 * n);
        assert_eq!(rig.run_to_irq(TIM3_IRQ, Time::from_millis(1)), Some(due));
        rig.write(TIM3 + SR, u32::MAX);
        assert!(rig.irq(TIM3_IRQ), "writing 1 leaves the flag");
        rig.write(TIM3 + SR, 0);
    }
}

#[test]
fn a_preloaded_period_takes_effect_at_the_update() {
    let mut rig = rig();
    rig.write(TIM3 + ARR, 999);
    rig.write(TIM3 + DIER, 1);
    rig.write(TIM3 + CR1, 0x81);
    let start = rig.now;
    rig.wait(Time(CYCLE.0 * 10));
    rig.write(TIM3 + ARR, 99);
    assert_eq!(rig.run_to_irq(TIM3_IRQ, Time::from_millis(1)), Some(start + Time(CYCLE.0 * 1000)));
    rig.write(TIM3 + SR, 0);
    assert_eq!(rig.run_to_irq(TIM3_IRQ, Time::from_millis(1)), Some(start + Time(CYCLE.0 * 1100)));
}

#[test]
fn the_prescaler_is_always_preloaded() {
    let mut rig = rig();
    rig.write(TIM3 + ARR, 9);
    rig.write(TIM3 + CR1, 1);
    rig.write(TIM3 + PSC, 9);
    let start = rig.now;
    rig.run_to(start + Time(CYCLE.0 * 9));
    assert_eq!(rig.read(TIM3 + CNT), 9, "still without division");
    rig.run_to(start + Time(CYCLE.0 * 10));
    assert_eq!(rig.read(TIM3 + CNT), 0);
    rig.run_to(start + Time(CYCLE.0 * 29));
    assert_eq!(rig.read(TIM3 + CNT), 1, "divided by ten since the update");
}

#[test]
fn an_update_by_software_is_silent_with_urs_and_lost_with_udis() {
    let mut rig = rig();
    rig.write(TIM3 + CR1, 1 << 2);
    rig.write(TIM3 + EGR, 1);
    assert_eq!(rig.read(TIM3 + SR), 0);
    rig.write(TIM3 + CR1, 1 << 1);
    rig.write(TIM3 + EGR, 1);
    assert_eq!(rig.read(TIM3 + SR), 0);
    rig.write(TIM3 + CR1, 0);
    rig.write(TIM3 + EGR, 1);
    assert_eq!(rig.read(TIM3 + SR), 1);
}

#[test]
fn one_pulse_mode_stops_at_the_update() {
    let mut rig = rig();
    rig.write(TIM3 + ARR, 99);
    rig.write(TIM3 + CR1, 1 << 3 | 1);
    rig.wait(Time(CYCLE.0 * 1050));
    assert_eq!((rig.read(TIM3 + CNT), rig.read(TIM3 + CR1) & 1), (0, 0));
}

#[test]
fn a_stopped_counter_keeps_the_part_of_its_tick() {
    let mut rig = rig();
    let start = time_base(&mut rig);
    rig.run_to(start + Time(Time::PER_MICRO * 3 / 2));
    rig.write(TIM2 + CR1, 0);
    rig.wait(Time::from_millis(1));
    assert_eq!(rig.read(TIM2 + CNT), 1);
    rig.write(TIM2 + CR1, 1);
    rig.wait(Time(Time::PER_MICRO / 2));
    assert_eq!(rig.read(TIM2 + CNT), 2);
}

#[test]
fn unmodelled_functions_of_a_timer_are_recorded() {
    let mut rig = rig();
    rig.write(TIM3 + CR1, 1 << 4);
    rig.write(TIM3 + DIER, 1 << 8);
    rig.write(TIM3 + 0x08, 7);
    let names: Vec<String> = rig.chip.unmodelled().into_iter().map(|entry| entry.name).collect();
    assert_eq!(names, ["TIM3+0x00", "TIM3+0x08", "TIM3+0x0c"]);
}

#[test]
fn a_reset_by_rcc_clears_the_timer() {
    let mut rig = rig();
    time_base(&mut rig);
    rig.wait(Time::from_micros(50));
    rig.set(crate::support::RCC + 0x20, 1);
    rig.write(crate::support::RCC + 0x20, 0);
    assert_eq!((rig.read(TIM2 + CNT), rig.read(TIM2 + CR1), rig.read(TIM2 + PSC)), (0, 0, 0));
}
