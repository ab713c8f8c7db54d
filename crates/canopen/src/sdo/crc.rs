//! The CRC of block transfers: CRC-16/XMODEM (CiA 301, 7.2.4.3.16).
//!
//! Without a table, and four bytes at a time: half the instructions that a table of 512 bytes takes. What is wanted is
//! the remainder of w·x^16 divided by P = x^16 + x^12 + x^5 + 1. The quotient q is the solution of
//! q = w + q/x^4 + q/x^11 + q/x^16, where division by a power of x is a shift that loses bits: q = (1 + S)^-1 w with
//! S = x^-4 + x^-11 + x^-16. S^8 leaves nothing of a word of 32 bits, so (1 + S)^-1 = (1 + S)(1 + S^2)(1 + S^4), and
//! squares of polynomials over GF(2) have no mixed terms. The remainder is the low part of q·(x^12 + x^5 + 1). Each sum of
//! shifted values is written so that every term is one instruction of the processor, a shift and an exclusive or.

/// The CRC of some data, given that of what came before it; 0 before the first.
pub(crate) fn extend(crc: u16, bytes: &[u8]) -> u16 {
    let (pairs, rest) = bytes.as_chunks::<8>();
    let crc = pairs.iter().fold(crc, |crc, &[a, b, c, d, e, f, g, h]| with_word(with_word(crc, [a, b, c, d]), [e, f, g, h]));
    rest.iter().fold(crc, |crc, &byte| remainder(u32::from(byte) ^ u32::from(crc >> 8)) ^ crc << 8)
}

fn with_word(crc: u16, word: [u8; 4]) -> u16 {
    remainder(u32::from_be_bytes(word) ^ u32::from(crc) << 16)
}

/// The remainder of the word times x^16.
#[allow(clippy::cast_possible_truncation)] // The low part is what is wanted.
fn remainder(word: u32) -> u16 {
    let once = word ^ (word ^ (word ^ word >> 5) >> 7) >> 4;
    let twice = once ^ (once ^ once >> 14) >> 8;
    let quotient = twice ^ twice >> 16;
    (quotient ^ (quotient ^ quotient << 7) << 5) as u16
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
