//! Tests of the board at the start of a development image: the stack, the clock, the LSI, the CAN controller. Their results
//! are values of 2005h ([`crate::start::self_test`]).
#![expect(unsafe_code, reason = "registers, and the stack")]

use core::arch::asm;
use core::sync::atomic::Ordering;

use canopen::Frame;
use cortex_m::peripheral::{DCB, DWT};
use stm32f4xx_hal::pac::{TIM5, tim5};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::boards::APB1_HZ;
use crate::can::bit_timing::BitTiming;
use crate::can::controller::{self, Controller, registers};
use crate::can::filters::{self, Fifo};
use crate::can::receive;
use crate::can::transmit::Transmitter;
use crate::chip::memory;
use crate::chip::vectors::UNUSED_STACK;
use crate::start::self_test::FOUND;

/// DEMCR: the trace unit is on. DWT_CTRL: the cycle counter runs (ARMv7-M, C1.6.5 and C1.8.7).
const TRACE: u32 = 1 << 24;
const COUNTS_CYCLES: u32 = 1 << 0;
/// The core runs from HSI until the PLL is ready.
const HSI_MHZ: u32 = 16;
/// TIM5_OR: channel 4 captures the LSI (RM0390, 17.4.21, TI4_RMP). CCMR2: channel 4 is an input. CCER: it captures.
const FROM_LSI: u32 = 0b01 << 6;
const INPUT: u32 = 1 << 8;
const CAPTURES: u32 = 1 << 12;
/// Cycles of the LSI in a measurement, half a millisecond.
const PERIODS: u32 = 16;
/// Clock of the timers at APB1 (RM0390, 6.2).
const TIMER_HZ: u32 = 2 * APB1_HZ;
/// Number of polls for an edge of the LSI: some cycles of the slowest one.
const EDGE_POLLS: u32 = 1 << 13;
/// Number of polls for a frame of 130 us in loop-back.
const FRAME_POLLS: u32 = 1 << 14;
/// CAN_BTR: loop-back, and silent towards the bus.
const LOOP_BACK: u32 = 1 << 30 | 1 << 31;

/// The number of the unused stack in 2005h.
pub(crate) const FREE_STACK: u8 = 108;

/// Starts the cycle counter.
pub(crate) fn begin() {
    // SAFETY: nothing else uses the cycle counter.
    unsafe {
        (*DCB::PTR).demcr.modify(|value| value | TRACE);
        (*DWT::PTR).cyccnt.write(0);
        (*DWT::PTR).ctrl.modify(|value| value | COUNTS_CYCLES);
    }
}

/// Fills the stack from its end to the stack pointer.
#[inline(never)]
fn mark_stack(end: u32) {
    // SAFETY: below the stack pointer nothing is in use, and no interrupt is enabled yet.
    unsafe {
        asm!(
            "mov {top}, sp",
            "2:",
            "cmp {at}, {top}",
            "bhs 3f",
            "str {mark}, [{at}], #4",
            "b 2b",
            "3:",
            at = inout(reg) end => _,
            top = out(reg) _,
            mark = in(reg) UNUSED_STACK,
        );
    }
}

/// Takes note of the part of the stack that is still marked.
pub(crate) fn note_stack() {
    let stack = memory::stack();
    // SAFETY: RAM, of which any content is a valid word.
    let is_unused = |at: &u32| unsafe { (*at as *const u32).read_volatile() } == UNUSED_STACK;
    let unused = stack.step_by(4).take_while(is_unused).count() as u32;
    FOUND.free_stack.store(4 * unused, Ordering::Relaxed);
}

/// Takes note of the cycles since the start: after the change to the PLL only a few instructions have run. Then marks the
/// unused stack, which takes 2 ms at the clock before.
pub(crate) fn note_clock() {
    FOUND.clock_wait.store(DWT::cycle_count() / HSI_MHZ, Ordering::Relaxed);
    mark_stack(memory::stack().start);
}

