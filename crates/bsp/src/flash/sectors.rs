//! The sectors of the flash (RM0390, table 5): four of 16 KiB, one of 64 KiB, the rest 128 KiB.

/// First address of the flash.
pub const FLASH: u32 = 0x0800_0000;
const KIB: u32 = 1024;
/// Sectors of a chip with 512 KiB; larger chips repeat the last size.
static SIZES: [u32; 8] = [16 * KIB, 16 * KIB, 16 * KIB, 16 * KIB, 64 * KIB, 128 * KIB, 128 * KIB, 128 * KIB];

/// A sector: the unit of an erase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sector {
    /// Number for SNB.
    pub number: u8,
    /// First address.
    pub start: u32,
    /// Size in bytes.
    pub size: u32,
}

/// All sectors, in order.
pub fn all() -> impl Iterator<Item = Sector> {
    (0..).zip(&SIZES).scan(FLASH, |next, (number, &size)| {
        let start = *next;
        *next += size;
        Some(Sector { number, start, size })
    })
}

/// The sector that begins at an address.
#[must_use]
pub fn starting_at(address: u32) -> Option<Sector> {
    all().find(|sector| sector.start == address)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sector_is_found_by_its_first_address_only() {
        assert_eq!(starting_at(0x0800_8000), Some(Sector { number: 2, start: 0x0800_8000, size: 16 * KIB }));
        assert_eq!(starting_at(0x0804_0000), Some(Sector { number: 6, start: 0x0804_0000, size: 128 * KIB }));
        assert_eq!(starting_at(0x0800_8004), None);
        assert_eq!(starting_at(0x0808_0000), None);
        assert_eq!(all().map(|sector| sector.size).sum::<u32>(), 512 * KIB);
    }
}
