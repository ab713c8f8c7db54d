//! Backup SRAM: its clock gate and write protection, and the resets and power losses that it survives.

use canbus::Time;
use chip::{Peripherals, Reason};

use crate::support::{AHB1ENR, APB1ENR, Rig};

const BKPSRAM: u32 = 0x4002_4000;
const PWR_CR: u32 = 0x4000_7000;
const PWR_CSR: u32 = PWR_CR + 4;
const DBP: u32 = 1 << 8;
const BRE: u32 = 1 << 9;

/// A chip whose backup SRAM is clocked, writable, and kept by the battery.
fn rig() -> Rig {
    let mut rig = Rig::new();
    open(&mut rig);
    rig.set(PWR_CSR, BRE);
    rig
}

fn open(rig: &mut Rig) {
    rig.set(APB1ENR, 1 << 28);
    rig.set(AHB1ENR, 1 << 18);
    rig.set(PWR_CR, DBP);
}

fn cycle(rig: &mut Rig, power: bool) {
    rig.chip.reset(power, rig.now);
    open(rig);
}

#[test]
fn all_words_are_memory() {
    let mut rig = rig();
    for n in 0..1024 {
        rig.write(BKPSRAM + 4 * n, 0x1234_0000 | n);
    }
    rig.chip.write(BKPSRAM + 0xFFD, 1, 0x5A, rig.now).expect("a byte");
    assert_eq!(rig.read(BKPSRAM + 4 * 77), 0x1234_0000 | 77);
    assert_eq!(rig.read(BKPSRAM + 0xFFC), 0x1234_5AFF);
    assert!(rig.chip.unmodelled().is_empty());
}

#[test]
fn it_is_protected_until_the_program_says_otherwise() {
    let mut rig = rig();
    rig.write(BKPSRAM, 1);
    rig.write(PWR_CR, 0);
    rig.write(BKPSRAM, 2);
    assert_eq!(rig.read(BKPSRAM), 1);
    assert_eq!(rig.chip.unmodelled()[0].reason, Reason::Protected);
}

#[test]
fn without_a_clock_the_memory_is_not_accessible() {
    let mut rig = rig();
    rig.write(BKPSRAM, 1);
    rig.write(AHB1ENR, 0);
    rig.write(BKPSRAM, 2);
    assert_eq!(rig.read(BKPSRAM), 0);
    rig.set(AHB1ENR, 1 << 18);
    assert_eq!(rig.read(BKPSRAM), 1);
}

#[test]
fn it_outlives_a_reset_and_with_its_regulator_a_loss_of_power() {
    let mut rig = rig();
    rig.write(BKPSRAM + 8, 0x1234_5678);
    for power in [false, true, true] {
        cycle(&mut rig, power);
        assert_eq!(rig.read(BKPSRAM + 8), 0x1234_5678);
        assert_eq!(rig.read(PWR_CSR) & BRE, BRE);
    }
}

#[test]
fn without_the_regulator_the_memory_survives_a_reset_only() {
    let mut rig = rig();
    rig.write(PWR_CSR, 0);
    rig.write(BKPSRAM + 8, 0x1234_5678);
    cycle(&mut rig, false);
    assert_eq!(rig.read(BKPSRAM + 8), 0x1234_5678);
    cycle(&mut rig, true);
    assert_ne!(rig.read(BKPSRAM + 8), 0x1234_5678);
}

#[test]
fn an_empty_battery_keeps_nothing() {
    let mut rig = rig();
    rig.write(BKPSRAM + 8, 0x1234_5678);
    rig.chip.plant_mut(rig.now).add_fault("battery-empty@1".parse().expect("a fault"));
    cycle(&mut rig, true);
    assert_eq!(rig.read(BKPSRAM + 8), 0x1234_5678, "it is not empty yet");
    rig.wait(Time::from_millis(1000));
    assert_eq!(rig.chip.kept_by_battery(rig.now), None);
    cycle(&mut rig, false);
    assert_eq!(rig.read(BKPSRAM + 8), 0x1234_5678, "the main supply is there");
    cycle(&mut rig, true);
    assert_ne!(rig.read(BKPSRAM + 8), 0x1234_5678);
    assert_eq!(rig.read(PWR_CSR) & BRE, 0, "nor the bit of the regulator");
}

#[test]
fn a_weak_battery_loses_some_bits() {
    let mut rig = rig();
    let words = [0, 4, 8, 12, 16].map(|offset| BKPSRAM + offset);
    words.iter().for_each(|&word| rig.write(word, 0));
    rig.chip.plant_mut(rig.now).add_fault("battery-weak@0".parse().expect("a fault"));
    cycle(&mut rig, false);
    assert_eq!(words.map(|word| rig.read(word)), [0; 5], "the main supply is there");
    cycle(&mut rig, true);
    assert_eq!(words.map(|word| rig.read(word)), [0, 0x80, 0, 0, 0x80]);
}

#[test]
fn the_kept_memory_can_be_saved_and_restored() {
    let mut first = rig();
    first.write(BKPSRAM + 0x10, 0xCAFE_F00D);
    let kept = first.chip.kept_by_battery(first.now).expect("a battery");
    assert_eq!(kept.len(), 4096);
    let mut second = Rig::new();
    assert_eq!(second.chip.kept_by_battery(second.now), None, "the regulator is off");
    second.chip.set_kept_by_battery(&kept);
    cycle(&mut second, true);
    assert_eq!(second.read(BKPSRAM + 0x10), 0xCAFE_F00D);
}
