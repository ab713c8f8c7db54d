//! Mechanisms of the core that a test may switch off, to check that another test notices.

/// One mechanism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mechanism {
    /// BASEPRI masks interrupts.
    Basepri,
    /// A higher priority interrupts a lower one.
    Preemption,
    /// Exception entry saves the floating-point registers in use.
    FloatFrame,
    /// Exception return restores the state of an IT block.
    ItState,
    /// Exception entry and return clear the exclusive monitor.
    ExclusiveMonitor,
    /// Code written to flash replaces the translated code.
    Retranslation,
    /// A pending exception follows the ending one without unstacking.
    TailChain,
    /// A fault that cannot be taken becomes a HardFault.
    Escalation,
    /// The memory protection unit keeps code from running.
    ExecuteNever,
    /// Loads from a busy flash wait.
    FlashLoads,
    /// WFI sleeps until an interrupt is pending.
    Sleep,
}
