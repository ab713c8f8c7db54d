//! One stream of a DMA controller.

use crate::register::{bit, field, flag};

const CR: u32 = 0x00;
const NDTR: u32 = 0x04;
const PAR: u32 = 0x08;
const M0AR: u32 = 0x0C;
const M1AR: u32 = 0x10;
const FCR: u32 = 0x14;

const EN: u32 = 0;
const CIRC: u32 = 8;
const PINC: u32 = 9;
const MINC: u32 = 10;
const DBM: u32 = 18;
const CT: u32 = 19;
/// Unmodelled bits of CR: PFCTRL, PBURST and MBURST.
const CR_NOT_MODELLED: u32 = 1 << 5 | 0xF << 21;
/// Unmodelled bit of FCR: DMDIS (FIFO mode).
const FCR_NOT_MODELLED: u32 = 1 << 2;

/// Positions of the flags within a stream's part of the status registers.
const DMEIF: u32 = 2;
const TEIF: u32 = 3;
const HTIF: u32 = 4;
const TCIF: u32 = 5;

/// The direction of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    PeripheralToMemory,
    MemoryToPeripheral,
}

/// The next item that the stream moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Transfer {
    pub(crate) direction: Direction,
    pub(crate) peripheral: u32,
    pub(crate) memory: u32,
    /// Size in bytes. In direct mode PSIZE applies to both sides.
    pub(crate) size: u8,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Stream {
    cr: u32,
    /// Items left.
    left: u32,
    /// Items in a complete round.
    all: u32,
    par: u32,
    memory: [u32; 2],
    fcr: u32,
    flags: u32,
    /// A transfer has begun while flags of the last transfer were set.
    begun_with_flags: bool,
    /// The program has stopped the stream and has not seen its end yet.
    is_stopping: bool,
    /// The program has set the stream up in this state.
    set_up_early: bool,
    /// A transfer has begun with an address that is no multiple of its width.
    odd_address: bool,
}

impl Default for Stream {
    fn default() -> Self {
        Self {
            cr: 0,
            left: 0,
            all: 0,
            par: 0,
            memory: [0; 2],
            fcr: 0x21,
            flags: 0,
            begun_with_flags: false,
            is_stopping: false,
            set_up_early: false,
            odd_address: false,
        }
    }
}

impl Stream {
    pub(super) fn read(&mut self, register: u32) -> Option<u32> {
        match register {
            CR => {
                self.is_stopping = false;
                Some(self.cr)
            }
            NDTR => Some(self.left),
            PAR => Some(self.par),
            M0AR => Some(self.memory[0]),
            M1AR => Some(self.memory[1]),
            FCR => Some(self.fcr),
            _ => None,
        }
    }

    pub(super) fn write(&mut self, register: u32, value: u32) -> Option<()> {
        self.set_up_early |= self.is_stopping;
        match register {
            CR => return self.write_control(value),
            FCR => {
                self.fcr = value & 0x87 | self.fcr & 0x38;
                return (value & FCR_NOT_MODELLED == 0).then_some(());
            }
            M0AR => self.write_memory(0, value),
            M1AR => self.write_memory(1, value),
            // Write-protected while the stream is enabled.
            NDTR | PAR if self.enabled() => {}
            NDTR => self.left = value & 0xFFFF,
            PAR => self.par = value,
            _ => return None,
        }
        Some(())
    }

    fn write_control(&mut self, value: u32) -> Option<()> {
        let enable = bit(value, EN);
        if self.enabled() {
            // Only EN and the interrupt enables can be written; a stop by software raises TCIF (RM0390 section 9.3.17).
            self.cr = self.cr & !0x1F | value & 0x1F;
            self.flags |= flag(!enable, TCIF);
            self.is_stopping = !enable;
            return Some(());
        }
        self.cr = value & 0x0FEF_FFFF;
        self.odd_address |= enable && (self.par | self.memory[0]) & (self.width() - 1) != 0;
        self.begun_with_flags |= enable && self.flags != 0;
        self.all = self.left;
        let memory_to_memory = field(value, 6, 2) >= 2;
        (value & CR_NOT_MODELLED == 0 && !memory_to_memory).then_some(())
    }

