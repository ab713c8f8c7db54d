//! The nested vectored interrupt controller, for interrupts and system exceptions alike: what is enabled, pending and
//! active, and which exception is next (ARMv7-M ARM, B1.5.4 and B3.4).

use canbus::Time;

use crate::exception::{Exception, Set};

/// Execution priority of Thread mode with nothing masked: below every exception.
pub(crate) const THREAD_PRIORITY: i16 = 256;

/// Priority bits that the STM32F4 implements (PM0214, section 4.3): the upper four.
const IMPLEMENTED: u8 = 0xF0;

/// Exceptions of the system have no enable bit here. The configurable faults are sorted out where they are raised.
const ALWAYS_ENABLED: u128 = 0xFFFF;

/// A pending exception that could be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Candidate {
    pub(crate) exception: Exception,
    /// Its group priority: what counts for preemption.
    pub(crate) priority: i16,
}

/// A bit register of the controller.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Bits {
    Enabled,
    Pending,
    Active,
}

/// Pending, enabled and active exceptions with their priorities.
pub(crate) struct Nvic {
    pending: Set,
    active: Set,
    enabled: Set,
    priority: [u8; Exception::COUNT],
    /// When a pending exception became pending.
    since: [Time; Exception::COUNT],
    /// Which priority bits are group priority.
    group_mask: u8,
    lines: u128,
    active_priority: i16,
}

impl Nvic {
    pub(crate) fn new() -> Nvic {
        Nvic {
            pending: Set::default(),
            active: Set::default(),
            enabled: Set(ALWAYS_ENABLED),
            priority: [0; Exception::COUNT],
            since: [Time::ZERO; Exception::COUNT],
            group_mask: 0xFE,
            lines: 0,
            active_priority: THREAD_PRIORITY,
        }
    }

    pub(crate) fn pend(&mut self, exception: Exception, now: Time) {
        if !self.pending.contains(exception) {
            self.since[exception.index()] = now;
            self.pending.insert(exception);
        }
    }

    pub(crate) fn unpend(&mut self, exception: Exception) {
        self.pending.remove(exception);
    }

    pub(crate) fn is_pending(&self, exception: Exception) -> bool {
        self.pending.contains(exception)
    }

    pub(crate) fn any_irq_pending(&self) -> bool {
        self.pending.0 > ALWAYS_ENABLED
    }

    pub(crate) fn is_active(&self, exception: Exception) -> bool {
        self.active.contains(exception)
    }

    pub(crate) fn pending_since(&self, exception: Exception) -> Time {
        self.since[exception.index()]
    }

    /// Any exception active besides `exception`.
    pub(crate) fn others_active(&self, exception: Exception) -> bool {
        let mut others = self.active;
        others.remove(exception);
        others.0 != 0
    }

    /// Samples the interrupt lines: a rising line becomes pending, and with `levels` one that is high while its
    /// handler does not run.
    pub(crate) fn sample(&mut self, lines: u128, levels: bool, now: Time) {
        let rising = Set::of_lines(lines & !self.lines).0;
        let high = if levels { Set::of_lines(lines).0 & !self.active.0 } else { 0 };
        self.lines = lines;
        for exception in Set((rising | high) & !self.pending.0).iter() {
            self.pend(exception, now);
        }
    }

    pub(crate) fn activate(&mut self, exception: Exception) {
        self.pending.remove(exception);
        self.active.insert(exception);
        self.update_active_priority();
    }

    /// The handler ends. With `levels`, a line that is still high pends again.
    pub(crate) fn deactivate(&mut self, exception: Exception, levels: bool, now: Time) {
        self.active.remove(exception);
        self.update_active_priority();
        let high = exception.line().is_some_and(|line| self.lines >> line & 1 != 0);
        if high && levels {
            self.pend(exception, now);
        }
    }

    /// Group priority of an exception.
    pub(crate) fn group_priority(&self, exception: Exception) -> i16 {
        match exception {
            Exception::NMI => -2,
            Exception::HARD_FAULT => -1,
            other => self.group(self.priority[other.index()]),
        }
    }

    /// The group part of a priority, as BASEPRI is compared.
    pub(crate) fn group(&self, priority: u8) -> i16 {
        i16::from(priority & self.group_mask)
    }

    /// The priority that the active exceptions give, before the mask registers.
    pub(crate) fn active_priority(&self) -> i16 {
        self.active_priority
    }

    /// The priority that BASEPRI gives; zero masks nothing.
    pub(crate) fn base_priority(&self, basepri: u32) -> i16 {
        match basepri as u8 & IMPLEMENTED {
            0 => THREAD_PRIORITY,
            priority => self.group(priority),
        }
    }

