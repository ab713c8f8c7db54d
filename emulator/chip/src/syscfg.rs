//! SYSCFG: selects the port for each EXTI line (RM0390 section 8.2, RM0090 section 9.2).

use crate::register::{Plain, RegisterFile, bit, field, flag};

const CMPCR: u32 = 0x20;
const EXTICR1: u32 = 0x08;

const PLAIN: &[Plain] = &[
    Plain::new(0x00, 0, 0x0000_0C07),
    Plain::new(0x04, 0, 0x0087_0000),
    Plain::new(EXTICR1, 0, 0xFFFF),
    Plain::new(0x0C, 0, 0xFFFF),
    Plain::new(0x10, 0, 0xFFFF),
    Plain::new(0x14, 0, 0xFFFF),
    Plain::new(CMPCR, 0, 0x0000_0001),
];

#[derive(Clone)]
pub(crate) struct Syscfg {
    plain: RegisterFile,
}

impl Syscfg {
    pub(crate) fn new() -> Self {
        Self { plain: RegisterFile::new(PLAIN) }
    }

    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        let value = self.plain.read(offset)?;
        // The compensation cell is ready immediately.
        Some(if offset == CMPCR { value | flag(bit(value, 0), 8) } else { value })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        self.plain.write(offset, value)
    }

    /// The port (0 is GPIOA) that drives an EXTI line with its pin of the same number.
    pub(crate) fn port_of_line(&self, line: u32) -> usize {
        field(self.plain.get(EXTICR1 + line / 4 * 4), line % 4 * 4, 4) as usize
    }
}
