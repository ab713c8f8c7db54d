//! From native steps to measuring units: objects 6000h, 6001h, 6002h, 6005h:1, 6501h and 6502h.

use core::num::{NonZeroU16, NonZeroU32, NonZeroU64};

use super::ShaftPosition;
use super::fraction::Fraction;

/// Number of different values of an UNSIGNED32: more positions cannot be told apart.
const MOST: NonZeroU64 = NonZeroU64::new(1 << 32).unwrap();
/// Steps in a turn of a linear encoder: as many as possible, so that a turn hardly ever ends.
const LONG_TURN: NonZeroU32 = NonZeroU32::new(1 << 31).unwrap();

/// Resolution of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Native {
    /// A rotary encoder.
    Rotary {
        /// Steps per revolution (6501h).
        per_revolution: NonZeroU32,
        /// Revolutions that the sensor distinguishes (6502h).
        revolutions: NonZeroU32,
    },
    /// A linear encoder.
    Linear {
        /// Measuring step in nm (6501h).
        step: NonZeroU32,
        /// Steps that the sensor distinguishes.
        steps: NonZeroU64,
    },
}

impl Native {
    /// Steps that the sensor distinguishes.
    #[must_use]
    pub fn steps(&self) -> NonZeroU64 {
        match *self {
            Native::Rotary { per_revolution, revolutions } => {
                NonZeroU64::from(per_revolution).saturating_mul(revolutions.into())
            }
            Native::Linear { steps, .. } => steps,
        }
    }
}

/// Scaling requested by the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Counts the other way: code sequence of a shaft, measuring direction of a linear encoder (6000h).
    pub reversed: bool,
    /// Scaling function, bit 2 of 6000h.
    pub scaling: bool,
    /// Measuring units per revolution (6001h).
    pub per_revolution: u32,
    /// Revolutions that have the units of 6001h (2114h).
    pub gear: NonZeroU16,
    /// Total measuring range (6002h).
    pub range: u32,
    /// Measuring step of a linear encoder in nm (6005h:1), with and without the scaling function.
    pub step: u32,
}

/// Turns a mechanical position into a position value. Only usable scales can be built.
///
/// The position repeats after `range` units, whatever the ratio of the range to the units per turn. It continues
/// without a jump in both directions for ever, because turns are counted without end (see [`ShaftPosition`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    turn: NonZeroU32,
    units: u32,
    range: NonZeroU64,
    reversed: bool,
    within: Fraction,
}

impl Scale {
    /// The scale of these settings; `None` if the sensor cannot give them (0609 0030h).
    #[must_use]
    pub fn new(native: &Native, settings: &Settings) -> Option<Scale> {
        let (units, turn) = match *native {
            Native::Rotary { .. } if !settings.scaling => {
                return Some(Scale::unscaled(native, settings.reversed));
            }
            Native::Rotary { per_revolution, .. } if settings.gear == NonZeroU16::MIN => {
                (settings.per_revolution, per_revolution)
            }
            Native::Rotary { per_revolution, .. } => {
                let turns = NonZeroU64::from(per_revolution).saturating_mul(settings.gear.into());
                way(NonZeroU32::new(settings.per_revolution)?.into(), turns)?
            }
            Native::Linear { step, .. } => way(step.into(), NonZeroU32::new(settings.step)?.into())?,
        };
        let range = if settings.scaling {
            NonZeroU64::new(settings.range.into()).filter(|_| units > 0)?
        } else {
            whole(native, units, turn).unwrap_or(NonZeroU64::MIN)
        };
        Some(Scale::build(units, turn, range, settings.reversed))
    }

    /// The scale of a travel in units of `step` nm, over all positions that the sensor distinguishes. A shaft travels
    /// `travel` um in a revolution; nothing is rounded, however long the travel gets. `None` if the sensor does not
    /// resolve the step, or if the ratio of both needs more than 32 bits.
    #[must_use]
    pub fn along(native: &Native, travel: NonZeroU32, step: NonZeroU32) -> Option<Scale> {
        let (nanometres, steps) = match *native {
            Native::Rotary { per_revolution, .. } => (u64::from(travel.get()) * 1000, per_revolution),
            Native::Linear { step, .. } => (step.get().into(), NonZeroU32::MIN),
        };
        // Both factors are below 2^32.
        let unit = NonZeroU64::from(steps).saturating_mul(step.into());
        let (units, turn) =
            way(NonZeroU64::new(nanometres)?, unit).filter(|(units, turn)| *units <= turn.get())?;
        Some(Scale::build(units, turn, whole(native, units, turn)?, false))
    }

    /// The scale in the sensor's own steps.
    #[must_use]
    pub fn unscaled(native: &Native, reversed: bool) -> Scale {
        let turn = match *native {
            Native::Rotary { per_revolution, .. } => per_revolution,
            Native::Linear { .. } => LONG_TURN,
        };
        Scale::build(turn.get(), turn, native.steps().min(MOST), reversed)
    }

    fn build(units: u32, turn: NonZeroU32, range: NonZeroU64, reversed: bool) -> Scale {
        Scale { turn, units, range, reversed, within: Fraction::new(units, turn) }
    }

    /// Native steps in a turn. A turn of a linear encoder is a length that is a whole number both of native steps and
    /// of units.
    #[must_use]
    pub fn turn(&self) -> NonZeroU32 {
        self.turn
    }

    /// Units in a turn.
    #[must_use]
    pub fn units(&self) -> u32 {
        self.units
    }

    /// Number of different position values, 2^32 at most.
    #[must_use]
    pub fn range(&self) -> NonZeroU64 {
        self.range
    }