    /// Double buffer mode: the address not in use can be written while the stream runs.
    fn write_memory(&mut self, index: usize, value: u32) {
        let in_use = usize::from(bit(self.cr, CT)) == index;
        if !self.enabled() || bit(self.cr, DBM) && !in_use {
            self.memory[index] = value;
        }
    }

    /// Whether a transfer has begun, since the last call, while flags of the previous transfer were set (RM0390 section
    /// 9.5.5, EN).
    pub(crate) fn take_begun_with_flags(&mut self) -> bool {
        std::mem::take(&mut self.begun_with_flags)
    }

    /// Whether the stream was set up, since the last call, before the program has seen that it has stopped (RM0390 section
    /// 9.3.18).
    pub(crate) fn take_set_up_early(&mut self) -> bool {
        std::mem::take(&mut self.set_up_early)
    }

    /// Whether a transfer has begun, since the last call, with an address that is no multiple of its width.
    pub(crate) fn take_odd_address(&mut self) -> bool {
        std::mem::take(&mut self.odd_address)
    }

    /// Bytes of an item.
    fn width(&self) -> u32 {
        1 << field(self.cr, 11, 2).min(2)
    }

    fn enabled(&self) -> bool {
        bit(self.cr, EN)
    }

    pub(super) fn listens_to(&self, channel: u32) -> bool {
        self.enabled() && self.left != 0 && field(self.cr, 25, 3) == channel
    }

    /// The next item; the caller moves the item and then calls `done` or `fail`.
    pub(crate) fn next(&self) -> Transfer {
        let size = self.width();
        let moved = (self.all - self.left) * size;
        let step = |increments: u32| if bit(self.cr, increments) { moved } else { 0 };
        let direction = if field(self.cr, 6, 2) == 0 {
            Direction::PeripheralToMemory
        } else {
            Direction::MemoryToPeripheral
        };
        let memory = self.memory[usize::from(bit(self.cr, CT))];
        Transfer {
            direction,
            peripheral: self.par.wrapping_add(step(PINC)),
            memory: memory.wrapping_add(step(MINC)),
            size: size as u8,
        }
    }

    /// Counts a moved item; `true` for the last item of a round.
    pub(crate) fn done(&mut self) -> bool {
        self.left -= 1;
        // Half transfer (RM0390 section 9.3.7).
        self.flags |= flag(self.left == self.all / 2, HTIF);
        let last = self.left == 0;
        if last {
            self.end_round();
        }
        last
    }

    fn end_round(&mut self) {
        self.flags |= 1 << TCIF;
        let double = bit(self.cr, DBM);
        if double {
            self.cr ^= 1 << CT;
        }
        if double || bit(self.cr, CIRC) {
            self.left = self.all;
        } else {
            self.cr &= !(1 << EN);
        }
    }

    /// A bus error stops the stream.
    pub(crate) fn fail(&mut self) {
        self.flags |= 1 << TEIF;
        self.cr &= !(1 << EN);
    }

    /// Items until the next half or full transfer.
    pub(crate) fn until_event(&self) -> u32 {
        let half = self.all / 2;
        if self.left > half { self.left - half } else { self.left }
    }

    /// The flags as the program reads them: a stopped stream shows by its flag, too.
    pub(super) fn show_flags(&mut self) -> u32 {
        self.is_stopping = false;
        self.flags
    }

    pub(super) fn clear(&mut self, flags: u32) {
        self.flags &= !(flags & 0x3D);
    }

    /// The level of the interrupt line.
    pub(super) fn interrupt(&self) -> bool {
        let enabled = flag(bit(self.cr, 1), DMEIF)
            | flag(bit(self.cr, 2), TEIF)
            | flag(bit(self.cr, 3), HTIF)
            | flag(bit(self.cr, 4), TCIF);
        self.flags & enabled != 0
    }
}