/// Measures the LSI by TIM5.
pub(crate) fn note_lsi(rcc: &mut Rcc) {
    TIM5::enable(rcc);
    TIM5::reset(rcc);
    // SAFETY: only this function uses TIM5, and the bits are those of its registers.
    let timer = unsafe {
        let timer = &*TIM5::ptr();
        timer.or().write(|w| w.bits(FROM_LSI));
        timer.ccmr2_input().write(|w| w.bits(INPUT));
        timer.ccer().write(|w| w.bits(CAPTURES));
        timer
    };
    timer.cr1().write(|w| w.cen().set_bit());
    let span = span(timer);
    TIM5::reset(rcc);
    TIM5::disable(rcc);
    let hertz = span.and_then(|span| (TIMER_HZ * PERIODS).checked_div(span));
    FOUND.lsi.store(hertz.unwrap_or(0), Ordering::Relaxed);
}

/// The counts from the first edge to the last one; `None` without edges.
fn span(timer: &tim5::RegisterBlock) -> Option<u32> {
    let first = edge(timer)?;
    let last = (0..PERIODS).try_fold(first, |_, _| edge(timer))?;
    Some(last.wrapping_sub(first))
}

/// The count at the next edge.
fn edge(timer: &tim5::RegisterBlock) -> Option<u32> {
    timer.sr().reset();
    let has_come = (0..EDGE_POLLS).any(|_| timer.sr().read().cc4if().bit_is_set());
    has_come.then(|| timer.ccr(3).read().bits())
}

/// The result of the test in loop-back.
#[derive(Clone, Copy)]
#[repr(u32)]
enum LoopBack {
    /// The frame was received as it was sent.
    Good = 1,
    /// The controller does not leave initialisation, or does not return to it.
    Mode = 2,
    /// The frame was not sent.
    NotSent = 3,
    /// The frame was not received.
    NotReceived = 4,
    /// Another frame was received.
    Different = 5,
}

/// Sends a frame in loop-back. The controller is off the bus before and afterwards.
pub(crate) fn note_loop_back(controller: &mut Controller) {
    let mut result = loop_back(controller);
    if !controller::is_initialising() {
        result = LoopBack::Mode;
    }
    FOUND.loop_back.store(result as u32, Ordering::Relaxed);
}

fn loop_back(controller: &mut Controller) -> LoopBack {
    let (Some(timing), Some(sent)) = (BitTiming::of(1000), Frame::new(0x2AA, &[0x55, 0xAA, 0, 0xFF])) else {
        return LoopBack::Mode;
    };
    let can = registers();
    // The timing can be set in initialisation only.
    if !controller::is_initialising() {
        return LoopBack::Mode;
    }
    // SAFETY: `BitTiming` asserts that its values fit the register.
    can.btr().write(|w| unsafe { w.bits(timing.btr() | LOOP_BACK) });
    controller.set_filters(&filters::everything());
    can.mcr().modify(|_, w| w.sleep().clear_bit().inrq().clear_bit());
    if !(0..FRAME_POLLS).any(|_| can.msr().read().inak().bit_is_clear()) {
        return LoopBack::Mode;
    }
    let is_sent = Transmitter::new().put(&sent)
        && (0..FRAME_POLLS).any(|_| can.tsr().read().rqcp0().bit_is_set())
        && can.tsr().read().txok0().bit_is_set();
    can.tsr().write(|w| w.rqcp0().set_bit().abrq0().set_bit());
    if !is_sent {
        return LoopBack::NotSent;
    }
    let state = can.rfr(Fifo::Services as usize);
    let has_come = (0..FRAME_POLLS).any(|_| state.read().fmp().bits() > 0);
    match receive::take(Fifo::Services).filter(|_| has_come) {
        None => LoopBack::NotReceived,
        Some(mailbox) if mailbox.frame() == Some(sent) => LoopBack::Good,
        Some(_) => LoopBack::Different,
    }
}
