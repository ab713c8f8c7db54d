//! Exceptions by number, as ARMv7-M counts them: 0 is Thread mode, 1..15 the system, 16 and up the interrupts.

use std::fmt;

/// An exception number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Exception(pub u8);

impl Exception {
    /// Not an exception: Thread mode.
    pub const THREAD: Exception = Exception(0);
    /// Non-maskable interrupt.
    pub const NMI: Exception = Exception(2);
    /// HardFault.
    pub const HARD_FAULT: Exception = Exception(3);
    /// Memory management fault.
    pub const MEM_MANAGE: Exception = Exception(4);
    /// Bus fault.
    pub const BUS_FAULT: Exception = Exception(5);
    /// Usage fault.
    pub const USAGE_FAULT: Exception = Exception(6);
    /// Supervisor call.
    pub const SV_CALL: Exception = Exception(11);
    /// Pended service call.
    pub const PEND_SV: Exception = Exception(14);
    /// The core's own timer.
    pub const SYS_TICK: Exception = Exception(15);
    /// Number of exception numbers: 16 of the system and 112 interrupts.
    pub const COUNT: usize = 128;

    /// The exception of an interrupt line.
    pub const fn irq(line: u8) -> Exception {
        Exception(16 + line)
    }

    /// The interrupt line; `None` for a system exception.
    pub const fn line(self) -> Option<u8> {
        self.0.checked_sub(16)
    }

    pub(crate) const fn bit(self) -> u128 {
        1 << self.0
    }
}

impl fmt::Display for Exception {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (*self, self.line()) {
            (Exception::THREAD, _) => f.write_str("Thread"),
            (Exception::NMI, _) => f.write_str("NMI"),
            (Exception::HARD_FAULT, _) => f.write_str("HardFault"),
            (Exception::MEM_MANAGE, _) => f.write_str("MemManage"),
            (Exception::BUS_FAULT, _) => f.write_str("BusFault"),
            (Exception::USAGE_FAULT, _) => f.write_str("UsageFault"),
            (Exception::SV_CALL, _) => f.write_str("SVCall"),
            (Exception::PEND_SV, _) => f.write_str("PendSV"),
            (Exception::SYS_TICK, _) => f.write_str("SysTick"),
            (_, Some(line)) => write!(f, "IRQ{line}"),
            (Exception(number), None) => write!(f, "exception {number}"),
        }
    }
}
