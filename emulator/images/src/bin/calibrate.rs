//! Measures instructions with the cycle counter, to compare the model with a chip. The clocks are those of the firmware
//! (144 MHz, PCLK1 36 MHz, PCLK2 72 MHz), derived from the HSI, so that any board will do. Each line is printed by
//! semihosting.
#![no_std]
#![no_main]

use core::arch::asm;

use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use cortex_m_semihosting::hprintln;
use mechanics_images::finish;
use stm32f4xx_hal::pac::Peripherals;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;

/// Number of repetitions of an instruction.
const COUNT: u32 = 64;
/// A register on each bus: CR of PWR, MEMRMP of SYSCFG, IDR of GPIOA.
const ON_APB1: u32 = 0x4000_7000;
const ON_APB2: u32 = 0x4001_3800;
const ON_AHB1: u32 = 0x4002_0010;
/// Registers to which a zero can be written without effect: CSR of PWR, EXTICR1 of SYSCFG.
const WRITABLE_ON_APB1: u32 = 0x4000_7004;
const WRITABLE_ON_APB2: u32 = 0x4001_3808;

/// The cycles of some code and of reading the counter. The first of two runs fills the caches of the flash.
#[inline(always)]
fn cycles(code: impl Fn()) -> u32 {
    let mut took = 0;
    for _ in 0..2 {
        unsafe { asm!("dsb", "isb") };
        let before = DWT::cycle_count();
        unsafe { asm!("isb") };
        code();
        unsafe { asm!("isb") };
        took = DWT::cycle_count().wrapping_sub(before);
    }
    took
}

/// Repeats an instruction and prints its cycles: the difference between twice as many repetitions and once as many, in
/// which the code around them cancels out.
macro_rules! repeat {
    ($name:literal, $($instruction:literal),+ $(; $($operand:tt)*)?) => {{
        let once = cycles(|| unsafe { asm!(".rept 64", $($instruction),+, ".endr" $(, $($operand)*)?) });
        let twice = cycles(|| unsafe { asm!(".rept 128", $($instruction),+, ".endr" $(, $($operand)*)?) });
        hprintln!("{}: {} took {}", $name, COUNT, twice.wrapping_sub(once))
    }};
}

/// 4 KiB of straight-line code: more than the caches hold.
#[inline(never)]
fn straight_line() {
    unsafe { asm!(".rept 2048", "nop", ".endr") };
}

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().unwrap();
    let chip = Peripherals::take().unwrap();
    let clocks = Config::hsi().sysclk(144.MHz()).pclk1(36.MHz()).pclk2(72.MHz());
    let mut rcc = chip.RCC.freeze(clocks);
    let _port = chip.GPIOA.split(&mut rcc);
    let _syscfg = chip.SYSCFG.constrain(&mut rcc);
    rcc.apb1enr().modify(|_, w| w.pwren().enabled());
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let word = 0_u32;
    let here = &raw const word;
    repeat!("ADDS", "adds r0, r0, #1"; out("r0") _);
    repeat!("LDR, one after the other", "ldr r0, [{0}]"; in(reg) here, out("r0") _);
    repeat!("STR", "str r0, [{0}]"; in(reg) here, out("r0") _);
    repeat!("branch not taken", "cmp r0, r0", "bne 2f", "2:"; out("r0") _);
    // The branch skips an instruction: a branch to the next instruction would look the same as one not taken.
    repeat!("branch taken", "b 2f", "nop", "2:");
    repeat!("UDIV of 1", "udiv r1, {0}, {0}"; in(reg) 1, out("r1") _);
    repeat!("UDIV of FFFFFFFFh", "udiv r1, {0}, {1}"; in(reg) u32::MAX, in(reg) 3, out("r1") _);
    repeat!("VADD, each for itself", "vadd.f32 s0, s1, s2"; out("s0") _);
    repeat!("VADD of the one before", "vadd.f32 s0, s0, s1"; out("s0") _);
    repeat!("VDIV", "vdiv.f32 s0, s1, s2"; out("s0") _);
    repeat!("LDR on APB1", "ldr r0, [{0}]"; in(reg) ON_APB1, out("r0") _);
    repeat!("LDR on APB2", "ldr r0, [{0}]"; in(reg) ON_APB2, out("r0") _);
    repeat!("LDR on AHB1", "ldr r0, [{0}]"; in(reg) ON_AHB1, out("r0") _);
    let zero = 0_u32;
    repeat!("STR on APB1", "str {1}, [{0}]"; in(reg) WRITABLE_ON_APB1, in(reg) zero);
    repeat!("STR on APB2", "str {1}, [{0}]"; in(reg) WRITABLE_ON_APB2, in(reg) zero);
    hprintln!("4 KiB of NOP: 2048 took {}", cycles(straight_line) - cycles(|| ()));
    finish(Ok(()))
}
