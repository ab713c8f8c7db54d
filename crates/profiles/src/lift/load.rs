//! The load measuring unit: from the pressure input to the load of the car and its signals.
//!
//! ```text
//! RawSample ─ ratio ─ Pa (transducer) ─ filter ─ kg (two points) ─ + zero offset ─ 6480h ─ limits (6483h) ─ 6482h
//! ```
//!
//! The calibration consists of two pressures and their loads. For a hydraulic lift these are pressures of the cylinder;
//! for a load cell whose amplifier is on the same input, they are the signals that the input takes for pressures.
//!
//! # Interpretation where CiA 417 is not public
//!
//! The layout of PDO 258 is public; the meaning of its objects is known from products only. These interpretations are
//! made in this module alone:
//!
//! * The load (6480h) is in kg, from 0 to 65535.
//! * The signals (6482h) are zero, half, full and overload, in bits 0 to 3, with the limits 6483h:1 to 4 in the same
//!   order. A limit of 0 switches its bit off.
//! * Zero is signalled below its limit, the others above their limits. If the first limit in use is higher than the
//!   last, all signals are inverted.
//! * The reference weight (6486h) is the load in the car at the moment of the write.
//! * A broken sensor gives the highest possible load, because a car that cannot be weighed must not leave. This load is
//!   kept until the filter is full of samples of an intact sensor.

use crate::board::{ChipThermometer, RawSample};
use crate::pressure::{Calibration, Filter, Recovery};

/// Load signal (6482h): the car is empty.
pub const ZERO_LOAD: u8 = 1 << 0;
/// Load signal (6482h): half load.
pub const HALF_LOAD: u8 = 1 << 1;
/// Load signal (6482h): full load.
pub const FULL_LOAD: u8 = 1 << 2;
/// Load signal (6482h): overload.
pub const OVERLOAD: u8 = 1 << 3;

/// A pressure and its load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Pressure in Pa.
    pub pressure: f32,
    /// Load in kg.
    pub load: f32,
}

/// The parameters of the load measuring unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Characteristic of the transducer.
    pub transducer: Calibration,
    /// Filter type, with the codes of 61A0h of CiA 404.
    pub filter_type: u8,
    /// Filter constant, as in 61A1h of CiA 404.
    pub filter_constant: u8,
    /// Two different pressures; with two equal ones the unit measures no load, as with a broken sensor.
    pub points: [Point; 2],
    /// Added to the load in kg.
    pub offset: f32,
    /// Load signalling limits (6483h) in kg: zero, half, full, overload.
    pub limits: [u16; 4],
    /// Hysteresis of the signals (2310h:3) in kg.
    pub hysteresis: u16,
}

impl Default for Parameters {
    /// 10 bar are 1000 kg; mean of 100 samples; no limits.
    fn default() -> Parameters {
        Parameters {
            transducer: Calibration::default(),
            filter_type: 2,
            filter_constant: 100,
            points: [Point { pressure: 0.0, load: 0.0 }, Point { pressure: 1.0e6, load: 1000.0 }],
            offset: 0.0,
            limits: [0; 4],
            hysteresis: 10,
        }
    }
}

impl Parameters {
    /// Whether the load measuring unit is calibrated, which switches it on.
    #[must_use]
    pub fn is_calibrated(&self) -> bool {
        self.line().is_some()
    }

    /// Factor and constant of the load in kg: `factor * pressure + constant`.
    fn line(&self) -> Option<(f32, f32)> {
        let [a, b] = self.points;
        let factor = (b.load - a.load) / (b.pressure - a.pressure);
        factor.is_finite().then_some((factor, a.load - factor * a.pressure + self.offset))
    }
}

/// Output of the load measuring unit for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Load (6480h) in kg.
    pub load: u16,
    /// Signals (6482h).
    pub signals: u8,
    /// The measured load in kg, negative values included.
    pub measured: f32,
    /// The offset that `measured` includes.
    pub offset: f32,
    /// The sensor or its wiring is broken.
    pub is_broken: bool,
}

