//! What outlives a loss of power with a battery, and what a start without one knows.
//!
//! The firmware copies [`Kept`] to the backup SRAM after every sample, for that does not wear. To the parameter store goes
//! what must outlive a battery: the offset, which is a parameter (650Ch) and is stored with every preset, and
//! [`Lasting`], now and then. So a start without a battery knows that there was a position, and that it is lost.

use super::SensorType;
use super::input::{Found, Left};
use super::reference::Trust;
use crate::board::{LASTING_WORDS, RETAINED_WORDS, Retained};

/// Milliseconds in a tenth of an hour.
const TENTH: u32 = 360_000;
/// 6508h saturates here: one more would mean that there is no operating time.
const LAST: u32 = u32::MAX - 1;

/// The time for which the encoder has worked: object 6508h.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperatingTime {
    tenths: u32,
    millis: u32,
}

impl OperatingTime {
    /// The stored form.
    pub(super) fn to_words(self) -> [u32; 2] {
        [self.tenths, self.millis]
    }

    /// In units of 0.1 h.
    #[must_use]
    pub fn tenths(&self) -> u32 {
        self.tenths
    }

    /// A millisecond later.
    pub(super) fn tick(&mut self) {
        self.millis = self.millis.saturating_add(1);
        if self.millis >= TENTH {
            (self.millis, self.tenths) = (0, self.tenths.saturating_add(1).min(LAST));
        }
    }
}

/// What one channel keeps. It is taken back by a channel whose sensor is still the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeptChannel {
    /// Code of the sensor's type, 0 for a channel that has no position.
    kind: u8,
    /// Steps per turn of a shaft, nm of a rod.
    resolution: u32,
    total: i64,
    trust: Trust,
    /// The sensor alone does not tell where it is, though its type does.
    needs_memory: bool,
}

impl KeptChannel {
    #[inline]
    pub(super) fn new(kind: SensorType, resolution: u32, left: Left) -> KeptChannel {
        let Left { total, trust, needs_memory } = left;
        KeptChannel { kind: kind.code(), resolution, total, trust, needs_memory }
    }

    /// A channel that has no position yet, and one that has lost it.
    pub(super) fn unread((lost, needs_memory): (bool, bool)) -> KeptChannel {
        let trust = Trust { lost, ..Trust::default() };
        KeptChannel { trust, needs_memory, ..KeptChannel::default() }
    }

    /// What is known of the sensor: nothing of one that does not go on from where it was left, or of another one.
    pub(super) fn found(&self, kind: SensorType, resolution: u32) -> Found {
        let Trust { lost, .. } = self.trust;
        if self.kind == 0 {
            return Found { left: None, lost: lost && (kind.is_counted() || self.needs_memory) };
        }
        let is_same = (self.kind, self.resolution) == (kind.code(), resolution);
        let left = Left { total: self.total, trust: self.trust, needs_memory: self.needs_memory };
        Found {
            left: (is_same && (kind.is_kept() || self.needs_memory)).then_some(left),
            lost: !is_same && kind.is_counted(),
        }
    }
}

/// What is to be kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kept {
    /// Of each channel.
    pub channels: [KeptChannel; 2],
    /// Operating time (6508h).
    pub operating_time: OperatingTime,
}

/// What the memory had when the power came back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// Nothing yet: the first start.
    #[default]
    First,
    /// This.
    Kept(Kept),
    /// Nothing any more. The parameter store has this.
    Lost(Lasting),
    /// Something that is no longer right. The parameter store has this.
    Damaged(Lasting),
}

impl Start {
    /// By what the board has found: in the memory that a battery keeps, and in the parameter store.
    #[must_use]
    pub fn of(retained: Retained, stored: Option<[u32; LASTING_WORDS]>) -> Start {
        match (retained, stored.map(Lasting::from_words)) {
            (Retained::Words(words), lasting) => {
                Start::Kept(Kept::from_words(&words).with(lasting.unwrap_or_default()))
            }
            (Retained::Nothing, None) => Start::First,
            (Retained::Nothing, Some(lasting)) => Start::Lost(lasting),
            (Retained::Damaged, lasting) => Start::Damaged(lasting.unwrap_or(Lasting::UNKNOWN)),
        }
    }

