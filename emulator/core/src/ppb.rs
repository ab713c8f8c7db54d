//! The private peripheral bus: every register of the core by address (ARMv7-M, B3.1).

use chip::{Breach, Peripherals};

use crate::core::Core;
use crate::exception::Exception;
use crate::scb::{DIV_0_TRP, UNALIGN_TRP};

/// Start of the system space.
pub(crate) const BASE: u32 = 0xE000_0000;
/// Size of the system space.
pub(crate) const SIZE: u32 = 0x0010_0000;

/// The debug unit of the chip lies among the registers of the core (RM0390, section 33.16).
const DBGMCU: u32 = 0xE004_2000;
const DBGMCU_END: u32 = 0xE004_23FF;

/// The configurable fault status register.
pub(crate) const CFSR: u32 = 0xE000_ED28;

/// The memory protection unit: MPU_TYPE to the last alias of MPU_RASR.
pub(crate) const MPU: u32 = 0xE000_ED90;
pub(crate) const MPU_END: u32 = 0xE000_EDB8;

const CPUID: u32 = 0x410F_C241;
const AIRCR_KEY: u32 = 0x05FA;
const SYSRESETREQ: u32 = 1 << 2;

/// Bits of ICSR.
const PENDSVSET: u32 = 1 << 28;
const PENDSVCLR: u32 = 1 << 27;
const PENDSTSET: u32 = 1 << 26;
const PENDSTCLR: u32 = 1 << 25;
const ISRPENDING: u32 = 1 << 22;
const VECTPENDING: u32 = 12;
const RETTOBASE: u32 = 1 << 11;

/// DEMCR: enables the trace units, among them the DWT.
const TRCENA: u32 = 1 << 24;

impl<P: Peripherals> Core<P> {
    /// Reads a word of the system space; `None` for an unknown register.
    pub(crate) fn ppb_read(&mut self, address: u32, ipsr: u32) -> Option<u32> {
        Some(match address {
            // Without TRCENA the DWT is stopped and not writable (ARMv7-M, C1.8.1 and C1.6.5).
            0xE000_1000..=0xE000_1004 if !self.traces() => 0,
            0xE000_1000 => u32::from(self.cyccnt_runs()) | 0x4000_0000,
            0xE000_1004 => self.cyccnt(),
            0xE000_1FB0..=0xE000_1FFF => 0,
            0xE000_E004 => 3,
            0xE000_E008 => self.scb.actlr,
            0xE000_E010..=0xE000_E01C => self.systick.read(address - 0xE000_E010, self.now),
            0xE000_E100..=0xE000_E11C => self.nvic.enabled_word((address - 0xE000_E100) / 4),
            0xE000_E180..=0xE000_E19C => self.nvic.enabled_word((address - 0xE000_E180) / 4),
            0xE000_E200..=0xE000_E21C => self.nvic.pending_word((address - 0xE000_E200) / 4),
            0xE000_E280..=0xE000_E29C => self.nvic.pending_word((address - 0xE000_E280) / 4),
            0xE000_E300..=0xE000_E31C => self.nvic.active_word((address - 0xE000_E300) / 4),
            0xE000_E400..=0xE000_E4EF => self.priorities(16 + (address - 0xE000_E400)),
            0xE000_ED00 => CPUID,
            0xE000_ED04 => self.icsr(ipsr),
            0xE000_ED08 => self.scb.vtor,
            0xE000_ED0C => 0xFA05_0000 | self.nvic.group() << 8,
            0xE000_ED10 => self.scb.scr,
            0xE000_ED14 => self.scb.ccr,
            0xE000_ED18..=0xE000_ED20 => self.priorities(4 + (address - 0xE000_ED18)),
            0xE000_ED24 => self.scb.shcsr | self.nvic.system_states(),
            CFSR => self.scb.cfsr,
            0xE000_ED2C => self.scb.hfsr,
            0xE000_ED34 => self.scb.mmfar,
            0xE000_ED38 => self.scb.bfar,
            0xE000_ED88 => self.scb.cpacr,
            MPU..=MPU_END => self.scb.mpu.read(address - MPU)?,
            0xE000_EDF0 => 0,
            0xE000_EDFC => self.scb.demcr,
            0xE000_EF34 => self.scb.fpccr,
            0xE000_EF38 => self.scb.fpcar,
            0xE000_EF3C => self.scb.fpdscr,
            DBGMCU..=DBGMCU_END => self.chip.read(address, 4, self.now).ok()?,
            _ => return None,
        })
    }

