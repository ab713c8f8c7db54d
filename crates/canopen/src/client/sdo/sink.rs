//! The destination of the bytes of an upload.

use crate::copy::copy;

/// The destination of the bytes of an upload.
pub trait Sink {
    /// A transfer begins, perhaps once more: discards all bytes so far. `size` is the number of bytes, if the server
    /// announces it. `false` when there is no room for that many.
    fn begin(&mut self, size: Option<u32>) -> bool;

    /// Takes the next bytes. `false` when there is no room for them.
    fn append(&mut self, bytes: &[u8]) -> bool;
}

/// A sink of fixed size in memory.
#[derive(Debug)]
pub struct Buffer<'a> {
    memory: &'a mut [u8],
    len: usize,
}

impl<'a> Buffer<'a> {
    /// A sink that fills `memory` from its beginning.
    #[must_use]
    pub fn new(memory: &'a mut [u8]) -> Buffer<'a> {
        Buffer { memory, len: 0 }
    }

    /// The bytes received so far.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        self.memory.get(..self.len).unwrap_or(&[])
    }
}

impl Sink for Buffer<'_> {
    fn begin(&mut self, size: Option<u32>) -> bool {
        self.len = 0;
        size.is_none_or(|size| usize::try_from(size).is_ok_and(|size| size <= self.memory.len()))
    }

    fn append(&mut self, bytes: &[u8]) -> bool {
        let end = self.len.saturating_add(bytes.len());
        let Some(room) = self.memory.get_mut(self.len..end) else { return false };
        copy(room, bytes);
        self.len = end;
        true
    }
}