    /// What a start goes on from.
    #[must_use]
    pub fn kept(&self) -> Kept {
        match *self {
            Start::First => Kept::default(),
            Start::Kept(kept) => kept,
            Start::Lost(lasting) | Start::Damaged(lasting) => lasting.kept(),
        }
    }
}

/// What the parameter store holds, in its own record: that there has been a start, the operating time, and which sensors
/// need a memory though their type does not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lasting {
    /// Operating time in 0.1 h.
    tenths: u32,
    needs_memory: [bool; 2],
}

/// Tenths of an hour between two times that are stored, at least.
const INTERVAL: u32 = 10;
/// Of the time since the start, the part that may be lost with the power: one in so many.
const PART: u32 = 8;

impl Lasting {
    /// Nothing is known, and everything may have been lost.
    const UNKNOWN: Lasting = Lasting { tenths: 0, needs_memory: [true; 2] };

    /// Of the words that a profile retains.
    #[must_use]
    pub fn of(retained: &[u32; RETAINED_WORDS]) -> Lasting {
        let Kept { channels: [first, second], operating_time } = Kept::from_words(retained);
        Lasting { tenths: operating_time.tenths, needs_memory: [first.needs_memory, second.needs_memory] }
    }

    /// The stored form.
    #[must_use]
    pub fn to_words(self) -> [u32; LASTING_WORDS] {
        let [first, second] = self.needs_memory;
        [self.tenths, u32::from(first) | u32::from(second) << 1]
    }

    /// From the stored form; any words are something.
    #[must_use]
    pub fn from_words([tenths, flags]: [u32; LASTING_WORDS]) -> Lasting {
        Lasting { tenths: tenths.min(LAST), needs_memory: [flags & 1 != 0, flags & 2 != 0] }
    }

    /// Whether it is worth a write to the parameter store that has `stored`, in a run that began with `start`: at once when
    /// a sensor needs its memory now, else once an hour, and less and less often in a long run.
    #[must_use]
    pub fn is_due(self, stored: Lasting, start: Lasting) -> bool {
        let run = self.tenths.saturating_sub(start.tenths);
        let interval = INTERVAL.max(run / PART);
        self.needs_memory != stored.needs_memory || self.tenths >= stored.tenths.saturating_add(interval)
    }

    fn kept(self) -> Kept {
        let operating_time = OperatingTime { tenths: self.tenths, millis: 0 };
        Kept { channels: self.needs_memory.map(|needs| KeptChannel::unread((true, needs))), operating_time }
    }
}

/// Words of a channel.
const CHANNEL: usize = 4;
const _: () = assert!(Kept::WORDS == 2 * CHANNEL + 2);

impl Kept {
    /// Words of its stored form.
    pub const WORDS: usize = RETAINED_WORDS;

    /// The form to be stored. It has no check of its own: whoever stores it adds one.
    #[must_use]
    #[inline(never)]
    pub fn to_words(&self) -> [u32; Kept::WORDS] {
        let OperatingTime { tenths, millis } = self.operating_time;
        let [[a0, a1, a2, a3], [b0, b1, b2, b3]] = self.channels.map(KeptChannel::to_words);
        [a0, a1, a2, a3, b0, b1, b2, b3, tenths, millis]
    }

    /// From the stored form. Any words are something; a channel that fits no sensor is not used.
    #[must_use]
    pub fn from_words(words: &[u32; Kept::WORDS]) -> Kept {
        let ([first, second], &[tenths, millis]) = words.as_chunks() else { return Kept::default() };
        let channels = [first, second].map(KeptChannel::from_words);
        Kept { channels, operating_time: OperatingTime { tenths, millis } }
    }

    /// The later of both operating times: the memory may be that of another life.
    fn with(mut self, stored: Lasting) -> Kept {
        if stored.tenths > self.operating_time.tenths {
            self.operating_time = OperatingTime { tenths: stored.tenths, millis: 0 };
        }
        self
    }
}

