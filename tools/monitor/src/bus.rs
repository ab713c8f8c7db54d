//! The recent traffic, and the time that it leaves.

use std::collections::VecDeque;

use canopen::{Frame, Instant};

/// Frames that are kept: half a second of a full bus at 1 Mbit/s.
const KEPT: usize = 8192;
/// Standard bit rates in bit/s.
const BIT_RATES: [f64; 9] = [1e4, 2e4, 5e4, 1e5, 1.25e5, 2.5e5, 5e5, 8e5, 1e6];
/// Longest gap in bits between two frames that follow each other without a pause.
const GAP: f64 = 25.0;
/// Gaps in bits with an error frame between the two: the shortest, with some tolerance (14 bits and the interframe space),
/// the longest, and the longest with a frame that an error has destroyed.
const SHORTEST_ERROR_GAP: f64 = 10.0;
const ERROR_GAP: f64 = 80.0;
const DESTROYED_GAP: f64 = 400.0;

/// A frame that has passed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passed {
    /// Start of frame and end of frame in us.
    pub(crate) start: f64,
    pub(crate) end: f64,
    pub(crate) at: Instant,
    pub(crate) frame: Frame,
    pub(crate) device: Option<usize>,
}

/// How long a bit lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bit {
    /// There is no bus: a frame takes no time.
    None,
    /// In us.
    Known(f64),
    /// The greatest bit rate that the frames so far have shown, in bit/s.
    Seen(f64),
}

/// The traffic.
#[derive(Debug)]
pub(crate) struct Bus {
    bit: Bit,
    /// Start of the traffic without a pause that the newest frame ends, in us.
    busy_since: f64,
    pub(crate) recent: VecDeque<Passed>,
    /// The newest frame of a device that has failed for it, with the start of frame in us.
    newest_failed: Option<(f64, usize, Frame)>,
    /// Frames that were received and have failed for the devices that have sent them: they come again.
    failed: Vec<(usize, Frame)>,
}

impl Bus {
    pub(crate) fn new() -> Bus {
        Bus {
            bit: Bit::Seen(0.0),
            busy_since: 0.0,
            recent: VecDeque::new(),
            newest_failed: None,
            failed: Vec::new(),
        }
    }

    pub(crate) fn set_bit_rate(&mut self, bits_per_second: u32) {
        self.bit = Bit::Known(1e6 / f64::from(bits_per_second));
    }

    pub(crate) fn remove(&mut self) {
        self.bit = Bit::None;
    }

    /// Whether frames take time.
    pub(crate) fn is_real(&self) -> bool {
        self.bit != Bit::None
    }

    /// The length of a bit in us; at an unknown bit rate, that of the slowest one that fits the traffic.
    pub(crate) fn bit(&self) -> f64 {
        match self.bit {
            Bit::None => 0.0,
            Bit::Known(bit) => bit,
            Bit::Seen(rate) => {
                1e6 / BIT_RATES.into_iter().find(|standard| *standard >= 0.97 * rate).unwrap_or(1e6)
            }
        }
    }

    /// The time of the longest frame in us.
    pub(crate) fn longest(&self) -> f64 {
        135.0 * self.bit()
    }

    /// Takes a frame that ended at `at`. Returns whether it is the repetition of the frame before, which a CAN
    /// controller sends after an error in the last bit.
    pub(crate) fn take(&mut self, at: Instant, frame: &Frame, device: Option<usize>) -> bool {
        let end = at.0 as f64;
        if let (Bit::Seen(rate), Some(last)) = (self.bit, self.recent.back()) {
            let span = (end - last.end).max(1.0);
            // The interframe space is at least three bits.
            self.bit = Bit::Seen(rate.max(1e6 * f64::from(bits(frame)) / span).min(1e6));
        }
        let start = end - f64::from(bits(frame) - 3) * self.bit();
        let is_repeated =
            self.comes_again(frame, device) || self.is_real() && self.is_repetition(start, frame, device);
        if self.recent.back().is_none_or(|last| start - last.end > GAP * self.bit() + 1.0) {
            self.busy_since = start;
        }
        if self.recent.len() == KEPT {
            self.recent.pop_front();
        }
        self.recent.push_back(Passed { start, end, at, frame: *frame, device });
        self.note_received_and_failed();
        is_repeated
    }

    /// A frame that began at `start` has failed for the device that has sent it. Others have received it before or receive it
    /// a few bits later, or not at all.
    pub(crate) fn failed(&mut self, start: Instant, frame: &Frame, device: usize) {
        self.newest_failed = Some((start.0 as f64, device, *frame));
        self.note_received_and_failed();
    }

