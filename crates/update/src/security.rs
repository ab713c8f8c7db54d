//! The least security counter and the least generation of keys, which no image may undo. They have an area of their own, which is
//! programmed and never erased: a bit that is 0 stays 0, so both only rise.
//!
//! | mark | meaning if set |
//! |---|---|
//! | n, below 64 | an image with keys of the generation n has run, so no image with keys of a lower generation may run |
//! | 63 + n | an image with the security counter n has run, so no image with a lower counter may run |
//!
//! A mark is set if either of its two words is 0; the second word is half the area behind the first. The place of the
//! highest mark counts, so a step of any size needs one mark only. A word that a power cut left half programmed
//! may read as 0 or not. Both results are acceptable, because the image that needs the mark is still there and sets it
//! again at the next start, and zeros may be programmed once more over such a word.

use crate::area::Area;
use crate::flash::Flash;
use crate::header::Header;
use crate::key::GENERATIONS;
use crate::record::{is_zero, mark};
use crate::refusal::Refusal;

/// Room for a mark in each half: a word of any size.
const ROOM: u32 = 8;
/// The mark of the counter n is behind this mark by n; no mark is that of the generation 0.
const COUNTERS: u32 = GENERATIONS - 1;

/// The area of the marks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Security(pub(crate) Area);

impl Security {
    /// The highest counter that has a mark.
    pub(crate) const fn highest_counter(self) -> u32 {
        (self.half() / ROOM).saturating_sub(GENERATIONS)
    }

    /// Whether an image with this header may run: its counter is not too low, and its keys are not revoked.
    pub(crate) fn admit<F: Flash>(self, flash: &mut F, header: &Header) -> Result<(), Refusal> {
        let least = self.least_counter(flash);
        let generation = self.least_generation(flash);
        if header.counter() < least {
            Err(Refusal::Counter { least })
        } else if header.generation() < generation {
            Err(Refusal::Revoked { generation })
        } else {
            Ok(())
        }
    }

    /// Records that the image with this header runs: images that are older, or signed with an earlier key, are refused from
    /// now on.
    pub(crate) fn note<F: Flash>(self, flash: &mut F, header: &Header) -> Result<(), Refusal> {
        self.set(flash, 0, header.generation())?;
        self.set(flash, COUNTERS, header.counter())
    }

    /// The lowest generation of keys that an image may have.
    pub(crate) fn least_generation<F: Flash>(self, flash: &mut F) -> u32 {
        self.highest(flash, 0, COUNTERS)
    }

    /// The lowest security counter that an image may have.
    pub(crate) fn least_counter<F: Flash>(self, flash: &mut F) -> u32 {
        self.highest(flash, COUNTERS, self.highest_counter())
    }

    /// The highest number up to `number` that has a mark; 0 if none has.
    #[inline(never)] // Little room in flash.
    fn highest<F: Flash>(self, flash: &mut F, base: u32, mut number: u32) -> u32 {
        while number > 0 && !self.is_set(flash, base.wrapping_add(number)) {
            number = number.wrapping_sub(1);
        }
        number
    }

    const fn half(self) -> u32 {
        self.0.size() / 2
    }

    /// The place of the first word of a mark.
    fn place(self, mark: u32) -> u32 {
        self.0.start().wrapping_add(mark.wrapping_mul(ROOM))
    }

    /// Whether the mark is set. A flash that cannot be read has all marks, so no image is admitted.
    fn is_set<F: Flash>(self, flash: &mut F, mark: u32) -> bool {
        let place = self.place(mark);
        is_zero(flash, place, 0) || is_zero(flash, place.wrapping_add(self.half()), 0)
    }

    /// Sets the mark of a number above 0.
    #[inline(never)] // Little room in flash.
    fn set<F: Flash>(self, flash: &mut F, base: u32, number: u32) -> Result<(), Refusal> {
        if number == 0 {
            return Ok(());
        }
        let place = self.place(base.wrapping_add(number));
        set_word(flash, place)?;
        set_word(flash, place.wrapping_add(self.half()))
    }
}

