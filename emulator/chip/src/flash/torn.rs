//! The content of the flash after a power cut in the middle of an operation: neither old nor new. The same operation
//! always gives the same content, so that a test can be repeated.

use std::ops::Range;

use crate::peripherals::Effect;

/// Bytes between the erased and the unerased part of a sector; they have arbitrary values.
const BORDER: u32 = 256;

/// The content of a unit after a cut in its programming: only some of the bits to be cleared are cleared.
pub(super) fn programmed(old: &[u8], new: &[u8], salt: u64) -> Vec<u8> {
    let pairs = (0..).zip(old.iter().zip(new));
    pairs.map(|(index, (old, new))| old & (new | scatter(salt.wrapping_add(index)) as u8)).collect()
}

/// The content of a sector after a cut in its erase.
pub(super) fn erased(sector: Range<u32>, salt: u64) -> [Effect; 2] {
    let eighth = (sector.end - sector.start) / 8;
    let border = sector.start + eighth * (1 + scatter(salt) as u32 % 6);
    let bytes = (0..u64::from(BORDER)).map(|index| scatter(salt ^ index << 8) as u8).collect();
    [Effect::Fill { range: sector.start..border, byte: 0xFF }, Effect::Store { address: border, bytes }]
}

/// A well mixed function of its argument (the finaliser of MurmurHash3).
fn scatter(salt: u64) -> u64 {
    let x = (salt ^ salt >> 33).wrapping_add(1).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
    let x = (x ^ x >> 33).wrapping_mul(0xC4CE_B9FE_1A85_EC53);
    x ^ x >> 33
}