    fn note_received_and_failed(&mut self) {
        let (Some((start, device, frame)), Some(last)) = (self.newest_failed, self.recent.back()) else {
            return;
        };
        let is_one = (last.start - start).abs() < SHORTEST_ERROR_GAP * self.bit();
        if is_one
            && (last.device, last.frame) == (Some(device), frame)
            && !self.failed.contains(&(device, frame))
        {
            self.failed.push((device, frame));
        }
    }

    /// A device forgets the frames that it has to send again.
    pub(crate) fn forget_failed(&mut self, device: usize) {
        self.failed.retain(|(of, _)| *of != device);
    }

    /// Whether the frame has failed before. Another frame with its CAN-ID shows that the device does not send it again.
    fn comes_again(&mut self, frame: &Frame, device: Option<usize>) -> bool {
        let failed =
            self.failed.extract_if(.., |(of, failed)| Some(*of) == device && failed.id() == frame.id());
        failed.collect::<Vec<_>>().iter().any(|(_, failed)| failed == frame)
    }

    /// Whether the frame follows an equal one of its sender without a pause, after an error frame. Between the two of an SDO server, more
    /// urgent frames may have passed.
    fn is_repetition(&self, start: f64, frame: &Frame, device: Option<usize>) -> bool {
        const FRAMES: usize = 64;
        let is_sdo = (0x580..0x600).contains(&frame.id());
        let (frames, gap) = if is_sdo { (FRAMES, DESTROYED_GAP) } else { (1, ERROR_GAP) };
        let mut next = start;
        for passed in self.recent.iter().rev().take(frames) {
            if next - passed.end > gap * self.bit() + 1.0 {
                return false;
            }
            if passed.device == device && passed.frame.id() == frame.id() {
                let has_error_frame = is_sdo || next - passed.end >= SHORTEST_ERROR_GAP * self.bit();
                return passed.frame == *frame && has_error_frame;
            }
            if passed.frame.id() > frame.id() {
                return false;
            }
            next = passed.start;
        }
        false
    }

    /// The time in us from the start of the unbroken traffic before the newest frame to its start: how long the frame
    /// may have waited.
    pub(crate) fn wait(&self) -> f64 {
        self.recent.back().map_or(0.0, |newest| newest.start - self.busy_since)
    }

    /// The time in us that was free for a frame of this device with this identifier: the bus was idle, or carried less
    /// urgent frames, or frames that the device sends by itself. Its SDO responses are not free time: a client asks for
    /// them.
    pub(crate) fn room(&self, device: usize, id: u16, from: Instant, to: Instant) -> f64 {
        let oldest = self.recent.front().filter(|_| self.recent.len() == KEPT);
        let from = (from.0 as f64).max(oldest.map_or(0.0, |passed| passed.start));
        let to = to.0 as f64;
        let others = self.recent.iter().rev().take_while(|passed| passed.end > from);
        let is_asked_for = |passed: &&Passed| (0x581..0x600).contains(&passed.frame.id());
        let others = others.filter(|passed| {
            passed.frame.id() < id && (passed.device != Some(device) || is_asked_for(passed))
        });
        let busy: f64 = others
            .map(|passed| (passed.end.min(to) + 3.0 * self.bit() - passed.start.max(from)).max(0.0))
            .sum();
        (to - from - busy).max(0.0)
    }

    /// Whether that time is enough: a tenth of the span, and a few frames.
    pub(crate) fn has_room(&self, device: usize, id: u16, from: Instant, to: Instant) -> bool {
        let room = self.room(device, id, from, to);
        room >= 0.1 * to.0.saturating_sub(from.0) as f64 && room >= 4.0 * self.longest()
    }

    /// The last frames of or to a device, oldest first.
    pub(crate) fn frames_of(&self, device: usize, node: Option<u8>) -> Vec<(Instant, Frame)> {
        const SHOWN: usize = 8;
        let request = node.map(|node| 0x600 + u16::from(node));
        let mut frames: Vec<_> = self
            .recent
            .iter()
            .rev()
            .filter(|passed| {
                let id = passed.frame.id();
                passed.device == Some(device)
                    || Some(id) == request
                    || (id == 0 && passed.frame.data().get(1).is_some_and(|to| *to == 0 || Some(*to) == node))
            })
            .take(SHOWN)
            .map(|passed| (passed.at, passed.frame))
            .collect();
        frames.reverse();
        frames
    }
}

