//! Extends a 32-bit counter that wraps to 64 bits, without a lock.
//!
//! The software part counts half periods of the counter. Its lowest bit says in which half the counter was last seen. A
//! reader between a wrap of the counter and the next [`Extension::follow`] sees that the two disagree, and corrects the
//! result. A reader therefore gets the right count at every priority, also above the priority of the caller of
//! `follow`.

use core::sync::atomic::{AtomicU32, Ordering};

/// The software part.
#[derive(Debug, Default)]
pub struct Extension {
    halves: AtomicU32,
}

impl Extension {
    /// An extension of a counter that starts in its lower half.
    #[must_use]
    pub const fn new() -> Extension {
        Extension { halves: AtomicU32::new(0) }
    }

    /// Takes note of the counter. To be called by one task only, and at least once in each half period.
    pub fn follow(&self, counter: u32) {
        let halves = self.halves.load(Ordering::Relaxed);
        if halves & 1 != counter >> 31 {
            self.halves.store(halves.wrapping_add(1), Ordering::Relaxed);
        }
    }

    /// The extended count. The software part is read first, so it may be one half period behind but never ahead.
    pub fn read(&self, counter: impl FnOnce() -> u32) -> u64 {
        let halves = self.halves.load(Ordering::Acquire);
        let within = counter() ^ (halves & 1) << 31;
        (u64::from(halves) << 31) + u64::from(within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[expect(clippy::cast_possible_truncation)]
    fn hardware(count: u64) -> u32 {
        count as u32
    }

    #[test]
    fn it_is_right_before_and_after_each_notice() {
        let extension = Extension::new();
        for half in 0..9_u64 {
            for count in [half << 31, (half << 31) + 1, (half << 31) + 0x7FFF_FFFF] {
                assert_eq!(extension.read(|| hardware(count)), count, "not yet noticed");
                extension.follow(hardware(count));
                assert_eq!(extension.read(|| hardware(count)), count, "noticed");
            }
        }
    }

    #[test]
    fn it_is_right_when_the_notice_is_taken_in_the_middle_of_a_read() {
        let extension = Extension::new();
        extension.follow(0x8000_0000);
        let wrapped = (1 << 32) + 5;
        let read = extension.read(|| {
            extension.follow(hardware(wrapped));
            hardware(wrapped)
        });
        assert_eq!(read, wrapped);
    }

    #[test]
    fn repeated_notices_in_one_half_count_once() {
        let extension = Extension::new();
        (0..10).for_each(|_| extension.follow(0x8000_0000));
        assert_eq!(extension.read(|| 0x8000_0000), 0x8000_0000);
    }
}
