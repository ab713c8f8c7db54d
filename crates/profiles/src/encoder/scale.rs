//! From native steps to measuring units: objects 6000h, 6001h, 6002h, 6003h, 6501h, 6502h and 6509h.

use core::num::{NonZeroU32, NonZeroU64};

use super::Shaft;

/// What the sensor itself resolves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Native {
    /// Steps per revolution (6501h).
    pub per_revolution: NonZeroU32,
    /// Revolutions it can tell apart (6502h).
    pub revolutions: NonZeroU32,
}

/// What the user asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Code sequence, bit 0 of 6000h: the position falls when the shaft turns clockwise.
    pub reversed: bool,
    /// Scaling function, bit 2 of 6000h.
    pub scaling: bool,
    /// Measuring units per revolution (6001h).
    pub per_revolution: u32,
    /// Total measuring range (6002h).
    pub range: u32,
}

/// Why settings cannot be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invalid {
    /// 6001h is zero or finer than the sensor.
    PerRevolution,
    /// 6002h is zero or longer than what the sensor can tell apart.
    Range,
}

/// Turns a mechanical position into a position value. Only usable scales can be built.
///
/// The position repeats after `range` units, whatever its ratio to the units per revolution is, and goes on
/// without a jump for ever in both directions, because revolutions are counted without end (see [`Shaft`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    native: NonZeroU32,
    units: NonZeroU32,
    range: NonZeroU64,
    reversed: bool,
}

impl Scale {
    /// Checks the settings against the sensor.
    ///
    /// # Errors
    /// [`Invalid`] names the object to refuse with 0609 0030h.
    pub fn new(native: Native, settings: &Settings) -> Result<Scale, Invalid> {
        let all = NonZeroU64::from(native.per_revolution).saturating_mul(native.revolutions.into());
        let (units, range) = if settings.scaling {
            let units =
                NonZeroU32::new(settings.per_revolution).filter(|units| *units <= native.per_revolution);
            let range = NonZeroU64::new(settings.range.into()).filter(|range| *range <= all);
            (units.ok_or(Invalid::PerRevolution)?, range.ok_or(Invalid::Range)?)
        } else {
            // The position value is an UNSIGNED32: it cannot tell more than 2^32 steps apart.
            (native.per_revolution, all.min(NonZeroU64::new(1 << 32).unwrap_or(all)))
        };
        Ok(Scale { native: native.per_revolution, units, range, reversed: settings.reversed })
    }

    /// Number of different position values.
    #[must_use]
    pub fn range(&self) -> NonZeroU64 {
        self.range
    }

    /// The position without offset.
    #[must_use]
    pub fn position(&self, shaft: Shaft) -> u32 {
        let Shaft { turns, step } = if self.reversed { self.mirrored(shaft) } else { shaft };
        let within = u64::from(step) * u64::from(self.units.get()) / NonZeroU64::from(self.native);
        // Both factors are below 2^32, and so is what is added: the sum stays below 2^64.
        let units = self.modulo(turns) * u64::from(self.units.get()) + within;
        low_word(units % self.range)
    }

    /// The position value: the position moved by the offset of 6509h.
    #[must_use]
    pub fn value(&self, shaft: Shaft, offset: i32) -> u32 {
        let position = u64::from(self.position(shaft));
        low_word((position + self.modulo(offset.into())) % self.range)
    }

    /// The offset (6509h) that makes the position value `preset` here, the one nearest to zero; `None` for a preset
    /// outside of the range.
    #[must_use]
    pub fn offset_for(&self, preset: u32, shaft: Shaft) -> Option<i32> {
        let range = self.range.get();
        let preset = Some(u64::from(preset)).filter(|preset| *preset < range)?;
        let offset = (preset + range - u64::from(self.position(shaft))) % self.range;
        let signed = i64::try_from(offset).ok()?;
        let folded = if offset >= range.div_ceil(2) { signed - i64::try_from(range).ok()? } else { signed };
        i32::try_from(folded).ok()
    }

    /// The shaft as seen from its other end.
    fn mirrored(&self, shaft: Shaft) -> Shaft {
        let step = (self.native.get() - 1).saturating_sub(shaft.step);
        Shaft { turns: (-1_i64).saturating_sub(shaft.turns), step }
    }

    fn modulo(&self, value: i64) -> u64 {
        match (value.unsigned_abs() % self.range, value < 0) {
            (0, _) => 0,
            (rest, true) => self.range.get() - rest,
            (rest, false) => rest,
        }
    }
}

