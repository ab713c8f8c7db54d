//! What a start must have besides a decision: a word that comes out of the equation of the signature.
//!
//! A processor that a dip of its supply has made leave out one instruction may take any one branch the wrong way. So the branches are
//! not all: the verification leaves a word in which the CRC of the header and the result of the equation are mixed. The word is
//! kept until the start, and there it is mixed into the address at which the application begins. With a signature that is not
//! good, or where none was verified, that address is not the application's, whatever the branches said.

use core::hint::black_box;

/// 0 where the two sides of the equation are the same, any other word where they are not.
pub(crate) fn difference(found: &[u8; 32], expected: &[u8; 32]) -> u32 {
    let bits = found.iter().zip(expected).fold(0, |bits, (a, b)| bits | a ^ b);
    // In every byte of the word: an address that is wrong by this is not near the right one.
    u32::from(bits) * 0x0101_0101
}

/// The CRC of a header, where there is no difference; another word with any other.
pub(crate) fn seal(crc: u32, difference: u32) -> u32 {
    // The compiler must not know what a branch before has found.
    crc ^ black_box(difference)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_good_signature_leaves_the_crc() {
        let good = [0x5A; 32];
        assert_eq!(seal(0x1234_5678, difference(&good, &good)), 0x1234_5678);
        for bit in 0..256 {
            let mut other = good;
            other[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(seal(0x1234_5678, difference(&other, &good)), 0x1234_5678, "bit {bit}");
        }
    }
}
