//! The flash of a board, shared with the store, so that a test can cut the power while the store writes.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use storage::mock::{MockFlash, PowerCut, Weak};

/// Size of a page on the board (memory.x).
const PAGE: usize = 16 * 1024;

/// The flash.
#[derive(Clone, Debug)]
pub(super) struct Chip(Rc<RefCell<MockFlash<PAGE>>>);

impl Chip {
    pub(super) fn new(seed: u64) -> Chip {
        Chip(Rc::new(RefCell::new(MockFlash::new(2 * PAGE, seed))))
    }

    /// Cuts the power in the middle of an operation, after `operations` further operations.
    pub(super) fn cut_after(&self, operations: u32) {
        self.0.borrow_mut().cut_after(operations, Weak::Random);
    }

    pub(super) fn is_down(&self) -> bool {
        self.0.borrow().is_down()
    }

    pub(super) fn power_up(&self) {
        self.0.borrow_mut().power_up();
    }

    /// Erases of both pages.
    pub(super) fn erases(&self) -> u32 {
        self.0.borrow().erases().iter().sum()
    }
}

impl ErrorType for Chip {
    type Error = PowerCut;
}

impl ReadNorFlash for Chip {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        self.0.borrow_mut().read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.borrow().capacity()
    }
}

impl NorFlash for Chip {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        self.0.borrow_mut().erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        self.0.borrow_mut().write(offset, bytes)
    }
}
