//! CRC: the Ethernet polynomial over whole words, most significant bit first (RM0390 section 4, RM0090 section 4).

use crc::{CRC_32_MPEG_2, Crc};

use crate::register::bit;

const DR: u32 = 0x00;
const IDR: u32 = 0x04;
const CR: u32 = 0x08;

const ALGORITHM: Crc<u32> = Crc::<u32>::new(&CRC_32_MPEG_2);
const INITIAL: u32 = u32::MAX;

#[derive(Clone, Debug)]
pub(crate) struct CrcUnit {
    data: u32,
    independent: u32,
}

impl CrcUnit {
    pub(crate) fn new() -> Self {
        Self { data: INITIAL, independent: 0 }
    }

    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            DR => Some(self.data),
            IDR => Some(self.independent),
            CR => Some(0),
            _ => None,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            DR => self.add(value),
            IDR => self.independent = value & 0xFF,
            CR if bit(value, 0) => self.data = INITIAL,
            CR => {}
            _ => return None,
        }
        Some(())
    }

    fn add(&mut self, word: u32) {
        let mut digest = ALGORITHM.digest_with_initial(self.data);
        digest.update(&word.to_be_bytes());
        self.data = digest.finalize();
    }
}
