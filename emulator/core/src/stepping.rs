//! The mode in which an interrupt can come between any two instructions, and time advances with each instruction.
//!
//! The usual mode counts the cycles of a whole block of code before the block runs, and checks for interrupts between
//! blocks. That mode is several times faster, and exact except for races. This mode counts and checks every
//! instruction. With a seed, some instructions take longer, as waits on a bus do on silicon, so that each seed
//! interrupts the program at other places.
//!
//! An IT block counts as one instruction, because the CPU library does not stop inside an IT block.

use std::ops::Range;

use crate::exception::Exception;

/// Longest extra wait of an instruction in cycles; one instruction in eight has a wait.
const LONGEST_WAIT: u64 = 7;

/// The state of the mode.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stepping {
    /// Zero only when no instruction waits.
    random: u64,
    /// The instructions of the IT block whose cycles have been counted.
    conditional: Range<u32>,
    /// The exception to pend, and the address of the instruction before which it is pended.
    place: Option<(u32, Exception)>,
    /// The addresses of barriers that a test has taken out.
    omitted: Vec<u32>,
}

impl Stepping {
    /// With a seed, some instructions have waits; with `None`, no instruction has.
    pub(crate) fn new(seed: Option<u64>) -> Stepping {
        let random = seed.map_or(0, |seed| seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        Stepping { random, ..Stepping::default() }
    }

    /// Pends an exception before the next execution of this instruction.
    pub(crate) fn interrupt_before(&mut self, address: u32, exception: Exception) {
        self.place = Some((address, exception));
    }

    /// The exception to pend before this instruction.
    pub(crate) fn arrived(&mut self, address: u32) -> Option<Exception> {
        self.place.take_if(|(place, _)| *place == address).map(|(_, exception)| exception)
    }

    /// Whether the cycles of the instruction were counted with its IT block.
    pub(crate) fn is_charged(&self, address: u32) -> bool {
        self.conditional.contains(&address)
    }

    /// Records that an IT instruction and its block were counted together.
    pub(crate) fn charged(&mut self, first: u32, size: u32, block: u32) {
        self.conditional = first + size..first + block;
    }

    /// Takes the barrier at an address out.
    pub(crate) fn omit(&mut self, address: u32) {
        self.omitted.push(address);
    }

    /// Whether the barrier at an address was taken out.
    pub(crate) fn omits(&self, address: u32) -> bool {
        self.omitted.contains(&address)
    }

    /// Extra cycles of the next instruction.
    pub(crate) fn wait(&mut self) -> u32 {
        self.draw();
        if self.random % 8 == 1 { (self.random >> 8 & LONGEST_WAIT) as u32 } else { 0 }
    }

    /// One of two numbers of cycles; without a seed the second.
    pub(crate) fn either(&mut self, one: u32, other: u32) -> u32 {
        self.draw();
        if self.random >> 20 & 1 != 0 { one } else { other }
    }

    /// The next random number (xorshift64).
    fn draw(&mut self) {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
    }
}

/// Bytes of the longest IT block: the IT instruction and four wide ones.
pub(crate) const LONGEST_BLOCK: usize = 18;

/// Length in bytes of the instruction at the start of `code`; for an IT instruction, with its block (ARMv7-M, A7.7.37).
pub(crate) fn length(code: &[u8]) -> u32 {
    // Most are no IT instruction, and this is asked of every instruction that runs.
    if let [low, high, ..] = code
        && !is_it(u16::from_le_bytes([*low, *high]))
    {
        return width(u16::from_le_bytes([*low, *high]));
    }
    instructions(code).last().map_or(0, |(at, size)| at + size)
}

/// The instruction at the start of `code`, and those of its block if it is an IT instruction: offset and length of
/// each.
pub(crate) fn instructions(code: &[u8]) -> Vec<(u32, u32)> {
    let half = |at: u32| {
        let bytes = code.get(at as usize..at as usize + 2);
        bytes.map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]))
    };
    let first = half(0).unwrap_or(0);
    let conditional = if is_it(first) { 4 - (first & 0xF).trailing_zeros() } else { 0 };
    let mut all = vec![(0, width(first))];
    for _ in 0..conditional {
        let at = all.last().map_or(0, |(at, size)| at + size);
        let Some(next) = half(at) else { break };
        all.push((at, width(next)));
    }
    all
}

fn is_it(first: u16) -> bool {
    first >> 8 == 0xBF && first & 0xF != 0
}

/// Length in bytes of an instruction that begins with this halfword.
pub(crate) fn width(first: u16) -> u32 {
    if first >> 11 >= 0b11101 { 4 } else { 2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(halves: &[u16]) -> Vec<u8> {
        halves.iter().flat_map(|half| half.to_le_bytes()).collect()
    }

    #[test]
    fn an_it_block_is_as_long_as_its_mask_says() {
        for (halves, size, name) in [
            (&[0xBF00, 0x2000][..], 2, "nop"),
            (&[0xBF08, 0x2000, 0x2001], 4, "it eq"),
            (&[0xBF0C, 0x2000, 0x2001, 0x2002], 6, "ite eq"),
            (&[0xBF01, 0x2000, 0x2001, 0x2002, 0x2003, 0x2004], 10, "itttt eq"),
            (&[0xBF0C, 0xF04F, 0x0001, 0x2001, 0x2002], 8, "ite eq, the first of its two wide"),
            (&[0xF04F, 0x0001], 4, "mov.w"),
        ] {
            assert_eq!(length(&bytes(halves)), size, "{name}");
        }
    }

    #[test]
    fn a_seed_decides_and_none_waits_never() {
        let waits = |seed| {
            let mut stepping = Stepping::new(seed);
            (0..1000).map(|_| stepping.wait()).collect::<Vec<u32>>()
        };
        assert_eq!(waits(Some(0)), waits(Some(0)));
        assert_ne!(waits(Some(0)), waits(Some(1)));
        let of_one = waits(Some(1));
        assert!(of_one.contains(&7) && of_one.iter().all(|&wait| wait <= 7));
        assert!(waits(None).iter().all(|&wait| wait == 0));
    }
}
