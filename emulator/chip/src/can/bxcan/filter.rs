//! Acceptance filters: 28 banks in CAN1 that CAN1 and CAN2 share (RM0390, bxCAN identifier filtering).

use std::ops::Range;

use canbus::Frame;

use super::mailbox::identifier;
use crate::register::{bit, field};

const FMR: u32 = 0x200;
const FM1R: u32 = 0x204;
const FS1R: u32 = 0x20C;
const FFA1R: u32 = 0x214;
const FA1R: u32 = 0x21C;
const F0R1: u32 = 0x240;

const BANKS: usize = 28;
const ALL_BANKS: u32 = (1 << BANKS) - 1;
const LAST_FILTER: u32 = F0R1 + 8 * BANKS as u32 - 4;
/// Bits 31:14 and 7:1 of FMR are reserved and keep this value.
const FMR_RESET: u32 = 0x2A1C_0E01;
const FMR_WRITABLE: u32 = 0x3F01;

/// The filter that a frame has passed, and the FIFO for the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Match {
    /// The FIFO: 0 or 1.
    pub(crate) fifo: usize,
    /// Filter match index, counted for each FIFO.
    pub(crate) index: u8,
}

/// The filter registers.
#[derive(Clone, Debug)]
pub(crate) struct FilterBanks {
    fmr: u32,
    /// Bit `n` set: bank `n` is a list, not a mask.
    list: u32,
    /// Bit `n` set: bank `n` has 32-bit filters, not 16-bit ones.
    wide: u32,
    /// Bit `n` set: bank `n` stores into FIFO 1, not FIFO 0.
    fifo1: u32,
    active: u32,
    registers: [[u32; 2]; BANKS],
}

impl FilterBanks {
    pub(crate) fn new() -> FilterBanks {
        FilterBanks { fmr: FMR_RESET, list: 0, wide: 0, fifo1: 0, active: 0, registers: [[0; 2]; BANKS] }
    }

    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            FMR => Some(self.fmr),
            FM1R => Some(self.list),
            FS1R => Some(self.wide),
            FFA1R => Some(self.fifo1),
            FA1R => Some(self.active),
            F0R1..=LAST_FILTER => {
                let (bank, half) = place(offset);
                Some(self.registers[bank][half])
            }
            _ => None,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        let banks = value & ALL_BANKS;
        match offset {
            FMR => self.fmr = FMR_RESET & !FMR_WRITABLE | value & FMR_WRITABLE,
            FM1R => self.configure(|banks_of| &mut banks_of.list, banks),
            FS1R => self.configure(|banks_of| &mut banks_of.wide, banks),
            FFA1R => self.configure(|banks_of| &mut banks_of.fifo1, banks),
            FA1R => self.active = banks,
            F0R1..=LAST_FILTER => {
                let (bank, half) = place(offset);
                // An active filter is write protected outside of the filter initialisation mode.
                if self.is_initialising() || !bit(self.active, bank as u32) {
                    self.registers[bank][half] = value;
                }
            }
            _ => return None,
        }
        Some(())
    }

    /// Mode, scale and assignment can be written in the filter initialisation mode only.
    fn configure(&mut self, register: impl Fn(&mut FilterBanks) -> &mut u32, value: u32) {
        if self.is_initialising() {
            *register(self) = value;
        }
    }

    fn is_initialising(&self) -> bool {
        bit(self.fmr, 0)
    }

    /// The banks of CAN1 or, with `slave`, of CAN2.
    pub(crate) fn share(&self, slave: bool) -> Range<usize> {
        let split = (field(self.fmr, 8, 6) as usize).min(BANKS);
        if slave { split..BANKS } else { 0..split }
    }

    /// The filter of `banks` that the frame passes; `None` when the node does not receive the frame.
    pub(crate) fn accept(&self, frame: &Frame, banks: Range<usize>) -> Option<Match> {
        if self.is_initialising() {
            return None;
        }
        let mut numbers = [0_u8; 2];
        let mut best: Option<(u8, Match)> = None;
        for bank in banks {
            let kind = self.kind(bank);
            let fifo = usize::from(bit(self.fifo1, bank as u32));
            let first = numbers[fifo];
            numbers[fifo] += kind.filters();
            let hit = kind.first_match(self.registers[bank], identifier(frame));
            let Some(n) = hit.filter(|_| bit(self.active, bank as u32)) else { continue };
            // A match replaces one of an earlier bank only when its kind has a higher priority.
            if best.is_none_or(|(priority, _)| kind.priority() < priority) {
                best = Some((kind.priority(), Match { fifo, index: first + n }));
            }
        }
        best.map(|(_, found)| found)
    }

    fn kind(&self, bank: usize) -> Kind {
        match (bit(self.wide, bank as u32), bit(self.list, bank as u32)) {
            (true, true) => Kind::List32,
            (true, false) => Kind::Mask32,
            (false, true) => Kind::List16,
            (false, false) => Kind::Mask16,
        }
    }
}

/// The bank and the register within the bank.
fn place(offset: u32) -> (usize, usize) {
    let n = (offset - F0R1) as usize / 4;
    (n / 2, n % 2)
}

/// The scale and the mode of a bank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    List32,
    Mask32,
    List16,
    Mask16,
}

impl Kind {
    /// Number of filters in the bank. Inactive banks are numbered too.
    fn filters(self) -> u8 {
        match self {
            Kind::Mask32 => 1,
            Kind::List32 | Kind::Mask16 => 2,
            Kind::List16 => 4,
        }
    }

    /// Lower values have priority: 32 bits before 16, list before mask.
    fn priority(self) -> u8 {
        match self {
            Kind::List32 => 0,
            Kind::Mask32 => 1,
            Kind::List16 => 2,
            Kind::Mask16 => 3,
        }
    }

    /// The first filter in the bank that an identifier, in the layout of CAN_RIxR, passes.
    fn first_match(self, [one, two]: [u32; 2], identifier: u32) -> Option<u8> {
        let low = |register: u32| register & 0xFFFF;
        let high = |register: u32| register >> 16;
        let short = shorten(identifier);
        let passes: &[bool] = match self {
            Kind::Mask32 => &[(identifier ^ one) & two & !1 == 0],
            Kind::List32 => &[(identifier ^ one) & !1 == 0, (identifier ^ two) & !1 == 0],
            Kind::Mask16 => &[(short ^ low(one)) & high(one) == 0, (short ^ low(two)) & high(two) == 0],
            Kind::List16 => &[short == low(one), short == high(one), short == low(two), short == high(two)],
        };
        passes.iter().position(|passes| *passes).map(|n| n as u8)
    }
}

/// The 16-bit form: STID[10:0], RTR, IDE, EXID[17:15].
fn shorten(identifier: u32) -> u32 {
    let flag = |n: u32| field(identifier, n, 1);
    field(identifier, 21, 11) << 5 | flag(1) << 4 | flag(2) << 3 | field(identifier, 18, 3)
}