    /// Whether the scale counts the other way.
    #[must_use]
    pub fn is_reversed(&self) -> bool {
        self.reversed
    }

    /// Whether the position is the same after this number of native steps, 2^32 at most.
    pub(super) fn repeats_after(&self, steps: u64) -> bool {
        // A turn and a range have at most 2^32 steps each, so their product fits 64 bits.
        let range = NonZeroU64::from(self.turn).saturating_mul(self.range);
        steps.saturating_mul(self.units.into()) % range == 0
    }

    /// Whether the range is that of a code of this number of native steps, to one unit.
    pub(super) fn covers(&self, steps: u64) -> bool {
        steps.saturating_mul(self.units.into()) / NonZeroU64::from(self.turn) == self.range.get()
    }

    /// Whether both scales count in the same units.
    #[must_use]
    pub fn is_like(&self, other: &Scale) -> bool {
        (self.turn, self.units, self.range) == (other.turn, other.units, other.range)
    }

    /// The position of the shaft in counting direction: unchanged, or as seen from the other end of the shaft.
    #[must_use]
    pub fn seen(&self, shaft: ShaftPosition) -> ShaftPosition {
        if !self.reversed {
            return shaft;
        }
        let step = (self.turn.get() - 1).saturating_sub(shaft.step);
        ShaftPosition { turns: (-1_i64).saturating_sub(shaft.turns), step }
    }

    /// Units from the start of a turn to a step within the turn, modulo the range.
    #[must_use]
    pub fn within(&self, step: u32) -> u32 {
        let units = self.within.of(step);
        match NonZeroU32::new(low_word(self.range.get())) {
            Some(range) if units >= range.get() => units % range,
            _ => units,
        }
    }

    /// Position at the start of a turn, in counting direction, moved by an offset.
    #[must_use]
    #[inline(never)]
    pub fn start(&self, turns: i64, offset: i32) -> u32 {
        // Both factors are below 2^32, and so is the summand: the sum stays below 2^64.
        let units = self.modulo(turns) * u64::from(self.units) + self.modulo(offset.into());
        low_word(units % self.range)
    }

    /// The sum of two positions.
    #[must_use]
    pub fn add(&self, a: u32, b: u32) -> u32 {
        let (sum, range) = (u64::from(a) + u64::from(b), self.range.get());
        low_word(if sum >= range { sum - range } else { sum })
    }

    /// The difference of two positions.
    #[must_use]
    pub fn subtract(&self, a: u32, b: u32) -> u32 {
        let (a, b) = (u64::from(a), u64::from(b));
        low_word(if a >= b { a - b } else { a + self.range.get() - b })
    }

    /// The position this number of units further.
    #[must_use]
    #[inline(never)]
    pub(super) fn moved(&self, position: u32, units: i32) -> u32 {
        self.add(position, low_word(self.modulo(units.into())))
    }

    /// The position value, computed with two divisions; [`Position`](super::Position) computes it faster for every
    /// sample.
    #[must_use]
    pub fn value(&self, shaft: ShaftPosition, offset: i32) -> u32 {
        let seen = self.seen(shaft);
        self.add(self.start(seen.turns, offset), self.within(seen.step))
    }

    /// The offset (6509h) that makes the position value `preset` at this place of the shaft; of the possible offsets,
    /// the one nearest to zero. `None` for a preset outside of the range.
    #[must_use]
    pub fn offset_for(&self, preset: u32, shaft: ShaftPosition) -> Option<i32> {
        let range = self.range.get();
        let offset =
            u64::from(preset).lt(&range).then(|| u64::from(self.subtract(preset, self.value(shaft, 0))))?;
        let signed = i64::try_from(offset).ok()?;
        let folded = if offset >= range.div_ceil(2) { signed - i64::try_from(range).ok()? } else { signed };
        i32::try_from(folded).ok()
    }

    fn modulo(&self, value: i64) -> u64 {
        match (value.unsigned_abs() % self.range, value < 0) {
            (0, _) => 0,
            (rest, true) => self.range.get() - rest,
            (rest, false) => rest,
        }
    }
}

/// Units and steps in the turn of a linear scale: the ratio of a step to a unit in lowest terms, multiplied as far as
/// 32 bits allow. `None` if even the lowest terms do not fit.
fn way(step: NonZeroU64, unit: NonZeroU64) -> Option<(u32, NonZeroU32)> {
    let common = common_divisor(step, unit);
    let units = u32::try_from(step.get() / common).ok()?;
    let turn = NonZeroU32::new(u32::try_from(unit.get() / common).ok()?)?;
    let times = (LONG_TURN.get() / turn).min(u32::MAX.checked_div(units)?).max(1);
    Some((units.saturating_mul(times), turn.saturating_mul(NonZeroU32::new(times)?)))
}

/// All positions that a sensor distinguishes, in units.
fn whole(native: &Native, units: u32, turn: NonZeroU32) -> Option<NonZeroU64> {
    // A product that saturates is longer than any range: a turn has less than 2^32 steps.
    let range = native.steps().get().saturating_mul(units.into()) / NonZeroU64::from(turn);
    NonZeroU64::new(range).map(|range| range.min(MOST))
}

fn common_divisor(a: NonZeroU64, b: NonZeroU64) -> NonZeroU64 {
    let (mut a, mut b) = (a, b.get());
    while let Some(divisor) = NonZeroU64::new(b) {
        (a, b) = (divisor, a.get() % divisor);
    }
    a
}

/// Converts the remainder of a division by a range, which is at most 2^32.
#[allow(clippy::cast_possible_truncation)]
fn low_word(remainder: u64) -> u32 {
    remainder as u32
}

#[cfg(test)]
pub(super) mod tests;
