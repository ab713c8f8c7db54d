//! What is printed, for whoever runs a command in a program of their own.

use std::cell::RefCell;
use std::io::{self, Write};
use std::rc::Rc;

/// Takes what is printed; its clones are the same paper.
#[derive(Clone, Debug, Default)]
pub struct Paper(Rc<RefCell<Vec<u8>>>);

impl Paper {
    /// What has been printed since the last call.
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
