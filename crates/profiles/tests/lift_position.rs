//! Car position units: the travel of a car, measured by sensors of each kind.
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)]

use profiles::board::{RawEncoder, Retained, SsiFrame};
use std::num::{NonZeroU16, NonZeroU32};

use profiles::encoder::{
    Area, Coding, Command, Format, OVERFLOW, SensorType, Start, UNDERFLOW, WARNING_FREQUENCY,
};
use profiles::lift::position::{
    INVERTED, NO_OFFSET, NOT_REFERENCED, Parameters, PositionUnits, Snapshot, Source, UNKNOWN, UnitParameters,
};

/// Speed of the car in mm/ms.
const FAST: f64 = 2.5;

/// A car with its sensors; `way` is its travel in mm.
struct Car {
    units: PositionUnits,
    parameters: Parameters,
    way: f64,
}

impl Car {
    fn new(parameters: Parameters, way: f64) -> Car {
        let mut car = Car { units: PositionUnits::default(), parameters, way };
        car.apply();
        car.drive(0.0);
        car
    }

    fn apply(&mut self) {
        self.units.apply(&self.parameters);
    }

    /// Moves the car by this distance within a millisecond.
    fn drive(&mut self, millimetres: f64) -> Snapshot {
        self.way += millimetres;
        let steps = self.way / self.step();
        let raw = match self.parameters.sensors.channels[0].kind {
            Some(kind) if kind.is_absolute() => RawEncoder {
                ssi: Some(frame(&self.parameters.sensors.format, steps.floor() as u32)),
                ..RawEncoder::default()
            },
            _ => RawEncoder { counter: steps.floor() as i64 as u16, ..RawEncoder::default() },
        };
        self.units.sample(&raw)
    }

    /// Travel per native step in mm.
    fn step(&self) -> f64 {
        let sensors = &self.parameters.sensors;
        let sensor = sensors.sensor(&sensors.channels[0]).unwrap();
        if sensor.kind.is_linear() {
            return f64::from(sensor.resolution()) * 1e-6;
        }
        f64::from(self.parameters.travel.get()) * 1e-3 / f64::from(sensor.resolution())
    }

    /// Length of a measuring step in mm.
    fn unit(&self) -> f64 {
        f64::from(self.parameters.position_step.get()) / 100.0
    }

    fn position(&mut self) -> u32 {
        self.drive(0.0).units[0].position
    }

    /// As in the node: the offset is computed when the preset is written.
    fn preset(&mut self, preset: u32) -> Option<()> {
        let position = self.position();
        self.parameters.units[0].offset = self.parameters.preset(0, position, preset)?;
        self.apply();
        Some(())
    }
}

/// Frame of an SSI encoder: a high level, the code, and a low level up to the last clock.
fn frame(format: &Format, position: u32) -> SsiFrame {
    let bits = format.position_bits();
    let code = position ^ (position >> 1);
    SsiFrame { bits: (1 << bits | u64::from(code)) << 1, clocks: bits + 2 }
}

fn with_sensor(kind: SensorType, resolution: u32) -> Parameters {
    let mut parameters = Parameters::default();
    let [channel, _] = &mut parameters.sensors.channels;
    channel.kind = Some(kind);
    // The car of some tests moves in leaps.
    channel.fastest = 10_000;
    channel.resolution = NonZeroU32::new(resolution).unwrap();
    parameters.sensors.index = false;
    parameters.sensors.format =
        Format::new(12, 13, Coding::Gray, false, profiles::encoder::Parity::None).unwrap();
    parameters
}

/// A pulley of odd size, a multi-turn encoder on the pulley, a tape with 0.1 mm, an absolute tape with 0.0625 mm.
fn sensors() -> [Parameters; 4] {
    let pulley = Parameters {
        travel: NonZeroU32::new(314_159).unwrap(),
        ..with_sensor(SensorType::IncrementalCounted, 4096)
    };
    [
        pulley,
        with_sensor(SensorType::MultiTurn, 1),
        with_sensor(SensorType::LinearIncremental, 100_000),
        with_sensor(SensorType::LinearAbsolute, 62_500),
    ]
}