    /// The first of the pending and enabled exceptions: by group priority, then sub-priority, then number.
    pub(crate) fn best(&self) -> Option<Candidate> {
        let ready = Set(self.pending.0 & self.enabled.0);
        let exception = ready.iter().min_by_key(|&exception| {
            (self.group_priority(exception), self.priority[exception.index()], exception)
        })?;
        Some(Candidate { exception, priority: self.group_priority(exception) })
    }

    fn update_active_priority(&mut self) {
        let priorities = self.active.iter().map(|exception| self.group_priority(exception));
        self.active_priority = priorities.min().unwrap_or(THREAD_PRIORITY);
    }

    pub(crate) fn set_priority(&mut self, exception: Exception, priority: u8) {
        self.priority[exception.index()] = priority & IMPLEMENTED;
        self.update_active_priority();
    }

    pub(crate) fn priority(&self, exception: Exception) -> u8 {
        self.priority[exception.index()]
    }

    /// AIRCR.PRIGROUP: how many low bits of a priority only order pending exceptions.
    pub(crate) fn set_grouping(&mut self, prigroup: u32) {
        self.group_mask = (0xFE_u32 << (prigroup & 7)) as u8;
        self.update_active_priority();
    }

    /// A bit register for lines `32 * index` and up, `index` 0 to 3.
    pub(crate) fn word(&self, register: Bits, index: u32) -> u32 {
        let set = match register {
            Bits::Enabled => self.enabled,
            Bits::Pending => self.pending,
            Bits::Active => self.active,
        };
        (set.0 >> 16 >> (32 * index)) as u32
    }

    pub(crate) fn enable(&mut self, index: u32, bits: u32) {
        self.enabled.0 |= lines(index, bits).0;
    }

    pub(crate) fn disable(&mut self, index: u32, bits: u32) {
        self.enabled.0 &= !lines(index, bits).0;
    }

    /// ISPR and STIR: pends lines by software.
    pub(crate) fn set_pending(&mut self, index: u32, bits: u32, now: Time) {
        for exception in lines(index, bits).iter() {
            self.pend(exception, now);
        }
    }

    /// ICPR: a line that is still high pends again at the next sample.
    pub(crate) fn clear_pending(&mut self, index: u32, bits: u32) {
        self.pending.0 &= !lines(index, bits).0;
    }
}

/// The exceptions of 32 lines.
fn lines(index: u32, bits: u32) -> Set {
    Set::of_lines(u128::from(bits) << (32 * index))
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Exception = Exception::irq(3);
    const B: Exception = Exception::irq(40);

    fn nvic() -> Nvic {
        let mut nvic = Nvic::new();
        nvic.enable(0, 1 << 3);
        nvic.enable(1, 1 << 8);
        nvic
    }

    #[test]
    fn lower_value_goes_first_then_lower_number() {
        let mut nvic = nvic();
        nvic.set_priority(A, 0x80);
        nvic.set_priority(B, 0x40);
        nvic.pend(A, Time::ZERO);
        nvic.pend(B, Time::ZERO);
        assert_eq!(nvic.best().map(|best| best.exception), Some(B));
        nvic.set_priority(B, 0x80);
        assert_eq!(nvic.best().map(|best| best.exception), Some(A));
    }

    #[test]
    fn only_the_group_part_preempts() {
        let mut nvic = nvic();
        nvic.set_grouping(5); // two group bits
        nvic.set_priority(A, 0x90);
        nvic.set_priority(B, 0x80);
        nvic.activate(A);
        nvic.pend(B, Time::ZERO);
        assert_eq!(nvic.best().map(|best| best.priority), Some(nvic.active_priority()));
    }

    #[test]
    fn a_disabled_line_stays_pending() {
        let mut nvic = nvic();
        nvic.disable(0, 1 << 3);
        nvic.pend(A, Time::ZERO);
        assert_eq!(nvic.best(), None);
        assert_eq!(nvic.word(Bits::Pending, 0), 1 << 3);
    }

    #[test]
    fn a_level_pends_again_when_its_handler_ends() {
        let mut nvic = nvic();
        nvic.sample(1 << 3, true, Time::ZERO);
        nvic.activate(A);
        nvic.sample(1 << 3, true, Time(1));
        assert!(!nvic.is_pending(A));
        nvic.deactivate(A, true, Time(2));
        assert!(nvic.is_pending(A));
        assert_eq!(nvic.pending_since(A), Time(2));
    }

    #[test]
    fn a_pulse_during_the_handler_is_not_lost() {
        let mut nvic = nvic();
        nvic.sample(1 << 3, true, Time::ZERO);
        nvic.activate(A);
        nvic.sample(0, true, Time(1));
        nvic.sample(1 << 3, true, Time(2));
        nvic.sample(0, true, Time(3));
        nvic.deactivate(A, true, Time(4));
        assert!(nvic.is_pending(A));
    }
}
