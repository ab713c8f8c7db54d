//! The least security counter and the revoked keys, which no image may undo. They have an area of their own, which is
//! programmed and never erased: a bit that is 0 stays 0, so the counter only rises and a key stays revoked.
//!
//! | mark | meaning if set |
//! |---|---|
//! | 0 to 7 | the key with this number is revoked |
//! | 7 + n | an image with the security counter n has run, so no image with a lower counter may run |
//!
//! A mark is set if either of its two words is 0; the second word is half the area behind the first. The counter is the
//! place of the highest mark, so a step of any size needs one mark only. A word that a power cut left half programmed
//! may read as 0 or not. Both results are acceptable, because the image that needs the mark is still there and sets it
//! again at the next start, and zeros may be programmed once more over such a word.

use crate::area::Area;
use crate::flash::Flash;
use crate::header::{Description, Header, MOST_KEYS};
use crate::record::{is_zero, mark};
use crate::refusal::Refusal;

/// Room for a mark in each half: a word of any size.
const ROOM: u32 = 8;

/// The area of the marks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Security(pub(crate) Area);

impl Security {
    /// The highest counter that has a mark.
    pub(crate) const fn highest_counter(self) -> u32 {
        (self.half() / ROOM).saturating_sub(MOST_KEYS)
    }

    /// Whether an image with this header may run: its counter is not too low, and its key is not revoked.
    pub(crate) fn admit<F: Flash>(self, flash: &mut F, about: &Description) -> Result<(), Refusal> {
        let least = self.least_counter(flash)?;
        if about.counter < least {
            Err(Refusal::Counter { least })
        } else if self.is_set(flash, about.key.into())? {
            Err(Refusal::Revoked { key: about.key })
        } else {
            Ok(())
        }
    }

    /// Records that the image with this header runs: older images are refused from now on, and so are the keys that it
    /// revokes.
    pub(crate) fn note<F: Flash>(self, flash: &mut F, header: &Header) -> Result<(), Refusal> {
        let about = header.description();
        for key in (0..MOST_KEYS).filter(|key| about.revokes.checked_shr(*key).unwrap_or(0) & 1 != 0) {
            self.set(flash, key)?;
        }
        if about.counter == 0 { Ok(()) } else { self.set(flash, mark_of(about.counter)) }
    }

    /// The revoked keys, bit n for key n. A key that cannot be read is not among them.
    pub(crate) fn revoked<F: Flash>(self, flash: &mut F) -> u8 {
        let is_revoked = |key: &u32| self.is_set(flash, *key).unwrap_or(false);
        (0..MOST_KEYS).filter(is_revoked).fold(0, |keys, key| keys | 1_u8.wrapping_shl(key))
    }

    pub(crate) fn least_counter<F: Flash>(self, flash: &mut F) -> Result<u32, Refusal> {
        let mut counter = self.highest_counter();
        while counter > 0 && !self.is_set(flash, mark_of(counter))? {
            counter = counter.saturating_sub(1);
        }
        Ok(counter)
    }

    const fn half(self) -> u32 {
        self.0.size() / 2
    }

    /// The places of the two words of a mark.
    fn places(self, mark: u32) -> [u32; 2] {
        let place = self.0.start().saturating_add(mark.saturating_mul(ROOM));
        [place, place.saturating_add(self.half())]
    }

    fn is_set<F: Flash>(self, flash: &mut F, mark: u32) -> Result<bool, Refusal> {
        let mut is_set = false;
        for place in self.places(mark) {
            is_set |= is_zero(flash, place)?;
        }
        Ok(is_set)
    }

    /// Sets both words, unless they are set already: one of them may have been cut.
    fn set<F: Flash>(self, flash: &mut F, number: u32) -> Result<(), Refusal> {
        for place in self.places(number) {
            if !is_zero(flash, place)? {
                mark(flash, place)?;
            }
        }
        Ok(())
    }
}

