//! TIM2 as the time base: one microsecond a count, extended to 64 bits, with two alarms.
#![expect(unsafe_code, reason = "registers")]

use canopen::{Duration, Instant};
use stm32f4xx_hal::pac::{TIM2, tim2};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::boards::APB1_HZ;
use crate::time::extension::Extension;

static EXTENSION: Extension = Extension::new();

/// Half a period: no alarm is set further ahead, so each compare value means one instant only.
const FARTHEST: Duration = Duration(1 << 31);

/// Microseconds after which an expired alarm without a flag has lost its flag. The interrupt is late by a few
/// microseconds at most.
const MISSED: u32 = 500;

/// Clock of the timers at APB1: twice the bus clock, because the bus clock is divided (RM0390, 6.2).
const TIMER_MHZ: u32 = 2 * APB1_HZ / 1_000_000;

fn registers() -> &'static tim2::RegisterBlock {
    // SAFETY: TIM2 is given to `start`, so only this module uses it. CNT is only read, each CCR belongs to one alarm,
    // and EGR and SR are written without being read back, so no register is read, changed and written by two
    // priorities.
    unsafe { &*TIM2::ptr() }
}

/// Starts TIM2 at 1 MHz. Its interrupt comes at each alarm, and twice a period for the extension.
pub(crate) fn start(_tim2: TIM2, rcc: &mut Rcc) -> (TimeInterrupt, [Alarm; 2]) {
    TIM2::enable(rcc);
    TIM2::reset(rcc);
    let prescaler = TIMER_MHZ - 1;
    let tim2 = registers();
    tim2.psc().write(|w| w.psc().set(prescaler as u16));
    tim2.arr().write(|w| w.arr().set(u32::MAX));
    tim2.ccr3().write(|w| w.ccr().set(1 << 31));
    // The prescaler takes effect with an update event, which must not look like the end of a period.
    tim2.egr().write(|w| w.ug().set_bit());
    tim2.sr().reset();
    tim2.dier().write(|w| w.uie().set_bit().cc1ie().set_bit().cc2ie().set_bit().cc3ie().set_bit());
    tim2.cr1().write(|w| w.cen().set_bit());
    (TimeInterrupt { told: [0; 2] }, [Alarm(Compare::First), Alarm(Compare::Second)])
}

/// Time since start-up.
#[derive(Clone, Copy, Debug)]
pub struct Clock;

impl Clock {
    /// The present instant, right at every priority.
    #[must_use]
    #[inline(never)]
    pub fn now() -> Instant {
        Instant(EXTENSION.read(|| registers().cnt().read().cnt().bits()))
    }
}

/// One compare channel.
#[derive(Debug)]
pub struct Alarm(Compare);

/// The compare channels used as alarms, with their index among the registers.
#[derive(Clone, Copy, Debug)]
enum Compare {
    First = 0,
    Second = 1,
}

impl Alarm {
    /// Raises the interrupt of the timer at `deadline`, or at once if the deadline has passed. An alarm more than half
    /// a period of the counter ahead is raised after half a period: the caller then sets it again.
    #[expect(clippy::cast_possible_truncation, reason = "the hardware compares the low half")]
    pub fn set(&mut self, deadline: Instant) {
        let now = Clock::now();
        let deadline = deadline.max(now).min(now + FARTHEST);
        registers().ccr(self.0 as usize).write(|w| w.ccr().set(deadline.0 as u32));
        // The counter may have passed the value before the value was written; the next match would then be 71 minutes
        // later.
        if Clock::now() >= deadline {
            registers().egr().write(|w| w.ccg(self.0 as u8).set_bit());
        }
    }
}

/// The timer's interrupt.
#[derive(Debug)]
pub struct TimeInterrupt {
    /// For each alarm, the compare value for which [`TimeInterrupt::acknowledge`] has already reported the alarm.
    told: [u32; 2],
}

/// State of an alarm when polled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ring {
    /// The alarm is not due, or was reported before.
    No,
    /// The alarm has just gone off.
    Yes,
    /// The alarm was due, but its interrupt never came.
    Missed,
}

impl TimeInterrupt {
    /// Acknowledges the interrupt, updates the extension, and returns which alarms have gone off. An alarm whose flag
    /// was lost is detected by its time: a caller that also calls every millisecond without an interrupt finds such an
    /// alarm a millisecond late.
    pub fn acknowledge(&mut self) -> [Ring; 2] {
        // In this order: an alarm that was due before `now` has its flag set.
        let now = registers().cnt().read().cnt().bits();
        let flags = registers().sr().read();
        // SAFETY: writing 0 clears a bit of SR, writing 1 leaves it alone, reserved bits included.
        registers().sr().write(|w| unsafe { w.bits(!flags.bits()) });
        EXTENSION.follow(registers().cnt().read().cnt().bits());
        let [first, second] = &mut self.told;
        [
            ring(Compare::First, first, flags.cc1if().bit(), now),
            ring(Compare::Second, second, flags.cc2if().bit(), now),
        ]
    }
}

/// The state of one alarm. No alarm is set more than half a period ahead, so a compare value that seems to be further
/// ahead has passed.
fn ring(alarm: Compare, told: &mut u32, has_flag: bool, now: u32) -> Ring {
    let due = registers().ccr(alarm as usize).read().ccr().bits();
    let is_late = (MISSED..1 << 31).contains(&now.wrapping_sub(due));
    let is_told = *told == due;
    if has_flag || is_late {
        *told = due;
    }
    match has_flag {
        true => Ring::Yes,
        false if is_late && !is_told => Ring::Missed,
        false => Ring::No,
    }
}
