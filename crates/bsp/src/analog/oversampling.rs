//! The sums of the conversions of a millisecond, channel by channel.

use core::sync::atomic::{AtomicU32, Ordering};

/// Channels of one scan: pressure, its supply, thermistor, temperature sensor, VREFINT.
pub const CHANNELS: usize = 5;
/// Scans in a millisecond.
pub const SCANS: usize = 16;
/// Number of words with the conversions of a millisecond, two in each word, the first in the lower half.
pub const WORDS: usize = SCANS * CHANNELS / 2;

/// Largest result of a conversion.
const FULL_SCALE: usize = 4095;
/// The sum of a millisecond at the upper rail.
#[allow(clippy::cast_possible_truncation, reason = "a product of two small constants")]
const RAIL: u32 = (FULL_SCALE * SCANS) as u32;
const _: () = {
    assert!(FULL_SCALE * SCANS / 2 < 1 << 16, "the sum of a lower half must not reach into the upper one");
    assert!(
        SCANS.is_multiple_of(4),
        "a channel has its conversions in both halves, and four scans are added at once"
    );
};

/// The sum of each channel. Two scans are a whole number of words, and both halves of a word are added at once. The ten
/// words of four scans are written out, because the firmware is compiled for size and inner loops would take three
/// times as long.
#[allow(clippy::many_single_char_names)] // The ten words of four scans.
pub fn sums(words: &[AtomicU32; WORDS]) -> [u32; CHANNELS] {
    let load = |word: &AtomicU32| word.load(Ordering::Relaxed);
    let [a, b, c, d, e] =
        words.as_chunks().0.iter().fold([0; CHANNELS], |[a, b, c, d, e], [v, w, x, y, z, p, q, r, s, t]| {
            [
                a + load(v) + load(p),
                b + load(w) + load(q),
                c + load(x) + load(r),
                d + load(y) + load(s),
                e + load(z) + load(t),
            ]
        });
    let (low, high) = (|sum: u32| sum & 0xFFFF, |sum: u32| sum >> 16);
    [low(a) + high(c), high(a) + low(d), low(b) + high(d), high(b) + low(e), low(c) + high(e)]
}

/// The sum of the pressure input. An input that is at a rail at the last conversion has crossed to it in this
/// millisecond: the sum is that of the rail, so that the mean of signal and rail is never taken for a signal.
pub fn pressure(words: &[AtomicU32; WORDS], sum: u32) -> u32 {
    // The last scan begins in the upper half of a word.
    let [.., last, _, _] = words;
    match last.load(Ordering::Relaxed) >> 16 {
        0 => 0,
        4095.. => RAIL,
        _ => sum,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The buffer as DMA leaves it, from the result of each conversion.
    fn buffer(conversion: impl Fn(usize) -> u32) -> [AtomicU32; WORDS] {
        core::array::from_fn(|word| AtomicU32::new(conversion(2 * word) | conversion(2 * word + 1) << 16))
    }

    #[test]
    fn every_conversion_counts_for_its_channel() {
        for one in 0..SCANS * CHANNELS {
            let mut expected = [0; CHANNELS];
            expected[one % CHANNELS] = 1;
            assert_eq!(sums(&buffer(|n| u32::from(n == one))), expected);
        }
    }

    #[test]
    fn the_largest_sums_do_not_run_over() {
        assert_eq!(sums(&buffer(|_| 4095)), [16 * 4095; CHANNELS]);
    }

    /// The rail is reached at any conversion of the millisecond, and lasts.
    #[test]
    fn a_sample_that_crosses_to_a_rail_is_at_the_rail() {
        for (rail, sum) in [(0, 0), (4095, 16 * 4095)] {
            for first in 0..SCANS {
                let words = buffer(|n| if n % CHANNELS == 0 && n / CHANNELS >= first { rail } else { 2000 });
                assert_eq!(pressure(&words, sums(&words)[0]), sum, "{rail} from scan {first} on");
            }
        }
        let words = buffer(|n| if n % CHANNELS == 0 { 1000 } else { 4095 });
        assert_eq!(pressure(&words, sums(&words)[0]), 16_000, "other channels do not count");
    }
}
