//! A program observes its stores that have not arrived yet, and notes the observations; the test knows the right ones in each
//! mode. On the bench, the word at 4000 0000h is the level of interrupt 28, and bit 0 of the word at 4002 3830h is the clock
//! of the word at 4002 0000h.
#![no_std]
#![no_main]

use core::arch::asm;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::NVIC;
use cortex_m_rt::entry;
use mechanics_images::{finish, note};
use stm32f4::stm32f446::{Interrupt, interrupt};

const LEVEL: *mut u32 = 0x4000_0000 as *mut u32;
const ENABLE: *mut u32 = 0x4002_3830 as *mut u32;
const CLOCKED: *mut u32 = 0x4002_0000 as *mut u32;
const ICPR: u32 = 0xE000_E280;
const BIT: u32 = 1 << 28;

static ENTRIES: AtomicU32 = AtomicU32::new(0);
static WAITS: AtomicU32 = AtomicU32::new(0);

/// Raises the line and waits; the number of entries of the handler.
fn entries(waits: u32) -> u32 {
    ENTRIES.store(0, Relaxed);
    WAITS.store(waits, Relaxed);
    unsafe { LEVEL.write_volatile(1) };
    cortex_m::asm::dsb();
    cortex_m::asm::delay(1000);
    ENTRIES.load(Relaxed)
}

/// Lowers the line and clears the pending state right behind; whether the interrupt is pending afterwards.
fn stays_pending(waits: bool) -> u32 {
    NVIC::mask(Interrupt::TIM2);
    unsafe { LEVEL.write_volatile(1) };
    cortex_m::asm::dsb();
    let (level, clear) = (LEVEL, ICPR as *mut u32);
    if waits {
        unsafe {
            asm!("str {0}, [{1}]", "ldr {0}, [{1}]", "str {2}, [{3}]", inout(reg) 0 => _, in(reg) level, in(reg) BIT, in(reg) clear)
        };
    } else {
        unsafe {
            asm!("str {0}, [{1}]", "str {2}, [{3}]", in(reg) 0, in(reg) level, in(reg) BIT, in(reg) clear)
        };
    }
    cortex_m::asm::delay(1000);
    let is_pending = NVIC::is_pending(Interrupt::TIM2);
    NVIC::unpend(Interrupt::TIM2);
    is_pending.into()
}

/// Stores right behind the enabling of a clock; what arrived.
fn behind_enable(waits: bool) -> u32 {
    unsafe { ENABLE.write_volatile(0) };
    cortex_m::asm::dsb();
    if waits {
        unsafe {
            asm!("str {0}, [{1}]", "dsb", "str {2}, [{3}]", in(reg) 1, in(reg) ENABLE, in(reg) 7, in(reg) CLOCKED)
        };
    } else {
        unsafe {
            asm!("str {0}, [{1}]", "str {2}, [{3}]", in(reg) 1, in(reg) ENABLE, in(reg) 7, in(reg) CLOCKED)
        };
    }
    cortex_m::asm::delay(1000);
    let arrived = unsafe { CLOCKED.read_volatile() };
    unsafe { CLOCKED.write_volatile(0) };
    cortex_m::asm::dsb();
    arrived
}

#[entry]
fn main() -> ! {
    note(2, stays_pending(false));
    note(3, stays_pending(true));
    unsafe { NVIC::unmask(Interrupt::TIM2) };
    note(0, entries(0));
    note(1, entries(1));
    note(4, behind_enable(false));
    note(5, behind_enable(true));
    finish(Ok(()))
}

#[interrupt]
fn TIM2() {
    ENTRIES.fetch_add(1, Relaxed);
    let waits = WAITS.load(Relaxed);
    unsafe { LEVEL.write_volatile(0) };
    if waits != 0 {
        cortex_m::asm::dsb();
    }
}
