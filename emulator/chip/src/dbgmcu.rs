//! DBGMCU: the device code and the freeze bits for a debugger (RM0390 section 33.16). Without a debugger nothing is
//! frozen.

use crate::register::{Plain, RegisterFile, bit};
use crate::variant::Variant;

const IDCODE: u32 = 0x00;
const CR: u32 = 0x04;

const PLAIN: &[Plain] =
    &[Plain::new(CR, 0, 0x0000_00E7), Plain::new(0x08, 0, 0x0EE0_1DFF), Plain::new(0x0C, 0, 0x0007_0003)];

#[derive(Clone)]
pub(crate) struct Dbgmcu {
    id_code: u32,
    plain: RegisterFile,
}

impl Dbgmcu {
    pub(crate) fn new(variant: Variant) -> Self {
        Self { id_code: variant.id_code(), plain: RegisterFile::new(PLAIN) }
    }

    /// DBG_SLEEP: the clocks run on while the core sleeps.
    pub(crate) fn debugs_sleep(&self) -> bool {
        bit(self.plain.get(CR), 0)
    }

    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        if offset == IDCODE { Some(self.id_code) } else { self.plain.read(offset) }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        if offset == IDCODE { Some(()) } else { self.plain.write(offset, value) }
    }
}
