//! Where the bytes of an upload go.

use crate::copy::copy;

/// Where the bytes of an upload go.
pub trait Sink {
    /// A transfer begins, perhaps anew: what has come before is void. `size` is how many bytes the server announces,
    /// where it does. `false` when there is no room for them.
    fn begin(&mut self, size: Option<u32>) -> bool;

    /// Takes the next bytes. `false` when there is no room for them.
    fn append(&mut self, bytes: &[u8]) -> bool;
}

/// A sink of fixed size.
#[derive(Debug)]
pub struct Buffer<'a> {
    memory: &'a mut [u8],
    len: usize,
}

impl<'a> Buffer<'a> {
    /// Fills this memory from its begin.
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