/// Bits of a frame with 11-bit identifier, with stuff bits and interframe space (ISO 11898-1, 10.4 and 10.5).
pub(crate) fn bits(frame: &Frame) -> u32 {
    let mut stream: Vec<bool> = Vec::with_capacity(98);
    let mut push = |value: u32, width: u32| stream.extend((0..width).rev().map(|n| value >> n & 1 == 1));
    push(0, 1);
    push(frame.id().into(), 11);
    push(u32::from(frame.is_remote()) << 2, 3);
    push(frame.len() as u32, 4);
    frame.data().iter().for_each(|byte| push((*byte).into(), 8));
    let crc = stream.iter().fold(0_u32, |crc, bit| {
        let next = u32::from(*bit) ^ (crc >> 14 & 1);
        (crc << 1 & 0x7FFF) ^ if next == 1 { 0x4599 } else { 0 }
    });
    stream.extend((0..15).rev().map(|n| crc >> n & 1 == 1));
    let (mut stuffed, mut last, mut run) = (0, true, 0);
    for &bit in &stream {
        run = if bit == last { run + 1 } else { 1 };
        last = bit;
        if run == 5 {
            stuffed += 1;
            (last, run) = (!bit, 1);
        }
    }
    stream.len() as u32 + stuffed + 10 + 3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u16, data: &[u8]) -> Frame {
        Frame::new(id, data).unwrap()
    }

    #[test]
    fn frames_have_the_length_of_iso_11898() {
        assert_eq!(bits(&frame(0, &[])), 34 + 6 + 10 + 3);
        assert_eq!((0..0x800).map(|id| bits(&frame(id, &[]))).min(), Some(48));
        assert!((0..0x800).all(|id| (111..=135).contains(&bits(&frame(id, &[0x55; 8])))));
    }

    #[test]
    fn the_bit_rate_is_that_of_frames_in_a_row() {
        let mut bus = Bus::new();
        let data = [0x55; 8];
        let mut at = 0.0;
        for id in 0x100..0x110 {
            at += f64::from(bits(&frame(id, &data))) * 8.0;
            bus.take(Instant(at as u64), &frame(id, &data), None);
        }
        assert!((bus.bit() - 8.0).abs() < 1e-9, "125 kbit/s: {}", bus.bit());
    }

    #[test]
    fn a_frame_that_was_received_and_has_failed_comes_again_once() {
        let (mut bus, answer, other) = (Bus::new(), frame(0x581, &[1; 8]), frame(0x581, &[2; 8]));
        bus.set_bit_rate(1_000_000);
        let length = u64::from(bits(&answer)) - 3;
        let take = |bus: &mut Bus, at, frame| bus.take(Instant(at), frame, Some(0));
        assert!(!take(&mut bus, 1000, &answer));
        bus.failed(Instant(1000 - length), &answer, 0);
        bus.failed(Instant(100_000), &answer, 0);
        assert!(take(&mut bus, 400_000, &answer), "it fails once more without a receiver");
        assert!(!take(&mut bus, 500_000, &answer), "an answer of its own");
        bus.failed(Instant(600_000 - length), &answer, 0);
        assert!(!take(&mut bus, 600_000, &answer), "the sender notices the error first");
        assert!(take(&mut bus, 700_000, &answer));
        bus.failed(Instant(800_000), &answer, 0);
        assert!(!take(&mut bus, 800_200, &answer), "nobody has received the failed one");
        bus.failed(Instant(800_200 - length), &answer, 0);
        assert!(!take(&mut bus, 810_000, &other));
        assert!(!take(&mut bus, 820_000, &answer), "the node has given it up");
        bus.failed(Instant(820_000 - length), &answer, 0);
        bus.forget_failed(0);
        assert!(!take(&mut bus, 900_000, &answer), "a node that restarts has nothing to repeat");
    }

    #[test]
    fn a_client_that_asks_without_a_pause_leaves_no_room() {
        let mut bus = Bus::new();
        bus.set_bit_rate(10_000);
        for n in 0..20 {
            let (id, device) = if n % 2 == 0 { (0x601, None) } else { (0x581, Some(0)) };
            bus.take(Instant((n + 1) * 12_000), &frame(id, &[0x55; 8]), device);
        }
        let room = bus.room(0, 0x701, Instant(0), Instant(240_000));
        assert!(room < 24_000.0, "{room}");
    }

    #[test]
    fn the_room_of_a_frame_is_the_time_without_more_urgent_frames() {
        let mut bus = Bus::new();
        bus.set_bit_rate(1_000_000);
        for n in 0..100 {
            bus.take(Instant(100 + n * 200), &frame(0x100, &[0x55; 8]), Some(usize::from(n % 2 == 0)));
        }
        let [mine, less_urgent] =
            [(1, 0x701), (7, 0x50)].map(|(device, id)| bus.room(device, id, Instant(0), Instant(20_000)));
        assert!((13_000.0..15_000.0).contains(&mine), "half of the frames are its own: {mine}");
        assert!((less_urgent - 20_000.0).abs() < 1.0, "{less_urgent}");
    }
}
