//! A flash that the board and the store share, so that the board can cut the power while the store writes.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use storage::mock::{MockFlash, PowerCut, Weak};

/// Page size of the board (memory.x).
pub(super) const PAGE: u32 = 16 * 1024;
const ERASE: usize = PAGE as usize;

/// The flash.
#[derive(Clone, Debug)]
pub(super) struct Flash(Rc<RefCell<MockFlash<ERASE>>>);

impl Flash {
    pub(super) fn erased() -> Flash {
        Flash(Rc::new(RefCell::new(MockFlash::new(2 * ERASE, 1))))
    }

    /// Cuts the power in the middle of an operation, after `operations` further operations.
    pub(super) fn cut_after(&self, operations: u8) {
        self.0.borrow_mut().cut_after(operations.into(), Weak::Random);
    }

    pub(super) fn is_down(&self) -> bool {
        self.0.borrow().is_down()
    }

    pub(super) fn power_up(&self) {
        self.0.borrow_mut().power_up();
    }
}

impl ErrorType for Flash {
    type Error = PowerCut;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        self.0.borrow_mut().read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.borrow().capacity()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        self.0.borrow_mut().erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        self.0.borrow_mut().write(offset, bytes)
    }
}
