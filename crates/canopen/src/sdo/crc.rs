//! The CRC of block transfers: CRC-16/XMODEM (CiA 301, 7.2.4.3.16).
//!
//! Computed without a table, four bytes at a time, with half the instructions of a table of 512 bytes. The result is
//! the remainder of w·x^16 divided by P = x^16 + x^12 + x^5 + 1. The quotient q is the solution of q = w + q/x^4 +
//! q/x^11 + q/x^16, where division by a power of x is a shift that loses bits: q = (1 + S)^-1 w with S = x^-4 + x^-11 +
//! x^-16. S^8 leaves nothing of a word of 32 bits, so (1 + S)^-1 = (1 + S)(1 + S^2)(1 + S^4), and squares of
//! polynomials over GF(2) have no mixed terms. The remainder is the low part of q·(x^12 + x^5 + 1).

/// Extends a CRC by some bytes. `crc` is the CRC of all bytes before; 0 before the first byte.
pub(crate) fn extend(crc: u16, bytes: &[u8]) -> u16 {
    let (words, rest) = bytes.as_chunks();
    let crc = words.iter().fold(crc, |crc, word| remainder(u32::from_be_bytes(*word) ^ u32::from(crc) << 16));
    rest.iter().fold(crc, |crc, &byte| remainder(u32::from(byte) ^ u32::from(crc >> 8)) ^ crc << 8)
}

/// The remainder of `word`·x^16 divided by P.
#[allow(clippy::cast_possible_truncation)] // The remainder is the low part.
fn remainder(word: u32) -> u16 {
    let once = word ^ word >> 4 ^ word >> 11 ^ word >> 16;
    let twice = once ^ once >> 8 ^ once >> 22;
    let quotient = twice ^ twice >> 16;
    (quotient ^ quotient << 5 ^ quotient << 12) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn check_value_in_one_piece_and_in_two() {
        assert_eq!(extend(0, b"123456789"), 0x31C3);
        assert_eq!(extend(extend(0, b"1234"), b"56789"), 0x31C3);
    }

    #[test]
    fn every_bit_of_a_word_counts_as_the_polynomial_says() {
        let reference = crc::Crc::<u16>::new(&crc::CRC_16_XMODEM);
        for start in 0..4 {
            for bit in 0..64_u32 {
                let bytes = (1_u64 << bit).to_be_bytes();
                assert_eq!(extend(0, &bytes[start..]), reference.checksum(&bytes[start..]));
            }
        }
    }
}
