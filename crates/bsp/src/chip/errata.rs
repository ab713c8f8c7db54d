//! Errata of the core and of its debug port that concern the tasks.

use core::arch::naked_asm;

use stm32f4xx_hal::pac::DBGMCU;

/// Sleeps until an interrupt is pending.
///
/// With DBG_SLEEP set, the core may execute wrong instructions after a WFI in flash, depending on the address of WFI
/// (ES0298 and ES0182: debugging Sleep/Stop mode with WFE/WFI entry; mynewt-core 2058, RIOT 20149, mbed-os 12294). A
/// debugger may set the bit as well. WFI at a multiple of eight with ISB behind it is safe, as is WFI in RAM. A test
/// checks the addresses in the ELF files.
#[unsafe(naked)]
pub extern "C" fn sleep() {
    naked_asm!(".p2align 3", "wfi", "isb", "bx lr")
}

/// The end of a task: its drop waits until the last store of the task has arrived. Without the wait, a store that
/// overlaps the return from the interrupt may make the core enter the handler of another one (erratum 838869 of the
/// Cortex-M4). A task makes this value first, so that it is dropped last.
pub struct TaskEnd;

impl Drop for TaskEnd {
    fn drop(&mut self) {
        cortex_m::asm::dsb();
    }
}

/// Keeps the debug port clocked while the core sleeps, because RTT is read then. For development only: see [`sleep`].
pub(crate) fn keep_debugger(debug: &DBGMCU, is_for_development: bool) {
    if is_for_development {
        debug.cr().modify(|_, w| w.dbg_sleep().set_bit());
    }
}