/// The value of a remainder of a range, which is at most 2^32.
#[allow(clippy::cast_possible_truncation)]
fn low_word(remainder: u64) -> u32 {
    remainder as u32
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, clippy::cast_sign_loss)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn native(per_revolution: u32, revolutions: u32) -> Native {
        Native {
            per_revolution: NonZeroU32::new(per_revolution).unwrap(),
            revolutions: NonZeroU32::new(revolutions).unwrap(),
        }
    }

    fn scaled(per_revolution: u32, range: u32) -> Settings {
        Settings { reversed: false, scaling: true, per_revolution, range }
    }

    /// Any sensor with any settings that it can serve.
    fn any_scale() -> impl Strategy<Value = (Native, Settings)> {
        let sensor = (1..u32::MAX, 1..=65_535_u32);
        sensor.prop_flat_map(|(steps, revolutions)| {
            let longest = (u64::from(steps) * u64::from(revolutions)).min(u32::MAX.into()) as u32;
            (1..=steps, 1..=longest, any::<bool>(), any::<bool>()).prop_map(
                move |(units, range, reversed, scaling)| {
                    (native(steps, revolutions), Settings { reversed, scaling, per_revolution: units, range })
                },
            )
        })
    }

    fn shaft_at(total: i128, steps: u32) -> Shaft {
        let steps = i128::from(steps);
        Shaft {
            turns: i64::try_from(total.div_euclid(steps)).unwrap(),
            step: u32::try_from(total.rem_euclid(steps)).unwrap(),
        }
    }

    proptest! {
        /// The formula of CiA 406 on numbers that cannot overflow: floor(P * 6001h / 6501h) modulo 6002h.
        #[test]
        fn agrees_with_the_formula((native, settings) in any_scale(), total in -(1_i128 << 60)..1 << 60) {
            let scale = Scale::new(native, &settings).unwrap();
            let steps = i128::from(native.per_revolution.get());
            let units = if settings.scaling { i128::from(settings.per_revolution) } else { steps };
            let at = if settings.reversed { -1 - total } else { total };
            let expected = (at * units).div_euclid(steps).rem_euclid(i128::from(scale.range().get()));
            let position = scale.position(shaft_at(total, native.per_revolution.get()));
            prop_assert_eq!(i128::from(position), expected);
        }

        #[test]
        fn preset_then_read_gives_the_preset(
            (native, settings) in any_scale(), total in -(1_i128 << 50)..1 << 50, fraction in 0.0..1.0_f64,
        ) {
            let scale = Scale::new(native, &settings).unwrap();
            let shaft = shaft_at(total, native.per_revolution.get());
            let preset = (fraction * (scale.range().get() - 1) as f64) as u32;
            let offset = scale.offset_for(preset, shaft).unwrap();
            prop_assert_eq!(scale.value(shaft, offset), preset);
        }

        /// One native step changes the value by nothing or by one unit, also where the range ends.
        #[test]
        fn has_no_jump_anywhere((native, settings) in any_scale(), total in -(1_i128 << 60)..1 << 60, offset: i32) {
            let scale = Scale::new(native, &settings).unwrap();
            let steps = native.per_revolution.get();
            let here = u64::from(scale.value(shaft_at(total, steps), offset));
            let there = u64::from(scale.value(shaft_at(total + 1, steps), offset));
            let range = scale.range().get();
            let forward = (there + range - here) % range;
            let way = if settings.reversed { (range - forward) % range } else { forward };
            prop_assert!(way <= 1, "{} to {}", here, there);
        }
    }

    #[test]
    fn refuses_what_the_sensor_cannot_resolve() {
        let native = native(4096, 16);
        assert_eq!(Scale::new(native, &scaled(0, 1)), Err(Invalid::PerRevolution));
        assert_eq!(Scale::new(native, &scaled(4097, 1)), Err(Invalid::PerRevolution));
        assert_eq!(Scale::new(native, &scaled(4096, 0)), Err(Invalid::Range));
        assert_eq!(Scale::new(native, &scaled(4096, 65_537)), Err(Invalid::Range));
        assert!(Scale::new(native, &scaled(4096, 65_536)).is_ok());
    }

    #[test]
    fn refuses_a_preset_outside_of_the_range() {
        let scale = Scale::new(native(4096, 16), &scaled(360, 3600)).unwrap();
        assert_eq!(scale.offset_for(3600, Shaft::default()), None);
        assert_eq!(scale.offset_for(3599, Shaft::default()), Some(-1));
    }

    #[test]
    fn without_scaling_the_largest_sensor_fits_the_value() {
        let settings = Settings { reversed: false, scaling: false, per_revolution: 0, range: 0 };
        let scale = Scale::new(native(u32::MAX, 65_535), &settings).unwrap();
        assert_eq!(scale.range().get(), 1 << 32);
    }
}
