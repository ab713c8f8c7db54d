//! The areas of an update in flash. Offsets count from the start of the flash, not of the address space.

use core::ops::Range;

use crate::header::HEADER;
use crate::record::RECORD_ROOM;
use crate::security::Security;

/// Bytes of the largest word of a flash.
const LARGEST_WORD: u32 = 8;

/// Consecutive sectors of any sizes.
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

    /// Size in bytes.
    #[must_use]
    pub const fn size(&self) -> u32 {
        let (mut size, mut rest) = (0_u32, self.sectors);
        while let [sector, others @ ..] = rest {
            size = size.saturating_add(*sector);
            rest = others;
        }
        size
    }

    /// Sizes of the sectors in bytes.
    pub(crate) const fn sizes(&self) -> &'static [u32] {
        self.sectors
    }

    /// Offset of the first byte after the area.
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

/// The areas of an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    security: Area,
    /// The offset of the first word, and that of the last one.
    wear: (u32, u32),
    application: Area,
    staging: Area,
    kept: Area,
}

impl Layout {
    /// A layout; `None` if there is no room for an image or for a security counter.
    #[must_use]
    pub const fn new(
        security: Area,
        wear: Area,
        application: Area,
        staging: Area,
        kept: Area,
    ) -> Option<Layout> {
        let wear = (wear.start(), wear.end().saturating_sub(LARGEST_WORD));
        let layout = Layout { security, wear, application, staging, kept };
        let fits = layout.longest_image() > HEADER && layout.highest_counter() > 0;
        if fits { Some(layout) } else { None }
    }

    /// The area of the security counter and the generation of keys: an update programs it, and nothing ever erases it.
    #[must_use]
    pub const fn security(&self) -> Area {
        self.security
    }

    /// The offsets of the first and of the last of the words that count erases, which nothing ever erases either.
    pub(crate) const fn wear(&self) -> (u32, u32) {
        self.wear
    }

    /// The area where the application runs: its header, then its vector table.
    #[must_use]
    pub const fn application(&self) -> Area {
        self.application
    }

    /// The area of a download: the image, and in the last bytes the commit record.
    #[must_use]
    pub const fn staging(&self) -> Area {
        self.staging
    }

    /// The area where the previous image is kept while the image in the application area is on trial, with a record
    /// like that of staging.
    #[must_use]
    pub const fn kept(&self) -> Area {
        self.kept
    }

    /// Length of the longest image, header and code, in bytes: it must fit the application area, and staging and the
    /// kept image next to their records.
    #[must_use]
    pub const fn longest_image(&self) -> u32 {
        let beside_record = least(self.staging.size(), self.kept.size()).saturating_sub(RECORD_ROOM);
        least(self.application.size(), beside_record)
    }

    /// The highest security counter that an image may have.
    #[must_use]
    pub const fn highest_counter(&self) -> u32 {
        Security(self.security).highest_counter()
    }
}

const fn least(one: u32, other: u32) -> u32 {
    if one < other { one } else { other }
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
    fn the_longest_image_fits_where_it_runs_and_where_it_is_staged() {
        let (security, application) = (Area::new(0, &[2048]), Area::new(2048, &[1024, 2048]));
        let (short, long) = (Area::new(5120, &[2048, 1024]), Area::new(5120, &[2048, 2048]));
        let longest = |staging, kept| {
            Layout::new(security, security, application, staging, kept).unwrap().longest_image()
        };
        assert_eq!(longest(long, long), 3072);
        assert_eq!(longest(short, long), 2560, "the commit record takes 512");
        assert_eq!(longest(long, short), 2560, "the record of the kept image does so");
    }

    #[test]
    fn areas_that_are_too_small_are_refused() {
        let (security, image) = (Area::new(0, &[2048]), Area::new(2048, &[2048]));
        assert!(Layout::new(security, security, image, image, image).is_some());
        assert!(Layout::new(Area::new(0, &[1024]), security, image, image, image).is_none());
        assert!(Layout::new(security, security, Area::new(2048, &[512]), image, image).is_none());
        assert!(Layout::new(security, security, image, Area::new(2048, &[1024]), image).is_none());
        assert!(Layout::new(security, security, image, image, Area::new(2048, &[1024])).is_none());
    }
}
