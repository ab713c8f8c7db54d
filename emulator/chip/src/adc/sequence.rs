//! The regular sequence of an ADC and the sample times of its channels.

use crate::register::field;

const SMPR1: u32 = 0x0C;
const SMPR2: u32 = 0x10;
const SQR1: u32 = 0x2C;
const SQR2: u32 = 0x30;
const SQR3: u32 = 0x34;

/// Cycles of the ADC clock for each code of SMPx (RM0390 section 13.13.4).
const SAMPLE_CYCLES: [u32; 8] = [3, 15, 28, 56, 84, 112, 144, 480];

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sequence {
    smpr1: u32,
    smpr2: u32,
    sqr1: u32,
    sqr2: u32,
    sqr3: u32,
}

impl Sequence {
    pub(super) fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            SMPR1 => Some(self.smpr1),
            SMPR2 => Some(self.smpr2),
            SQR1 => Some(self.sqr1),
            SQR2 => Some(self.sqr2),
            SQR3 => Some(self.sqr3),
            _ => None,
        }
    }

    pub(super) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            SMPR1 => self.smpr1 = value & 0x07FF_FFFF,
            SMPR2 => self.smpr2 = value & 0x3FFF_FFFF,
            SQR1 => self.sqr1 = value & 0x00FF_FFFF,
            SQR2 => self.sqr2 = value & 0x3FFF_FFFF,
            SQR3 => self.sqr3 = value & 0x3FFF_FFFF,
            _ => return None,
        }
        Some(())
    }

    /// Conversions in the sequence, 1 to 16.
    pub(super) fn length(&self) -> usize {
        field(self.sqr1, 20, 4) as usize + 1
    }

    /// The channel of a rank, counted from 0.
    pub(super) fn channel(&self, rank: usize) -> u32 {
        let (register, place) = match rank {
            0..=5 => (self.sqr3, rank),
            6..=11 => (self.sqr2, rank - 6),
            _ => (self.sqr1, (rank - 12) % 4),
        };
        field(register, place as u32 * 5, 5)
    }

    /// The sample time of a rank in cycles.
    pub(super) fn sample_cycles(&self, rank: usize) -> u32 {
        let channel = self.channel(rank);
        let code = match channel {
            0..=9 => field(self.smpr2, channel * 3, 3),
            10..=18 => field(self.smpr1, (channel - 10) * 3, 3),
            _ => 0,
        };
        SAMPLE_CYCLES[code as usize]
    }
}