fn half_millimetre(parameters: Parameters) -> Parameters {
    Parameters { position_step: NonZeroU16::new(50).unwrap(), ..parameters }
}

#[test]
fn the_position_is_that_of_the_car_to_the_step_at_any_time() {
    for parameters in sensors().into_iter().flat_map(|one| [one, half_millimetre(one)]) {
        let mut car = Car::new(parameters, 0.0);
        car.preset(10_000).unwrap();
        let profile = (0..40_000).map(|t| if t < 20_000 { FAST } else { -FAST });
        for millimetres in profile {
            let position = car.drive(millimetres).units[0].position;
            let exact = 10_000.0 + car.way / car.unit();
            let error = f64::from(position) - exact;
            assert!(error.abs() <= 1.0, "{error} steps at {} mm", car.way);
        }
        assert!(car.way.abs() < 1e-6, "back again");
        assert_eq!(car.position().abs_diff(10_000), 0);
    }
}

#[test]
fn the_speed_is_in_its_own_step() {
    for (step, expected) in [(10, 2500), (1, 25_000), (1000, 25)] {
        for parameters in sensors() {
            let mut car =
                Car::new(Parameters { speed_step: NonZeroU16::new(step).unwrap(), ..parameters }, 0.0);
            (0..500).for_each(|_| _ = car.drive(FAST));
            let speed = car.drive(FAST).units[0].speed;
            assert!((speed - expected).abs() <= expected / 100 + 1, "{speed} for {expected}");
            (0..500).for_each(|_| _ = car.drive(-FAST));
            assert!((car.drive(-FAST).units[0].speed + expected).abs() <= expected / 100 + 1);
        }
    }
}

#[test]
fn a_preset_is_the_position_from_then_on() {
    for parameters in sensors() {
        let mut car = Car::new(parameters, 1234.5);
        for preset in [0, 1, 77, 250_000] {
            car.preset(preset).unwrap();
            assert_eq!(car.position(), preset);
            car.drive(100.0);
            assert!(car.position().abs_diff(preset + 100) <= 1);
        }
    }
}

#[test]
fn a_preset_beyond_the_sensor_is_none() {
    let mut car = Car::new(with_sensor(SensorType::MultiTurn, 1), 0.0);
    // The range: 4096 revolutions of 200 mm.
    assert_eq!(car.preset(4096 * 200), None);
    assert_eq!(car.preset(4096 * 200 - 1), Some(()));
    assert_eq!(car.position(), 4096 * 200 - 1);
    car.drive(1.1);
    assert_eq!(car.position(), 0, "and it goes round");
    assert_eq!(car.parameters.preset(1, 0, 0), None, "a unit without a sensor");
    assert_eq!(car.parameters.preset(4, 0, 0), None, "no unit");
}

#[test]
fn the_other_direction_leaves_the_position_and_turns_the_speed() {
    for parameters in sensors() {
        let mut car = Car::new(parameters, 5000.0);
        car.preset(30_000).unwrap();
        let before = car.position();
        let own = &mut car.parameters.units[0];
        own.operating ^= INVERTED;
        car.parameters.units[0].offset = car.parameters.turned(0, before).unwrap();
        car.apply();
        assert_eq!(car.position(), before);
        (0..400).for_each(|_| _ = car.drive(1.0));
        let values = car.drive(1.0).units[0];
        assert!(values.position.abs_diff(before - 401) <= 1, "{values:?}");
        assert!(values.speed < -900 && values.operating_status & INVERTED != 0);
    }
}

