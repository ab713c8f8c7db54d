#![allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, clippy::cast_sign_loss)]

use proptest::prelude::*;

use super::*;

impl Scale {
    /// The same scale with the other direction.
    pub(in crate::encoder) fn turned(self) -> Scale {
        Scale { reversed: !self.reversed, ..self }
    }
}

fn rotary(per_revolution: u32, revolutions: u32) -> Native {
    let [per_revolution, revolutions] = [per_revolution, revolutions].map(|n| NonZeroU32::new(n).unwrap());
    Native::Rotary { per_revolution, revolutions }
}

fn linear(step: u32) -> Native {
    Native::Linear { step: NonZeroU32::new(step).unwrap(), steps: MOST }
}

fn scaled(per_revolution: u32, range: u32) -> Settings {
    Settings { reversed: false, scaling: true, per_revolution, gear: NonZeroU16::MIN, range, step: 1 }
}

fn any_settings() -> impl Strategy<Value = (Native, Settings)> {
    let shaft = (1..u32::MAX, 1..=65_536_u32).prop_map(|(steps, revolutions)| rotary(steps, revolutions));
    let rod = (1..u32::MAX).prop_map(linear);
    prop_oneof![3 => shaft, 1 => rod].prop_flat_map(|native| {
        (1..=u32::MAX, 1..=u32::MAX, 1..=u32::MAX, any::<bool>(), any::<bool>()).prop_map(
            move |(per_revolution, step, range, reversed, scaling)| {
                (native, Settings { reversed, scaling, per_revolution, gear: NonZeroU16::MIN, range, step })
            },
        )
    })
}

/// Any sensor with any settings that it can serve.
pub(in crate::encoder) fn any_scale() -> impl Strategy<Value = Scale> {
    any_settings().prop_map(|(native, settings)| Scale::new(&native, &settings).unwrap())
}

pub(in crate::encoder) fn shaft_at(total: i64, scale: &Scale) -> ShaftPosition {
    ShaftPosition::at(total, scale.turn())
}

/// Units per native step as a fraction, from the definitions.
fn ratio(native: &Native, settings: &Settings) -> (i128, i128) {
    match native {
        Native::Rotary { .. } if !settings.scaling => (1, 1),
        Native::Rotary { per_revolution, .. } => {
            (settings.per_revolution.into(), per_revolution.get().into())
        }
        Native::Linear { step, .. } => (step.get().into(), settings.step.into()),
    }
}

proptest! {
    /// The formula of CiA 406 on numbers that cannot overflow: floor(P * 6001h / 6501h) modulo 6002h.
    #[test]
    fn agrees_with_the_formula((native, settings) in any_settings(), total in -(1_i64 << 60)..1 << 60) {
        let scale = Scale::new(&native, &settings).unwrap();
        let (units, steps) = ratio(&native, &settings);
        let seen = i128::from(if settings.reversed { -1 - total } else { total });
        let expected = (seen * units).div_euclid(steps).rem_euclid(i128::from(scale.range().get()));
        prop_assert_eq!(i128::from(scale.value(shaft_at(total, &scale), 0)), expected);
    }

    /// One native step changes the value by its scaled length, rounded down or up, also at the end of the range.
    #[test]
    fn has_no_jump_anywhere(scale in any_scale(), total in -(1_i64 << 60)..1 << 60, offset: i32) {
        let [here, there] = [total, total + 1].map(|total| scale.value(shaft_at(total, &scale), offset));
        let way = if scale.is_reversed() { scale.subtract(here, there) } else { scale.subtract(there, here) };
        let (units, turn, range) = (u64::from(scale.units()), u64::from(scale.turn().get()), scale.range().get());
        let worth = [units / turn, units.div_ceil(turn)].map(|units| units % range);
        prop_assert!(worth.contains(&u64::from(way)), "{} to {}", here, there);
    }

    /// Within one range the value of a shaft that turns forwards never falls.
    #[test]
    fn is_monotonic(scale in any_scale(), from in any::<u32>(), by in 0..=u32::MAX) {
        let scale = if scale.is_reversed() { scale.turned() } else { scale };
        let (first, second) = (i64::from(from), i64::from(from) + i64::from(by));
        let units = |total: i64| i128::from(total) * i128::from(scale.units()) / i128::from(scale.turn().get());
        prop_assume!(units(second) < i128::from(scale.range().get()));
        let [first, second] = [first, second].map(|total| scale.value(shaft_at(total, &scale), 0));
        prop_assert!(first <= second);
    }

    #[test]
    fn sums_and_differences_are_modular(scale in any_scale(), a: u32, b: u32) {
        let range = scale.range().get();
        let (a, b) = ((u64::from(a) % range) as u32, (u64::from(b) % range) as u32);
        prop_assert_eq!(u64::from(scale.add(a, b)), (u64::from(a) + u64::from(b)) % range);
        prop_assert_eq!(scale.add(scale.subtract(a, b), b), a);
    }
}

