//! Exception entry and return (ARMv7-M ARM, B1.5.6 to B1.5.8).

use chip::{BusFault, Peripherals};
use unicorn_engine::RegisterARM;

use crate::core::Core;
use crate::exception::Exception;
use crate::fault::Fault;
use crate::hooks::mask_priority;
use crate::incident::{FaultReport, Incident};
use crate::mechanism::Mechanism;
use crate::nvic::Candidate;
use crate::registers::{FPCA, FRAME, IT, Registers, SPSEL, THUMB, float_frame};

/// Cycles of the Cortex-M4 with memory without wait states (Cortex-M4 TRM, section 3.9).
const ENTRY: u32 = 12;
const EXIT: u32 = 12;
const TAIL_CHAIN: u32 = 6;

const FRAME_SIZE: u32 = 0x20;
const FLOAT_FRAME_SIZE: u32 = 0x68;
/// xPSR in a frame: the stack pointer was moved by four to align the frame.
const ALIGNED: u32 = 1 << 9;

/// EXC_RETURN: bit 2 selects the process stack, bit 3 thread mode, a clear bit 4 a frame with FPU registers.
const RETURN: u32 = 0xFFFF_FFE1;
const TO_PROCESS_STACK: u32 = 1 << 2;
const TO_THREAD: u32 = 1 << 3;
const PLAIN_FRAME: u32 = 1 << 4;

/// SCR.SLEEPONEXIT.
const SLEEP_ON_EXIT: u32 = 1 << 1;

/// A fault where none can be handled, at this address.
pub(crate) struct Lockup {
    pub(crate) pc: u32,
}

