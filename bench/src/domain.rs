//! The content of the domain object: a block upload returns the data of the last block download.

/// One block of 127 segments of 7 bytes.
const CAPACITY: usize = 889;

/// Up to one block of data. In every program the application owns it.
#[derive(Debug)]
pub struct Domain {
    bytes: [u8; CAPACITY],
    len: usize,
}

impl Domain {
    /// An empty domain.
    #[must_use]
    pub const fn new() -> Domain {
        Domain { bytes: [0; CAPACITY], len: 0 }
    }

    /// The content.
    #[must_use]
    pub fn content(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&[])
    }

    /// Writes a part of new content, which ends there for now; `false` if there is no room.
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
