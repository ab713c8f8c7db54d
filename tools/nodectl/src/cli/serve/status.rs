//! The load of the bus.

use canopen::Frame;

use crate::cli::load::{self, Peak};

/// Frames and bits since the last rate, and frames in total.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Count {
    frames: u32,
    bits: u64,
    pub(super) total: u64,
}

/// The rates over a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rate {
    /// Frames a second.
    pub(super) frames: f64,
    /// Bits a second.
    bits: f64,
}

impl Count {
    pub(super) fn add(&mut self, frame: &Frame) {
        self.frames = self.frames.saturating_add(1);
        self.bits += bits(frame);
        self.total += 1;
    }

    /// The rates over a time; the counts start again at 0.
    #[allow(clippy::cast_precision_loss)]
    pub(super) fn rate(&mut self, seconds: f64) -> Rate {
        let (frames, bits) = (std::mem::take(&mut self.frames), std::mem::take(&mut self.bits));
        if seconds <= 0.0 {
            return Rate::default();
        }
        Rate { frames: (f64::from(frames) / seconds).round(), bits: bits as f64 / seconds }
    }
}

/// The load in the busiest tenth of a second since the last call.
#[allow(clippy::cast_precision_loss)]
pub(super) fn busiest(peak: &mut Peak, kbit: Option<u16>) -> Option<f64> {
    Rate { frames: 0.0, bits: peak.take() as f64 / load::WINDOW }.load(kbit)
}

/// Bits of a frame.
pub(super) fn bits(frame: &Frame) -> u64 {
    load::bits(if frame.is_remote() { 0 } else { frame.len() })
}

impl Rate {
    /// The load as a share of the bit rate, 0 to 1.
    pub(super) fn load(self, kbit: Option<u16>) -> Option<f64> {
        let share = self.bits / (f64::from(kbit?) * 1000.0);
        Some((share.min(1.0) * 10_000.0).round() / 10_000.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_bus_is_full() {
        let mut count = Count::default();
        let frame = Frame::new(0x181, &[0x55; 8]).unwrap();
        // 111 bits and 6 stuff bits: 8547 frames at 1 Mbit/s.
        (0..8547).for_each(|_| count.add(&frame));
        let rate = count.rate(1.0);
        assert_eq!(rate.load(Some(1000)), Some(1.0));
        assert_eq!(rate.load(Some(500)), Some(1.0));
        assert_eq!((rate.load(None), count.total), (None, 8547));
        (0..854).for_each(|_| count.add(&frame));
        assert_eq!(count.rate(1.0).load(Some(1000)), Some(0.0999));
        assert_eq!(count.rate(1.0), Rate::default());
    }

    #[test]
    fn the_peak_is_the_load_of_the_busiest_tenth_of_a_second() {
        let mut peak = Peak::default();
        let frame = Frame::new(0x181, &[0x55; 8]).unwrap();
        // 117 bits: 100 frames in 0.1 s at 250 kbit/s are 46.8 %, and one frame in the next 0.9 s.
        (0..100_u8).for_each(|at| peak.add(bits(&frame), 1.0 + f64::from(at) / 1e6));
        peak.add(bits(&frame), 1.9);
        assert_eq!(busiest(&mut peak, Some(250)), Some(0.468));
        assert_eq!(busiest(&mut peak, Some(250)), Some(0.0));
        peak.add(bits(&frame), 2.0);
        assert_eq!(busiest(&mut peak, None), None, "the bit rate is unknown");
    }
}
