//! The seal: a word that comes out of the equation of the signature, and without which no application starts.
//!
//! A processor that a dip of its supply has made leave out one instruction may take any one branch the wrong way. So the branches are
//! not all: the verification leaves a word in which the CRC of the header and the result of the equation are mixed. The word is
//! kept until the start, and there it is mixed into the address at which the application begins. With a signature that is not
//! good, or where none was verified, that address is not the application's, whatever the branches said.

use core::hint::black_box;

/// The CRC of a header, when the signature of the image is good; with any other signature another word.
pub(crate) fn seal(crc: u32, found: &[u8; 32], expected: &[u8; 32]) -> u32 {
    // The compiler must not know what a comparison before has found.
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
