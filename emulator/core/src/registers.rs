//! The CPU's registers in the library.

use unicorn_engine::{RegisterARM, Unicorn};

/// xPSR.T.
pub(crate) const THUMB: u32 = 1 << 24;
/// xPSR: the IT bits.
pub(crate) const IT: u32 = 0x0600_FC00;
/// CONTROL.SPSEL and CONTROL.FPCA.
pub(crate) const SPSEL: u32 = 1 << 1;
pub(crate) const FPCA: u32 = 1 << 2;

/// The registers of an exception frame in their order, PC and xPSR excepted.
pub(crate) const FRAME: [RegisterARM; 6] =
    [RegisterARM::R0, RegisterARM::R1, RegisterARM::R2, RegisterARM::R3, RegisterARM::R12, RegisterARM::LR];

const FLOATS: [RegisterARM; 16] = [
    RegisterARM::S0,
    RegisterARM::S1,
    RegisterARM::S2,
    RegisterARM::S3,
    RegisterARM::S4,
    RegisterARM::S5,
    RegisterARM::S6,
    RegisterARM::S7,
    RegisterARM::S8,
    RegisterARM::S9,
    RegisterARM::S10,
    RegisterARM::S11,
    RegisterARM::S12,
    RegisterARM::S13,
    RegisterARM::S14,
    RegisterARM::S15,
];

/// The registers of the FPU that an exception frame holds: S0..S15 and FPSCR.
pub(crate) fn float_frame() -> impl Iterator<Item = RegisterARM> {
    FLOATS.into_iter().chain([RegisterARM::FPSCR])
}

/// Access to registers that this CPU has, which cannot fail.
pub(crate) trait Registers {
    fn get(&self, register: RegisterARM) -> u32;
    fn set(&mut self, register: RegisterARM, value: u32);

    /// Writes xPSR with its IT bits and exception number.
    fn set_xpsr(&mut self, value: u32) {
        self.set(RegisterARM::XPSR_NZCVQG, value);
        // This write makes the library notice the change of mode; the one above does not.
        self.set(RegisterARM::APSR_NZCV, value);
    }
}

impl<D> Registers for Unicorn<'_, D> {
    fn get(&self, register: RegisterARM) -> u32 {
        self.reg_read(register).map_or(0, |value| value as u32)
    }

    fn set(&mut self, register: RegisterARM, value: u32) {
        let written = self.reg_write(register, u64::from(value));
        debug_assert_eq!(written, Ok(()), "{register:?}");
    }
}