    /// Writes a word of the system space; `None` for an unknown register.
    pub(crate) fn ppb_write(&mut self, address: u32, value: u32) -> Option<()> {
        match address {
            0xE000_1000..=0xE000_1004 if !self.traces() => {}
            0xE000_1000 => self.set_cyccnt(value & 1 != 0, self.cyccnt()),
            0xE000_1004 => self.set_cyccnt(self.cyccnt_runs(), value),
            // The lock access register of the DWT. The DWT is always unlocked, as for a debugger.
            0xE000_1FB0 => {}
            0xE000_E008 => self.scb.actlr = value,
            0xE000_E010..=0xE000_E01C => {
                self.systick.write(address - 0xE000_E010, value, self.now, self.cycle);
            }
            0xE000_E100..=0xE000_E11C => {
                let word = (address - 0xE000_E100) / 4;
                self.nvic.enable(word, value & self.present(word));
            }
            0xE000_E180..=0xE000_E19C => self.nvic.disable((address - 0xE000_E180) / 4, value),
            0xE000_E200..=0xE000_E21C => self.pend_irqs((address - 0xE000_E200) / 4, value),
            0xE000_E280..=0xE000_E29C => self.nvic.clear_pending((address - 0xE000_E280) / 4, value),
            0xE000_E400..=0xE000_E4EF => self.set_priorities(16 + (address - 0xE000_E400), value),
            0xE000_ED04 => self.set_icsr(value),
            0xE000_ED08 => {
                self.scb.vtor = value & 0x3FFF_FF80;
                self.memory.code_is_old = true;
                let least = (4 * (16 + self.chip.interrupts())).next_power_of_two();
                if !value.is_multiple_of(least) {
                    self.report(Breach::VectorTable { address: value, least });
                }
            }
            0xE000_ED0C => self.set_aircr(value),
            0xE000_ED10 => self.scb.scr = value & 0x16,
            0xE000_ED14 => self.set_ccr(value),
            0xE000_ED18..=0xE000_ED20 => self.set_priorities(4 + (address - 0xE000_ED18), value),
            0xE000_ED24 => self.scb.shcsr = value & 0x0007_0000,
            CFSR => self.scb.cfsr &= !value,
            0xE000_ED2C => self.scb.hfsr &= !value,
            0xE000_ED34 => self.scb.mmfar = value,
            0xE000_ED38 => self.scb.bfar = value,
            0xE000_ED88 => self.scb.cpacr = value,
            MPU..=MPU_END => {
                self.scb.mpu.write(address - MPU, value)?;
                if let Some(what) = self.scb.mpu.not_modelled() {
                    self.report(Breach::NotModelled { what });
                }
            }
            0xE000_EDFC => self.set_demcr(value),
            0xE000_EF00 => self.pend_irqs((value >> 5) & 3, 1 << (value & 31)),
            0xE000_EF34 => self.scb.fpccr = value,
            0xE000_EF38 => self.scb.fpcar = value & !7,
            0xE000_EF3C => self.scb.fpdscr = value & 0x07C0_0000,
            DBGMCU..=DBGMCU_END => self.chip.write(address, 4, value, self.now).ok()?,
            _ => return None,
        }
        Some(())
    }

    /// The interrupts of a register that the chip has.
    fn present(&self, word: u32) -> u32 {
        let left = self.chip.interrupts().saturating_sub(32 * word);
        if left >= 32 { u32::MAX } else { (1 << left) - 1 }
    }

    fn pend_irqs(&mut self, word: u32, bits: u32) {
        let before = self.nvic.pending_set();
        self.nvic.set_pending(word, bits & self.present(word));
        self.stamp(self.nvic.pending_set() & !before);
    }

    /// Four priority bytes from exception number `first` on.
    fn priorities(&self, first: u32) -> u32 {
        let byte =
            |n: u32| if n < Exception::COUNT as u32 { self.nvic.priority(Exception(n as u8)) } else { 0 };
        u32::from_le_bytes([byte(first), byte(first + 1), byte(first + 2), byte(first + 3)])
    }

    fn set_priorities(&mut self, first: u32, value: u32) {
        for (number, priority) in (first..).zip(value.to_le_bytes()) {
            if number < Exception::COUNT as u32 {
                self.nvic.set_priority(Exception(number as u8), priority);
            }
        }
    }

    fn icsr(&self, ipsr: u32) -> u32 {
        let flag = |exception, bit| if self.nvic.is_pending(exception) { bit } else { 0 };
        let irq = if self.nvic.any_irq_pending() { ISRPENDING } else { 0 };
        let pending = self.nvic.first_pending().map_or(0, |exception| u32::from(exception.0) << VECTPENDING);
        let to_base = if self.nvic.active_count() <= 1 { RETTOBASE } else { 0 };
        ipsr | irq
            | pending
            | to_base
            | flag(Exception::PEND_SV, PENDSVSET)
            | flag(Exception::SYS_TICK, PENDSTSET)
    }

    fn set_icsr(&mut self, value: u32) {
        for (bit, exception) in
            [(PENDSVSET, Exception::PEND_SV), (PENDSTSET, Exception::SYS_TICK), (1 << 31, Exception::NMI)]
        {
            if value & bit != 0 {
                self.pend(exception);
            }
        }
        for (bit, exception) in [(PENDSVCLR, Exception::PEND_SV), (PENDSTCLR, Exception::SYS_TICK)] {
            if value & bit != 0 {
                self.nvic.clear(exception.bit());
            }
        }
    }

    fn traces(&self) -> bool {
        self.scb.demcr & TRCENA != 0
    }

    fn set_demcr(&mut self, value: u32) {
        self.scb.demcr = value;
        if !self.traces() {
            self.set_cyccnt(false, self.cyccnt());
        }
    }

    fn set_ccr(&mut self, value: u32) {
        self.scb.ccr = value;
        let traps = [
            (UNALIGN_TRP, "CCR.UNALIGN_TRP, but with --interleave,"),
            (DIV_0_TRP, "CCR.DIV_0_TRP, but with --interleave,"),
        ];
        let sees_none = self.stepping.is_none();
        for (_, what) in traps.into_iter().filter(|(bit, _)| value & bit != 0 && sees_none) {
            self.report(Breach::NotModelled { what });
        }
    }

    fn set_aircr(&mut self, value: u32) {
        if value >> 16 == AIRCR_KEY {
            self.nvic.set_group(value >> 8 & 7);
            self.reset_requested |= value & SYSRESETREQ != 0;
        }
    }
}
