//! The trust in a position: its state after a start, a loss of readings and a preset.
//!
//! A sensor with its code or its index determines a part of the position; the rest is counted, and counting needs an
//! unbroken run. What breaks it, and what follows:
//!
//! * The last sample before a reset or a loss of power saw a shaft that turned, or the shaft turns when the node is
//!   back: the movement in between is unknown.
//! * The memory has not survived a loss of power.
//! * No reading came for so long that the code can have made half a round more or less than expected.
//!
//! Several users (presets of a channel, position units of a lift) have their own zero on one sensor. A preset by one
//! user restores the trust in its own position alone.

use super::{Scale, Sensor, SensorType};

/// All users of a sensor.
pub(super) const ALL: u8 = 0x0F;

/// The source of the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Basis {
    /// The reading alone: the code has a whole number of ranges.
    Code,
    /// The reading, and the number of rounds of a code that the shaft hardly leaves while the power is off.
    LongCode,
    /// The reading, and the number of rounds of a short code.
    ShortCode,
    /// The count, retained through a loss of power.
    Count,
    /// The count since the start, until the index or a preset.
    Start,
}

/// Bits of revolutions from which a code is long: a quarter of it is more than a shaft turns while the power is off.
const LONG: u32 = 6;

impl Basis {
    pub(super) fn of(sensor: &Sensor, scale: &Scale) -> Basis {
        match sensor.kind {
            SensorType::Incremental | SensorType::LinearIncremental => Basis::Start,
            SensorType::IncrementalCounted | SensorType::LinearIncrementalCounted => Basis::Count,
            // The code has a whole number of ranges.
            _ if scale.repeats_after(1 << sensor.bits().min(32)) => Basis::Code,
            // A linear encoder does not leave its code: a rest of less than a unit at its end does not matter.
            SensorType::LinearAbsolute if scale.covers(1 << sensor.bits().min(32)) => Basis::Code,
            SensorType::LinearAbsolute => Basis::LongCode,
            SensorType::MultiTurn if sensor.format.revolution_bits() >= LONG => Basis::LongCode,
            _ => Basis::ShortCode,
        }
    }

    /// Whether the number of rounds of the code matters.
    pub(super) fn has_rounds(self) -> bool {
        matches!(self, Basis::LongCode | Basis::ShortCode)
    }
}

/// The trust in the position of one sensor, in its stored form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Trust {
    /// Low half: a bit for each user for whom turns have been lost; high half: for whom steps may have been lost.
    pub(super) users: u8,
    pub(super) flags: u8,
}

impl Trust {
    /// Nothing is known.
    pub(super) const NONE: Trust = Trust { users: ALL, flags: 0 };
    /// Flag: the index has been seen.
    pub(super) const REFERENCED: u8 = 1 << 0;
    /// Flag: the shaft turned at the last sample, or gave no reading.
    pub(super) const MOVING: u8 = 1 << 1;
    /// Flag: a long code may have wrapped, so the reading alone does not tell the position.
    pub(super) const NEEDS_MEMORY: u8 = 1 << 2;

    /// At the start with the retained trust of this sensor.
    pub(super) fn at_start(retained: Trust, basis: Basis) -> Trust {
        match basis {
            Basis::Code => Trust::default(),
            Basis::Start => Trust::NONE,
            Basis::ShortCode | Basis::Count if retained.has(Trust::MOVING) => retained.unseen(),
            _ => retained,
        }
    }

    pub(super) fn has(self, flag: u8) -> bool {
        self.flags & flag != 0
    }

    /// The users for whom turns have been lost.
    pub(super) fn lost(self) -> u8 {
        self.users & ALL
    }

    /// The users whose position is not known.
    pub(super) fn unknown(self) -> u8 {
        self.users >> 4 | self.lost()
    }

    pub(super) fn lose(&mut self) {
        self.users |= ALL;
    }

    pub(super) fn doubt(&mut self) {
        self.users |= ALL << 4;
    }

    /// After an unseen movement. The place of the index in the count is lost too.
    pub(super) fn unseen(self) -> Trust {
        Trust { users: u8::MAX, flags: self.flags & !Trust::REFERENCED }
    }
}

/// Steps a millisecond by which the speed of a shaft can change in a millisecond, as a part of the fastest movement:
/// from standstill to 12,000 rpm in 32 ms.
const ACCELERATION: u32 = 32;

/// Steps by which a sensor can be away from where an even movement would have brought it in `millis`.
pub(super) fn deviation(fastest: u32, millis: u32) -> u32 {
    let millis = millis.min(0xFFFF);
    let change = (fastest / ACCELERATION).max(1);
    change.saturating_mul(millis * (millis + 1) / 2).min(fastest.saturating_mul(2 * millis))
}

/// Milliseconds without a movement after which a shaft is at rest.
const REST_MILLIS: u8 = 100;

/// Whether a shaft is at rest. A shaft that dithers between two steps is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    anchor: u32,
    millis: u8,
}

impl Rest {
    /// At a start. A shaft that was at rest before still is, unless it moves.
    pub(super) fn new(is_moving: bool) -> Rest {
        Rest { anchor: 0, millis: if is_moving { 0 } else { REST_MILLIS } }
    }

    /// Takes the movement up to now, modulo 2^32; returns whether the shaft has left its place.
    #[inline]
    pub(super) fn follow(&mut self, count: u32) -> bool {
        let is_away = count.wrapping_sub(self.anchor).wrapping_add(1) > 2;
        if is_away {
            *self = Rest { anchor: count, millis: 0 };
        } else {
            self.millis = self.millis.saturating_add(1);
        }
        is_away
    }

    /// Takes a millisecond without a reading.
    pub(super) fn miss(&mut self) {
        self.millis = 0;
    }

    pub(super) fn is_moving(self) -> bool {
        self.millis < REST_MILLIS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shaft_is_at_rest_after_a_tenth_of_a_second_and_during_dither() {
        assert!(!Rest::new(false).is_moving());
        let mut rest = Rest::new(true);
        (0..99).for_each(|n| assert!(!rest.follow(n % 2) && rest.is_moving()));
        rest.follow(0);
        assert!(!rest.is_moving());
        assert!(!rest.follow(u32::MAX) && !rest.is_moving(), "a step either way");
        assert!(rest.follow(2) && rest.is_moving());
        (0..100).for_each(|_| _ = rest.follow(2));
        assert!(!rest.is_moving());
        rest.miss();
        assert!(rest.is_moving());
    }

    #[test]
    fn an_unseen_movement_counts_where_the_reading_does_not_suffice() {
        let turning = Trust { users: 0, flags: Trust::MOVING };
        for (basis, is_lost) in
            [(Basis::Code, false), (Basis::LongCode, false), (Basis::ShortCode, true), (Basis::Count, true)]
        {
            assert_eq!(Trust::at_start(turning, basis).lost() != 0, is_lost, "{basis:?}");
            assert_eq!(Trust::at_start(Trust::default(), basis).lost(), 0, "{basis:?} at rest");
            assert_eq!(Trust::at_start(Trust::NONE, basis).lost() != 0, basis != Basis::Code, "{basis:?}");
        }
    }

    #[test]
    fn the_way_of_a_shaft_is_uncertain_by_its_acceleration_and_never_by_more_than_its_speed() {
        assert_eq!([1, 2, 3, 8].map(|millis| deviation(1640, millis)), [51, 153, 306, 1836]);
        assert_eq!(
            deviation(1640, 1000),
            1640 * 2000,
            "from the fastest one way to the fastest the other way"
        );
        assert_eq!(deviation(u32::MAX, u32::MAX), u32::MAX);
    }
}