#[test]
fn a_turn_or_a_range_of_nothing_is_refused() {
    let native = rotary(4096, 16);
    for (per_revolution, range) in [(0, 1), (4096, 0)] {
        assert_eq!(Scale::new(&native, &scaled(per_revolution, range)), None);
    }
    for all in [4096, 65_537, u32::MAX] {
        assert!(Scale::new(&native, &scaled(all, all)).is_some(), "the whole of UNSIGNED32 (CiA 406, 7.2.2)");
    }
}

#[test]
fn refuses_a_preset_outside_of_the_range() {
    let scale = Scale::new(&rotary(4096, 16), &scaled(360, 3600)).unwrap();
    assert_eq!(scale.offset_for(3600, ShaftPosition::default()), None);
    assert_eq!(scale.offset_for(3599, ShaftPosition::default()), Some(-1));
}

#[test]
fn without_scaling_the_largest_sensor_fits_the_value() {
    assert_eq!(Scale::unscaled(&rotary(u32::MAX, 65_536), false).range(), MOST);
}

/// A linear encoder of 1 um with a measuring step of 5 um, and one of 5 nm with a measuring step of 3 um.
#[test]
fn a_rod_counts_in_its_measuring_step() {
    for (native, step, moved, expected) in [(1000, 5000, 26, 5), (5, 3000, 1199, 1), (5, 3000, 1200, 2)] {
        let settings = Settings { step, ..scaled(1, 1000) };
        let scale = Scale::new(&linear(native), &settings).unwrap();
        assert_eq!(scale.value(shaft_at(moved, &scale), 0), expected);
        assert_eq!(scale.value(shaft_at(-1, &scale), 0), 999);
    }
}

proptest! {
    /// For any length of travel: floor(P * length of a step / unit), modulo all positions that the sensor
    /// distinguishes.
    #[test]
    fn a_way_is_never_rounded(
        exponent in 0..20_u32, revolutions in 1..=65_536_u32, travel in 1..=10_000_000_u32, step in 1..=u32::MAX,
        rod: bool, total in -(1_i64 << 50)..1 << 50,
    ) {
        let native = if rod { linear(travel) } else { rotary(1 << exponent, revolutions) };
        let along = Scale::along(&native, NonZeroU32::new(travel).unwrap(), NonZeroU32::new(step).unwrap());
        let (way, unit) = match native {
            Native::Rotary { .. } => (i128::from(travel) * 1000, i128::from(step) << exponent),
            Native::Linear { .. } => (i128::from(travel), i128::from(step)),
        };
        let Some(scale) = along else {
            let is_nothing = i128::from(native.steps().get()) * way < unit;
            let is_long = unit >> exponent.min(unit.trailing_zeros()) > 1 && unit > 1 << 32;
            prop_assert!(way > unit || is_nothing || is_long, "{} / {}", way, unit);
            return Ok(());
        };
        let range = i128::from(scale.range().get());
        prop_assert_eq!(range, (i128::from(native.steps().get()) * way / unit).min(1 << 32));
        let expected = (i128::from(total) * way).div_euclid(unit).rem_euclid(range);
        prop_assert_eq!(i128::from(scale.value(shaft_at(total, &scale), 0)), expected);
    }
}

