//! FLASH: access control.

use crate::register::{Plain, RegisterFile};

const PLAIN: &[Plain] = &[Plain::new(0x00, 0, 0x0000_1F0F)];

#[derive(Clone)]
pub(crate) struct Flash {
    plain: RegisterFile,
}

impl Flash {
    pub(crate) fn new() -> Self {
        Self { plain: RegisterFile::new(PLAIN) }
    }
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        self.plain.read(offset)
    }
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        self.plain.write(offset, value)
    }
}
