//! A flash for tests: sectors of different sizes, words of four or eight bytes, and an erase that takes several polls.

use core::cell::RefCell;
use core::ops::{Deref, DerefMut, Range};
use std::collections::HashMap;
use std::vec::Vec;

use embedded_storage::nor_flash::{ErrorType, ReadNorFlash, check_read};
use storage::cells::{Cells, WORD};

use crate::flash::Flash;

pub use storage::cells::{PowerCut, Weak};

/// Number of polls that an erase takes.
const ERASE_POLLS: u32 = 3;

/// Number of points that are kept.
const MOST_POINTS: usize = 10_000;

std::thread_local! {
    /// The points of signatures that were computed, because tests verify the same images again and again, and the
    /// arithmetic would take all of their time. A point is kept for all of its numbers, so no result is another one.
    static POINTS: RefCell<HashMap<Vec<u8>, [u8; 32]>> = RefCell::new(HashMap::new());
}

/// The point of these numbers, if it was computed before.
pub(crate) fn known_point(numbers: &[u8]) -> Option<[u8; 32]> {
    POINTS.with_borrow(|points| points.get(numbers).copied())
}

/// Keeps the point of these numbers.
pub(crate) fn learn_point(numbers: Vec<u8>, point: [u8; 32]) {
    POINTS.with_borrow_mut(|points| {
        if points.len() >= MOST_POINTS {
            points.clear();
        }
        points.insert(numbers, point);
    });
}

/// A flash whose [`Cells`] define the power cuts.
#[derive(Clone, Debug)]
pub struct MockFlash {
    cells: Cells,
    word: usize,
    sectors: Vec<Range<usize>>,
    /// The start of the sector of each erase.
    erased: Vec<usize>,
    busy: u32,
}

impl MockFlash {
    /// An erased flash with sectors of these sizes in bytes. `seed` determines how random weak bits read.
    #[must_use]
    pub fn new(sectors: &[usize], seed: u64) -> MockFlash {
        MockFlash::with_words(sectors, WORD, seed)
    }

    /// The same flash with words of `word` bytes, 4 or 8.
    #[must_use]
    pub fn with_words(sectors: &[usize], word: usize, seed: u64) -> MockFlash {
        let mut end = 0;
        let ranges = sectors.iter().map(|size| {
            end += size;
            end - size..end
        });
        let sectors_of = ranges.collect();
        let cells = Cells::with_words(sectors.iter().sum(), word, seed);
        MockFlash { sectors: sectors_of, erased: Vec::new(), cells, word, busy: 0 }
    }

    /// Switches the power on, without a further cut.
    pub fn power_up(&mut self) {
        self.busy = 0;
        self.cells.power_up();
    }

    /// Number of erases of the sector that begins at `offset`.
    #[must_use]
    pub fn erases(&self, offset: usize) -> u32 {
        let erases = self.erased.iter().filter(|start| **start == offset).count();
        u32::try_from(erases).unwrap_or(u32::MAX)
    }

    /// Checks that no erase is in progress, because the flash can then neither be read nor programmed.
    fn ready(&self) -> Result<(), PowerCut> {
        self.cells.check_power()?;
        assert_eq!(self.busy, 0, "the flash erases");
        Ok(())
    }
}

impl Deref for MockFlash {
    type Target = Cells;

    fn deref(&self) -> &Cells {
        &self.cells
    }
}

impl DerefMut for MockFlash {
    fn deref_mut(&mut self) -> &mut Cells {
        &mut self.cells
    }
}

impl ErrorType for MockFlash {
    type Error = PowerCut;
}

impl ReadNorFlash for MockFlash {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        check_read(self, offset, bytes.len()).expect("a read within the flash, of whole words");
        self.ready()?;
        self.cells.read(offset as usize, bytes)
    }

    fn capacity(&self) -> usize {
        self.cells.size()
    }
}

impl Flash for MockFlash {
    fn word_size(&self) -> u32 {
        u32::try_from(self.word).expect("a few bytes")
    }

    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        check_read(self, offset, bytes.len()).expect("words within the flash");
        let is_whole = |len: usize| len.is_multiple_of(self.word);
        assert!(is_whole(offset as usize) && is_whole(bytes.len()), "whole words");
        self.ready()?;
        self.cells.program(offset as usize, bytes)
    }

    fn start_erase(&mut self, offset: u32) -> Result<(), PowerCut> {
        self.ready()?;
        let sector = self.sectors.iter().find(|sector| sector.start == offset as usize);
        let sector = sector.expect("the start of a sector").clone();
        self.busy = ERASE_POLLS;
        self.erased.push(sector.start);
        self.cells.erase(sector)
    }

    fn is_busy(&mut self) -> Result<bool, PowerCut> {
        self.busy = self.busy.saturating_sub(1);
        self.cells.check_power()?;
        Ok(self.busy > 0)
    }
}