/// Programs a word of a mark, unless it is set already: the other one may have been cut.
#[inline(never)] // Little room in flash.
fn set_word<F: Flash>(flash: &mut F, place: u32) -> Result<(), Refusal> {
    if is_zero(flash, place, u8::MAX) { Ok(()) } else { mark(flash, place) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certificate::{Certificate, KeyList};
    use crate::header::Description;
    use crate::mock::{MockFlash, Weak};

    const SIZE: usize = 1536;
    const AREA: Security = Security(Area::new(0, &[1536]));

    fn header(counter: u32, generation: u32) -> Header {
        let certificate = Certificate { generation, counter: 0, key: [1; 32], signature: [2; 64] };
        let release = (generation != 0).then_some(certificate);
        let keys = KeyList { release, root: None };
        Header::describe(Description { counter, keys, ..Description::default() }, &[0; 4]).unwrap()
    }

    fn least(flash: &mut MockFlash) -> u32 {
        AREA.least_counter(flash)
    }

    #[test]
    fn the_counter_is_that_of_the_highest_image_that_has_run() {
        for word in [4, 8] {
            let mut flash = MockFlash::with_words(&[SIZE], word, 1);
            assert_eq!((least(&mut flash), AREA.highest_counter()), (0, 32));
            for (counter, then) in [(0, 0), (5, 5), (3, 5), (32, 32), (1, 32)] {
                AREA.note(&mut flash, &header(counter, 0)).unwrap();
                assert_eq!(least(&mut flash), then);
            }
            assert_eq!(AREA.admit(&mut flash, &header(31, 0)), Err(Refusal::Counter { least: 32 }));
            assert_eq!(AREA.admit(&mut flash, &header(32, 0)), Ok(()));
        }
    }

    #[test]
    fn keys_of_a_lower_generation_are_revoked_and_the_others_are_not() {
        let mut flash = MockFlash::new(&[SIZE], 1);
        for (generation, least) in [(3, 3), (1, 3), (15, 15)] {
            AREA.note(&mut flash, &header(0, generation)).unwrap();
            for generation in 0..16 {
                let is_revoked = generation < least;
                let expected = if is_revoked { Err(Refusal::Revoked { generation: least }) } else { Ok(()) };
                assert_eq!(AREA.admit(&mut flash, &header(0, generation)), expected);
            }
        }
        assert_eq!(least(&mut flash), 0);
    }

    /// Any single damaged bit in the area is harmless: the counter is lost only if both words of its mark are damaged.
    #[test]
    fn one_damaged_word_lowers_nothing() {
        let mut flash = MockFlash::new(&[SIZE], 1);
        AREA.note(&mut flash, &header(9, 1)).unwrap();
        let places = [1, 63 + 9].map(|mark| AREA.place(mark)).into_iter().flat_map(|at| [at, at + 768]);
        for place in places {
            let mut damaged = flash.clone();
            damaged.disturb(place as usize, |byte| byte ^ 1);
            assert_eq!(least(&mut damaged), 9);
            assert_eq!(AREA.least_generation(&mut damaged), 1);
        }
    }

    /// Power cuts at each operation, in each way, and again at each operation of the next start. The counter is never
    /// lower than before, and the start after that has the intended counter.
    #[test]
    fn after_a_cut_anywhere_nothing_is_undone() {
        let new = header(9, 4);
        let mut cuts = 0;
        for (seed, weak) in (0..8).flat_map(|seed| Weak::ALL.map(|weak| (seed, weak))) {
            let mut before = MockFlash::new(&[SIZE], seed);
            AREA.note(&mut before, &header(5, 2)).unwrap();
            for (first, second) in (0..4).flat_map(|first| (0..4).map(move |second| (first, second))) {
                let mut flash = before.clone();
                for operation in [first, second] {
                    flash.cut_after(operation, weak);
                    let _ = AREA.note(&mut flash, &new);
                    cuts += u32::from(flash.is_down());
                    flash.power_up();
                    assert!([5, 9].contains(&least(&mut flash)));
                    assert!([2, 4].contains(&AREA.least_generation(&mut flash)));
                }
                AREA.note(&mut flash, &new).unwrap();
                for _ in 0..4 {
                    assert_eq!(least(&mut flash), 9);
                    assert_eq!(AREA.least_generation(&mut flash), 4);
                }
            }
        }
        std::println!("{cuts} cuts while the counter and the generation rise");
        assert!(cuts > 8 * 4 * 16);
    }
}
