//! State of the encoder that is retained through a loss of power.
//!
//! The firmware copies [`RetainedState`] to the backup SRAM after every sample, because the backup SRAM does not wear.
//! Data that must survive an empty battery goes to the parameter store: the offset, which is a parameter (650Ch) and is
//! stored with every preset, and now and then [`PositionRecord`]. A start with an empty battery therefore knows that
//! there was a position and that it is lost.

use super::SensorType;
use super::trust::Trust;
use crate::board::{POSITION_RECORD_WORDS, RETAINED_WORDS, Retained};

/// Milliseconds in a tenth of an hour.
const TENTH: u32 = 360_000;
/// Last value of 6508h: one more (`FFFF FFFFh`) would mean that the operating time is not available.
const LAST: u32 = u32::MAX - 1;

/// The operating time of the encoder: object 6508h.
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

    /// Counts a millisecond.
    pub(super) fn tick(&mut self) {
        self.millis = self.millis.saturating_add(1);
        if self.millis >= TENTH {
            (self.millis, self.tenths) = (0, self.tenths.saturating_add(1).min(LAST));
        }
    }
}

/// Retained state of one channel. Only a channel with the same sensor takes it over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RetainedChannel {
    /// Code of the sensor's type, 0 for a channel that has no position.
    pub(super) kind: u8,
    /// Steps per turn of a shaft, nm per step of a linear encoder.
    pub(super) resolution: u32,
    pub(super) total: i64,
    pub(super) trust: Trust,
}

impl RetainedChannel {
    /// A channel that has lost its position with the memory.
    fn forgotten(needs_memory: bool) -> RetainedChannel {
        let flags = if needs_memory { Trust::NEEDS_MEMORY } else { 0 };
        RetainedChannel { trust: Trust { flags, ..Trust::NONE }, ..RetainedChannel::default() }
    }

    /// Whether a sensor of this type has left the state.
    pub(super) fn is_of(&self, kind: SensorType, resolution: u32) -> bool {
        (self.kind, self.resolution) == (kind.code(), resolution)
    }
}

/// Retained state of the encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RetainedState {
    /// State of each channel.
    pub channels: [RetainedChannel; 2],
    /// Operating time (6508h).
    pub operating_time: OperatingTime,
}

/// Content of the memories when the power came back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// Both memories are empty: the first start.
    #[default]
    First,
    /// The backup SRAM has retained this state.
    Retained(RetainedState),
    /// The backup SRAM is empty; the parameter store has this.
    Lost(PositionRecord),
    /// The backup SRAM is damaged; the parameter store has this.
    Damaged(PositionRecord),
}

impl Start {
    /// The start that follows from the content of the backup SRAM and of the parameter store.
    #[must_use]
    pub fn of(retained: Retained, stored: Option<[u32; POSITION_RECORD_WORDS]>) -> Start {
        match (retained, stored.map(PositionRecord::from_words)) {
            (Retained::Words(words), record) => {
                Start::Retained(RetainedState::from_words(&words).with(record.unwrap_or_default()))
            }
            (Retained::Nothing, None) => Start::First,
            (Retained::Nothing, Some(record)) => Start::Lost(record),
            (Retained::Damaged, record) => Start::Damaged(record.unwrap_or(PositionRecord::UNKNOWN)),
        }
    }

    /// The retained state with which a start begins.
    #[must_use]
    pub fn retained_state(&self) -> RetainedState {
        match *self {
            Start::First => RetainedState::default(),
            Start::Retained(retained) => retained,
            Start::Lost(record) | Start::Damaged(record) => record.retained_state(),
        }
    }
}

/// Record of the encoder in the parameter store: its presence says that there was a start before. It holds the
/// operating time, and which absolute sensors need retained memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PositionRecord {
    /// Operating time in 0.1 h.
    tenths: u32,
    needs_memory: [bool; 2],
}

/// Shortest time between two stores, in tenths of an hour.
const INTERVAL: u32 = 10;
/// In a long run the interval is the run divided by this number, so a loss of power costs at most this part of the run.
const PART: u32 = 8;

impl PositionRecord {
    /// Nothing is known, and everything may have been lost.
    const UNKNOWN: PositionRecord = PositionRecord { tenths: 0, needs_memory: [true; 2] };

    /// Takes the record from the retained words.
    #[must_use]
    pub fn of(retained: &[u32; RETAINED_WORDS]) -> PositionRecord {
        let RetainedState { channels: [first, second], operating_time } = RetainedState::from_words(retained);
        PositionRecord {
            tenths: operating_time.tenths,
            needs_memory: [first, second].map(|channel| channel.trust.has(Trust::NEEDS_MEMORY)),
        }
    }

    /// The stored form.
    #[must_use]
    pub fn to_words(self) -> [u32; POSITION_RECORD_WORDS] {
        let [first, second] = self.needs_memory;
        [self.tenths, u32::from(first) | u32::from(second) << 1]
    }

