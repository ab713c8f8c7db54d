//! Faults: the exceptions that they raise, and the bits of the status registers.

use chip::Peripherals;
use unicorn_engine::RegisterARM;

use crate::clock;
use crate::exception::Exception;
use crate::incident::Incident;
use crate::machine::Machine;
use crate::mechanism::Mechanism;
use crate::scb::{Scb, cfsr};

/// A fault as it was detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The address of the instruction; for a load from a peripheral and for a store, the start of the next block.
    pub pc: u32,
    /// The link register.
    pub lr: u32,
    /// The address of a data access. For a store, the program does not see this address.
    pub address: Option<u32>,
    /// The bits of the fault in CFSR.
    pub status: u32,
    /// Whether the fault became a HardFault because its own exception could not be taken.
    pub escalated: bool,
}

impl Fault {
    fn new(pc: u32, status: u32) -> Fault {
        Fault { pc, lr: 0, address: None, status, escalated: false }
    }

    pub(crate) fn data(pc: u32, address: u32) -> Fault {
        Fault { address: Some(address), ..Fault::new(pc, cfsr::PRECISERR) }
    }

    /// A store to an address without memory or register, detected some instructions later.
    pub(crate) fn lost_store(pc: u32, address: u32) -> Fault {
        Fault { address: Some(address), ..Fault::new(pc, cfsr::IMPRECISERR) }
    }

    pub(crate) fn fetch(pc: u32) -> Fault {
        Fault::new(pc, cfsr::IBUSERR)
    }

    /// The memory protection unit forbids code at this address.
    pub(crate) fn execution(pc: u32) -> Fault {
        Fault::new(pc, cfsr::IACCVIOL)
    }

    /// The memory protection unit forbids the data access.
    pub(crate) fn protection(pc: u32, address: u32) -> Fault {
        Fault { address: Some(address), ..Fault::new(pc, cfsr::DACCVIOL) }
    }

    /// A usage fault with these status bits.
    pub(crate) fn usage(pc: u32, status: u32) -> Fault {
        Fault::new(pc, status)
    }

    /// SVC whose exception cannot be taken: no status bit but that of the escalation.
    pub(crate) fn refused_call(pc: u32) -> Fault {
        Fault { escalated: true, ..Fault::new(pc, 0) }
    }

    pub(crate) fn undefined(pc: u32) -> Fault {
        Fault::new(pc, cfsr::UNDEFINSTR)
    }

    pub(crate) fn stacking(pc: u32, status: u32) -> Fault {
        Fault::new(pc, status)
    }

    pub(crate) fn unstacking(stack: u32) -> Fault {
        Fault { address: Some(stack), ..Fault::new(0, cfsr::UNSTKERR) }
    }

    pub(crate) fn bad_return(exc_return: u32) -> Fault {
        Fault::new(exc_return, cfsr::INVPC)
    }

    pub(crate) fn breakpoint(pc: u32) -> Fault {
        Fault::new(pc, 0)
    }
}

impl<P: Peripherals + 'static> Machine<P> {
    /// A fault of the current instruction: its exception is taken at once, or the core locks up.
    pub(crate) fn take_fault(&mut self, fault: Fault) {
        let fault = Fault { lr: self.register(RegisterARM::LR), ..fault };
        self.record(&fault);
        let masks = clock::masks(&self.cpu);
        let wanted = self.exception_of(&fault);
        match self.escalated(wanted, masks) {
            Some(exception) => self.enter(exception),
            None => self.lock_up(fault.pc),
        }
    }

    /// A fault while the context was saved for `exception`: the exception with the higher priority is taken, the other
    /// stays pending (ARMv7-M, B1.5.10).
    pub(crate) fn derived(&mut self, fault: Fault, exception: Exception) -> Exception {
        self.record(&fault);
        let masks = clock::masks(&self.cpu);
        let wanted = self.exception_of(&fault);
        self.escalated(wanted, masks).unwrap_or(exception)
    }

    fn record(&mut self, fault: &Fault) {
        self.note(Incident::Fault(*fault));
        let scb = &mut self.cpu.get_data_mut().scb;
        match fault.address {
            Some(address) if fault.status == cfsr::PRECISERR => scb.note_data_fault(address),
            Some(address) if fault.status == cfsr::DACCVIOL => scb.note_protection_fault(address),
            _ if fault.escalated => scb.note_escalation(),
            _ if fault.status == 0 => scb.note_breakpoint(),
            _ => scb.cfsr |= fault.status,
        }
    }

    fn exception_of(&self, fault: &Fault) -> Exception {
        if fault.status == 0 { Exception::HARD_FAULT } else { Scb::fault_of(fault.status) }
    }

    /// The fault's own exception if it is enabled and can preempt, otherwise HardFault; `None` if HardFault cannot
    /// preempt either.
    fn escalated(&mut self, wanted: Exception, masks: crate::nvic::Masks) -> Option<Exception> {
        let core = self.cpu.get_data_mut();
        if wanted != Exception::HARD_FAULT && core.scb.enables(wanted) && core.nvic.may_preempt(wanted, masks)
        {
            return Some(wanted);
        }
        if core.lacks(Mechanism::Escalation) || !core.nvic.may_preempt(Exception::HARD_FAULT, masks) {
            return None;
        }
        if wanted != Exception::HARD_FAULT {
            core.scb.note_escalation();
        }
        Some(Exception::HARD_FAULT)
    }
}
