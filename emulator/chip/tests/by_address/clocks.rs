//! RCC, PWR and the address map, as a start-up sequence uses them.

use crate::support::{AHB1ENR, APB1ENR, RCC, Rig};
use canbus::Time;
use chip::{BusFault, Direction, Effect, Peripherals, Reason, Variant};

const CFGR: u32 = RCC + 0x08;
const CIR: u32 = RCC + 0x0C;
const CSR: u32 = RCC + 0x74;
const PWR: u32 = 0x4000_7000;
const GPIOA: u32 = 0x4002_0000;

#[test]
fn the_start_up_of_the_firmware_gives_144_mhz() {
    let mut rig = Rig::new();
    rig.write(RCC, 0x0005_0083);
    assert_eq!(rig.read(RCC) >> 17 & 1, 0, "HSE is not ready at once");
    rig.wait(Time::from_micros(2));
    assert_eq!(rig.read(RCC) >> 17 & 1, 1);
    rig.firmware_clocks();
    assert_eq!(rig.read(CFGR) >> 2 & 3, 2, "SWS tells the PLL");
    assert!(rig.effects.contains(&Effect::CoreClock(144_000_000)));
    let clocks = rig.chip.clocks();
    assert_eq!(
        (clocks.hclk_cycle(), clocks.pclk1_cycle(), clocks.pclk2_cycle()),
        (Time(7000), Time(28_000), Time(14_000))
    );
}

#[test]
fn a_switch_to_a_pll_that_is_not_ready_waits_for_it() {
    let mut rig = Rig::new();
    rig.set(RCC, 1 << 24);
    rig.set(CFGR, 2);
    assert_eq!(rig.read(CFGR) >> 2 & 3, 0);
    rig.wait(Time::from_micros(100));
    assert_eq!(rig.read(CFGR) >> 2 & 3, 2);
    // M 16, N 192, P 2 from the 16 MHz HSI: the reset value of PLLCFGR.
    assert!(rig.effects.contains(&Effect::CoreClock(96_000_000)));
}

#[test]
fn without_a_clock_on_osc_in_hse_and_its_pll_never_get_ready() {
    let mut rig = Rig::new();
    rig.chip.plant_mut(Time::ZERO).add_fault("no-crystal@0".parse().unwrap());
    rig.write(RCC + 4, 4 | 144 << 6 | 1 << 22);
    rig.set(RCC, 1 << 16 | 1 << 24);
    rig.wait(Time::from_millis(100));
    assert_eq!(rig.read(RCC) & (1 << 17 | 1 << 25), 0);
}

#[test]
fn over_drive_of_the_f446_is_ready_when_asked_for() {
    let mut rig = Rig::new();
    rig.set(APB1ENR, 1 << 28);
    rig.set(PWR, 1 << 16);
    assert_eq!(rig.read(PWR + 4) >> 16 & 3, 0b01);
    rig.set(PWR, 1 << 17);
    assert_eq!(rig.read(PWR + 4) >> 16 & 3, 0b11);
}

#[test]
fn the_cause_of_a_reset_stays_until_cleared() {
    let mut rig = Rig::new();
    assert_eq!(rig.read(CSR) >> 24, 0x0E, "power-on: BOR, PIN, POR");
    rig.write(CSR, 1 << 24);
    assert_eq!(rig.read(CSR) >> 24, 0);
    rig.chip.reset(false, rig.now);
    assert_eq!(rig.read(CSR) >> 24, 0x14, "software: SFT, PIN");
    rig.chip.reset(true, rig.now);
    assert_eq!(rig.read(CSR) >> 24, 0x0E);
}

#[test]
fn an_access_without_clock_reads_zero_and_is_on_record() {
    let mut rig = Rig::new();
    rig.write(GPIOA + 0x14, 0x20);
    assert_eq!(rig.read(GPIOA), 0);
    let record = rig.chip.unmodelled();
    let seen: Vec<_> = record.iter().map(|e| (e.name.as_str(), e.direction, e.reason, e.count)).collect();
    let off = Reason::ClockOff;
    assert_eq!(seen, [("GPIOA+0x00", Direction::Read, off, 1), ("GPIOA+0x14", Direction::Write, off, 1)]);
    rig.set(AHB1ENR, 1);
    assert_eq!(rig.read(GPIOA), 0xA800_0000);
    assert_eq!(rig.read(GPIOA + 0x14), 0, "the write was lost");
}

