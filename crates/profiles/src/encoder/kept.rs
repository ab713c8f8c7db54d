//! What outlives a loss of power.
//!
//! When to store it: the firmware may copy [`Kept`] to battery-backed RAM after every sample, for that does not wear.
//! To flash it goes when the supply falls, and whenever 6508h has changed, which is every 6 minutes: a record of
//! less than 80 bytes fills a page of 16 KiB in 20 hours, and the 10 000 erasures that a page stands are used up after
//! 23 years with one page, 46 with two.

use super::input::Left;
use super::{Position, SensorType};
use crate::board::{RETAINED_WORDS, Retained};

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

/// What one channel keeps. It is taken back by a channel whose sensor is still the same; its offset only in the same
/// units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeptChannel {
    /// Code of the sensor's type, 0 for a channel that has no position.
    kind: u8,
    /// Steps per turn of a shaft, nm of a rod.
    resolution: u32,
    total: i64,
    referenced: bool,
    offset: i32,
    /// Units per turn and range to which the offset belongs, and the direction of counting.
    units: u32,
    range: u64,
    reversed: bool,
}

impl KeptChannel {
    pub(super) fn new(kind: SensorType, resolution: u32, left: Left, position: &Position) -> KeptChannel {
        let scale = position.scale();
        KeptChannel {
            kind: kind.code(),
            resolution,
            total: left.total,
            referenced: left.referenced,
            offset: position.offset(),
            units: scale.units(),
            range: scale.range().get(),
            reversed: scale.is_reversed(),
        }
    }

    /// Where the sensor was left; `None` for one that does not go on from there, or for another one.
    pub(super) fn left(&self, kind: SensorType, resolution: u32) -> Option<Left> {
        let is_same = (self.kind, self.resolution) == (kind.code(), resolution);
        (is_same && kind.is_kept()).then_some(Left { total: self.total, referenced: self.referenced })
    }

    /// The offset (6509h), where it belongs to this scale.
    pub(super) fn offset(&self, kind: SensorType, resolution: u32, scale: &super::Scale) -> Option<i32> {
        let own = (self.kind, self.resolution, self.units, self.range, self.reversed);
        let other = (kind.code(), resolution, scale.units(), scale.range().get(), scale.is_reversed());
        (own == other).then_some(self.offset)
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
    /// Something that is no longer right: positions that would have been kept are lost.
    Damaged,
}

impl From<Retained> for Start {
    fn from(retained: Retained) -> Start {
        match retained {
            Retained::Nothing => Start::First,
            Retained::Words(words) => Start::Kept(Kept::from_words(&words)),
            Retained::Damaged => Start::Damaged,
        }
    }
}

/// Words of a channel.
const CHANNEL: usize = 8;
const _: () = assert!(Kept::WORDS == 2 * CHANNEL + 2);

impl Kept {
    /// Words of its stored form.
    pub const WORDS: usize = RETAINED_WORDS;

    /// The form to be stored. It has no check of its own: whoever stores it adds one.
    #[must_use]
    pub fn to_words(&self) -> [u32; Kept::WORDS] {
        let OperatingTime { tenths, millis } = self.operating_time;
        let [[a0, a1, a2, a3, a4, a5, a6, a7], [b0, b1, b2, b3, b4, b5, b6, b7]] =
            self.channels.map(KeptChannel::to_words);
        [a0, a1, a2, a3, a4, a5, a6, a7, b0, b1, b2, b3, b4, b5, b6, b7, tenths, millis]
    }

    /// From the stored form. Any words are something; a channel that fits no sensor is not used.
    #[must_use]
    pub fn from_words(words: &[u32; Kept::WORDS]) -> Kept {
        let ([first, second], &[tenths, millis]) = words.as_chunks() else { return Kept::default() };
        let channels = [first, second].map(KeptChannel::from_words);
        Kept { channels, operating_time: OperatingTime { tenths, millis } }
    }
}

impl KeptChannel {
    fn to_words(self) -> [u32; CHANNEL] {
        let flags = u32::from_le_bytes([self.kind, self.referenced.into(), self.reversed.into(), 0]);
        let ([total, total_high], [range, range_high]) =
            (halves(self.total.cast_unsigned()), halves(self.range));
        let offset = self.offset.cast_unsigned();
        [flags, self.resolution, total, total_high, offset, self.units, range, range_high]
    }

    fn from_words(words: &[u32; CHANNEL]) -> KeptChannel {
        let [flags, resolution, total, total_high, offset, units, range, range_high] = *words;
        let [kind, referenced, reversed, _] = flags.to_le_bytes();
        KeptChannel {
            kind,
            resolution,
            total: whole([total, total_high]).cast_signed(),
            referenced: referenced != 0,
            offset: offset.cast_signed(),
            units,
            range: whole([range, range_high]),
            reversed: reversed != 0,
        }
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
            (kind, resolution, total, referenced) in any::<(u8, u32, i64, bool)>(),
            (offset, units, range, reversed) in any::<(i32, u32, u64, bool)>(),
        ) -> KeptChannel {
            KeptChannel { kind, resolution, total, referenced, offset, units, range, reversed }
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
}
