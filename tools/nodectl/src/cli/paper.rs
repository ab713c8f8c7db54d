//! A buffer for the output of a command that runs within another program.

use std::cell::RefCell;
use std::io::{self, Write};
use std::rc::Rc;

/// A buffer for printed text; its clones share the text.
#[derive(Clone, Debug, Default)]
pub struct Paper(Rc<RefCell<Vec<u8>>>);

impl Paper {
    /// The text printed since the last call.
    #[must_use]
    pub fn take(&self) -> String {
        String::from_utf8_lossy(&self.0.take()).into_owned()
    }
}

impl Write for Paper {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
