//! The serial number of 1018h sub-index 4, from the unique identifier of the chip.

/// The CRC-32 of the unique identifier of 96 bits (RM0390, 34.1).
///
/// In a thousand boards, two have the same number with a probability of about 1 in 10,000. Where that is too much, the
/// production line must store its own numbers.
#[must_use]
pub fn serial_number(unique_id: &[u8; 12]) -> u32 {
    storage::checksum::of(unique_id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chips_that_differ_in_any_bit_have_different_numbers() {
        let id = *b"\x12\x00\x34\x00\x0B51Q123 ";
        for bit in 0..96 {
            let mut other = id;
            other[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(serial_number(&id), serial_number(&other));
        }
    }
}
