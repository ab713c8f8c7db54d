//! Misuse of the chip: each row is a short program that is wrong in one place. The same program without the mistake breaks
//! no rule.

use canbus::Time;
use chip::{Board, Peripherals, Stm32f4, Variant};

use crate::flash_interface::{CR, PG, STRT};
use crate::support::{AHB1ENR, APB1ENR, APB2ENR, RCC, Rig};

const PWR_CR: u32 = 0x4000_7000;
const ADC1: u32 = 0x4001_2000;
const SMPR1: u32 = ADC1 + 0x0C;
const SMPR2: u32 = ADC1 + 0x10;
const CR2: u32 = ADC1 + 0x08;
const SQR3: u32 = ADC1 + 0x34;
const ADC_CCR: u32 = 0x4001_2304;
const ADON: u32 = 1;
const SWSTART: u32 = 1 << 30;
/// Stream 0 of DMA2.
const STREAM: u32 = 0x4002_6410;
const RAM: u32 = 0x2000_0000;
const HSEON: u32 = 1 << 16;
const HSEBYP: u32 = 1 << 18;
/// HSI, its trimming.
const HSI: u32 = 0x83;

/// A mistake: its name, the program with the mistake or without, and the words of the rule.
type Row = (&'static str, fn(&mut Rig, bool), &'static str);

const ROWS: &[Row] = &[
    ("the voltage scale behind the PLL", voltage_scale, "the voltage scale is changed while the PLL is on"),
    ("over-drive switched alone", over_drive, "the core is switched to over-drive without over-drive"),
    ("HSEBYP behind HSEON", late_bypass, "HSEBYP is changed while HSE is on"),
    ("a clock taken for a crystal", no_bypass, "HSE is switched on for a crystal, but the board has a clock"),
    (
        "a crystal taken for a clock",
        bypassed_crystal,
        "HSE is switched on for a clock, but the board has a crystal",
    ),
    ("an erase by double words", erase_with, "double words without VPP"),
    ("programming by double words", program_with, "double words without VPP"),
    (
        "ADON and SWSTART at once",
        |rig, wrong| start(rig, if wrong { 0 } else { 4 }),
        "a conversion starts 0 ns after ADON",
    ),
    (
        "a conversion 2 us after ADON",
        |rig, wrong| start(rig, if wrong { 2 } else { 4 }),
        "a conversion starts 2000 ns after ADON",
    ),
    (
        "pressure sampled for 3 cycles",
        |rig, wrong| sample(rig, 0, wrong),
        "ADC channel 0 is sampled for 166 ns",
    ),
    (
        "its supply sampled for 3 cycles",
        |rig, wrong| sample(rig, 1, wrong),
        "ADC channel 1 is sampled for 166 ns",
    ),
    (
        "the thermistor sampled for 3 cycles",
        |rig, wrong| sample(rig, 12, wrong),
        "ADC channel 12 is sampled for 166 ns",
    ),
    (
        "a stream stopped and set up at once",
        |rig, wrong| stop(rig, 0x04, wrong),
        "stream 0 of DMA2 is set up before it has stopped",
    ),
    (
        "a stream stopped and moved at once",
        |rig, wrong| stop(rig, 0x0C, wrong),
        "stream 0 of DMA2 is set up before it has stopped",
    ),
    (
        "a stream stopped and begun at once",
        |rig, wrong| stop(rig, 0x00, wrong),
        "stream 0 of DMA2 is set up before it has stopped",
    ),
    (
        "half-words to an odd address",
        |rig, wrong| stream(rig, RAM + u32::from(wrong), ADC1 + 0x4C),
        "an address that is no multiple of its width",
    ),
    (
        "half-words from an odd address",
        |rig, wrong| stream(rig, RAM, ADC1 + 0x4C + u32::from(wrong)),
        "an address that is no multiple of its width",
    ),
];

fn voltage_scale(rig: &mut Rig, wrong: bool) {
    rig.set(APB1ENR, 1 << 28);
    rig.write(RCC + 4, 1 << 22 | 144 << 6 | 4);
    rig.write(RCC, HSI | HSEBYP | HSEON | u32::from(wrong) << 24);
    rig.wait(Time::from_micros(200));
    rig.write(PWR_CR, 0x8000);
}

fn over_drive(rig: &mut Rig, wrong: bool) {
    rig.set(APB1ENR, 1 << 28);
    rig.write(PWR_CR, 0xC000 | u32::from(!wrong) << 16);
    rig.set(PWR_CR, 1 << 17);
}

fn late_bypass(rig: &mut Rig, wrong: bool) {
    rig.write(RCC, HSI | HSEON | if wrong { 0 } else { HSEBYP });
    rig.write(RCC, HSI | HSEON | HSEBYP);
}

fn no_bypass(rig: &mut Rig, wrong: bool) {
    rig.write(RCC, HSI | HSEON | if wrong { 0 } else { HSEBYP });
}

fn bypassed_crystal(rig: &mut Rig, wrong: bool) {
    rig.chip = Stm32f4::new(Variant::F405, Board { hse_is_clock: false, ..Board::default() });
    rig.write(RCC, HSI | HSEON | if wrong { HSEBYP } else { 0 });
}

