//! Flash and RAM of a node: the size of its image less that of an empty image.

use std::path::Path;

use anyhow::{Context, Result};
use object::{Object, ObjectSection};

/// Bytes of an image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizes {
    /// Instructions.
    pub(crate) code: u64,
    /// Constants, the dictionary among them.
    pub(crate) constants: u64,
    /// Variables with an initial value: they take RAM, and flash for the initial value.
    pub(crate) initialised: u64,
    /// Variables that are zero at start-up.
    pub(crate) zeroed: u64,
}

impl Sizes {
    /// The sizes of the program in an ELF file, without the stack and the vector table.
    pub(crate) fn of(path: &Path) -> Result<Sizes> {
        let file = std::fs::read(path).with_context(|| path.display().to_string())?;
        let elf = object::File::parse(file.as_slice())?;
        let size = |name| elf.section_by_name(name).map_or(0, |section| section.size());
        Ok(Sizes {
            code: size(".text"),
            constants: size(".rodata"),
            initialised: size(".data"),
            zeroed: size(".bss") + size(".uninit"),
        })
    }

    /// The sizes less those of an empty image.
    pub(crate) fn without(self, empty: Sizes) -> Sizes {
        Sizes {
            code: self.code.saturating_sub(empty.code),
            constants: self.constants.saturating_sub(empty.constants),
            initialised: self.initialised.saturating_sub(empty.initialised),
            zeroed: self.zeroed.saturating_sub(empty.zeroed),
        }
    }

    pub(crate) fn flash(self) -> u64 {
        self.code + self.constants + self.initialised
    }

    pub(crate) fn ram(self) -> u64 {
        self.initialised + self.zeroed
    }
}
