//! A NOR flash for tests: erased in units of one size, and programmed in words of four or eight bytes.

use std::ops::{Deref, DerefMut};
use std::vec;
use std::vec::Vec;

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash, check_erase, check_read, check_write};

use crate::cells::Cells;
pub use crate::cells::{PowerCut, Weak};

/// A flash that is erased in units of `ERASE` bytes and programmed in words of `WORD`. Its [`Cells`] define the power
/// cuts.
#[derive(Clone, Debug)]
pub struct MockFlash<const ERASE: usize, const WORD: usize = 4> {
    cells: Cells,
    erases: Vec<u32>,
}

impl<const ERASE: usize, const WORD: usize> MockFlash<ERASE, WORD> {
    /// An erased flash of `size` bytes. `seed` determines how random weak bits read.
    #[must_use]
    pub fn new(size: usize, seed: u64) -> Self {
        MockFlash { cells: Cells::with_words(size, WORD, seed), erases: vec![0; size / ERASE] }
    }

    /// Number of erases of each erase unit.
    #[must_use]
    pub fn erases(&self) -> &[u32] {
        &self.erases
    }
}

impl<const ERASE: usize, const WORD: usize> Deref for MockFlash<ERASE, WORD> {
    type Target = Cells;

    fn deref(&self) -> &Cells {
        &self.cells
    }
}

impl<const ERASE: usize, const WORD: usize> DerefMut for MockFlash<ERASE, WORD> {
    fn deref_mut(&mut self) -> &mut Cells {
        &mut self.cells
    }
}

impl<const ERASE: usize, const WORD: usize> ErrorType for MockFlash<ERASE, WORD> {
    type Error = PowerCut;
}

impl<const ERASE: usize, const WORD: usize> ReadNorFlash for MockFlash<ERASE, WORD> {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        check_read(self, offset, bytes.len()).expect("a read within the flash, of whole words");
        self.cells.read(offset as usize, bytes)
    }

    fn capacity(&self) -> usize {
        self.cells.size()
    }
}

impl<const ERASE: usize, const WORD: usize> NorFlash for MockFlash<ERASE, WORD> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        check_erase(self, from, to).expect("an erase of whole units within the flash");
        for unit in from as usize / ERASE..to as usize / ERASE {
            self.erases[unit] += 1;
            self.cells.erase(unit * ERASE..(unit + 1) * ERASE)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        check_write(self, offset, bytes.len()).expect("a write of whole words within the flash");
        self.cells.program(offset as usize, bytes)
    }
}
