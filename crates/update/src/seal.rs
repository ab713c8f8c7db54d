//! The seal: a word that results from the equation of the signature, and without which no application starts.
//!
//! A dip of the supply voltage can make a processor skip one instruction, so any single branch may go the wrong way.
//! The decision therefore does not depend on branches alone: the verification leaves a word that combines the CRC of
//! the header with the result of the equation. The word is kept until the start, where it is combined with the start
//! address of the application. With an invalid signature, or without a verification, the resulting address is not that
//! of the application, whatever the branches have decided.

use core::hint::black_box;

/// The CRC of a header, if the signature of the image is valid; another word with any other signature.
pub(crate) fn seal(crc: u32, found: &[u8; 32], expected: &[u8; 32]) -> u32 {
    // Keeps the compiler from using the result of an earlier comparison.
    let (found, expected) = (black_box(found).as_chunks().0, black_box(expected).as_chunks().0);
    let differences = found.iter().zip(expected);
    differences.fold(crc, |seal, (a, b)| seal.wrapping_add(u32::from_le_bytes(*a) ^ u32::from_le_bytes(*b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_good_signature_leaves_the_crc() {
        let good = [0x5A; 32];
        assert_eq!(seal(0x1234_5678, &good, &good), 0x1234_5678);
        for bit in 0..256 {
            let mut other = good;
            other[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(seal(0x1234_5678, &other, &good), 0x1234_5678, "bit {bit}");
        }
    }
}
