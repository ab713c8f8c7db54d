//! The nested vectored interrupt controller, for interrupts and system exceptions alike (ARMv7-M, B1.5 and B3.4).

use chip::IrqLines;

use crate::exception::Exception;

/// Bits of priority that the STM32F4 implements, in the high bits of the byte.
const PRIORITY_BITS: u32 = 4;

/// Exceptions that are always enabled: Reset to SysTick.
const ALWAYS_ENABLED: u128 = 0xFFFF;

/// The registers that mask exceptions.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Masks {
    pub(crate) primask: bool,
    pub(crate) faultmask: bool,
    pub(crate) basepri: u8,
}

/// Pending, enabled and active exceptions with their priorities.
#[derive(Clone, Debug)]
pub(crate) struct Nvic {
    pending: u128,
    enabled: u128,
    active: u128,
    lines: u128,
    priority: [u8; Exception::COUNT],
    /// AIRCR.PRIGROUP: the number of low priority bits that do not decide about preemption, less one.
    group: u32,
}

impl Default for Nvic {
    fn default() -> Nvic {
        Nvic {
            pending: 0,
            enabled: ALWAYS_ENABLED,
            active: 0,
            lines: 0,
            priority: [0; Exception::COUNT],
            group: 0,
        }
    }
}

impl Nvic {
    /// Takes the levels of the interrupt lines. A rising line pends; a line that stays high pends again when its
    /// exception ends.
    pub(crate) fn sample(&mut self, lines: IrqLines) {
        let lines = exceptions_of(lines);
        self.pending |= lines & !self.lines;
        self.lines = lines;
    }

    /// Whether the lines are as they were at the last sample.
    pub(crate) fn has_seen(&self, lines: IrqLines) -> bool {
        self.lines == exceptions_of(lines)
    }

    pub(crate) fn pend(&mut self, exception: Exception) {
        self.pending |= exception.bit();
    }

    /// Clears a pending state; a line that is still high sets it again at once.
    pub(crate) fn clear(&mut self, exceptions: u128) {
        self.pending &= !exceptions;
        self.pending |= self.lines & exceptions & !self.active;
    }

    pub(crate) fn is_pending(&self, exception: Exception) -> bool {
        self.pending & exception.bit() != 0
    }

    pub(crate) fn is_active(&self, exception: Exception) -> bool {
        self.active & exception.bit() != 0
    }

    /// Whether any exception is active.
    pub(crate) fn any_active(&self) -> bool {
        self.active != 0
    }

    /// Number of active exceptions.
    pub(crate) fn active_count(&self) -> u32 {
        self.active.count_ones()
    }

    /// The pending and enabled exception of the highest priority.
    pub(crate) fn first_pending(&self) -> Option<Exception> {
        self.first()
    }

    /// Active and pending system exceptions as SHCSR shows them (ARMv7-M, B3.2.13).
    pub(crate) fn system_states(&self) -> u32 {
        let active = [
            (Exception::MEM_MANAGE, 0),
            (Exception::BUS_FAULT, 1),
            (Exception::USAGE_FAULT, 3),
            (Exception::SV_CALL, 7),
            (Exception::PEND_SV, 10),
            (Exception::SYS_TICK, 11),
        ];
        let pending = [
            (Exception::USAGE_FAULT, 12),
            (Exception::MEM_MANAGE, 13),
            (Exception::BUS_FAULT, 14),
            (Exception::SV_CALL, 15),
        ];
        let active = active.into_iter().filter(|(exception, _)| self.is_active(*exception));
        let pending = pending.into_iter().filter(|(exception, _)| self.is_pending(*exception));
        active.chain(pending).fold(0, |word, (_, bit)| word | 1 << bit)
    }

    /// Whether an interrupt (not a system exception) is pending.
    pub(crate) fn any_irq_pending(&self) -> bool {
        self.pending >> 16 != 0
    }

    /// The numbers of all pending exceptions, as a set.
    pub(crate) fn pending_set(&self) -> u128 {
        self.pending
    }

    /// Makes a pending exception the active one.
    pub(crate) fn activate(&mut self, exception: Exception) {
        self.pending &= !exception.bit();
        self.active |= exception.bit();
    }

    /// Ends an active exception.
    pub(crate) fn deactivate(&mut self, exception: Exception) {
        self.active &= !exception.bit();
        self.pending |= self.lines & exception.bit();
    }

    /// The priority at which the core runs, masks left out: -1 in HardFault, 256 in Thread mode.
    fn active_priority(&self) -> i16 {
        bits(self.active).map(|exception| self.group_priority(exception)).min().unwrap_or(256)
    }

