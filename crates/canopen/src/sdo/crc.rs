//! The CRC of block transfers: CRC-16/XMODEM (CiA 301, 7.2.4.3.16). Bit by bit: seven bytes a frame are few, and the table
//! would be half a kilobyte of the bootloader.

use crc::{CRC_16_XMODEM, Crc, NoTable};

const ALGORITHM: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_XMODEM);

/// The CRC of some data, given that of what came before it; 0 before the first.
pub(super) fn extend(crc: u16, bytes: &[u8]) -> u16 {
    let mut digest = ALGORITHM.digest_with_initial(crc);
    digest.update(bytes);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn check_value_in_one_piece_and_in_two() {
        assert_eq!(extend(0, b"123456789"), 0x31C3);
        assert_eq!(extend(extend(0, b"1234"), b"56789"), 0x31C3);
    }
}
