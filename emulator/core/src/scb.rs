//! The system control block: vector table, fault status, sleep and FPU access (ARMv7-M ARM, B3.2).

use crate::exception::Exception;
use crate::fault::Fault;

/// CCR.STKALIGN reads as one: frames are aligned to eight bytes.
const CCR_RESET: u32 = 1 << 9;
/// FPCCR after reset: automatic and lazy state preservation.
const FPCCR_RESET: u32 = 0xC000_0000;
const VECTKEY: u32 = 0x05FA;
const SYSRESETREQ: u32 = 1 << 2;
const FAULT_ENABLES: u32 = 0x0007_0000;
const FORCED: u32 = 1 << 30;

/// State of the block that is not in the NVIC.
pub(crate) struct Scb {
    pub(crate) vtor: u32,
    pub(crate) prigroup: u32,
    pub(crate) scr: u32,
    pub(crate) ccr: u32,
    fault_enables: u32,
    pub(crate) cfsr: u32,
    pub(crate) hfsr: u32,
    pub(crate) mmfar: u32,
    pub(crate) bfar: u32,
    pub(crate) cpacr: u32,
    pub(crate) fpccr: u32,
    pub(crate) fpcar: u32,
    pub(crate) fpdscr: u32,
    pub(crate) reset_requested: bool,
}

impl Scb {
    pub(crate) fn new() -> Scb {
        Scb {
            vtor: 0,
            prigroup: 0,
            scr: 0,
            ccr: CCR_RESET,
            fault_enables: 0,
            cfsr: 0,
            hfsr: 0,
            mmfar: 0,
            bfar: 0,
            cpacr: 0,
            fpccr: FPCCR_RESET,
            fpcar: 0,
            fpdscr: 0,
            reset_requested: false,
        }
    }

    /// Whether the handler of a configurable fault is enabled (SHCSR).
    pub(crate) fn fault_enabled(&self, exception: Exception) -> bool {
        match exception {
            Exception::MEM_MANAGE => self.fault_enables >> 16 & 1 != 0,
            Exception::BUS_FAULT => self.fault_enables >> 17 & 1 != 0,
            Exception::USAGE_FAULT => self.fault_enables >> 18 & 1 != 0,
            _ => true,
        }
    }

    /// SHCSR's enable bits.
    pub(crate) fn fault_enables(&self) -> u32 {
        self.fault_enables
    }

    pub(crate) fn set_fault_enables(&mut self, shcsr: u32) {
        self.fault_enables = shcsr & FAULT_ENABLES;
    }

    /// CPACR: both coprocessors of the FPU are open to privileged code.
    pub(crate) fn fpu_enabled(&self) -> bool {
        self.cpacr >> 20 & 1 != 0 && self.cpacr >> 22 & 1 != 0
    }

    /// AIRCR counts only with its key; the result is the new priority grouping.
    pub(crate) fn write_aircr(&mut self, value: u32) -> Option<u32> {
        (value >> 16 == VECTKEY).then(|| {
            self.reset_requested |= value & SYSRESETREQ != 0;
            self.prigroup = value >> 8 & 7;
            self.prigroup
        })
    }

    /// Notes why a fault happened, and that it was escalated.
    pub(crate) fn record(&mut self, fault: Fault, escalated: bool) {
        self.cfsr |= fault.cfsr();
        self.hfsr |= fault.hfsr() | if escalated { FORCED } else { 0 };
        if let Fault::DataBus { address } = fault {
            self.bfar = address;
        }
    }
}
