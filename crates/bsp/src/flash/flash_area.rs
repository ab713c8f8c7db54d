//! The part of the flash that one driver may reach.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlashErrorKind;

/// A range of addresses that may be read, erased and programmed. Offsets count from an origin, which is at or before
/// the first of these addresses.
#[derive(Clone, Debug)]
pub struct FlashArea {
    origin: u32,
    range: Range<u32>,
}

impl FlashArea {
    /// The area `range`; offsets count from `origin`.
    #[must_use]
    pub const fn new(origin: u32, range: Range<u32>) -> FlashArea {
        FlashArea { origin, range }
    }

    /// The address of `len` bytes at `offset`. Both must be multiples of `boundary`.
    ///
    /// # Errors
    /// `OutOfBounds` if the bytes reach beyond the area, `NotAligned`.
    pub fn address(&self, offset: u32, len: usize, boundary: u32) -> Result<u32, NorFlashErrorKind> {
        let out_of_bounds = NorFlashErrorKind::OutOfBounds;
        let len = u32::try_from(len).map_err(|_| out_of_bounds)?;
        let start = self.origin.checked_add(offset).filter(|start| *start >= self.range.start);
        let start = start.ok_or(out_of_bounds)?;
        start.checked_add(len).filter(|end| *end <= self.range.end).ok_or(out_of_bounds)?;
        if start.is_multiple_of(boundary) && len.is_multiple_of(boundary) {
            Ok(start)
        } else {
            Err(NorFlashErrorKind::NotAligned)
        }
    }

    /// Bytes from the origin to the end.
    #[must_use]
    pub const fn capacity(&self) -> usize {
        self.range.end.saturating_sub(self.origin) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: FlashArea = FlashArea::new(0x0800_0000, 0x0801_0000..0x0802_0000);
    const OUT: Result<u32, NorFlashErrorKind> = Err(NorFlashErrorKind::OutOfBounds);

    #[test]
    fn nothing_outside_of_the_area_has_an_address() {
        assert_eq!(AREA.address(0x1_0000, 0x1_0000, 1), Ok(0x0801_0000));
        assert_eq!(AREA.address(0x1_FFFF, 1, 1), Ok(0x0801_FFFF));
        assert_eq!(AREA.address(0xFFFF, 1, 1), OUT);
        assert_eq!(AREA.address(0x1_0000, 0x1_0001, 1), OUT);
        assert_eq!(AREA.address(0x2_0000, 1, 1), OUT);
        assert_eq!(AREA.address(u32::MAX, 1, 1), OUT);
        assert_eq!(AREA.address(0x1_0000, usize::MAX, 1), OUT);
        assert_eq!(AREA.capacity(), 0x2_0000);
    }

    #[test]
    fn both_ends_are_on_a_boundary() {
        assert_eq!(AREA.address(0x1_0004, 8, 4), Ok(0x0801_0004));
        assert_eq!(AREA.address(0x1_0002, 8, 4), Err(NorFlashErrorKind::NotAligned));
        assert_eq!(AREA.address(0x1_0004, 6, 4), Err(NorFlashErrorKind::NotAligned));
    }
}
