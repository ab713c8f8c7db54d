//! Exception entry and return: the frames on the stack (ARMv7-M, B1.5.6 to B1.5.8).

use chip::Peripherals;
use unicorn_engine::{Prot, RegisterARM};

use crate::clock;
use crate::engine;
use crate::estimate::TAIL_CHAIN;
use crate::exception::Exception;
use crate::fault::Fault;
use crate::it_block;
use crate::machine::Machine;
use crate::mechanism::Mechanism;
use crate::scb::cfsr;

/// The integer registers of a frame, in the order of the frame.
const INTEGER: [RegisterARM; 6] =
    [RegisterARM::R0, RegisterARM::R1, RegisterARM::R2, RegisterARM::R3, RegisterARM::R12, RegisterARM::LR];

/// The integer registers that are not part of a frame.
const CALLEE_SAVED: [RegisterARM; 8] = [
    RegisterARM::R4,
    RegisterARM::R5,
    RegisterARM::R6,
    RegisterARM::R7,
    RegisterARM::R8,
    RegisterARM::R9,
    RegisterARM::R10,
    RegisterARM::R11,
];

/// Words of a basic frame, and of one with floating-point registers.
const BASIC: u32 = 8;
const EXTENDED: u32 = 26;

/// xPSR: Thumb state, the frame was aligned to eight bytes.
pub(crate) const THUMB: u32 = 1 << 24;
const ALIGNED: u32 = 1 << 9;

/// CONTROL: Thread mode has no privileges; it uses the process stack; floating-point registers are in use.
const NPRIV: u32 = 1 << 0;
const SPSEL: u32 = 1 << 1;
const FPCA: u32 = 1 << 2;

/// CCR: Thread mode may be entered while exceptions are active.
const NONBASETHRDENA: u32 = 1 << 0;

/// EXC_RETURN: no floating-point registers in the frame; return to Thread mode; return to the process stack.
const NO_FLOATS: u32 = 1 << 4;
const TO_THREAD: u32 = 1 << 3;
const TO_PROCESS: u32 = 1 << 2;