    /// The priority at which the core runs.
    pub(crate) fn execution_priority(&self, masks: Masks) -> i16 {
        let mut priority = self.active_priority();
        if masks.basepri != 0 {
            priority = priority.min(self.grouped(masks.basepri));
        }
        if masks.primask {
            priority = priority.min(0);
        }
        if masks.faultmask {
            priority = priority.min(-1);
        }
        priority
    }

    /// Whether an exception could preempt if no register masked it: a fast check before the exact one.
    #[inline]
    pub(crate) fn could_preempt(&self) -> bool {
        self.pending & self.enabled != 0 && self.to_take(Masks::default()).is_some()
    }

    /// The exception to take now, if one can preempt.
    pub(crate) fn to_take(&self, masks: Masks) -> Option<Exception> {
        let candidate = self.first()?;
        (self.group_priority(candidate) < self.execution_priority(masks)).then_some(candidate)
    }

    /// Whether WFI ends: whether an exception could preempt with PRIMASK clear.
    pub(crate) fn wakes(&self, masks: Masks) -> bool {
        self.to_take(Masks { primask: false, ..masks }).is_some()
    }

    /// Whether a fault with this exception could be taken now instead of escalating.
    pub(crate) fn may_preempt(&self, exception: Exception, masks: Masks) -> bool {
        self.group_priority(exception) < self.execution_priority(masks)
    }

    /// The pending exception with the highest priority; of equal ones, the one with the lowest number.
    fn first(&self) -> Option<Exception> {
        bits(self.pending & self.enabled).min_by_key(|exception| (self.full_priority(*exception), *exception))
    }

    fn full_priority(&self, exception: Exception) -> i16 {
        match exception {
            Exception::NMI => -2,
            Exception::HARD_FAULT => -1,
            Exception(number) => i16::from(self.priority[usize::from(number)]),
        }
    }

    fn group_priority(&self, exception: Exception) -> i16 {
        match self.full_priority(exception) {
            fixed @ ..0 => fixed,
            priority => self.grouped(priority as u8),
        }
    }

    fn grouped(&self, priority: u8) -> i16 {
        i16::from(priority) & !((2 << self.group) - 1)
    }

    /// The priority of an exception among the 16 of the chip; 0 for those with a fixed one.
    pub(crate) fn level(&self, exception: Exception) -> usize {
        (self.full_priority(exception).max(0) >> (8 - PRIORITY_BITS)) as usize
    }

    pub(crate) fn group(&self) -> u32 {
        self.group
    }

    pub(crate) fn set_group(&mut self, group: u32) {
        self.group = group & 7;
    }

    pub(crate) fn priority(&self, exception: Exception) -> u8 {
        self.priority[usize::from(exception.0)]
    }

    pub(crate) fn set_priority(&mut self, exception: Exception, priority: u8) {
        self.priority[usize::from(exception.0)] = priority & !(0xFF >> PRIORITY_BITS);
    }

    pub(crate) fn enabled_word(&self, word: u32) -> u32 {
        irq_word(self.enabled, word)
    }

    pub(crate) fn pending_word(&self, word: u32) -> u32 {
        irq_word(self.pending, word)
    }

    pub(crate) fn active_word(&self, word: u32) -> u32 {
        irq_word(self.active, word)
    }

    pub(crate) fn enable(&mut self, word: u32, bits: u32) {
        self.enabled |= irq_bits(word, bits);
    }

    pub(crate) fn disable(&mut self, word: u32, bits: u32) {
        self.enabled &= !irq_bits(word, bits);
    }

    pub(crate) fn set_pending(&mut self, word: u32, bits: u32) {
        self.pending |= irq_bits(word, bits);
    }

    pub(crate) fn clear_pending(&mut self, word: u32, bits: u32) {
        self.clear(irq_bits(word, bits));
    }
}

/// The exceptions of the lines that are high.
fn exceptions_of(lines: IrqLines) -> u128 {
    lines.irqs << 16 | if lines.nmi { Exception::NMI.bit() } else { 0 }
}

/// The exceptions of a set.
fn bits(mut set: u128) -> impl Iterator<Item = Exception> {
    std::iter::from_fn(move || {
        let number = set.trailing_zeros();
        (number < 128).then(|| {
            set &= set - 1;
            Exception(number as u8)
        })
    })
}

/// The 32 interrupts of a register, from a set of exceptions.
fn irq_word(set: u128, word: u32) -> u32 {
    (set >> 16).checked_shr(word * 32).unwrap_or(0) as u32
}

fn irq_bits(word: u32, bits: u32) -> u128 {
    u128::from(bits).checked_shl(word * 32 + 16).unwrap_or(0)
}