/// The load measuring unit and its state.
#[derive(Clone, Copy, Debug)]
pub struct LoadUnit {
    chip: ChipThermometer,
    parameters: Parameters,
    line: Option<(f32, f32)>,
    filter: Filter,
    recovery: Recovery,
    signals: u8,
}

impl LoadUnit {
    /// A unit that has not measured yet, in a chip with this temperature sensor.
    #[must_use]
    #[inline(never)] // Several callers, of which one runs.
    pub fn new(chip: ChipThermometer, parameters: &Parameters) -> LoadUnit {
        let filter = Filter::new(parameters.filter_type, parameters.filter_constant);
        let recovery = Recovery::default();
        LoadUnit { chip, parameters: *parameters, line: parameters.line(), filter, recovery, signals: 0 }
    }

    /// Takes over parameters; they act from the next sample on. The filter restarts only if its own parameters have
    /// changed.
    #[inline(never)]
    pub fn apply(&mut self, parameters: &Parameters) {
        let fresh = LoadUnit::new(self.chip, parameters);
        let filter = if fresh.filter.is_like(&self.filter) { self.filter } else { fresh.filter };
        *self = LoadUnit { filter, recovery: self.recovery, signals: self.signals, ..fresh };
    }

    /// Processes the sums of one millisecond.
    pub fn sample(&mut self, raw: &RawSample) -> Snapshot {
        let p = &self.parameters;
        let is_bad =
            self.line.is_none() || p.transducer.pressure.is_break(raw.ratio()) || raw.is_rail(raw.pressure);
        let is_broken = self.recovery.next(is_bad, &mut self.filter);
        let kelvin = p.transducer.temperature.temperature(raw, self.chip);
        let pascal = self.filter.next(p.transducer.pressure.pressure(raw.ratio(), kelvin));
        let measured = match self.line {
            Some((factor, constant)) if !is_broken => pascal * factor + constant,
            _ => f32::from(u16::MAX),
        };
        let load = rounded(measured);
        let found = signals(load, &p.limits, p.hysteresis, self.signals);
        self.signals = found | if is_broken { OVERLOAD } else { 0 };
        Snapshot { load, measured, signals: self.signals, offset: p.offset, is_broken }
    }
}

/// Rounds to the nearest kg; a negative load gives 0.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // `as` saturates.
fn rounded(load: f32) -> u16 {
    (load + 0.5) as u16
}

