//! The number of erases, in words of their own that are programmed and never erased: each erase of another area sets the
//! next word to 0, behind a first word that counts nothing. No power cut takes more than the newest word back, and a word
//! that is set before an erase that the power cut prevents counts all the same.

use crate::area::Layout;
use crate::flash::{Flash, first, program};
use crate::record::is_zero;

/// Number of erases of the application area, staging and the area of the kept image together. It stays when no word is
/// left.
pub(crate) fn erases<F: Flash>(flash: &mut F, layout: &Layout) -> u32 {
    let (start, _) = layout.wear();
    let words = next(flash, layout).saturating_sub(start).checked_div(flash.word_size()).unwrap_or(0);
    words.saturating_sub(1)
}

/// Counts an erase.
pub(crate) fn count<F: Flash>(flash: &mut F, layout: &Layout) {
    let (next, word) = (next(flash, layout), flash.word_size());
    // The word before, too: a cut may have left it half programmed. Without the mark the number is too small by one, which
    // is no reason to refuse an update.
    let _ = program(flash, next.wrapping_sub(word), first(&mut [0; 16], word.wrapping_mul(2)));
}

/// The offset of the first word that is not set; that of the last word if all are.
#[inline(never)] // Little room in flash.
fn next<F: Flash>(flash: &mut F, layout: &Layout) -> u32 {
    let (mut at, last) = layout.wear();
    loop {
        at = at.wrapping_add(flash.word_size());
        if at >= last || !is_zero(flash, at, 0) {
            return at;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::Area;
    use crate::mock::{MockFlash, Weak};

    fn layout() -> Layout {
        let (security, image) = (Area::new(0, &[1536]), Area::new(1536, &[2048]));
        Layout::new(security, Area::new(3584, &[64]), image, image, image).unwrap()
    }

    #[test]
    fn erases_are_counted_until_no_word_is_left() {
        for word in [4, 8] {
            // The first word and the last one count nothing.
            let marks = 56 / u32::try_from(word).unwrap() - 1;
            let mut flash = MockFlash::with_words(&[1536, 2048, 64], word, 1);
            for number in 0..marks + 3 {
                assert_eq!(erases(&mut flash, &layout()), number.min(marks));
                count(&mut flash, &layout());
            }
        }
    }

    #[test]
    fn a_power_cut_takes_no_more_than_the_newest_erase_back() {
        for (seed, weak) in (0..20).flat_map(|seed| Weak::ALL.map(|weak| (seed, weak))) {
            let mut flash = MockFlash::new(&[1536, 2048, 64], seed);
            for least in 0..5 {
                flash.cut_after(0, weak);
                count(&mut flash, &layout());
                flash.power_up();
                assert!(erases(&mut flash, &layout()) >= least);
                count(&mut flash, &layout());
                assert!((0..4).all(|_| erases(&mut flash, &layout()) > least));
            }
        }
    }
}
