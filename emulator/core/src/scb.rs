//! The system control block's own registers (ARMv7-M, B3.2): vector table, fault status, sleep, configuration.

use crate::exception::Exception;
use crate::mpu::Mpu;
use crate::ppb;

/// Fault status bits of CFSR.
pub(crate) mod cfsr {
    pub(crate) const IACCVIOL: u32 = 1 << 0;
    pub(crate) const DACCVIOL: u32 = 1 << 1;
    pub(crate) const MSTKERR: u32 = 1 << 4;
    pub(crate) const MMARVALID: u32 = 1 << 7;
    pub(crate) const IBUSERR: u32 = 1 << 8;
    pub(crate) const PRECISERR: u32 = 1 << 9;
    pub(crate) const IMPRECISERR: u32 = 1 << 10;
    pub(crate) const UNSTKERR: u32 = 1 << 11;
    pub(crate) const STKERR: u32 = 1 << 12;
    pub(crate) const BFARVALID: u32 = 1 << 15;
    pub(crate) const UNDEFINSTR: u32 = 1 << 16;
    pub(crate) const INVSTATE: u32 = 1 << 17;
    pub(crate) const INVPC: u32 = 1 << 18;
    pub(crate) const NOCP: u32 = 1 << 19;
    pub(crate) const UNALIGNED: u32 = 1 << 24;
    pub(crate) const DIVBYZERO: u32 = 1 << 25;
}

/// HFSR: a configurable fault escalated.
const FORCED: u32 = 1 << 30;
/// HFSR: a breakpoint without a debugger.
const DEBUGEVT: u32 = 1 << 31;

/// The registers.
#[derive(Clone, Debug)]
pub(crate) struct Scb {
    pub(crate) vtor: u32,
    pub(crate) scr: u32,
    pub(crate) ccr: u32,
    pub(crate) shcsr: u32,
    pub(crate) cfsr: u32,
    pub(crate) hfsr: u32,
    pub(crate) bfar: u32,
    pub(crate) mmfar: u32,
    pub(crate) cpacr: u32,
    pub(crate) fpccr: u32,
    pub(crate) fpcar: u32,
    pub(crate) fpdscr: u32,
    pub(crate) demcr: u32,
    pub(crate) actlr: u32,
    pub(crate) mpu: Mpu,
}

impl Default for Scb {
    fn default() -> Scb {
        Scb {
            vtor: 0,
            scr: 0,
            ccr: 1 << 9,
            shcsr: 0,
            cfsr: 0,
            hfsr: 0,
            bfar: 0,
            mmfar: 0,
            cpacr: 0,
            fpccr: ASPEN | LSPEN,
            fpcar: 0,
            fpdscr: 0,
            demcr: 0,
            actlr: 0,
            mpu: Mpu::default(),
        }
    }
}

/// ACTLR: disables the write buffer, so that stores wait for their answer (Cortex-M4 technical reference manual,
/// 4.3.1).
const DISDEFWBUF: u32 = 1 << 1;

/// SCR: WFI enters Stop or Standby.
pub(crate) const SLEEPDEEP: u32 = 1 << 2;

/// FPCCR: a frame has room for the floating-point registers; they are saved at the first use only; that use is still to
/// come (ARMv7-M, B3.2.21).
const ASPEN: u32 = 1 << 31;
const LSPEN: u32 = 1 << 30;
const LSPACT: u32 = 1 << 0;

/// CCR: traps of unaligned accesses and of divisions by zero.
pub(crate) const UNALIGN_TRP: u32 = 1 << 3;
pub(crate) const DIV_0_TRP: u32 = 1 << 4;

impl Scb {
    /// Whether CPACR allows the floating-point unit: privileged access to CP10 and CP11.
    pub(crate) fn allows_floats(&self) -> bool {
        self.cpacr >> 20 & 0b0101 == 0b0101
    }

    /// Whether the frame of an exception has the floating-point registers, if they are in use.
    pub(crate) fn stacks_floats(&self) -> bool {
        self.fpccr & ASPEN != 0
    }

    /// A frame with floating-point registers at this address begins: the program can see that they are saved later.
    pub(crate) fn begin_lazy(&mut self, registers: u32) {
        if self.fpccr & LSPEN != 0 {
            self.fpccr |= LSPACT;
            self.fpcar = registers & !7;
        }
    }

    /// The registers are saved, or restored.
    pub(crate) fn end_lazy(&mut self) {
        self.fpccr &= !LSPACT;
    }

    /// Records the fault of a data access that the memory protection unit forbids.
    pub(crate) fn note_protection_fault(&mut self, address: u32) {
        self.cfsr |= cfsr::DACCVIOL | cfsr::MMARVALID;
        self.mmfar = address;
    }

    /// Whether a store is buffered. The fault of a failed buffered store comes later, and without its address. Stores
    /// into the system space are not buffered.
    pub(crate) fn buffers(&self, address: u32) -> bool {
        self.actlr & DISDEFWBUF == 0 && !(ppb::BASE..ppb::BASE + ppb::SIZE).contains(&address)
    }

    /// Records a fault that was taken as HardFault instead.
    pub(crate) fn note_escalation(&mut self) {
        self.hfsr |= FORCED;
    }

    /// Records a breakpoint without a debugger.
    pub(crate) fn note_breakpoint(&mut self) {
        self.hfsr |= DEBUGEVT;
    }

    /// Records a precise fault of a data access to this address.
    pub(crate) fn note_data_fault(&mut self, address: u32) {
        self.cfsr |= cfsr::PRECISERR | cfsr::BFARVALID;
        self.bfar = address;
    }

    /// Whether software has enabled a configurable fault (SHCSR).
    pub(crate) fn enables(&self, fault: Exception) -> bool {
        let bit = match fault {
            Exception::MEM_MANAGE => 16,
            Exception::BUS_FAULT => 17,
            Exception::USAGE_FAULT => 18,
            _ => return true,
        };
        self.shcsr & 1 << bit != 0
    }

    /// The configurable fault that a set of CFSR bits belongs to.
    pub(crate) fn fault_of(status: u32) -> Exception {
        match status {
            0..=0xFF => Exception::MEM_MANAGE,
            0x100..=0xFFFF => Exception::BUS_FAULT,
            _ => Exception::USAGE_FAULT,
        }
    }
}
