//! The private peripheral bus: addresses of the core's own registers (ARMv7-M ARM, table B3-3 and on).

use chip::{BusFault, Peripherals};

use crate::exception::Exception;
use crate::mechanism::Mechanism;
use crate::nvic::Bits;
use crate::system::System;

/// Cortex-M4 r0p1.
const CPUID: u32 = 0x410F_C241;
/// ICTR: lines in units of 32, less one; the STM32F4 has up to 97.
const INTLINESNUM: u32 = 3;

const SYSTICK: u32 = 0xE000_E010;
const DWT: u32 = 0xE000_1000;

impl<P: Peripherals> System<P> {
    /// A read of 1, 2 or 4 bytes; a register that is not modelled is an error, never silently zero.
    pub(crate) fn read_control(&mut self, address: u32, size: u8) -> Result<u32, BusFault> {
        let shift = 8 * (address & 3);
        self.control_word(address & !3).map(|word| word >> shift & mask(size)).ok_or(BusFault)
    }

    /// A write of 1, 2 or 4 bytes; other bytes of a register of priorities keep their values.
    pub(crate) fn write_control(&mut self, address: u32, size: u8, value: u32) -> Result<(), BusFault> {
        let (word, shift) = (address & !3, 8 * (address & 3));
        let lanes = mask(size) << shift;
        let kept = if has_byte_lanes(word) { self.control_word(word).unwrap_or(0) & !lanes } else { 0 };
        self.set_control_word(word, kept | value << shift & lanes).ok_or(BusFault)
    }

    fn control_word(&mut self, address: u32) -> Option<u32> {
        let now = self.clock.now();
        match address {
            0xE000_1000..=0xE000_1FFF => self.dwt.read(address - DWT, self.clock.cycles()),
            0xE000_E004 => Some(INTLINESNUM),
            0xE000_E008 => Some(0),
            0xE000_E010..=0xE000_E01C => self.systick.read(address - SYSTICK, now),
            0xE000_E100..=0xE000_E10C | 0xE000_E180..=0xE000_E18C => {
                Some(self.nvic.word(Bits::Enabled, index(address)))
            }
            0xE000_E200..=0xE000_E20C | 0xE000_E280..=0xE000_E28C => {
                Some(self.nvic.word(Bits::Pending, index(address)))
            }
            0xE000_E300..=0xE000_E30C => Some(self.nvic.word(Bits::Active, index(address))),
            0xE000_E400..=0xE000_E46C => Some(self.priorities(16 + (address & 0x7F) as u8)),
            0xE000_ED00..=0xE000_ED8C => self.scb_word(address),
            // MPU_TYPE: the MPU is not modelled and so not there.
            0xE000_ED90 => Some(0),
            // DHCSR: no debugger.
            0xE000_EDF0 => Some(0),
            0xE000_EDFC => Some(self.dwt.demcr()),
            0xE000_EF34 => Some(self.scb.fpccr),
            0xE000_EF38 => Some(self.scb.fpcar),
            0xE000_EF3C => Some(self.scb.fpdscr),
            0xE000_EF40 => Some(0x1011_0021),
            0xE000_EF44 => Some(0x1100_0011),
            _ => None,
        }
    }

    fn set_control_word(&mut self, address: u32, value: u32) -> Option<()> {
        let now = self.clock.now();
        match address {
            0xE000_1000..=0xE000_1FFF => self.dwt.write(address - DWT, value, self.clock.cycles())?,
            0xE000_E008 => {}
            0xE000_E010..=0xE000_E01C => self.systick.write(address - SYSTICK, value, now)?,
            0xE000_E100..=0xE000_E10C => self.nvic.enable(index(address), value),
            0xE000_E180..=0xE000_E18C => self.nvic.disable(index(address), value),
            0xE000_E200..=0xE000_E20C => self.pend_lines(index(address), value),
            0xE000_E280..=0xE000_E28C => self.nvic.clear_pending(index(address), value),
            0xE000_E400..=0xE000_E46C => self.set_priorities(16 + (address & 0x7F) as u8, value),
            0xE000_ED00..=0xE000_ED8C => self.set_scb_word(address, value)?,
            0xE000_EDF0 => {}
            0xE000_EDFC => self.dwt.set_demcr(value, self.clock.cycles()),
            0xE000_EF00 => self.pend_lines((value & 0x1FF) >> 5, 1 << (value & 31)),
            0xE000_EF34 => self.scb.fpccr = value,
            0xE000_EF38 => self.scb.fpcar = value & !7,
            0xE000_EF3C => self.scb.fpdscr = value & 0x07C0_0000,
            _ => return None,
        }
        Some(())
    }