#[test]
fn units_of_one_sensor_have_their_own_zero_direction_and_limits() {
    let mut parameters = with_sensor(SensorType::LinearIncrementalCounted, 100_000);
    let limits = Area { low: 500, high: 1500 };
    let second = UnitParameters {
        source: Some(Source::First),
        operating: INVERTED,
        offset: 2000,
        limits,
        references: 1,
    };
    parameters.units[2] = second;
    parameters.units[0].references = 1;
    let mut car = Car::new(parameters, 0.0);
    let states = [1600.0, 900.0, 400.0, 1.0].map(|way| {
        // Ten metres a second at most: a leap would be a fault of the sensor.
        while (way - car.way).abs() > 10.0 {
            car.drive((way - car.way).clamp(-10.0, 10.0));
        }
        let [first, absent, third, other] = car.drive(way - car.way).units;
        assert_eq!((absent.state, other.state), (UNKNOWN, UNKNOWN), "no sensor");
        assert_eq!(first.position + third.position, 2000);
        assert_eq!(first.state, 0);
        (third.position, third.state)
    });
    assert_eq!(states, [(400, UNDERFLOW), (1100, 0), (1600, OVERFLOW), (1999, OVERFLOW)]);
}

#[test]
fn a_step_finer_than_the_sensor_is_not_consistent() {
    for (kind, resolution, consistent) in [
        (SensorType::LinearAbsolute, 1_000_000, true),
        (SensorType::LinearAbsolute, 1_000_001, false),
        (SensorType::IncrementalCounted, 200, true),
        (SensorType::IncrementalCounted, 199, false),
    ] {
        assert_eq!(with_sensor(kind, resolution).is_consistent(), consistent, "{kind:?} {resolution}");
    }
}

#[test]
fn the_status_describes_the_sensor() {
    let mut car = Car::new(with_sensor(SensorType::MultiTurn, 1), 0.0);
    let values = car.drive(0.0).units[0];
    assert_eq!((values.resolution, values.revolutions, values.operating_status), (8192, 4096, 4));
    assert_eq!(values.state, 0);
    assert_eq!(car.units.sample(&RawEncoder::default()).units[0].state, UNKNOWN, "it does not answer");
}

/// The pulley of a counted sensor turns on from its retained position.
#[test]
fn the_way_outlives_a_loss_of_power() {
    let [pulley, ..] = sensors();
    let mut car = Car::new(pulley, 0.0);
    car.preset(10_000).unwrap();
    (0..8000).for_each(|_| _ = car.drive(FAST));
    let before = car.position();
    car.units = PositionUnits::new(profiles::encoder::Start::Retained(car.units.retained_state()));
    car.apply();
    assert_eq!(car.position(), before);
}

#[test]
fn direction_and_unknown_are_bit_3() {
    assert_eq!((INVERTED, UNKNOWN), (8, 8));
}

#[test]
fn a_source_is_the_number_of_a_channel() {
    let sources = [0, 1, 2, 3].map(Source::from_code);
    assert_eq!(sources, [None, Some(Source::First), Some(Source::Second), None]);
}

/// Within the 819 200 positions of 4096 revolutions of 200 mm.
#[test]
fn the_offset_is_the_one_nearest_to_zero() {
    let parameters = with_sensor(SensorType::MultiTurn, 1);
    for (position, preset, offset) in [
        (0, 0, 0),
        (0, 5, 5),
        (5, 0, -5),
        (0, 409_599, 409_599),
        (0, 409_600, -409_600),
        (0, 819_199, -1),
        (819_199, 0, 1),
    ] {
        assert_eq!(parameters.preset(0, position, preset), Some(offset), "{position} to {preset}");
    }
}

#[test]
fn the_range_is_that_of_the_electronic_count() {
    let mut parameters = with_sensor(SensorType::IncrementalCounted, 4096);
    parameters.sensors.channels[0].counted = NonZeroU16::new(10).unwrap();
    let car = Car::new(parameters, 0.0);
    assert_eq!(car.parameters.preset(0, 0, 1999), Some(-1), "ten turns of 200 mm");
    assert_eq!(car.parameters.preset(0, 0, 2000), None);
}

