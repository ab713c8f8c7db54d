//! Tests that the plots and tables in docs/ agree with the present chain, and with theory.

use profiles::encoder::SENSOR_POSITION_ERROR;

use crate::encoder::{Disturbance, turn};
use crate::files;
use crate::resolution::resolution;
use crate::response::{Filter, delay, settling, trace};
use crate::stimulus::Stimulus;

const CONSTANTS: [u8; 5] = [1, 2, 10, 100, 255];

#[test]
fn the_plots_and_tables_are_up_to_date() {
    for file in files() {
        let text = std::fs::read_to_string(&file.path).unwrap_or_default();
        let path = file.path.display();
        assert!(
            text == file.text,
            "{path} is out of date: run `cargo xtask plots` and commit what it writes"
        );
    }
}

#[test]
fn without_a_filter_the_output_is_one_sample_old() {
    for (ms, bar) in trace(Filter::SHOWN[0], Stimulus::Step) {
        // All conversions of the millisecond that ends at the step are before the step.
        assert_eq!(bar.to_bits(), if ms <= 10.0 { 0_f64 } else { 5.0 }.to_bits(), "{ms}");
    }
    for (ms, bar) in trace(Filter::SHOWN[0], Stimulus::Ramp).into_iter().skip(11).take(70) {
        let input = |ms: f64| Stimulus::Ramp.at(ms) / 1e5;
        assert!(input(ms - 1.0) < bar && bar < input(ms), "{ms}");
    }
}

#[test]
fn the_moving_average_settles_as_a_geometric_series() {
    for constant in CONSTANTS {
        let filter = Filter { kind: 1, constant };
        let rest: f64 = 1.0 - 1.0 / f64::from(constant);
        for missing in [0.1, 0.01, 0.001] {
            let expected = if constant == 1 { 1.0 } else { (f64::ln(missing) / rest.ln()).ceil() };
            assert!((settling(filter, missing) as f64 - expected).abs() <= 0.0, "{constant} {missing}");
        }
        let (least, most) = delay(filter);
        let behind = f64::from(constant) - 1.0;
        assert!((least - behind).abs() < 0.01 && (most - behind).abs() < 0.01, "{constant}: {least} {most}");
    }
}

#[test]
fn the_repeating_average_settles_with_its_second_block() {
    for constant in CONSTANTS {
        let filter = Filter { kind: 2, constant };
        // The step comes with the second sample of the first block, so that 1 / N of the step is missing.
        let n = f64::from(constant);
        for missing in [0.1, 0.01, 0.001_f64] {
            let blocks = if 1.0 / n <= missing { 1.0 } else { 2.0 };
            let expected = if constant == 1 { 1.0 } else { blocks * n - 1.0 };
            assert!((settling(filter, missing) as f64 - expected).abs() <= 0.0, "{constant} {missing}");
        }
        let (least, most) = delay(filter);
        // The middle of the block at its end, and the additional time for which the value is held.
        assert!(
            (least - (n - 1.0) / 2.0).abs() < 0.01 && (most - 1.5 * (n - 1.0)).abs() < 0.01,
            "{constant}"
        );
    }
}

#[test]
fn the_resolution_is_that_of_one_conversion_without_noise() {
    let still = resolution(0.0);
    // The error is a step divided by the square root of 12, which means 12 bits.
    assert!(
        (still.steps - 1.0 / 12_f64.sqrt()).abs() < 0.005 && (still.bits() - 12.0).abs() < 0.03,
        "{still:?}"
    );
    assert!((still.pascal - still.steps * 1e6 / (0.8 * 3724.0)).abs() < 0.5, "{still:?}");
}

#[test]
fn with_noise_sixteen_conversions_are_four_times_as_good_as_one() {
    for noise in [0.5, 1.0, 2.0_f64] {
        let expected = ((noise * noise + 1.0 / 12.0) / 16.0).sqrt();
        let got = resolution(noise).steps;
        assert!((got / expected - 1.0).abs() < 0.03, "{noise}: {got} for {expected}");
    }
    assert!((resolution(0.5).bits() - 13.0).abs() < 0.05);
}

#[test]
fn a_disturbed_reading_is_not_taken_over_and_the_next_good_one_is() {
    for disturbance in [Disturbance::Jump, Disturbance::Silence] {
        let samples = turn(disturbance);
        for sample in &samples {
            let held = &samples[29];
            let expected = if sample.read == Some(sample.shaft) { sample.shaft } else { held.shaft };
            assert_eq!(i64::from(sample.values.position), expected, "{disturbance:?} at {} ms", sample.ms);
        }
        // From the third millisecond on the state reports a position error.
        let is_wrong = |ms: usize| samples[ms].values.sensor_state & SENSOR_POSITION_ERROR != 0;
        assert_eq!([29, 31, 32, 49].map(is_wrong), [false, false, true, true], "{disturbance:?}");
    }
}
