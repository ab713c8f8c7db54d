//! Registers without side effects, which only hold their value.

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
    /// Indexed by word: register look-ups are the most frequent operation of the models.
    registers: Vec<Option<Register>>,
}

#[derive(Clone, Copy)]
struct Register {
    value: u32,
    writable: u32,
}

impl RegisterFile {
    pub(crate) fn new(layout: &'static [Plain]) -> Self {
        let words = layout.iter().map(|plain| plain.offset as usize / 4 + 1).max().unwrap_or(0);
        let mut registers = vec![None; words];
        for &Plain { offset, reset, writable } in layout {
            registers[offset as usize / 4] = Some(Register { value: reset, writable });
        }
        Self { layout, registers }
    }

    /// All values as after a reset.
    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.layout);
    }

    /// The value at `offset`, a multiple of 4; `None` when no register of this file is there.
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        self.registers.get(offset as usize / 4)?.map(|register| register.value)
    }

    /// Writes the writable bits at `offset`, a multiple of 4; `None` when no register of this file is there.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        let register = self.registers.get_mut(offset as usize / 4)?.as_mut()?;
        register.value = register.value & !register.writable | value & register.writable;
        Some(())
    }

    /// The register's value at `offset`, as seen by the model.
    ///
    /// # Panics
    /// When the layout has no such register: a bug in the model.
    pub(crate) fn get(&self, offset: u32) -> u32 {
        self.read(offset).expect("the layout has the register")
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
