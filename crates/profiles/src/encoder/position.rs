//! The position value with its offset: objects 6003h, 6004h and 6509h.

use super::{Scale, ShaftPosition};

/// A scale, the offset, and the position at which the present turn starts.
///
/// The start of the next turn is the start of this one plus the units in a turn, so a sample needs no division.
#[derive(Clone, Copy, Debug)]
pub struct Position {
    scale: Scale,
    offset: i32,
    /// The scale and the offset of the last preset.
    home: (Scale, i32),
    /// Units in a turn, modulo the range.
    per_turn: u32,
    turns: i64,
    start: u32,
}

impl Position {
    /// A position with an offset that [`Scale::offset_for`] has given for this scale.
    #[must_use]
    pub fn new(scale: Scale, offset: i32) -> Position {
        Position {
            scale,
            offset,
            home: (scale, offset),
            per_turn: scale.start(1, 0),
            turns: 0,
            start: scale.start(0, offset),
        }
    }

    /// The scale.
    #[must_use]
    pub fn scale(&self) -> &Scale {
        &self.scale
    }

    /// The offset (6509h).
    #[must_use]
    pub fn offset(&self) -> i32 {
        self.offset
    }

    /// The position value (6004h).
    pub fn value(&mut self, shaft: ShaftPosition) -> u32 {
        let ShaftPosition { turns, step } = self.scale.seen(shaft);
        self.start = match turns.wrapping_sub(self.turns) {
            0 => self.start,
            1 => self.scale.add(self.start, self.per_turn),
            -1 => self.scale.subtract(self.start, self.per_turn),
            _ => self.scale.start(turns, self.offset),
        };
        self.turns = turns;
        self.scale.add(self.start, self.scale.within(step))
    }

    /// Makes the value `preset` at the present place of the shaft. A value outside of the range changes nothing.
    #[inline(never)]
    pub fn preset(&mut self, preset: u32, shaft: ShaftPosition) {
        if let Some(offset) = self.scale.offset_for(preset, shaft) {
            *self = Position::new(self.scale, offset);
        }
    }

    /// Takes another scale. A change of direction alone keeps the value. In other units the offset has lost its
    /// meaning: it is 0 until the units of the last preset come back. CiA 406 is silent about both.
    #[inline(never)]
    pub fn rescale(&mut self, scale: Scale, shaft: ShaftPosition) {
        if scale == self.scale {
            return;
        }
        let (home, offset) = self.home;
        if scale.is_like(&self.scale) {
            let value = self.scale.value(shaft, self.offset);
            *self = Position::new(scale, scale.offset_for(value, shaft).unwrap_or(0));
        } else {
            *self = Position::new(scale, if scale == home { offset } else { 0 });
            self.home = (home, offset);
        }
    }
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, clippy::cast_sign_loss)]
mod tests {
    use proptest::prelude::*;

    use super::super::scale::tests::{any_scale, shaft_at};
    use super::*;

    /// A walk of single steps and of jumps over many turns.
    fn any_walk() -> impl Strategy<Value = Vec<i64>> {
        prop::collection::vec(prop_oneof![-1..=1_i64, -10_000..10_000_i64, -(1_i64 << 40)..1 << 40], 1..40)
    }

    proptest! {
        /// Additions give the same value as divisions.
        #[test]
        fn agrees_with_the_scale(
            scale in any_scale(), offset: i32, start in -(1_i64 << 50)..1 << 50, walk in any_walk(),
        ) {
            let mut position = Position::new(scale, offset);
            let mut total = start;
            for steps in walk {
                total += steps;
                let shaft = shaft_at(total, &scale);
                prop_assert_eq!(position.value(shaft), scale.value(shaft, offset));
            }
        }

        #[test]
        fn preset_then_read_gives_the_preset(
            scale in any_scale(), before: i32, total in -(1_i64 << 50)..1 << 50, fraction in 0.0..1.0_f64,
        ) {
            let shaft = shaft_at(total, &scale);
            let preset = (fraction * (scale.range().get() - 1) as f64) as u32;
            let mut position = Position::new(scale, before);
            position.preset(preset, shaft);
            prop_assert_eq!(position.value(shaft), preset);
        }

        #[test]
        fn counting_the_other_way_leaves_the_value(
            scale in any_scale(), offset: i32, total in -(1_i64 << 50)..1 << 50,
        ) {
            let shaft = shaft_at(total, &scale);
            let mut position = Position::new(scale, offset);
            let before = position.value(shaft);
            position.rescale(scale.turned(), shaft);
            prop_assert_eq!(position.value(shaft), before);
            prop_assert_eq!(position.scale().is_reversed(), !scale.is_reversed());
        }
    }
}