fn width(wrong: bool) -> u32 {
    if wrong { 3 << 8 } else { 2 << 8 }
}

fn erase_with(rig: &mut Rig, wrong: bool) {
    rig.unlock_flash();
    rig.write(CR, 1 << 1 | 4 << 3 | width(wrong));
    rig.write(CR, 1 << 1 | 4 << 3 | width(wrong) | STRT);
}

fn program_with(rig: &mut Rig, wrong: bool) {
    rig.unlock_flash();
    rig.write(CR, PG | width(wrong));
    rig.program(0x0801_0000, &[0; 4]);
    rig.program(0x0801_0004, &[0; 4]);
}

/// The ADC at 18 MHz, its channel with this many cycles by their code.
fn adc(rig: &mut Rig, channel: u32, code: u32) {
    rig.firmware_clocks();
    // The set-up of the clocks is too quick for the rules: its breaches are discarded.
    while rig.chip.breach().is_some() {}
    rig.set(AHB1ENR, 0b101);
    rig.set(APB2ENR, 1 << 8);
    rig.write(0x4002_0000, 0xA800_000F);
    rig.write(0x4002_0800, 0x30);
    rig.write(ADC_CCR, 1 << 16);
    let (register, place) = if channel < 10 { (SMPR2, channel) } else { (SMPR1, channel - 10) };
    rig.write(register, code << (3 * place));
    rig.write(SQR3, channel);
}

fn start(rig: &mut Rig, micros: u64) {
    adc(rig, 0, 2);
    if micros > 0 {
        rig.write(CR2, ADON);
        rig.wait(Time::from_micros(micros));
    }
    rig.write(CR2, ADON | SWSTART);
    rig.wait(Time::from_micros(20));
    rig.read(ADC1 + 0x4C);
}

fn sample(rig: &mut Rig, channel: u32, wrong: bool) {
    adc(rig, channel, u32::from(!wrong));
    rig.write(CR2, ADON);
    rig.wait(Time::from_micros(4));
    rig.write(CR2, ADON | SWSTART);
    rig.wait(Time::from_micros(20));
    rig.read(ADC1 + 0x4C);
}

/// Stops a stream and writes one of its registers.
fn stop(rig: &mut Rig, register: u32, wrong: bool) {
    stream(rig, RAM, ADC1 + 0x4C);
    rig.write(STREAM, 0);
    if !wrong {
        rig.read(STREAM);
    }
    // The stop has raised a flag.
    rig.write(0x4002_6408, 0x3D);
    rig.write(STREAM + register, 0);
}

/// Sets a stream up for half-words.
fn stream(rig: &mut Rig, memory: u32, peripheral: u32) {
    rig.set(AHB1ENR, 1 << 22);
    rig.write(STREAM + 0x04, 8);
    rig.write(STREAM + 0x08, peripheral);
    rig.write(STREAM + 0x0C, memory);
    rig.write(STREAM, 1 << 11 | 1 << 13 | 1);
}

/// The rules that a program breaks.
fn told(program: fn(&mut Rig, bool), wrong: bool) -> String {
    let mut rig = Rig::new();
    program(&mut rig, wrong);
    let told: Vec<String> =
        std::iter::from_fn(|| rig.chip.breach()).map(|breach| breach.to_string()).collect();
    told.join("; ")
}

#[test]
fn every_mistake_is_reported_by_its_rule() {
    for (name, program, says) in ROWS {
        assert_eq!(told(*program, false), "", "{name}, done right");
        assert!(told(*program, true).contains(says), "{name}: {:?}", told(*program, true));
    }
}

/// HSEBYP and CCxS keep their value while what they belong to is on.
#[test]
fn settings_that_are_locked_keep_their_value() {
    const TIM3: u32 = 0x4000_0400;
    let mut rig = Rig::new();
    rig.write(RCC, HSI | HSEON | HSEBYP);
    rig.write(RCC, HSI | HSEON);
    assert_ne!(rig.read(RCC) & HSEBYP, 0);
    rig.set(APB1ENR, 1 << 1);
    rig.write(TIM3 + 0x18, 0x0102);
    rig.write(TIM3 + 0x20, 1);
    rig.write(TIM3 + 0x18, 0x7201);
    assert_eq!(rig.read(TIM3 + 0x18), 0x7202, "CC1S is locked, CC2S is not");
}

/// A second erase that is requested during the first waits for it (RM0390 section 3.8.4).
#[test]
fn an_erase_during_an_erase_comes_behind_it() {
    let mut rig = Rig::new();
    rig.unlock_flash();
    for (sector, place) in [(1, 0x0800_4000), (2, 0x0800_8000)] {
        rig.memory.0.insert(place, 0);
        rig.erase(sector);
    }
    let busy = rig.wait_for_flash();
    assert_eq!((rig.byte(0x0800_4000), rig.byte(0x0800_8000)), (0xFF, 0xFF));
    assert!(busy >= Time::from_millis(2 * 250), "both take their time: {busy}");
}

#[test]
fn option_bytes_can_be_read() {
    let mut rig = Rig::new();
    let options = [0x1FFF_C000, 0x1FFF_C008].map(|address| rig.read(address) & 0xFFFF);
    assert_eq!(options, [0xAAEF, 0xFFFF], "level 0, no brown-out reset; no sector is protected");
}
