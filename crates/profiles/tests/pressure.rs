//! Any finite parameters and any readings: the transmitter gives finite numbers only, and the order of pressures is
//! preserved.

use profiles::board::{ChipThermometer, RawSample};
use profiles::pressure::{
    Calibration, Channel, ChannelParameters, ChannelValues, Parameters, Polynomial, PressureCalibration,
    STATUS_INVALID, Span, TemperatureCalibration, Thermistor, Thermometer, Transmitter, Unit,
};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::RngSeed;

/// Every run draws the same cases.
fn repeatable() -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        cases: 2000,
        ..Default::default()
    }
}

/// Any finite number: random bits, a usual value, or an end of the range.
fn real() -> impl Strategy<Value = f32> {
    let bits = any::<u32>().prop_map(f32::from_bits).prop_filter("finite", |value| value.is_finite());
    prop_oneof![bits, -1e6_f32..1e6, select(vec![0.0, 1.0, f32::MIN, f32::MAX, f32::MIN_POSITIVE])]
}

fn unit() -> impl Strategy<Value = Unit> {
    let pressure = select(vec![0x22, 0x4E, 0xAB, 0xA0, 0xA1, 0xA2, 0xA4]);
    let temperature = select(vec![0x05, 0x2D, 0xAC]);
    let code = |(unit, prefix): (u32, i8)| unit << 16 | u32::from(prefix.to_le_bytes()[0]) << 24;
    prop_oneof![
        (pressure, -18_i8..=18).prop_map(code).prop_filter_map("a unit", Unit::pressure),
        (temperature, -18_i8..=18).prop_map(code).prop_filter_map("a unit", Unit::temperature),
    ]
}

prop_compose! {
    fn channel()(
        filter_type in 0_u8..4,
        filter_constant in any::<u8>(),
        (scaling_factor, scaling_offset, offset) in (real(), real(), real()),
        unit in unit(),
        digits in 0_u8..=38,
        (start, end) in (real(), real()),
    ) -> ChannelParameters {
        ChannelParameters {
            filter_type, filter_constant, scaling_factor, scaling_offset, offset, digits,
            ..ChannelParameters::new(unit, Span { start, end })
        }
    }
}

prop_compose! {
    fn polynomial()(constant in real(), linear in real(), quadratic in real()) -> Polynomial {
        Polynomial { constant, linear, quadratic }
    }
}

prop_compose! {
    fn calibration()(
        (start, end, reference) in (real(), real(), real()),
        (zero, span) in (polynomial(), polynomial()),
        thermometer in select(vec![Thermometer::Internal, Thermometer::Thermistor]),
        (factor, offset) in (real(), real()),
        (a, b, c, series) in (real(), real(), real(), real()),
    ) -> Calibration {
        let breaks = PressureCalibration::default();
        let thermistor = Thermistor { a, b, c, series, ..Thermistor::default() };
        Calibration {
            pressure: PressureCalibration { start, end, zero, span, reference, ..breaks },
            temperature: TemperatureCalibration { thermometer, factor, offset, thermistor },
        }
    }
}

prop_compose! {
    fn raw()(
        sums in any::<[u32; 5]>(),
        small in any::<[u16; 5]>(),
        is_small in any::<bool>(),
        count in any::<u16>(),
    ) -> RawSample {
        let [pressure, supply, temperature, reference, thermistor] =
            if is_small { small.map(u32::from) } else { sums };
        RawSample { pressure, supply, temperature, reference, thermistor, count }
    }
}

fn is_finite(values: &ChannelValues) -> bool {
    values.field_value.is_finite() && values.process_value.is_finite()
}

/// Polynomials of a transducer with a strong drift; few arbitrary polynomials are valid.
fn rising() -> impl Strategy<Value = Polynomial> {
    (0.1_f32..2.0, -5e-4_f32..5e-4, 0.0_f32..1e-6).prop_map(|(constant, linear, quadratic)| Polynomial {
        constant,
        linear,
        quadratic,
    })
}

proptest! {
    #![proptest_config(repeatable())]

    #[test]
    fn no_channel_gives_anything_but_numbers(
        parameters in channel(),
        inputs in vec(prop_oneof![real(), any::<f32>()], 1..8),
    ) {
        let mut channel = Channel::new(&parameters);
        for input in inputs {
            let values = channel.sample(input, true);
            prop_assert!(is_finite(&values), "{values:?}");
            prop_assert!(input.is_finite() || values.status & STATUS_INVALID != 0);
        }
    }

    #[test]
    fn no_transmitter_gives_anything_but_numbers(
        (pressure, temperature, calibration) in (channel(), channel(), calibration()),
        (offset, slope) in (any::<f32>(), any::<f32>()),
        readings in vec(raw(), 1..4),
    ) {
        let chip = ChipThermometer { offset, slope };
        let mut transmitter = Transmitter::new(chip, &Parameters { pressure, temperature, calibration });
        for reading in readings {
            let snapshot = transmitter.sample(&reading);
            prop_assert!(is_finite(&snapshot.pressure) && is_finite(&snapshot.temperature), "{snapshot:?}");
        }
    }

    #[test]
    fn a_valid_calibration_gives_higher_pressures_for_higher_ratios(
        (zero, span) in (rising(), rising()),
        (start, range) in (-1e6_f32..1e6, 1.0_f32..1e7),
        (a, b) in (0.0_f32..1.0, 0.0_f32..1.0),
        kelvin in 200.0_f32..450.0,
    ) {
        let own = PressureCalibration { start, end: start + range, zero, span, ..Default::default() };
        prop_assume!(own.is_valid());
        let [low, high] = [a.min(b), a.max(b)].map(|ratio| own.pressure(ratio, Some(kelvin)));
        prop_assert!(low <= high && low.is_finite() && high.is_finite(), "{low} {high}");
    }

    #[test]
    fn scaling_is_monotonic(unit in unit(), factor in 0.0_f32..1e6, offset in real(), (a, b) in (real(), real())) {
        let parameters = ChannelParameters {
            scaling_factor: factor,
            offset,
            ..ChannelParameters::new(unit, Span { start: f32::MIN, end: f32::MAX })
        };
        let [low, high] = [a.min(b), a.max(b)].map(|value| Channel::new(&parameters).sample(value, true));
        prop_assert!(low.process_value <= high.process_value);
        prop_assert!(low.process_value16 <= high.process_value16);
        prop_assert!(low.process_value32 <= high.process_value32);
    }
}
