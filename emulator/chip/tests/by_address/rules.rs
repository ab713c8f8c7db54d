//! Bugs that silicon does not tolerate, each seeded into a program that is correct otherwise.

use chip::{Breach, Peripherals};

use crate::support::{AHB1ENR, APB1ENR, APB2ENR, RCC, Rig};

const PLLCFGR: u32 = RCC + 0x04;
const CFGR: u32 = RCC + 0x08;
const FLASH_ACR: u32 = 0x4002_3C00;
const PWR_CR: u32 = 0x4000_7000;
const GPIOA_MODER: u32 = 0x4002_0000;
const GPIOB: u32 = 0x4002_0400;
const CAN1: u32 = 0x4000_6400;
const ADC1: u32 = 0x4001_2000;
const ADC_CCR: u32 = 0x4001_2304;
const BACKUP: u32 = 0x4002_4000;

/// HSE and PLL on, the system clock still from HSI. 144 MHz: 8 MHz / 4 x 144 / 2.
const PLL_144: u32 = 1 << 22 | 144 << 6 | 4;
/// The system clock from the PLL, APB1 at a quarter, APB2 at half of it.
const PRESCALERS: u32 = 0b101 << 10 | 0b100 << 13;

/// The settings of a program; a test changes one of them.
struct Program {
    wait_states: u32,
    pll: u32,
    prescalers: u32,
    /// The time between the dividers and the switch to the PLL.
    divided_for: canbus::Time,
    backup_writable: bool,
    port_b_clock: bool,
    can_function: u32,
    /// The level of the pin that puts the transceiver to sleep.
    standby: u32,
    bit_timing: u32,
    sample_times: u32,
    adc_prescaler: u32,
    analogue_pins: u32,
}

/// 36 MHz / 2 / 18 = 1 Mbit/s with 15 and 2 quanta: sampled at 88.9 %.
const TIMING: u32 = 1 << 20 | 14 << 16 | 1;
/// Sample times of 480 cycles for channels 10 to 18.
const LONG: u32 = 0x07FF_FFFF;
/// Sample times of 28 cycles for channels 0 to 9.
const SHORT: u32 = 0x1249_2492;

const RIGHT: Program = Program {
    wait_states: 4,
    pll: PLL_144,
    prescalers: PRESCALERS,
    divided_for: canbus::Time::from_micros(1),
    backup_writable: true,
    port_b_clock: true,
    can_function: 9,
    standby: 0,
    bit_timing: TIMING,
    sample_times: LONG,
    adc_prescaler: 0b01,
    analogue_pins: 0xF,
};

impl Program {
    /// Runs the program and returns the breaches.
    fn broken(&self) -> Vec<Breach> {
        let mut rig = Rig::new();
        rig.set(APB1ENR, 1 << 25 | 1 << 28);
        rig.set(APB2ENR, 1 << 8);
        rig.set(AHB1ENR, 1 | u32::from(self.port_b_clock) << 1 | 1 << 18);
        self.set_clocks(&mut rig);
        self.keep(&mut rig);
        self.join(&mut rig);
        self.measure(&mut rig);
        std::iter::from_fn(|| rig.chip.breach()).collect()
    }

    fn set_clocks(&self, rig: &mut Rig) {
        rig.write(FLASH_ACR, self.wait_states);
        rig.write(PLLCFGR, self.pll);
        rig.write(RCC, 0x0105_0083);
        rig.wait(canbus::Time::from_micros(200));
        rig.write(CFGR, self.prescalers);
        rig.wait(self.divided_for);
        rig.write(CFGR, self.prescalers | 0b10);
        rig.wait(canbus::Time::from_micros(10));
    }

    fn keep(&self, rig: &mut Rig) {
        rig.write(PWR_CR, 0xC000 | u32::from(self.backup_writable) << 8);
        rig.write(BACKUP, 1);
    }

    fn join(&self, rig: &mut Rig) {
        rig.write(GPIOB + 0x14, self.standby << 12);
        rig.write(GPIOB, 0b01 << 24 | 0b1010 << 16 | 0x280);
        rig.write(GPIOB + 0x24, self.can_function * 0x11);
        rig.write(CAN1, 1);
        rig.write(CAN1 + 0x1C, self.bit_timing);
        rig.write(CAN1, 0);
    }

    /// Measures the pressure at PA0 and the internal reference.
    fn measure(&self, rig: &mut Rig) {
        rig.write(GPIOA_MODER, 0xA800_0000 | self.analogue_pins);
        rig.write(ADC_CCR, 1 << 23 | self.adc_prescaler << 16);
        rig.write(ADC1 + 0x0C, self.sample_times);
        rig.write(ADC1 + 0x34, 17 << 5);
        rig.write(ADC1 + 0x2C, 1 << 20);
        rig.write(ADC1 + 0x04, 1 << 8);
        rig.write(ADC1 + 0x10, SHORT);
        rig.write(ADC1 + 0x08, 1);
        rig.wait(canbus::Time::from_micros(5));
        rig.write(ADC1 + 0x08, 1 << 30 | 1);
        rig.wait(canbus::Time::from_micros(100));
        rig.read(ADC1 + 0x4C);
    }
}