#[test]
fn an_access_without_a_model_is_recorded_by_name() {
    let mut rig = Rig::new();
    rig.set(APB1ENR, 1 << 1 | 1 << 17);
    for _ in 0..3 {
        assert_eq!(rig.read(0x4000_0444), 0);
    }
    rig.write(0x4000_440C, 5);
    let record = rig.chip.unmodelled();
    assert_eq!(record.len(), 2);
    assert_eq!((record[0].name.as_str(), record[0].address, record[0].count), ("TIM3+0x44", 0x4000_0444, 3));
    assert_eq!((record[1].name.as_str(), record[1].direction), ("USART2+0x0c", Direction::Write));
    assert_eq!(record[1].reason, Reason::NotModelled);
}

#[test]
fn where_the_chip_has_nothing_there_is_a_bus_fault() {
    let mut rig = Rig::new();
    assert_eq!(rig.chip.read(0x4000_2400, 4, rig.now), Err(BusFault));
    assert_eq!(rig.chip.write(0x4008_0000, 4, 0, rig.now), Err(BusFault));
    assert_eq!(rig.chip.read(RCC + 2, 4, rig.now), Err(BusFault), "across a word");
}

#[test]
fn chips_differ() {
    let mut f446 = Rig::new();
    let mut f407 = Rig::with(Variant::F407);
    let spi4 = 0x4001_3400;
    assert!(f446.chip.read(spi4, 4, f446.now).is_ok());
    assert_eq!(f407.chip.read(spi4, 4, f407.now), Err(BusFault));
    assert_eq!(f446.read(0xE004_2000) & 0xFFF, 0x421);
    assert_eq!(f407.read(0xE004_2000) & 0xFFF, 0x413);
}

#[test]
fn narrow_accesses_touch_their_lane() {
    let mut rig = Rig::new();
    rig.set(AHB1ENR, 1);
    rig.chip.write(GPIOA + 0x18, 2, 0x00FF, rig.now).unwrap();
    rig.chip.write(GPIOA + 0x1A, 2, 0x000F, rig.now).unwrap();
    assert_eq!(rig.read(GPIOA + 0x14), 0xF0);
    assert_eq!(rig.chip.read(GPIOA + 3, 1, rig.now), Ok(0xA8));
}

/// RM0390, 6.2.7: HSE and the PLL that it feeds are switched off, the system runs from HSI, and NMI stays until CSSC.
#[test]
fn the_clock_security_system_switches_to_hsi_and_raises_nmi() {
    let mut rig = Rig::new();
    rig.firmware_clocks();
    rig.set(RCC, 1 << 19);
    rig.chip.plant_mut(rig.now).add_fault("no-crystal@0.01..0.02".parse().unwrap());
    rig.wait(Time::from_millis(5));
    assert!(!rig.chip.lines().nmi);
    rig.wait(Time::from_millis(10));
    assert!(rig.chip.lines().nmi);
    assert_eq!(rig.read(RCC) & 0x0303_0003, 3, "HSI alone is on");
    assert_eq!(rig.read(CFGR) & 0xF, 0, "and in use");
    assert_eq!(rig.chip.clocks().hclk, 16_000_000);
    assert_eq!(rig.read(CIR), 1 << 7);
    rig.write(CIR, 1 << 23);
    assert!(!rig.chip.lines().nmi);
    rig.wait(Time::from_millis(20));
    rig.firmware_clocks();
    assert_eq!(rig.chip.clocks().hclk, 144_000_000, "the crystal is back");
}

#[test]
fn without_the_clock_security_system_no_interrupt_occurs() {
    let mut rig = Rig::new();
    rig.firmware_clocks();
    rig.chip.plant_mut(rig.now).add_fault("no-crystal@0.01".parse().unwrap());
    rig.wait(Time::from_millis(20));
    assert!(!rig.chip.lines().nmi);
    assert_eq!(rig.read(RCC) >> 17 & 1, 0, "HSERDY");
}
