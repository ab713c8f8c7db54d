//! Registers that only hold what is written to them.

/// One plain register of a peripheral.
#[derive(Clone)]
pub(crate) struct Plain {
    /// Byte offset from the base of the peripheral.
    pub(crate) offset: u32,
    /// Value after reset.
    pub(crate) reset: u32,
    /// Bits that a write can change; the others keep their reset value.
    pub(crate) writable: u32,
}

impl Plain {
    pub(crate) const fn new(offset: u32, reset: u32, writable: u32) -> Self {
        Self { offset, reset, writable }
    }
}

/// The plain registers of one peripheral.
#[derive(Clone)]
pub(crate) struct RegisterFile {
    layout: &'static [Plain],
    values: Vec<u32>,
}

impl RegisterFile {
    pub(crate) fn new(layout: &'static [Plain]) -> Self {
        let values = layout.iter().map(|register| register.reset).collect();
        Self { layout, values }
    }

    /// All values as after a reset.
    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.layout);
    }

    /// The value at `offset`; `None` when no register of this file is there.
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        self.position(offset).map(|index| self.values[index])
    }

    /// Writes the writable bits at `offset`; `None` when no register of this file is there.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        let index = self.position(offset)?;
        let writable = self.layout[index].writable;
        self.values[index] = self.values[index] & !writable | value & writable;
        Some(())
    }

    /// The value at `offset` as the hardware itself sees it.
    ///
    /// # Panics
    /// When the layout has no such register, which is a mistake of the model.
    pub(crate) fn get(&self, offset: u32) -> u32 {
        self.read(offset).expect("the layout has the register")
    }

    fn position(&self, offset: u32) -> Option<usize> {
        self.layout.iter().position(|register| register.offset == offset)
    }
}

/// Bit `n` of a register.
pub(crate) const fn bit(value: u32, n: u32) -> bool {
    value >> n & 1 != 0
}

/// The field of `width` bits from bit `low` on.
pub(crate) const fn field(value: u32, low: u32, width: u32) -> u32 {
    value >> low & ((1 << width) - 1)
}

/// `1 << n` when the condition holds, else nothing.
pub(crate) fn flag(condition: bool, n: u32) -> u32 {
    u32::from(condition) << n
}
