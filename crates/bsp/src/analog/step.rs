//! Check that the conversions of the ADC and the copies of the encoder's count are in step.
//!
//! One timer starts both, and two DMA streams write them side by side: one copy for each scan of conversions. A stream
//! that lost a single request would stay behind the other one for ever, and each count would belong to another scan.

use crate::analog::oversampling::{CHANNELS, SCANS};

/// Number of scans in a round of both streams.
const ROUND: usize = 2 * SCANS;

/// Progress of the two streams and the timer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Number of conversions still to come in this round.
    pub conversions_left: usize,
    /// Number of copies still to come in this round.
    pub copies_left: usize,
    /// Whether the timer is in the second half of its period. A scan lasts nearly the whole period.
    pub second_half: bool,
}

impl Progress {
    /// Whether copies and conversions belong to the same scans. The copy comes at the start of a scan, the conversions
    /// come during the scan.
    #[must_use]
    pub fn is_in_step(&self) -> bool {
        let converted = (ROUND * CHANNELS).saturating_sub(self.conversions_left);
        // A scan has begun with its first conversion, and without one if the period has just begun.
        let ahead = if self.second_half { CHANNELS - 1 } else { CHANNELS };
        let begun = (converted + ahead) / CHANNELS;
        ROUND.saturating_sub(self.copies_left) % ROUND == begun % ROUND
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All possible observations in a round in which the copies, and the conversions, are late by this number of requests.
    fn seen(copies_behind: usize, conversions_behind: usize) -> impl Iterator<Item = Progress> {
        (0..ROUND).flat_map(move |scan| {
            (0..=CHANNELS).flat_map(move |converted| {
                [false, true].into_iter().filter_map(move |second_half| {
                    // In the first half of the period the last conversion is not done; in the second half the first one
                    // is.
                    let is_possible = if second_half { converted > 0 } else { converted < CHANNELS };
                    let all = ROUND * CHANNELS;
                    let conversions = (scan * CHANNELS + converted + all - conversions_behind) % all;
                    let copies = (scan + 1 + ROUND - copies_behind) % ROUND;
                    is_possible.then_some(Progress {
                        conversions_left: all - conversions,
                        copies_left: ROUND - copies,
                        second_half,
                    })
                })
            })
        })
    }

    #[test]
    fn streams_that_lost_nothing_are_in_step_all_the_time() {
        assert!(seen(0, 0).all(|progress| progress.is_in_step()));
    }

    #[test]
    fn a_lost_copy_is_seen_wherever_one_looks() {
        for behind in 1..ROUND {
            assert!(seen(behind, 0).all(|progress| !progress.is_in_step()), "{behind}");
        }
    }

    #[test]
    fn lost_conversions_are_seen_once_they_fill_a_scan() {
        for behind in CHANNELS..(ROUND - 1) * CHANNELS {
            assert!(seen(0, behind).any(|progress| !progress.is_in_step()), "{behind}");
        }
    }
}
