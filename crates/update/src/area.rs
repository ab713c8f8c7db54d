//! Where things are in flash. Offsets count from the start of the flash, not of the address space.

use core::ops::Range;

use crate::commit::RECORD_ROOM;
use crate::header::HEADER;

/// Consecutive sectors, of whatever sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    start: u32,
    sectors: &'static [u32],
}

impl Area {
    /// The area that begins at offset `start` and has sectors of these sizes in bytes.
    #[must_use]
    pub const fn new(start: u32, sectors: &'static [u32]) -> Area {
        Area { start, sectors }
    }

    /// Offset of the first byte.
    #[must_use]
    pub const fn start(&self) -> u32 {
        self.start
    }

    /// Bytes.
    #[must_use]
    pub const fn size(&self) -> u32 {
        let (mut size, mut rest) = (0_u32, self.sectors);
        while let [sector, others @ ..] = rest {
            size = size.saturating_add(*sector);
            rest = others;
        }
        size
    }

    /// Offset of the first byte after it.
    #[must_use]
    pub const fn end(&self) -> u32 {
        self.start.saturating_add(self.size())
    }

    /// The sectors, as offsets.
    pub fn sectors(&self) -> impl Iterator<Item = Range<u32>> + use<> {
        self.sectors.iter().scan(self.start, |next, size| {
            let start = *next;
            *next = start.saturating_add(*size);
            Some(start..*next)
        })
    }
}

/// The two areas of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    application: Area,
    staging: Area,
}

impl Layout {
    /// A layout; `None` when staging could not hold every image of the application area and the commit record.
    #[must_use]
    pub const fn new(application: Area, staging: Area) -> Option<Layout> {
        let fits = staging.size() >= application.size().saturating_add(RECORD_ROOM);
        let holds_a_header = application.size() > HEADER;
        if fits && holds_a_header { Some(Layout { application, staging }) } else { None }
    }

    /// Where the application runs: its header, then its vector table.
    #[must_use]
    pub const fn application(&self) -> Area {
        self.application
    }

    /// Where a download goes: the image, and in the last bytes the commit record.
    #[must_use]
    pub const fn staging(&self) -> Area {
        self.staging
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    #[test]
    fn sectors_of_different_sizes_follow_each_other() {
        let area = Area::new(0x1_0000, &[64 * 1024, 128 * 1024]);
        assert_eq!(area.sectors().collect::<Vec<_>>(), [0x1_0000..0x2_0000, 0x2_0000..0x4_0000]);
        assert_eq!((area.start(), area.size(), area.end()), (0x1_0000, 196_608, 0x4_0000));
    }

    #[test]
    fn staging_that_is_too_small_is_refused() {
        let application = Area::new(0, &[1024, 2048]);
        assert!(Layout::new(application, Area::new(3072, &[2048, 1024])).is_none());
        assert!(Layout::new(application, Area::new(3072, &[2048, 2048])).is_some());
        assert!(Layout::new(Area::new(0, &[512]), Area::new(512, &[2048])).is_none());
    }
}