/// The mark of a counter above 0.
fn mark_of(counter: u32) -> u32 {
    counter.saturating_add(MOST_KEYS).saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::header::Version;
    use crate::mock::{MockFlash, Weak};

    const AREA: Security = Security(Area::new(0, &[512]));

    fn header(counter: u32, key: u8, revokes: u8) -> Header {
        let about = Description { board: 1, hardware: 1, version: Version::default(), counter, key, revokes };
        Header::describe(about, &[0; 4]).unwrap()
    }

    fn least(flash: &mut MockFlash) -> u32 {
        AREA.least_counter(flash).unwrap()
    }

    #[test]
    fn the_counter_is_that_of_the_highest_image_that_has_run() {
        for word in [4, 8] {
            let mut flash = MockFlash::with_words(&[512], word, 1);
            assert_eq!((least(&mut flash), AREA.highest_counter()), (0, 24));
            for (counter, then) in [(0, 0), (5, 5), (3, 5), (24, 24), (1, 24)] {
                AREA.note(&mut flash, &header(counter, 0, 0)).unwrap();
                assert_eq!(least(&mut flash), then);
            }
            assert_eq!(
                AREA.admit(&mut flash, header(23, 0, 0).description()),
                Err(Refusal::Counter { least: 24 })
            );
            assert_eq!(AREA.admit(&mut flash, header(24, 0, 0).description()), Ok(()));
        }
    }

    #[test]
    fn a_revoked_key_stays_revoked_and_the_others_are_good() {
        let mut flash = MockFlash::new(&[512], 1);
        AREA.note(&mut flash, &header(0, 1, 0b101)).unwrap();
        for key in 0..8 {
            let is_revoked = matches!(key, 0 | 2);
            let expected = if is_revoked { Err(Refusal::Revoked { key }) } else { Ok(()) };
            assert_eq!(AREA.admit(&mut flash, header(0, key, 0).description()), expected);
        }
        assert_eq!(least(&mut flash), 0);
    }

    /// Any single damaged bit in the area is harmless: the counter is lost only if both words of its mark are damaged.
    #[test]
    fn one_damaged_word_lowers_nothing() {
        let mut flash = MockFlash::new(&[512], 1);
        AREA.note(&mut flash, &header(9, 1, 1)).unwrap();
        let places = [AREA.places(0), AREA.places(16)].concat();
        for place in places {
            let mut damaged = flash.clone();
            damaged.disturb(place as usize, |byte| byte ^ 1);
            assert_eq!(least(&mut damaged), 9);
            assert!(AREA.is_set(&mut damaged, 0).unwrap());
        }
    }

    /// Power cuts at each operation, in each way, and again at each operation of the next start. The counter is never
    /// lower than before, and the start after that has the intended counter.
    #[test]
    fn after_a_cut_anywhere_nothing_is_undone() {
        let new = header(9, 1, 1);
        let mut cuts = 0;
        for (seed, weak) in (0..8).flat_map(|seed| Weak::ALL.map(|weak| (seed, weak))) {
            let mut before = MockFlash::new(&[512], seed);
            AREA.note(&mut before, &header(5, 1, 4)).unwrap();
            for (first, second) in (0..4).flat_map(|first| (0..4).map(move |second| (first, second))) {
                let mut flash = before.clone();
                for operation in [first, second] {
                    flash.cut_after(operation, weak);
                    let _ = AREA.note(&mut flash, &new);
                    cuts += u32::from(flash.is_down());
                    flash.power_up();
                    assert!([5, 9].contains(&least(&mut flash)));
                    assert!(AREA.is_set(&mut flash, 2).unwrap(), "revoked before");
                }
                AREA.note(&mut flash, &new).unwrap();
                for _ in 0..4 {
                    assert_eq!(least(&mut flash), 9);
                    assert!(AREA.is_set(&mut flash, 0).unwrap());
                }
            }
        }
        std::println!("{cuts} cuts while the counter rises and a key is revoked");
        assert!(cuts > 8 * 4 * 16);
    }
}
