//! The IT state: which condition the next instructions of an IT block depend on (ARMv7-M, A7.3).
//!
//! The state is a byte. The upper half is the condition of the next instruction; each bit of the lower half is the last bit of the condition of
//! one more instruction, and the lowest bit that is set ends the block. An IT instruction holds the byte that the first of its block
//! begins with.

/// Where xPSR has the byte.
pub(crate) const STATE: u32 = 0x0600_FC00;

/// The bits of xPSR for this byte.
pub(crate) fn state(it: u8) -> u32 {
    let it = u32::from(it);
    (it & 3) << 25 | (it >> 2) << 10
}

/// The byte after one instruction of the block.
pub(crate) fn advanced(it: u8) -> u8 {
    if it & 7 == 0 { 0 } else { it & 0xE0 | it << 1 & 0x1F }
}

/// The byte of the block's first instructions, as if there were no more than `count` of them.
pub(crate) fn shortened(it: u8, count: usize) -> u8 {
    let end = 1 << 4_usize.saturating_sub(count);
    it & !(2 * end - 1) | end
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `ite eq`, and `itete ne` with four instructions.
    #[test]
    fn each_instruction_takes_one_bit() {
        assert_eq!([0x0C, advanced(0x0C), advanced(advanced(0x0C))], [0x0C, 0x18, 0]);
        let states = std::iter::successors(Some(0x1B), |it| Some(advanced(*it)));
        assert_eq!(states.take(5).collect::<Vec<u8>>(), [0x1B, 0x16, 0x0C, 0x18, 0]);
    }

    #[test]
    fn a_shorter_block_has_the_same_conditions() {
        for (it, count, shorter) in [(0x0C, 1, 0x08), (0x1B, 1, 0x18), (0x1B, 2, 0x1C), (0x1B, 3, 0x1A)] {
            assert_eq!(shortened(it, count), shorter, "{count} of {it:#x}");
        }
    }

    #[test]
    fn the_bits_of_the_register_are_those_of_the_byte() {
        assert_eq!(state(0xFF), STATE);
        assert_eq!((state(0x0C), state(0x01), state(0x80)), (0x0C00, 1 << 25, 1 << 15));
    }
}
