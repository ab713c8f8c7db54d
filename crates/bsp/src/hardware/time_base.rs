//! TIM2 as the time base: one microsecond a count, extended to 64 bits, with two alarms.

use canopen::{Duration, Instant};
use stm32f4xx_hal::pac::{TIM2, tim2};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::bit_timing::APB1_HZ;
use crate::extension::Extension;

static EXTENSION: Extension = Extension::new();

/// Half a period: no alarm is set further ahead, so that a compare value means one instant only.
const FARTHEST: Duration = Duration(1 << 31);

/// Microseconds after its time, from which on an alarm without a flag has lost its flag. The interrupt is late by a few microseconds
/// at most.
const MISSED: u32 = 500;

/// Clock of the timers at APB1: twice that of the bus, which is divided (RM0390, 6.2).
const TIMER_MHZ: u32 = 2 * APB1_HZ / 1_000_000;

fn registers() -> &'static tim2::RegisterBlock {
    // SAFETY: TIM2 is given to `start`, so only this module uses it. Of its registers CNT is read only, each CCR belongs to
    // one alarm, EGR and SR are written without being read back; nothing is read, changed and written by two priorities.
    unsafe { &*TIM2::ptr() }
}

/// Starts TIM2 at 1 MHz. Its interrupt comes at each alarm and twice a period for the extension.
pub(crate) fn start(_tim2: TIM2, rcc: &mut Rcc) -> (TimeInterrupt, [Alarm; 2]) {
    TIM2::enable(rcc);
    TIM2::reset(rcc);
    let prescaler = TIMER_MHZ - 1;
    let tim2 = registers();
    tim2.psc().write(|w| w.psc().set(prescaler as u16));
    tim2.arr().write(|w| w.arr().set(u32::MAX));
    tim2.ccr3().write(|w| w.ccr().set(1 << 31));
    // The prescaler takes effect with an update, which must not look like the end of a period.
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

/// The channels that are alarms, by their index among the registers.
#[derive(Clone, Copy, Debug)]
enum Compare {
    First = 0,
    Second = 1,
}

impl Alarm {
    /// Raises the interrupt of the timer at `deadline`, or at once when the deadline is past. An alarm further ahead than half a period
    /// of the counter comes after half a period: the caller then sets the alarm again.
    #[expect(clippy::cast_possible_truncation, reason = "the hardware compares the low half")]
    pub fn set(&mut self, deadline: Instant) {
        let now = Clock::now();
        let deadline = deadline.max(now).min(now + FARTHEST);
        registers().ccr(self.0 as usize).write(|w| w.ccr().set(deadline.0 as u32));
        // The counter may have passed the value before it was written: then no match comes for 71 minutes.
        if Clock::now() >= deadline {
            registers().egr().write(|w| w.ccg(self.0 as u8).set_bit());
        }
    }
}

/// The timer's interrupt.
#[derive(Debug)]
pub struct TimeInterrupt {
    /// For each alarm, the value of the compare register for which [`TimeInterrupt::acknowledge`] has reported the alarm.
    told: [u32; 2],
}

/// State of an alarm after a look at the counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ring {
    /// Its time has not come, or was reported before.
    No,
    /// It has just gone off.
    Yes,
    /// Its time has passed, and its interrupt never came.
    Missed,
}

impl TimeInterrupt {
    /// Acknowledges the interrupt, keeps the extension up to date, and tells which alarms have gone off. An alarm whose flag was lost is
    /// found by the time: a caller that comes by every millisecond without an interrupt finds such an alarm a millisecond late.
    pub fn acknowledge(&mut self) -> [Ring; 2] {
        // In this order: an alarm whose time had come before has its flag.
        let now = registers().cnt().read().cnt().bits();
        let flags = registers().sr().read();
        // SAFETY: every bit of SR is cleared by writing 0 and left alone by writing 1, reserved bits included.
        registers().sr().write(|w| unsafe { w.bits(!flags.bits()) });
        EXTENSION.follow(registers().cnt().read().cnt().bits());
        let [first, second] = &mut self.told;
        [
            ring(Compare::First, first, flags.cc1if().bit(), now),
            ring(Compare::Second, second, flags.cc2if().bit(), now),
        ]
    }
}

/// The state of one alarm. No alarm is set further ahead than half a period, so a compare value that seems to lie further ahead has
/// passed.
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
