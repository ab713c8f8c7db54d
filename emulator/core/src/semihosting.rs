//! The output operations of Arm semihosting: a debugger that the program can print with.
//!
//! Source: Arm, "Semihosting for AArch32 and AArch64", operations SYS_OPEN, SYS_WRITEC, SYS_WRITE0 and SYS_WRITE.

use chip::Peripherals;
use unicorn_engine::RegisterARM;

use crate::machine::Machine;

/// BKPT AB: a request of the program to the debugger.
const CALL: u16 = 0xBEAB;

const SYS_OPEN: u32 = 0x01;
const SYS_WRITEC: u32 = 0x03;
const SYS_WRITE0: u32 = 0x04;
const SYS_WRITE: u32 = 0x05;

/// The only file: the output of the program.
const TERMINAL: u32 = 1;
const DONE: u32 = 0;
const REFUSED: u32 = u32::MAX;

/// Longest line that a program may print, in bytes.
const LONGEST: u32 = 4096;

impl<P: Peripherals + 'static> Machine<P> {
    /// Connects a debugger for programs that print by semihosting. Without a debugger, their first line is a fault.
    pub fn attach_debugger(&mut self) {
        self.printed.get_or_insert_default();
    }

    /// The output of the program since the last call.
    pub fn take_printed(&mut self) -> String {
        let printed = self.printed.as_mut().map(std::mem::take).unwrap_or_default();
        String::from_utf8_lossy(&printed).into_owned()
    }

    /// Carries out the request at this breakpoint; `false` if the breakpoint is no request, or if no debugger is
    /// connected.
    pub(crate) fn answer_call(&mut self) -> bool {
        let pc = self.pc();
        let mut code = [0; 2];
        if self.printed.is_none() || self.read(pc, &mut code).is_err() || u16::from_le_bytes(code) != CALL {
            return false;
        }
        let answer = self.call(self.register(RegisterARM::R0), self.register(RegisterARM::R1));
        self.set(RegisterARM::R0, answer.unwrap_or(REFUSED));
        self.set(RegisterARM::PC, pc.wrapping_add(2));
        true
    }

    fn call(&mut self, operation: u32, argument: u32) -> Option<u32> {
        match operation {
            SYS_OPEN => return Some(TERMINAL),
            SYS_WRITEC => self.print(argument, 1)?,
            SYS_WRITE0 => self.print(argument, self.length(argument)?)?,
            SYS_WRITE => {
                self.print(self.word(argument.wrapping_add(4))?, self.word(argument.wrapping_add(8))?)?;
            }
            _ => return None,
        }
        Some(DONE)
    }

    fn print(&mut self, address: u32, length: u32) -> Option<()> {
        let mut bytes = vec![0; length.min(LONGEST) as usize];
        self.read(address, &mut bytes).ok()?;
        self.printed.as_mut()?.extend(bytes);
        Some(())
    }

    /// The length of a text that ends with a zero.
    fn length(&self, address: u32) -> Option<u32> {
        let mut byte = [0];
        (0..LONGEST).find(|offset| self.read(address.wrapping_add(*offset), &mut byte).is_ok() && byte == [0])
    }
}