impl<P: Peripherals + 'static> Core<P> {
    /// Priority of what runs, with the mask registers.
    fn execution_priority(&self) -> i16 {
        self.system().nvic.active_priority().min(mask_priority(&self.uc))
    }

    /// The pending exception that interrupts what runs now.
    pub(crate) fn takeable(&self) -> Option<Candidate> {
        let system = self.system();
        system.nvic.best().filter(|best| system.preempts(best.priority, self.execution_priority()))
    }

    /// Whether a pending exception ends WFI: one that would be taken if PRIMASK were clear (B1.5.19).
    pub(crate) fn wakes(&self) -> bool {
        let nvic = &self.system().nvic;
        let base = nvic.base_priority(self.uc.get(RegisterARM::BASEPRI));
        nvic.best().is_some_and(|best| best.priority < nvic.active_priority().min(base))
    }

    /// Lets the block hook watch the mask registers, when they alone hold back an exception.
    pub(crate) fn note_masked(&mut self) {
        let system = self.system_mut();
        let best =
            system.nvic.best().filter(|best| system.preempts(best.priority, system.nvic.active_priority()));
        system.run.masked = best.map(|best| best.priority);
    }

    /// Enters an exception: pushes the frame, then takes the vector of whatever has the highest priority by then.
    pub(crate) fn enter(&mut self, first: Exception) -> Result<(), Lockup> {
        let from = self.uc.get(RegisterARM::PC);
        let (exc_return, pushed) = self.push();
        self.system_mut().spend(ENTRY);
        self.system_mut().catch_up();
        if pushed == Err(BusFault) && self.system().works(Mechanism::StackingFault) {
            self.raise(Fault::Stacking)?;
        }
        let late = self.system().works(Mechanism::LateArrival);
        let best = self.takeable().filter(|_| late || pushed.is_err());
        self.vector(best.map_or(first, |best| best.exception), exc_return, from)
    }

    /// Pushes the frame and gives the EXC_RETURN that pops it. A frame that does not fit still moves the stack
    /// pointer.
    fn push(&mut self) -> (u32, Result<(), BusFault>) {
        let uc = &self.uc;
        let (control, stack) = (uc.get(RegisterARM::CONTROL), uc.get(RegisterARM::SP));
        let thread = uc.get(RegisterARM::IPSR) == 0;
        let float = control & FPCA != 0 && self.system().works(Mechanism::FloatFrame);
        let size = if float { FLOAT_FRAME_SIZE } else { FRAME_SIZE };
        let frame = stack.wrapping_sub(size) & !7;
        let mut bytes: Vec<u8> = self.frame(stack & 4 != 0).flat_map(u32::to_le_bytes).collect();
        if float {
            bytes.extend(float_frame().flat_map(|register| uc.get(register).to_le_bytes()));
        }
        let pushed = self.system().memory.store(frame, &bytes);
        self.uc.set(RegisterARM::SP, frame);
        let mut exc_return = RETURN | PLAIN_FRAME;
        if thread {
            exc_return |= TO_THREAD | if control & SPSEL != 0 { TO_PROCESS_STACK } else { 0 };
        }
        (if float { exc_return & !PLAIN_FRAME } else { exc_return }, pushed)
    }

    /// The words of the basic frame.
    fn frame(&self, aligned: bool) -> impl Iterator<Item = u32> + '_ {
        let xpsr = self.uc.get(RegisterARM::XPSR) & !ALIGNED | if aligned { ALIGNED } else { 0 };
        let registers = FRAME.into_iter().chain([RegisterARM::PC]).map(|register| self.uc.get(register));
        registers.chain([xpsr])
    }

    /// Starts the handler of an exception whose frame is on the stack.
    fn vector(&mut self, exception: Exception, exc_return: u32, from: u32) -> Result<(), Lockup> {
        let system = self.system_mut();
        let vector = system.flash_address(system.scb.vtor + 4 * u32::from(exception.0));
        let entry = system.memory.word(vector);
        let pended = system.nvic.pending_since(exception);
        system.nvic.activate(exception);
        system.stats.entered(exception, pended);
        let now = system.clock.now();
        system.stats.trace.entry(exception, now, from);
        system.run.event = true;
        self.enter_handler_mode(exception, exc_return);
        let Ok(entry) = entry else { return self.raise(Fault::VectorTable) };
        self.uc.set(RegisterARM::PC, entry);
        self.system_mut().run.block_end = entry & !1;
        Ok(())
    }

    fn enter_handler_mode(&mut self, exception: Exception, exc_return: u32) {
        let control = self.uc.get(RegisterARM::CONTROL);
        self.uc.set(RegisterARM::CONTROL, control & !(SPSEL | FPCA));
        self.uc.set_xpsr(THUMB | u32::from(exception.0));
        self.uc.set(RegisterARM::LR, exc_return);
    }

    /// Returns from a handler: to the next pending exception, or to what was interrupted. Whether the core now
    /// sleeps (SLEEPONEXIT).
    pub(crate) fn leave(&mut self, exc_return: u32) -> Result<bool, Lockup> {
        let current = Exception(self.uc.get(RegisterARM::IPSR) as u8 & 0x7F);
        let from = self.uc.get(RegisterARM::PC);
        if exc_return | 0x1C != 0xFFFF_FFFD || !self.system().nvic.is_active(current) {
            return self.refuse_return(exc_return).map(|()| false);
        }
        self.end(current);
        let next = self.takeable().filter(|_| self.system().works(Mechanism::TailChain));
        self.system_mut().spend(if next.is_some() { TAIL_CHAIN } else { EXIT });
        let now = self.system().clock.now();
        self.system_mut().stats.left(now);
        if let Some(next) = next {
            return self.vector(next.exception, exc_return, from).map(|()| false);
        }
        match self.pop(exc_return) {
            Ok(()) => Ok(exc_return & TO_THREAD != 0 && self.system().scb.scr & SLEEP_ON_EXIT != 0),
            Err(fault) => self.chain_fault(fault, exc_return).map(|()| false),
        }
    }

    /// The handler is no longer active; its line is looked at again.
    fn end(&mut self, current: Exception) {
        let system = self.system_mut();
        let now = system.clock.now();
        system.catch_up();
        system.look(now);
        let resample = system.works(Mechanism::Levels);
        system.nvic.deactivate(current, resample, now);
        if current != Exception::NMI {
            self.uc.set(RegisterARM::FAULTMASK, 0);
        }
    }

    /// A return that cannot be: UsageFault with the frame left where it is.
    fn refuse_return(&mut self, exc_return: u32) -> Result<(), Lockup> {
        let current = self.system().stats.current();
        self.end(current);
        let now = self.system().clock.now();
        self.system_mut().stats.left(now);
        self.chain_fault(Fault::InvalidReturn, exc_return)
    }

    fn chain_fault(&mut self, fault: Fault, exc_return: u32) -> Result<(), Lockup> {
        self.raise(fault)?;
        let from = self.uc.get(RegisterARM::PC);
        match self.takeable() {
            Some(next) => self.vector(next.exception, exc_return, from),
            None => Ok(()),
        }
    }

    /// Pops the frame that `exc_return` stands for.
    fn pop(&mut self, exc_return: u32) -> Result<(), Fault> {
        let stack = if exc_return & TO_PROCESS_STACK != 0 { RegisterARM::PSP } else { RegisterARM::MSP };
        let frame = self.uc.get(stack);
        let float = exc_return & PLAIN_FRAME == 0;
        let size = if float { FLOAT_FRAME_SIZE } else { FRAME_SIZE };
        let mut bytes = [0; FLOAT_FRAME_SIZE as usize];
        self.system()
            .memory
            .load(frame, &mut bytes[..size as usize])
            .map_err(|BusFault| Fault::Unstacking)?;
        let word = |index: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| bytes[4 * index + byte]));
        let xpsr = word(7);
        if (xpsr & 0x1FF == 0) != (exc_return & TO_THREAD != 0) {
            return Err(Fault::InvalidReturn);
        }
        self.forget_exclusive();
        let floats =
            float_frame().enumerate().filter(|_| float).map(|(index, register)| (register, word(8 + index)));
        for (register, value) in
            FRAME.into_iter().enumerate().map(|(i, register)| (register, word(i))).chain(floats)
        {
            self.uc.set(register, value);
        }
        self.uc.set(stack, frame.wrapping_add(size + if xpsr & ALIGNED != 0 { 4 } else { 0 }));
        self.restore_mode(exc_return, xpsr);
        self.uc.set(RegisterARM::PC, word(6) | 1);
        self.system_mut().run.block_end = word(6) & !1;
        Ok(())
    }

    fn restore_mode(&mut self, exc_return: u32, xpsr: u32) {
        let kept = if self.system().works(Mechanism::ItState) { u32::MAX } else { !IT };
        self.uc.set_xpsr(xpsr & !ALIGNED & kept);
        let control = self.uc.get(RegisterARM::CONTROL) & !(SPSEL | FPCA);
        let stack = if exc_return & TO_PROCESS_STACK != 0 { SPSEL } else { 0 };
        let float = if exc_return & PLAIN_FRAME == 0 { FPCA } else { 0 };
        self.uc.set(RegisterARM::CONTROL, control | stack | float);
    }

    /// A return clears the exclusive monitor (A3.4.4), before the interrupted code's xPSR comes back.
    fn forget_exclusive(&mut self) {
        if self.system().run.exclusive && self.system().works(Mechanism::ExclusiveMonitor) {
            self.system_mut().run.exclusive = false;
            self.clear_monitor();
        }
    }

    /// Raises a fault: pends its exception, or HardFault when that one is disabled or may not preempt.
    pub(crate) fn raise(&mut self, fault: Fault) -> Result<(), Lockup> {
        let running = self.execution_priority();
        let wanted = fault.exception();
        let system = self.system_mut();
        let enabled = system.works(Mechanism::ConfigurableFaults) && system.scb.fault_enabled(wanted);
        let direct = enabled && system.nvic.group_priority(wanted) < running;
        let handler = if direct { wanted } else { Exception::HARD_FAULT };
        system.scb.record(fault, handler != wanted || fault == Fault::SupervisorCall);
        let report = self.report(fault, handler);
        let system = self.system_mut();
        system.incidents.add(system.clock.now(), Incident::Fault(report));
        if handler == Exception::HARD_FAULT && running <= -1 {
            return Err(Lockup { pc: report.pc });
        }
        let system = self.system_mut();
        system.nvic.pend(handler, system.clock.now());
        Ok(())
    }

    fn report(&self, fault: Fault, handler: Exception) -> FaultReport {
        FaultReport {
            fault,
            handler,
            pc: self.uc.get(RegisterARM::PC),
            lr: self.uc.get(RegisterARM::LR),
            sp: self.uc.get(RegisterARM::SP),
            status: self.system().scb.cfsr,
        }
    }

    /// SVC: SVCall when it may preempt, else HardFault.
    pub(crate) fn supervisor_call(&mut self) -> Result<(), Lockup> {
        let system = self.system_mut();
        let now = system.clock.now();
        if system.nvic.group_priority(Exception::SV_CALL) < self.execution_priority() {
            self.system_mut().nvic.pend(Exception::SV_CALL, now);
            Ok(())
        } else {
            self.raise(Fault::SupervisorCall)
        }
    }
}
