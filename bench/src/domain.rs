//! The content of the domain object: what a block download brings, a block upload gives back.

/// One block of 127 segments of 7 bytes.
const CAPACITY: usize = 889;

/// Up to one block of data, owned by the application in every program.
#[derive(Debug)]
pub struct Domain {
    bytes: [u8; CAPACITY],
    len: usize,
}

impl Domain {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Domain {
        Domain { bytes: [0; CAPACITY], len: 0 }
    }

    /// What is in it.
    #[must_use]
    pub fn content(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&[])
    }

    /// Takes a part of new content, and ends it there; `false` when there is no room.
    pub fn write(&mut self, offset: usize, part: &[u8]) -> bool {
        let end = offset.saturating_add(part.len());
        let Some(place) = self.bytes.get_mut(offset..end) else { return false };
        place.copy_from_slice(part);
        self.len = end;
        true
    }
}

impl Default for Domain {
    fn default() -> Domain {
        Domain::new()
    }
}
