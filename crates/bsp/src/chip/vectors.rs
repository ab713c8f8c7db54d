//! Check whether the first words of an image can be a vector table, before the bootloader jumps to the image.

use core::ops::Range;

/// The content of a word of the stack that a development image has never used: it fills its stack at its start.
pub const UNUSED_STACK: u32 = 0xA5C3_965A;

/// Initial stack pointer and entry of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vectors {
    stack: u32,
    reset: u32,
}

impl Vectors {
    /// The first two words of a vector table; `None` unless the stack lies in `ram`, and the entry, with the Thumb bit
    /// set, lies in `image`. Erased flash fails both conditions.
    #[must_use]
    pub fn check(words: [u32; 2], ram: &Range<u32>, image: &Range<u32>) -> Option<Vectors> {
        let [stack, reset] = words;
        let stack_fits = stack.is_multiple_of(8) && stack > ram.start && stack <= ram.end;
        let reset_fits = reset & 1 == 1 && image.contains(&(reset & !1));
        (stack_fits && reset_fits).then_some(Vectors { stack, reset })
    }

    /// Initial value of the stack pointer.
    #[must_use]
    pub fn stack(self) -> u32 {
        self.stack
    }

    /// Entry, with the Thumb bit.
    #[must_use]
    pub fn reset(self) -> u32 {
        self.reset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAM: Range<u32> = 0x2000_0000..0x2002_0000;
    const IMAGE: Range<u32> = 0x0802_0200..0x0804_0000;

    fn plausible(stack: u32, reset: u32) -> bool {
        Vectors::check([stack, reset], &RAM, &IMAGE).is_some()
    }

    #[test]
    fn a_stack_may_begin_at_the_end_of_ram() {
        assert!(plausible(0x2002_0000, 0x0802_0401));
        assert!(plausible(0x2000_4000, 0x0803_FFFF));
    }

    #[test]
    fn erased_or_foreign_content_is_refused() {
        assert!(!plausible(0xFFFF_FFFF, 0xFFFF_FFFF));
        assert!(!plausible(0, 0));
        assert!(!plausible(0x2000_0000, 0x0802_0401), "no stack at all");
        assert!(!plausible(0x2002_0008, 0x0802_0401), "beyond RAM");
        assert!(!plausible(0x2000_4004, 0x0802_0401), "not aligned");
        assert!(!plausible(0x2000_4000, 0x0802_0400), "not Thumb");
        assert!(!plausible(0x2000_4000, 0x0800_0401), "in the bootloader");
        assert!(!plausible(0x2000_4000, 0x0804_0001), "behind the image");
    }
}