/// The messages of all breaches, in one line.
fn says(program: &Program) -> String {
    program.broken().iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

#[test]
fn a_program_that_is_right_breaks_no_rule() {
    assert_eq!(says(&RIGHT), "");
}

#[test]
fn every_seeded_bug_is_reported() {
    let pll = |m: u32, n: u32| 1 << 22 | n << 6 | m;
    let bugs = [
        (
            "no wait states",
            Program { wait_states: 0, ..RIGHT },
            "0 wait states of the flash at 144000000 Hz; it needs 4",
        ),
        ("a wait state too few", Program { wait_states: 3, ..RIGHT }, "3 wait states"),
        ("PCLK1 undivided", Program { prescalers: 0b100 << 13, ..RIGHT }, "PCLK1 at 144000000 Hz"),
        ("PCLK1 halved", Program { prescalers: 0b100 << 10 | 0b100 << 13, ..RIGHT }, "PCLK1 at 72000000 Hz"),
        ("PCLK2 undivided", Program { prescalers: 0b101 << 10, ..RIGHT }, "PCLK2 at 144000000 Hz"),
        ("the VCO too fast", Program { pll: pll(2, 432), ..RIGHT }, "the VCO of the PLL at 1728000000 Hz"),
        (
            "the input of the PLL too fast",
            Program { pll: pll(2, 72), ..RIGHT },
            "the input of the PLL at 4000000 Hz",
        ),
        (
            "the input of the PLL too slow",
            Program { pll: pll(16, 432), ..RIGHT },
            "the input of the PLL at 500000 Hz",
        ),
        ("the VCO too slow", Program { pll: pll(4, 49), ..RIGHT }, "the VCO of the PLL at 98000000 Hz"),
        (
            "180 MHz without over-drive",
            Program { pll: pll(4, 180), wait_states: 5, ..RIGHT },
            "HCLK at 180000000 Hz",
        ),
        ("a transceiver that sleeps", Program { standby: 1, ..RIGHT }, "transceiver asleep: PB12"),
        ("CAN on AF8", Program { can_function: 8, ..RIGHT }, "PB8 is not switched to CAN1_RX"),
        (
            "port B without its clock",
            Program { port_b_clock: false, ..RIGHT },
            "GPIOB is accessed without its clock",
        ),
        (
            "TS2 at its maximum",
            Program { bit_timing: 7 << 20 | 8 << 16 | 1, ..RIGHT },
            "CAN samples at 555 permille",
        ),
        ("sampled too late", Program { bit_timing: 15 << 16 | 1, ..RIGHT }, "CAN samples at 944 permille"),
        (
            "3 cycles for the reference",
            Program { sample_times: 0, ..RIGHT },
            "ADC channel 17 is sampled for 166 ns",
        ),
        (
            "144 cycles for the reference",
            Program { sample_times: 0x06DB_6DB6, ..RIGHT },
            "ADC channel 17 is sampled for 8000 ns",
        ),
        (
            "the ADC too fast",
            Program { adc_prescaler: 0, prescalers: 0b101 << 10, ..RIGHT },
            "ADCCLK at 72000000 Hz",
        ),
        (
            "a digital pin measured",
            Program { analogue_pins: 0xC, ..RIGHT },
            "PA0 is not switched to analogue",
        ),
        (
            "the PLL at once",
            Program { divided_for: canbus::Time::ZERO, ..RIGHT },
            "the system clock is switched 0 cycles after a divider",
        ),
        (
            "the PLL half a microsecond later",
            Program { divided_for: canbus::Time(canbus::Time::PER_MICRO / 2), ..RIGHT },
            "the system clock is switched 8 cycles after a divider",
        ),
        (
            "a protected backup domain",
            Program { backup_writable: false, ..RIGHT },
            "BKPSRAM is written while the backup domain is protected",
        ),
    ];
    for (bug, program, expected) in bugs {
        let told = says(&program);
        assert!(told.contains(expected), "{bug}: {told:?}");
    }
}

#[test]
fn a_breach_is_reported_once() {
    let mut rig = Rig::new();
    for _ in 0..3 {
        rig.read(CAN1);
    }
    assert_eq!(rig.chip.breach(), Some(Breach::ClockOff { name: "CAN1" }));
    assert_eq!(rig.chip.breach(), None);
}

#[test]
fn system_memory_is_not_read_during_an_erase() {
    const UNIQUE_ID: u32 = 0x1FFF_7A10;
    let mut rig = Rig::new();
    rig.unlock_flash();
    rig.read(UNIQUE_ID);
    rig.erase(4);
    assert_eq!(rig.chip.breach(), None);
    rig.read(UNIQUE_ID);
    assert_eq!(rig.chip.breach(), Some(Breach::SystemMemory));
}

const DBGMCU_CR: u32 = 0xE004_2004;

/// In RAM, at a multiple of eight, or without DBG_SLEEP a WFI is safe.
#[test]
fn a_sleep_in_flash_is_reported_where_a_debugger_makes_it_unsafe() {
    for (debugs, address, is_safe) in [
        (1, 0x0802_0208, true),
        (1, 0x0802_020A, false),
        (1, 0x0802_020C, false),
        (1, 0x2000_6004, true),
        (0, 0x0802_020C, true),
    ] {
        let mut rig = Rig::new();
        rig.write(DBGMCU_CR, debugs);
        rig.chip.slept(address);
        let expected = (!is_safe).then_some(Breach::Sleep { address });
        assert_eq!(rig.chip.breach(), expected, "{address:08X}h");
    }
}