    /// From the stored form. Every content is valid.
    #[must_use]
    pub fn from_words([tenths, flags]: [u32; POSITION_RECORD_WORDS]) -> PositionRecord {
        PositionRecord { tenths: tenths.min(LAST), needs_memory: [flags & 1 != 0, flags & 2 != 0] }
    }

    /// Whether the record should be stored now, when the parameter store holds `stored` and the run began with `start`.
    /// The record is stored at once when a sensor starts or ceases to need retained memory, else once an hour, and more
    /// rarely in a long run.
    #[must_use]
    pub fn is_due(self, stored: PositionRecord, start: PositionRecord) -> bool {
        let run = self.tenths.saturating_sub(start.tenths);
        let interval = INTERVAL.max(run / PART);
        self.needs_memory != stored.needs_memory || self.tenths >= stored.tenths.saturating_add(interval)
    }

    fn retained_state(self) -> RetainedState {
        let operating_time = OperatingTime { tenths: self.tenths, millis: 0 };
        RetainedState { channels: self.needs_memory.map(RetainedChannel::forgotten), operating_time }
    }
}

/// Words per channel.
const CHANNEL: usize = 4;
const _: () = assert!(RetainedState::WORDS == 2 * CHANNEL + 2);

impl RetainedState {
    /// Words of the stored form.
    pub const WORDS: usize = RETAINED_WORDS;

    /// The stored form. It has no checksum: the caller adds one.
    #[must_use]
    #[inline(never)]
    pub fn to_words(&self) -> [u32; RetainedState::WORDS] {
        let OperatingTime { tenths, millis } = self.operating_time;
        let [[a0, a1, a2, a3], [b0, b1, b2, b3]] = self.channels.map(RetainedChannel::to_words);
        [a0, a1, a2, a3, b0, b1, b2, b3, tenths, millis]
    }

    /// From the stored form. Every content is valid: a channel that fits no sensor is not used.
    #[must_use]
    pub fn from_words(words: &[u32; RetainedState::WORDS]) -> RetainedState {
        let ([first, second], &[tenths, millis]) = words.as_chunks() else { return RetainedState::default() };
        let channels = [first, second].map(RetainedChannel::from_words);
        RetainedState { channels, operating_time: OperatingTime { tenths, millis } }
    }

    /// Takes the later of the two operating times: the retained memory may be older than the parameter store.
    fn with(mut self, stored: PositionRecord) -> RetainedState {
        if stored.tenths > self.operating_time.tenths {
            self.operating_time = OperatingTime { tenths: stored.tenths, millis: 0 };
        }
        self
    }
}

/// Marks the layout of the words: words of another layout say nothing about the position.
const LAYOUT: u8 = 2;

impl RetainedChannel {
    /// Words of the stored form.
    pub(super) const WORDS: usize = CHANNEL;

    /// The stored form.
    #[inline]
    pub(super) fn to_words(self) -> [u32; CHANNEL] {
        let Trust { users, flags } = self.trust;
        let [total, total_high] = halves(self.total.cast_unsigned());
        [u32::from_le_bytes([self.kind, users, flags, LAYOUT]), self.resolution, total, total_high]
    }

    #[inline(never)]
    fn from_words(words: &[u32; CHANNEL]) -> RetainedChannel {
        let [first, resolution, total, total_high] = *words;
        let [kind, users, flags, layout] = first.to_le_bytes();
        if first != 0 && layout != LAYOUT {
            return RetainedChannel::forgotten(true);
        }
        let total = whole([total, total_high]).cast_signed();
        RetainedChannel { kind, resolution, total, trust: Trust { users, flags } }
    }
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
            (users, flags) in any::<(u8, u8)>(),
        ) -> RetainedChannel {
            RetainedChannel { kind, resolution, total, trust: Trust { users, flags } }
        }
    }

    proptest! {
        #[test]
        fn retained_words_read_back(channels in prop::array::uniform2(any_channel()), tenths: u32, millis: u32) {
            let retained = RetainedState { channels, operating_time: OperatingTime { tenths, millis } };
            prop_assert_eq!(RetainedState::from_words(&retained.to_words()), retained);
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
        let record = |tenths| PositionRecord { tenths, ..PositionRecord::default() };
        let mut stored = record(start);
        let mut saves = Vec::new();
        for tenths in start..=start + 10 * hours {
            if record(tenths).is_due(stored, record(start)) {
                stored = record(tenths);
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
        let (without, with) = (
            PositionRecord::default(),
            PositionRecord { needs_memory: [false, true], ..PositionRecord::default() },
        );
        assert!(with.is_due(without, without) && without.is_due(with, with) && !with.is_due(with, without));
        assert_eq!(PositionRecord::from_words(with.to_words()), with);
    }
}