#[test]
fn settings_of_an_encoder_of_cia_406_have_no_effect() {
    // The second sensor does not resolve the step of 1 mm.
    for resolution in [4096, 199] {
        let plain = with_sensor(SensorType::IncrementalCounted, resolution);
        let mut other = plain;
        other.sensors.operating = u16::MAX;
        other.sensors.module.offset = 12_345;
        other.sensors.channels[0].area = Area { low: 5, high: 1 };
        let mut cars = [plain, other].map(|parameters| Car::new(parameters, 0.0));
        cars[1].parameters.sensors.channels[0].preset = Command { value: 777, count: 1 };
        cars.iter_mut().for_each(Car::apply);
        let [plain, other] = cars.map(|mut car| [0.0, 100.0, 1234.5].map(|way| car.drive(way)));
        assert_eq!(plain, other);
    }
}

#[test]
fn a_car_that_is_faster_than_its_sensor_is_a_warning() {
    for (fastest, warnings) in [(51, 0), (50, WARNING_FREQUENCY)] {
        let mut parameters = with_sensor(SensorType::IncrementalCounted, 4096);
        parameters.sensors.channels[0].fastest = fastest;
        let mut car = Car::new(parameters, 0.0);
        // The car travels 51.2 steps in a millisecond.
        assert_eq!(car.drive(FAST).units[0].warnings, warnings);
    }
}

/// A preset of one unit says nothing about another one on the same sensor.
#[test]
fn a_preset_of_one_unit_does_not_vouch_for_another() {
    let [pulley, ..] = sensors();
    let mut parameters = pulley;
    parameters.units[1].source = Some(Source::First);
    let mut car = Car::new(parameters, 0.0);
    let states = |car: &mut Car| car.drive(0.0).units.map(|unit| unit.state);
    assert_eq!(states(&mut car), [NOT_REFERENCED, NOT_REFERENCED, UNKNOWN, UNKNOWN], "never preset");
    let preset = |car: &mut Car, unit: usize, value| {
        let position = car.drive(0.0).units[unit].reading;
        let offset = car.parameters.preset(unit, position, value).unwrap();
        let own = &mut car.parameters.units[unit];
        (own.offset, own.references) = (offset, own.references + 1);
        car.apply();
    };
    preset(&mut car, 0, 1000);
    assert_eq!(states(&mut car)[..2], [0, NOT_REFERENCED]);
    preset(&mut car, 1, 2000);
    assert_eq!(states(&mut car)[..2], [0, 0]);
    // The battery is empty, and the car has moved.
    car.units = PositionUnits::new(Start::of(Retained::Nothing, Some([0; 2])));
    car.apply();
    assert_eq!(states(&mut car)[..2], [NOT_REFERENCED, NOT_REFERENCED]);
    preset(&mut car, 0, 5000);
    assert_eq!(states(&mut car)[..2], [0, NOT_REFERENCED]);
    let conditions = |car: &mut Car| car.drive(0.0).conditions.position;
    (0..200).for_each(|_| _ = conditions(&mut car));
    assert!(conditions(&mut car), "EMCY as long as one of them is wrong");
    // A reset keeps what is known of each.
    (0..200).for_each(|_| _ = car.drive(0.0));
    car.units = PositionUnits::new(Start::Retained(car.units.retained_state()));
    car.apply();
    assert_eq!(states(&mut car)[..2], [0, NOT_REFERENCED]);
    preset(&mut car, 1, 7000);
    assert_eq!(states(&mut car)[..2], [0, 0]);
    (0..200).for_each(|_| _ = conditions(&mut car));
    assert!(!conditions(&mut car));
}

#[test]
fn an_offset_that_has_lost_its_meaning_needs_a_preset() {
    for parameters in sensors() {
        let mut car = Car::new(parameters, 0.0);
        car.parameters.units[0].references = NO_OFFSET;
        car.apply();
        assert_eq!(car.drive(0.0).units[0].state, NOT_REFERENCED);
        car.parameters.units[0].references = 1;
        car.apply();
        assert_eq!(car.drive(0.0).units[0].state, 0);
    }
}