#[test]
fn a_way_needs_a_step_that_the_sensor_resolves() {
    let along = |native, travel, step| {
        Scale::along(&native, NonZeroU32::new(travel).unwrap(), NonZeroU32::new(step).unwrap())
    };
    // A pulley of 314.159 mm, 4096 steps a revolution, 1 mm: 314 159 units in 4 096 000 steps.
    let scale = along(rotary(4096, 4096), 314_159, 1_000_000).unwrap();
    assert_eq!(u64::from(scale.units()) * 4_096_000, u64::from(scale.turn().get()) * 314_159);
    assert_eq!(scale.range().get(), 4096 * 314_159 / 1000);
    assert_eq!(along(rotary(4096, 1), 4_096, 1000).unwrap().range().get(), 4096);
    assert_eq!(along(rotary(4096, 1), 4_096, 999), None);
    assert_eq!(along(linear(100_000), 1, 500_000).unwrap().range().get(), (1 << 32) / 5);
    assert_eq!(along(linear(100_000), 1, 50_000), None);
    assert_eq!(along(rotary(1, 1), 1, u32::MAX), None, "not even one unit");
}

/// A client that multiplies a position by 6005h:1 gets the travel, whatever bit 2 of 6000h and the sensor are.
#[test]
fn a_measuring_step_acts_without_the_scaling_function_and_may_be_finer_than_the_sensor() {
    let settings = |step| Settings {
        reversed: false,
        scaling: false,
        per_revolution: 1,
        gear: NonZeroU16::MIN,
        range: 1,
        step,
    };
    for (own, step) in
        [(1000, 10_000), (1000, 1000), (10_000, 1000), (4096, 999), (4096, 1), (4_000_000_000, 7)]
    {
        let native = linear(own);
        let scale = Scale::new(&native, &settings(step)).unwrap();
        let positions = i128::from(native.steps().get()) * i128::from(own) / i128::from(step);
        assert_eq!(i128::from(scale.range().get()), positions.min(1 << 32), "{own} {step}");
        for total in [0_i64, 1, 77, 5_000_000] {
            let expected =
                (i128::from(total) * i128::from(own) / i128::from(step)) % i128::from(scale.range().get());
            assert_eq!(i128::from(scale.value(shaft_at(total, &scale), 0)), expected, "{own} {step} {total}");
        }
    }
    assert_eq!(Scale::new(&linear(1000), &settings(0)), None);
}

/// A table with 3600 units behind a gear of 10 to 3: 10,800 units in 10 revolutions of the sensor, without end.
#[test]
fn a_gear_factor_makes_an_endless_axis_of_revolutions_that_do_not_divide() {
    let gear = |per_revolution, revolutions, range| {
        let gear = NonZeroU16::new(revolutions).unwrap();
        Scale::new(&rotary(8192, 4096), &Settings { gear, ..scaled(per_revolution, range) })
    };
    let table = gear(10_800, 10, 3600).unwrap();
    for total in [0_i64, 8191, 27_306, 27_307, 81_920, -1, -81_920, 123_456_789_012] {
        let expected = (i128::from(total) * 10_800).div_euclid(81_920).rem_euclid(3600);
        assert_eq!(i128::from(table.value(shaft_at(total, &table), 0)), expected, "{total}");
    }
    assert!(!table.repeats_after(1 << 25), "the code is no whole number of turns of the table");
    assert!(table.repeats_after(81_920), "ten revolutions are three turns");
    assert!(
        gear(3600, 4096, 3600).unwrap().repeats_after(1 << 25),
        "one turn of the table is the whole code"
    );
    assert_eq!(gear(0, 10, 3600), None);
}