/// Object 6482h for a load, after the signals `before`: a signal ends when the load is back by the hysteresis.
#[must_use]
pub fn signals(load: u16, limits: &[u16; 4], hysteresis: u16, before: u8) -> u8 {
    let mut used = limits.iter().filter(|limit| **limit != 0);
    let is_inverted = match (used.next(), used.next_back()) {
        (Some(first), Some(last)) => first > last,
        _ => false,
    };
    let bits = [ZERO_LOAD, HALF_LOAD, FULL_LOAD, OVERLOAD];
    limits.iter().zip(bits).filter(|(limit, _)| **limit != 0).fold(0, |signals, (limit, bit)| {
        let is_above = (bit == ZERO_LOAD) == is_inverted;
        let back = if before & bit == 0 { 0 } else { hysteresis };
        let is_set =
            if is_above { load > limit.saturating_sub(back) } else { load < limit.saturating_add(back) };
        if is_set { signals | bit } else { signals }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings of an intact transducer, 10 % to 90 % of its supply for 0 to 10 bar.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn raw(pascal: f64) -> RawSample {
        let pressure = (64_000.0 * (0.1 + 0.8 * pascal / 1.0e6)).round() as u32;
        RawSample { pressure, supply: 64_000, temperature: 0, thermistor: 0, reference: 0, count: 16 }
    }

    fn hydraulic() -> Parameters {
        // An empty car at 20 bar would be beyond the range: 2 bar empty, 6 bar with 800 kg.
        let points = [Point { pressure: 2.0e5, load: 0.0 }, Point { pressure: 6.0e5, load: 800.0 }];
        Parameters {
            filter_type: 0,
            points,
            limits: [50, 300, 600, 660],
            hysteresis: 0,
            ..Parameters::default()
        }
    }

    #[test]
    fn two_points_make_a_line_beyond_both() {
        let mut unit = LoadUnit::new(ChipThermometer::UNKNOWN, &hydraulic());
        for (pascal, load) in [(2.0e5, 0), (3.0e5, 200), (6.0e5, 800), (8.0e5, 1200), (1.0e5, 0)] {
            let snapshot = unit.sample(&raw(pascal));
            assert_eq!((snapshot.load, snapshot.is_broken), (load, false), "{pascal}");
        }
        assert!((unit.sample(&raw(1.0e5)).measured + 200.0).abs() < 0.1, "below zero");
    }

    #[test]
    fn the_line_goes_through_both_points() {
        let points = [Point { pressure: 2.0e5, load: 100.0 }, Point { pressure: 6.0e5, load: 300.0 }];
        let own = Parameters { points, ..hydraulic() };
        assert!(own.is_calibrated());
        let loads = [2.0e5, 4.0e5, 6.0e5]
            .map(|pascal| LoadUnit::new(ChipThermometer::UNKNOWN, &own).sample(&raw(pascal)).load);
        assert_eq!(loads, [100, 200, 300]);
    }

    #[test]
    fn signals_are_the_bits_0_to_3() {
        assert_eq!([ZERO_LOAD, HALF_LOAD, FULL_LOAD, OVERLOAD], [1, 2, 4, 8]);
    }

    #[test]
    fn every_signal_has_its_limit() {
        for (load, expected) in [
            (0, ZERO_LOAD),
            (49, ZERO_LOAD),
            (50, 0),
            (300, 0),
            (301, HALF_LOAD),
            (601, HALF_LOAD | FULL_LOAD),
            (660, HALF_LOAD | FULL_LOAD),
            (661, HALF_LOAD | FULL_LOAD | OVERLOAD),
            (u16::MAX, HALF_LOAD | FULL_LOAD | OVERLOAD),
        ] {
            assert_eq!(signals(load, &[50, 300, 600, 660], 0, 0), expected, "{load}");
        }
    }

    #[test]
    fn a_signal_ends_when_the_load_is_back_by_the_hysteresis() {
        let limits = [50, 300, 600, 650];
        let mut signals_of = 0;
        for (load, is_set) in
            [(650, false), (651, true), (645, true), (641, true), (640, false), (650, false)]
        {
            signals_of = signals(load, &limits, 10, signals_of);
            assert_eq!(signals_of & OVERLOAD != 0, is_set, "{load}");
        }
        for (load, is_set) in [(49, true), (59, true), (60, false), (50, false)] {
            signals_of = signals(load, &limits, 10, signals_of);
            assert_eq!(signals_of & ZERO_LOAD != 0, is_set, "{load}");
        }
        // 650.5 kg with 5 kg of noise.
        let noisy = (0..1000_u16).map(|n| 646 + n * 7 % 11);
        let overloads = noisy.map(|load| {
            signals_of = signals(load, &limits, 10, signals_of);
            signals_of & OVERLOAD
        });
        let mut changes: Vec<u8> = overloads.collect();
        changes.dedup();
        assert!(changes.len() <= 2, "{changes:?}");
    }

    #[test]
    fn a_limit_of_zero_switches_its_bit_off() {
        assert_eq!(signals(0, &[0; 4], 0, 0), 0);
        assert_eq!(signals(u16::MAX, &[0; 4], 0, 0), 0);
        assert_eq!(signals(1000, &[50, 0, 0, 660], 0, 0), OVERLOAD);
        assert_eq!(signals(10, &[50, 0, 0, 0], 0, 0), ZERO_LOAD, "one limit is in no order");
        assert_eq!(signals(700, &[0, 0, 0, 660], 0, 0), OVERLOAD);
        assert_eq!(signals(10, &[50, 0, 0, 50], 0, 0), ZERO_LOAD, "equal limits do not fall");
    }

    #[test]
    fn limits_that_fall_are_those_of_a_value_that_falls() {
        for (load, expected) in [(1000, ZERO_LOAD), (900, 0), (500, 0), (399, HALF_LOAD), (99, 14)] {
            assert_eq!(signals(load, &[900, 400, 200, 100], 0, 0), expected, "{load}");
        }
    }

    #[test]
    fn a_broken_sensor_is_an_overload() {
        let mut unit = LoadUnit::new(ChipThermometer::UNKNOWN, &hydraulic());
        for pressure in [0, 65_520] {
            let snapshot = unit.sample(&RawSample { pressure, ..raw(0.0) });
            assert_eq!((snapshot.load, snapshot.signals & OVERLOAD), (u16::MAX, OVERLOAD));
            assert!(snapshot.is_broken);
        }
        assert!(unit.sample(&raw(2.0e5)).is_broken, "the sample in which it ends does not count");
        assert_eq!(unit.sample(&raw(2.0e5)).load, 0);
    }

    /// The first load after a fault is neither too small nor signalled as such, whatever the last faulty sample
    /// contains.
    #[test]
    fn after_a_fault_the_first_load_is_the_right_one() {
        for (kind, constant) in [(0, 1), (1, 20), (2, 100)] {
            let parameters = Parameters { filter_type: kind, filter_constant: constant, ..hydraulic() };
            let mut unit = LoadUnit::new(ChipThermometer::UNKNOWN, &parameters);
            unit.sample(&raw(5.5e5));
            unit.sample(&RawSample { pressure: 0, ..raw(0.0) });
            let half_over = unit.sample(&raw(2.5e5));
            let mut held = vec![half_over];
            held.extend((0..constant - 1).map(|_| unit.sample(&raw(5.5e5))));
            for snapshot in held {
                assert_eq!((snapshot.load, snapshot.is_broken), (u16::MAX, true), "{kind}");
                assert_eq!(snapshot.signals & OVERLOAD, OVERLOAD);
            }
            let snapshot = unit.sample(&raw(5.5e5));
            assert_eq!((snapshot.load, snapshot.is_broken), (700, false), "{kind}");
        }
    }

    #[test]
    fn a_ratio_that_is_none_or_an_input_at_a_rail_is_enough_to_be_broken() {
        let open = RawSample { pressure: 640, ..raw(0.0) };
        let rail = RawSample { pressure: 65_520, supply: 70_000, ..raw(0.0) };
        for broken in [open, rail] {
            assert!(LoadUnit::new(ChipThermometer::UNKNOWN, &hydraulic()).sample(&broken).is_broken);
        }
    }

    /// A unit without a characteristic cannot say that there is no overload.
    #[test]
    fn equal_points_are_a_broken_sensor() {
        let points = [Point { pressure: 1.0, load: 0.0 }, Point { pressure: 1.0, load: 100.0 }];
        let parameters = Parameters { points, ..hydraulic() };
        assert!(!parameters.is_calibrated());
        let snapshot = LoadUnit::new(ChipThermometer::UNKNOWN, &parameters).sample(&raw(5.0e5));
        assert_eq!((snapshot.load, snapshot.is_broken), (u16::MAX, true));
        assert_eq!(snapshot.signals & OVERLOAD, OVERLOAD);
    }

    #[test]
    fn a_broken_sensor_is_an_overload_without_limits_too() {
        let parameters = Parameters::default();
        let snapshot = LoadUnit::new(ChipThermometer::UNKNOWN, &parameters)
            .sample(&RawSample { pressure: 0, ..raw(0.0) });
        assert_eq!((snapshot.load, snapshot.signals & OVERLOAD), (u16::MAX, OVERLOAD));
    }

    #[test]
    fn the_mean_of_many_samples_stays_until_the_next() {
        let mut unit = LoadUnit::new(
            ChipThermometer::UNKNOWN,
            &Parameters { filter_type: 2, filter_constant: 4, ..hydraulic() },
        );
        let loads = [2.0e5, 4.0e5, 4.0e5, 4.0e5, 6.0e5].map(|pascal| unit.sample(&raw(pascal)).load);
        assert_eq!(loads, [0, 0, 0, 300, 300]);
        unit.apply(&Parameters { filter_type: 2, filter_constant: 4, offset: 5.0, ..hydraulic() });
        assert_eq!(unit.sample(&raw(6.0e5)).load, 305, "the filter goes on");
    }
}
