//! Parts of the core that a test may switch off, to see that a program notices.

/// One mechanism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mechanism {
    /// A pending exception of higher priority interrupts a handler.
    Preemption,
    /// BASEPRI masks exceptions.
    Basepri,
    /// PRIMASK masks exceptions.
    Primask,
    /// Exception entry saves the floating-point registers in use.
    FloatFrame,
    /// Exception return restores the state of an IT block.
    ItState,
    /// Exception return clears the exclusive monitor.
    ExclusiveMonitor,
    /// Code written to flash takes the place of what was translated before.
    Retranslation,
    /// An interrupt whose line is still high at its end becomes pending again.
    Levels,
    /// A pending exception follows the ending one without unstacking.
    TailChain,
    /// An exception that arrives while a lower one is being entered goes first.
    LateArrival,
    /// A frame that cannot be stacked is a fault.
    StackingFault,
    /// A configurable fault whose handler is enabled goes to that handler.
    ConfigurableFaults,
    /// SysTick counts.
    SysTick,
    /// WFI sleeps until something is pending.
    Sleep,
    /// Software pends exceptions through ISPR, STIR and ICSR.
    SoftwarePending,
}

/// What is switched off.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Missing(u32);

impl Missing {
    pub(crate) fn add(&mut self, mechanism: Mechanism) {
        self.0 |= 1 << mechanism as u32;
    }

    pub(crate) fn contains(self, mechanism: Mechanism) -> bool {
        self.0 >> mechanism as u32 & 1 != 0
    }
}