impl KeptChannel {
    /// Words of the stored form.
    pub(super) const WORDS: usize = CHANNEL;

    #[inline(never)]
    pub(super) fn to_words(self) -> [u32; CHANNEL] {
        stored_form(self.kind, self.resolution, self.total, self.trust.bits(), self.needs_memory)
    }

    /// The stored form of a position.
    #[inline]
    pub(super) fn words(
        kind: SensorType,
        resolution: u32,
        total: i64,
        trust: u8,
        needs_memory: bool,
    ) -> [u32; CHANNEL] {
        stored_form(kind.code(), resolution, total, trust, needs_memory)
    }

    fn from_words(words: &[u32; CHANNEL]) -> KeptChannel {
        let [flags, resolution, total, total_high] = *words;
        let [kind, trust, needs_memory, _] = flags.to_le_bytes();
        KeptChannel {
            kind,
            resolution,
            total: whole([total, total_high]).cast_signed(),
            trust: Trust::from_bits(trust),
            needs_memory: needs_memory != 0,
        }
    }
}

#[inline]
fn stored_form(kind: u8, resolution: u32, total: i64, trust: u8, needs_memory: bool) -> [u32; CHANNEL] {
    let flags = u32::from_le_bytes([kind, trust, needs_memory.into(), 0]);
    let [total, total_high] = halves(total.cast_unsigned());
    [flags, resolution, total, total_high]
}

/// The low and the high word.
#[allow(clippy::cast_possible_truncation)]
fn halves(value: u64) -> [u32; 2] {
    [value as u32, (value >> 32) as u32]
}

fn whole([low, high]: [u32; 2]) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    prop_compose! {
        fn any_channel()(
            (kind, resolution, total) in any::<(u8, u32, i64)>(),
            (referenced, lost, doubted, needs_memory) in any::<(bool, bool, bool, bool)>(),
        ) -> KeptChannel {
            KeptChannel { kind, resolution, total, trust: Trust { referenced, lost, doubted }, needs_memory }
        }
    }

    proptest! {
        #[test]
        fn words_give_back_what_was_kept(channels in prop::array::uniform2(any_channel()), tenths: u32, millis: u32) {
            let kept = Kept { channels, operating_time: OperatingTime { tenths, millis } };
            prop_assert_eq!(Kept::from_words(&kept.to_words()), kept);
        }
    }

    #[test]
    fn operating_time_counts_tenths_of_an_hour_and_never_says_unused() {
        let mut time = OperatingTime::default();
        (0..TENTH - 1).for_each(|_| time.tick());
        assert_eq!(time.tenths(), 0);
        time.tick();
        assert_eq!(time.tenths(), 1);
        let mut time = OperatingTime { tenths: LAST, millis: u32::MAX };
        time.tick();
        assert_eq!(time.tenths(), 0xFFFF_FFFE);
    }

    /// Hours of a run after which the operating time is stored.
    fn saves(start: u32, hours: u32) -> Vec<u32> {
        let lasting = |tenths| Lasting { tenths, ..Lasting::default() };
        let mut stored = lasting(start);
        let mut saves = Vec::new();
        for tenths in start..=start + 10 * hours {
            if lasting(tenths).is_due(stored, lasting(start)) {
                stored = lasting(tenths);
                saves.push(tenths - start);
            }
        }
        saves
    }

    #[test]
    fn the_operating_time_is_stored_every_hour_and_less_often_in_a_long_run() {
        assert_eq!(saves(0, 8), [10, 20, 30, 40, 50, 60, 70, 80]);
        assert_eq!(saves(1_000_000, 8).len(), 8, "whatever it was before");
        // Ten years without a break.
        assert_eq!(saves(0, 10 * 365 * 24).len(), 78);
    }

    #[test]
    fn a_sensor_that_needs_its_memory_is_stored_at_once() {
        let (without, with) =
            (Lasting::default(), Lasting { needs_memory: [false, true], ..Lasting::default() });
        assert!(with.is_due(without, without) && without.is_due(with, with) && !with.is_due(with, without));
        assert_eq!(Lasting::from_words(with.to_words()), with);
    }
}