    fn scb_word(&mut self, address: u32) -> Option<u32> {
        match address {
            0xE000_ED00 => Some(CPUID),
            0xE000_ED04 => Some(self.icsr()),
            0xE000_ED08 => Some(self.scb.vtor),
            0xE000_ED0C => Some(0xFA05_0000 | self.scb.prigroup << 8),
            0xE000_ED10 => Some(self.scb.scr),
            0xE000_ED14 => Some(self.scb.ccr),
            0xE000_ED18..=0xE000_ED20 => Some(self.priorities(4 + (address - 0xE000_ED18) as u8)),
            0xE000_ED24 => Some(self.shcsr()),
            0xE000_ED28 => Some(self.scb.cfsr),
            0xE000_ED2C => Some(self.scb.hfsr),
            0xE000_ED30 => Some(0),
            0xE000_ED34 => Some(self.scb.mmfar),
            0xE000_ED38 => Some(self.scb.bfar),
            0xE000_ED88 => Some(self.scb.cpacr),
            _ => None,
        }
    }

    fn set_scb_word(&mut self, address: u32, value: u32) -> Option<()> {
        match address {
            0xE000_ED04 => self.set_icsr(value),
            0xE000_ED08 => self.scb.vtor = value & 0xFFFF_FF80,
            0xE000_ED0C => {
                if let Some(prigroup) = self.scb.write_aircr(value) {
                    self.nvic.set_grouping(prigroup);
                }
            }
            0xE000_ED10 => self.scb.scr = value & 0x16,
            0xE000_ED14 => self.scb.ccr = value & 0x31B,
            0xE000_ED18..=0xE000_ED20 => self.set_priorities(4 + (address - 0xE000_ED18) as u8, value),
            0xE000_ED24 => self.scb.set_fault_enables(value),
            0xE000_ED28 => self.scb.cfsr &= !value,
            0xE000_ED2C => self.scb.hfsr &= !value,
            0xE000_ED30 => {}
            0xE000_ED34 => self.scb.mmfar = value,
            0xE000_ED38 => self.scb.bfar = value,
            0xE000_ED88 => self.scb.cpacr = value & 0x00F0_0000,
            _ => return None,
        }
        Some(())
    }

    /// ICSR; VECTACTIVE is the handler that was entered last.
    fn icsr(&self) -> u32 {
        let pending = |exception, bit: u32| u32::from(self.nvic.is_pending(exception)) << bit;
        let next = self.nvic.best().map_or(0, |best| u32::from(best.exception.0));
        let active = self.stats.current();
        pending(Exception::NMI, 31)
            | pending(Exception::PEND_SV, 28)
            | pending(Exception::SYS_TICK, 26)
            | u32::from(self.nvic.any_irq_pending()) << 22
            | next << 12
            | u32::from(!self.nvic.others_active(active)) << 11
            | u32::from(active.0)
    }

    fn set_icsr(&mut self, value: u32) {
        let bits = [
            (31, Exception::NMI, true),
            (28, Exception::PEND_SV, true),
            (27, Exception::PEND_SV, false),
            (26, Exception::SYS_TICK, true),
            (25, Exception::SYS_TICK, false),
        ];
        let now = self.clock.now();
        for (_, exception, pend) in bits.into_iter().filter(|(bit, ..)| value >> bit & 1 != 0) {
            if !pend {
                self.nvic.unpend(exception);
            } else if self.works(Mechanism::SoftwarePending) {
                self.nvic.pend(exception, now);
            }
        }
    }

    /// ISPR and STIR.
    fn pend_lines(&mut self, index: u32, bits: u32) {
        if index < 4 && self.works(Mechanism::SoftwarePending) {
            self.nvic.set_pending(index, bits, self.clock.now());
        }
    }

    fn shcsr(&self) -> u32 {
        let active = |exception, bit: u32| u32::from(self.nvic.is_active(exception)) << bit;
        let pending = |exception, bit: u32| u32::from(self.nvic.is_pending(exception)) << bit;
        self.scb.fault_enables()
            | active(Exception::MEM_MANAGE, 0)
            | active(Exception::BUS_FAULT, 1)
            | active(Exception::USAGE_FAULT, 3)
            | active(Exception::SV_CALL, 7)
            | active(Exception::DEBUG_MONITOR, 8)
            | active(Exception::PEND_SV, 10)
            | active(Exception::SYS_TICK, 11)
            | pending(Exception::USAGE_FAULT, 12)
            | pending(Exception::MEM_MANAGE, 13)
            | pending(Exception::BUS_FAULT, 14)
            | pending(Exception::SV_CALL, 15)
    }

    /// Four priorities, one a byte, from exception `first`.
    fn priorities(&self, first: u8) -> u32 {
        let bytes = [0, 1, 2, 3].map(|lane| self.nvic.priority(Exception(first + lane)));
        u32::from_le_bytes(bytes)
    }

    fn set_priorities(&mut self, first: u8, value: u32) {
        for (exception, priority) in (first..).map(Exception).zip(value.to_le_bytes()) {
            self.nvic.set_priority(exception, priority);
        }
    }
}

/// The number of a 32-bit register in its bank of the NVIC.
fn index(address: u32) -> u32 {
    address >> 2 & 3
}

fn mask(size: u8) -> u32 {
    match size {
        1 => 0xFF,
        2 => 0xFFFF,
        _ => u32::MAX,
    }
}

/// Registers of which a byte can be written alone: the priorities.
fn has_byte_lanes(address: u32) -> bool {
    matches!(address, 0xE000_E400..=0xE000_E46C | 0xE000_ED18..=0xE000_ED20)
}
