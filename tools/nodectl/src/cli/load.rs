//! The part of the bus that frames take.

use std::collections::VecDeque;

/// The time over which the peak of the load is measured, in seconds.
pub(super) const WINDOW: f64 = 0.1;

/// Bits of a base frame with this number of data bytes, with the interframe space and an estimate of the stuff bits. The
/// estimate is one stuff bit for sixteen bits, which lies between the numbers for counting data and for zeros.
pub(super) fn bits(data_bytes: usize) -> u64 {
    let data = 8 * data_bytes as u64;
    47 + data + (34 + data) / 16
}

/// The most bits of any tenth of a second.
#[derive(Clone, Debug, Default)]
pub(super) struct Peak {
    /// Times and bits of the frames of the last tenth of a second. Frames of one time are one entry.
    recent: VecDeque<(f64, u64)>,
    bits: u64,
    most: u64,
}

impl Peak {
    /// Counts a frame with its time in seconds.
    pub(super) fn add(&mut self, bits: u64, time: f64) {
        let newest = self.recent.back().map_or(time, |recent| recent.0);
        // A much older frame is that of another log.
        let now = if newest - time < WINDOW { time.max(newest) } else { time };
        self.drop_beyond(now);
        match self.recent.back_mut() {
            Some(recent) if recent.0 >= now => recent.1 += bits,
            _ => self.recent.push_back((now, bits)),
        }
        self.bits += bits;
        self.most = self.most.max(self.bits);
    }

    fn drop_beyond(&mut self, now: f64) {
        while let Some((time, bits)) = self.recent.front().copied() {
            if (now - time).abs() < WINDOW {
                break;
            }
            self.recent.pop_front();
            self.bits -= bits;
        }
    }

    /// The most bits so far.
    pub(super) fn most(&self) -> u64 {
        self.most
    }

    /// The most bits since the last call.
    pub(super) fn take(&mut self) -> u64 {
        std::mem::take(&mut self.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(times: &[f64]) -> Peak {
        let mut peak = Peak::default();
        times.iter().for_each(|time| peak.add(100, *time));
        peak
    }

    #[test]
    fn a_burst_is_counted_as_a_whole_at_any_begin() {
        for begin in [0.0, 0.05, 0.095, 0.1, 0.17] {
            assert_eq!(peak(&[0.0, begin + 0.101, begin + 0.14, begin + 0.2]).most(), 300, "{begin}");
        }
    }

    #[test]
    fn frames_of_two_tenths_of_a_second_are_not_added() {
        assert_eq!(peak(&[1.0, 1.11, 1.22, 1.33]).most(), 100);
        assert_eq!(peak(&[1.0, 1.09, 1.11]).most(), 200);
    }

    #[test]
    fn a_taken_peak_begins_again() {
        let mut peak = peak(&[1.0, 1.01]);
        assert_eq!((peak.take(), peak.take()), (200, 0));
        peak.add(100, 1.02);
        assert_eq!(peak.take(), 300, "the frames of the last tenth of a second count");
    }

    /// A frame that this program sends has the time of another clock. A second log in one file begins again.
    #[test]
    fn a_frame_may_be_older_than_the_one_before() {
        assert_eq!(peak(&[1.0, 0.999, 1.001]).most(), 300);
        assert_eq!(peak(&[5.0, 1.0, 1.001]).most(), 200);
    }
}