impl<P: Peripherals + 'static> Machine<P> {
    /// Sets the registers to their values after a reset.
    pub(crate) fn reset_registers(&mut self, stack: u32, entry: u32) {
        for register in
            [RegisterARM::PRIMASK, RegisterARM::FAULTMASK, RegisterARM::BASEPRI, RegisterARM::CONTROL]
        {
            self.set(register, 0);
        }
        self.set_xpsr(THUMB);
        self.set(RegisterARM::CONTROL, 0);
        INTEGER.iter().chain(&CALLEE_SAVED).for_each(|register| self.set(*register, 0));
        (0..32).for_each(|n| self.set_float(n, 0));
        self.set(RegisterARM::FPSCR, 0);
        self.set(RegisterARM::SP, stack & !3);
        self.set(RegisterARM::LR, 0xFFFF_FFFF);
        self.jump(entry);
    }

    /// Continues at a vector. A vector without its lowest bit leaves the Thumb state, in which no instruction runs (ARMv7-M,
    /// B1.5.3).
    fn jump(&mut self, vector: u32) {
        self.set(RegisterARM::PC, vector & !1);
        self.lost_thumb = vector & 1 == 0;
    }

    /// Takes an exception.
    pub(crate) fn enter(&mut self, exception: Exception) {
        let pc = self.pc();
        let (frame, exc_return) = self.push_frame(pc);
        let entry = self.cpu.get_data().estimate().entry(exc_return & NO_FLOATS == 0);
        let pended = self.cpu.get_data().pended[usize::from(exception.0)];
        let taken = match frame {
            Ok(()) => exception,
            Err(fault) => self.derived(fault, exception),
        };
        self.vector(taken, exc_return, entry);
        let core = self.cpu.get_data_mut();
        core.count_entry(taken, pended, pc);
    }

    /// Starts the handler of an exception whose frame is on the stack.
    fn vector(&mut self, exception: Exception, exc_return: u32, cycles: u32) {
        let core = self.cpu.get_data_mut();
        core.nvic.activate(exception);
        core.spend(0, cycles);
        let base = if core.scb.vtor == 0 { self.model().flash.start } else { self.cpu.get_data().scb.vtor };
        let vector = base + 4 * u32::from(exception.0);
        self.cpu.get_data_mut().wait_for_vector(vector);
        let handler = self.word(vector);
        // Handler mode always uses the main stack.
        let before = self.register(RegisterARM::CONTROL);
        let control = before & !(FPCA | SPSEL);
        let handler_mode = u32::from(exception.0) | THUMB;
        if before & SPSEL != 0 {
            // Only privileged Thread mode can change SPSEL, and Handler mode is privileged.
            self.set_xpsr(handler_mode);
            self.set(RegisterARM::CONTROL, control & !NPRIV);
            self.set_xpsr(THUMB);
            self.set(RegisterARM::CONTROL, control & !NPRIV);
        }
        self.set_xpsr(handler_mode);
        self.set(RegisterARM::CONTROL, control);
        self.rebuild_flags(0);
        self.clear_monitor();
        self.set(RegisterARM::LR, exc_return);
        self.cpu.get_data_mut().ahead = handler.unwrap_or(0) & !1;
        match handler {
            Some(handler) => self.jump(handler),
            None => self.lock_up(base),
        }
    }

    /// Saves the context. The stack pointer moves even when a word cannot be written.
    fn push_frame(&mut self, pc: u32) -> (Result<(), Fault>, u32) {
        let control = self.register(RegisterARM::CONTROL);
        let xpsr = self.register(RegisterARM::XPSR);
        let handler = xpsr & 0x1FF != 0;
        let core = self.cpu.get_data();
        let floats = control & FPCA != 0 && core.scb.stacks_floats() && !core.lacks(Mechanism::FloatFrame);
        let words = if floats { EXTENDED } else { BASIC };
        let stack = self.register(RegisterARM::SP);
        let padded = if stack & 4 != 0 { ALIGNED } else { 0 };
        let top = stack.wrapping_sub(words * 4) & !7;
        self.set(RegisterARM::SP, top);
        let result = self.write_frame(top, pc, xpsr & !ALIGNED | padded, floats);
        let process = !handler && control & SPSEL != 0;
        let mut exc_return = 0xFFFF_FFE1;
        exc_return |= if floats { 0 } else { NO_FLOATS };
        exc_return |= if handler { 0 } else { TO_THREAD };
        exc_return |= if process { TO_PROCESS } else { 0 };
        if floats {
            self.cpu.get_data_mut().scb.begin_lazy(top + 4 * BASIC);
        }
        (result.map_err(|status| Fault::stacking(pc, status)), exc_return)
    }

    /// The error is the status of the fault.
    fn write_frame(&mut self, top: u32, pc: u32, xpsr: u32, floats: bool) -> Result<(), u32> {
        let mut words: Vec<u32> = INTEGER.iter().map(|register| self.register(*register)).collect();
        words.extend([pc, xpsr]);
        if floats {
            words.extend((0..16).map(|n| self.float(n)));
            words.extend([self.register(RegisterARM::FPSCR), 0]);
        }
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        if !self.model().ram.contains(&top) {
            return Err(cfsr::STKERR);
        }
        let core = self.cpu.get_data_mut();
        let ends = [top, top + bytes.len() as u32 - 1];
        if !ends.iter().all(|&end| core.scb.mpu.data_rights(end).0 & Prot::WRITE.0 != 0) {
            return Err(cfsr::MSTKERR);
        }
        core.memory.write(top, &bytes).ok_or(cfsr::STKERR)
    }

    /// Ends the active exception, after the core has branched to an EXC_RETURN value.
    pub(crate) fn leave(&mut self) {
        let exc_return = self.register(RegisterARM::PC) | 1;
        let ending = Exception((self.register(RegisterARM::XPSR) & 0x7F) as u8);
        if !self.may_return(ending, exc_return) {
            return self.take_fault(Fault::bad_return(exc_return));
        }
        let core = self.cpu.get_data_mut();
        let requested = core.nvic.pending_set();
        core.nvic.deactivate(ending);
        // A request that came while the handler ran keeps its time. A line that is still up requests now.
        core.stamp(core.nvic.pending_set() & !requested);
        core.stats.left(core.now);
        if ending != Exception::NMI {
            self.set(RegisterARM::FAULTMASK, 0);
        }
        if let Some(next) = self.follower() {
            return self.chain(next, exc_return);
        }
        self.pop_frame(exc_return);
        let ahead = self.pc();
        let core = self.cpu.get_data_mut();
        core.ahead = ahead;
        core.spend(0, core.estimate().exit(exc_return & NO_FLOATS == 0));
    }

    /// The checks of an exception return (ARMv7-M, B1.5.8): the exception is active, the value is one of six, and the
    /// return goes to Thread mode if and only if no other exception is active.
    fn may_return(&self, ending: Exception, exc_return: u32) -> bool {
        let core = self.cpu.get_data();
        let is_valid = matches!(exc_return | NO_FLOATS, 0xFFFF_FFF1 | 0xFFFF_FFF9 | 0xFFFF_FFFD);
        let to_thread = exc_return & TO_THREAD != 0;
        let is_last = core.nvic.active_count() == 1;
        let fits = to_thread == is_last || to_thread && core.scb.ccr & NONBASETHRDENA != 0;
        is_valid && fits && core.nvic.is_active(ending)
    }

    /// The exception to tail-chain, without unstacking.
    fn follower(&self) -> Option<Exception> {
        let core = self.cpu.get_data();
        let next = core.to_take(clock::masks(&self.cpu))?;
        (!core.lacks(Mechanism::TailChain)).then_some(next)
    }

    fn chain(&mut self, exception: Exception, exc_return: u32) {
        let pended = self.cpu.get_data().pended[usize::from(exception.0)];
        self.vector(exception, exc_return, TAIL_CHAIN);
        let core = self.cpu.get_data_mut();
        core.stats.tail_chained += 1;
        core.count_entry(exception, pended, exc_return);
    }

    fn pop_frame(&mut self, exc_return: u32) {
        let floats = exc_return & NO_FLOATS == 0;
        let process = exc_return & TO_PROCESS != 0;
        let bank = if process { RegisterARM::PSP } else { RegisterARM::MSP };
        let top = self.register(bank);
        let count = if floats { EXTENDED } else { BASIC };
        let words: Option<Vec<u32>> = (0..count).map(|n| self.word(top.wrapping_add(4 * n))).collect();
        let Some(words) = words else { return self.take_fault(Fault::unstacking(top)) };
        let handler = self.register(RegisterARM::XPSR);
        self.set_xpsr(handler & !it_block::STATE);
        self.clear_monitor();
        let xpsr = words[7];
        let padding = if xpsr & ALIGNED != 0 { 4 } else { 0 };
        self.set(bank, top.wrapping_add(4 * count) + padding);
        // Unprivileged Thread mode cannot write CONTROL.
        let control = self.register(RegisterARM::CONTROL);
        self.set(RegisterARM::CONTROL, control & !NPRIV);
        self.set_xpsr(xpsr & !ALIGNED);
        self.restore_control(control, exc_return, floats);
        for (register, word) in INTEGER.iter().zip(&words) {
            self.set(*register, *word);
        }
        if floats {
            self.cpu.get_data_mut().scb.end_lazy();
            (0..16).for_each(|n| self.set_float(n, words[8 + n as usize]));
            self.set(RegisterARM::FPSCR, words[24]);
        }
        self.set(RegisterARM::PC, words[6] & !1);
    }

    fn restore_control(&mut self, control: u32, exc_return: u32, floats: bool) {
        let mut control = control & !(FPCA | SPSEL);
        control |= if floats { FPCA } else { 0 };
        control |= if exc_return & TO_PROCESS != 0 { SPSEL } else { 0 };
        self.set(RegisterARM::CONTROL, control);
        let flags = self.register(RegisterARM::XPSR);
        self.rebuild_flags(flags);
    }

    /// Clears the exclusive monitor with code of the emulator. No IT block may be open, because the block would skip
    /// that code.
    fn clear_monitor(&mut self) {
        // The call fails only when the library has lost its memory, and then no other code runs either.
        let _ = engine::clear_monitor(&mut self.cpu);
    }

    /// Writes all of xPSR. The register holds the exception number, so the write also switches the mode.
    pub(crate) fn set_xpsr(&mut self, value: u32) {
        let value =
            if self.cpu.get_data().lacks(Mechanism::ItState) { value & !it_block::STATE } else { value };
        self.set(RegisterARM::XPSR_NZCVQG, value);
        self.rebuild_flags(value);
    }

    /// Writes the condition flags, which makes the library update its mode.
    fn rebuild_flags(&mut self, xpsr: u32) {
        self.set(RegisterARM::APSR_NZCV, xpsr & 0xF000_0000);
    }

    fn float(&self, number: i32) -> u32 {
        self.cpu.reg_read(RegisterARM::S0 as i32 + number).unwrap_or(0) as u32
    }

    fn set_float(&mut self, number: i32, value: u32) {
        let _ = self.cpu.reg_write(RegisterARM::S0 as i32 + number, value.into());
    }
}
