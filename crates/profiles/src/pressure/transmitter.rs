//! The transmitter: sensor, pressure channel, temperature channel.

use super::{
    Channel, ChannelParameters, ChannelValues, PressureCalibration, Span, TemperatureCalibration, Unit,
};
use crate::board::{ChipThermometer, Inputs, PowerOn, RawSample};
use crate::profile::Chain;

/// Samples in a second: how often a sensor break is looked for (CiA 404 leaves it to the device).
const SAMPLES_PER_SECOND: u16 = 1000;

/// The calibration made in production: from converter readings to Pa and K.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calibration {
    /// Calibration of the transducer.
    pub pressure: PressureCalibration,
    /// Calibration of the thermometer.
    pub temperature: TemperatureCalibration,
}

impl Calibration {
    /// Whether each reading has one field value, rising with the reading.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.pressure.is_valid() && self.temperature.is_valid()
    }
}

/// All parameters of the transmitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Sub-index 1 of the profile's objects.
    pub pressure: ChannelParameters,
    /// Sub-index 2 of the profile's objects.
    pub temperature: ChannelParameters,
    /// Calibration: from converter readings to field values.
    pub calibration: Calibration,
}

impl Default for Parameters {
    fn default() -> Parameters {
        Parameters {
            pressure: ChannelParameters::new(Unit::BAR, Span { start: 0.0, end: 10.0 }),
            temperature: ChannelParameters::new(Unit::CELSIUS, Span { start: -40.0, end: 125.0 }),
            calibration: Calibration::default(),
        }
    }
}

/// Faults of the sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Conditions {
    /// The transducer or its wiring is broken; checked once a second.
    pub sensor_break: bool,
    /// The pressure input is at a rail of the converter.
    pub pressure_rail: bool,
    /// The temperature cannot be measured: input at a rail, broken thermistor, or a chip without a calibration of its
    /// own sensor.
    pub temperature_rail: bool,
}

/// Output of the transmitter for one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Sub-index 1 of the profile's objects.
    pub pressure: ChannelValues,
    /// Sub-index 2 of the profile's objects.
    pub temperature: ChannelValues,
    /// Faults of the sensors.
    pub conditions: Conditions,
}

/// The whole measuring chain with its state.
#[derive(Clone, Copy, Debug)]
pub struct Transmitter {
    chip: ChipThermometer,
    calibration: Calibration,
    pressure: Channel,
    temperature: Channel,
    conditions: Conditions,
    /// The range of an intact sensor, as a middle and half of a width.
    intact: (f32, f32),
    /// The pressure comes from a faulty sensor, or its filter contains such a sample.
    is_pressure_held: bool,
    /// No fault is present, and no filter contains a sample taken during a fault.
    is_well: bool,
    /// Samples until the next check for a sensor break.
    until_check: u16,
}

impl Transmitter {
    /// A chain that has not measured yet, in a chip with this temperature sensor.
    #[must_use]
    #[inline(never)] // Several callers, of which one runs.
    pub fn new(chip: ChipThermometer, parameters: &Parameters) -> Transmitter {
        Transmitter {
            chip,
            calibration: parameters.calibration,
            pressure: Channel::new(&parameters.pressure),
            temperature: Channel::new(&parameters.temperature),
            conditions: Conditions::default(),
            intact: parameters.calibration.pressure.intact(),
            is_pressure_held: false,
            is_well: true,
            until_check: 0,
        }
    }

    /// Processes the sums of one millisecond.
    pub fn sample(&mut self, raw: &RawSample) -> Snapshot {
        let mut snapshot = Snapshot::default();
        self.measure(raw, &mut snapshot);
        snapshot
    }

    fn measure(&mut self, raw: &RawSample, snapshot: &mut Snapshot) {
        let ratio = raw.ratio();
        let kelvin = self.calibration.temperature.temperature(raw, self.chip);
        let conditions = self.check(raw, ratio, kelvin.is_none());
        let pressure = self.calibration.pressure.pressure(ratio, kelvin);
        snapshot.pressure = self.pressure.sample(pressure, !self.is_pressure_held);
        if kelvin.is_none() {
            snapshot.pressure.status |= self.calibration.pressure.uncompensated();
        }
        // A temperature that cannot be measured reads 0 K, as in a transmitter without a temperature sensor.
        snapshot.temperature = self.temperature.sample(kelvin.unwrap_or(0.0), !conditions.temperature_rail);
        snapshot.conditions = conditions;
    }

    /// The faults of the sensors. A fault lasts until the filter behind the sensor is full of good samples. A ratio that no
    /// intact sensor gives makes the value invalid at once; the break is reported with the next check.
    fn check(&mut self, raw: &RawSample, ratio: f32, has_no_temperature: bool) -> Conditions {
        let (left, is_check) = self.until_check.overflowing_sub(1);
        self.until_check = left;
        let (middle, width) = self.intact;
        if (ratio - middle).abs() > width || is_check || has_no_temperature || !self.is_well {
            let sensor_break = self.calibration.pressure.is_break(ratio);
            let pressure_rail = raw.is_rail(raw.pressure);
            let seen = Conditions { sensor_break, pressure_rail, temperature_rail: has_no_temperature };
            self.judge(is_check, seen);
        }
        self.conditions
    }

    // Most samples are good ones, and their processing time is short.
    #[cold]
    #[inline(never)]
    fn judge(&mut self, is_check: bool, seen: Conditions) {
        let pressure_holds = self.pressure.is_faulty(seen.sensor_break || seen.pressure_rail);
        let temperature_holds = self.temperature.is_faulty(seen.temperature_rail);
        let before = self.conditions;
        if is_check {
            self.until_check = SAMPLES_PER_SECOND - 1;
            self.conditions.sensor_break = seen.sensor_break || before.sensor_break && pressure_holds;
        }
        self.conditions.pressure_rail = seen.pressure_rail || before.pressure_rail && pressure_holds;
        self.conditions.temperature_rail =
            seen.temperature_rail || before.temperature_rail && temperature_holds;
        self.is_pressure_held = pressure_holds;
        self.is_well = self.conditions == Conditions::default() && !pressure_holds && !temperature_holds;
    }
}

impl Chain for Transmitter {
    type Parameters = Parameters;
    type Snapshot = Snapshot;

    fn new(power_on: &PowerOn) -> Transmitter {
        Transmitter::new(power_on.thermometer, &Parameters::default())
    }

    fn apply(&mut self, parameters: &Parameters) {
        self.calibration = parameters.calibration;
        self.intact = parameters.calibration.pressure.intact();
        self.pressure.apply(&parameters.pressure);
        self.temperature.apply(&parameters.temperature);
    }

    fn update(&mut self, inputs: &Inputs, snapshot: &mut Snapshot) {
        self.measure(&inputs.analogue, snapshot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pressure::{Polynomial, STATUS_ABOVE, STATUS_BELOW, STATUS_INVALID};

    /// An intact sensor at 5 bar and 30 degC.
    const GOOD: RawSample = RawSample {
        pressure: 16 * 1000,
        supply: 16 * 2000,
        temperature: 16 * 940,
        reference: 16 * 1500,
        thermistor: 0,
        count: 16,
    };
    /// 940 at 30 degC and 1210 at 110 degC, with the reference at 1500.
    const CHIP: ChipThermometer =
        ChipThermometer { offset: 303.15 - 940.0 * 80.0 / 270.0, slope: 1500.0 * 80.0 / 270.0 };
    /// The wire of the transducer is open: 1 % of the supply.
    const OPEN: RawSample = RawSample { pressure: 16 * 20, ..GOOD };

    #[test]
    fn an_intact_sensor_is_measured() {
        let snapshot = Transmitter::new(CHIP, &Parameters::default()).sample(&GOOD);
        assert_eq!(snapshot.conditions, Conditions::default());
        assert!((snapshot.pressure.process_value - 5.0).abs() < 1e-5);
        assert!((snapshot.temperature.process_value - 30.0).abs() < 1e-3);
        assert_eq!((snapshot.pressure.status, snapshot.temperature.status), (0, 0));
    }

    #[test]
    fn a_break_is_invalid_at_once_and_reported_once_a_second() {
        let mut transmitter = Transmitter::new(CHIP, &Parameters::default());
        transmitter.sample(&GOOD);
        for _ in 1..1000 {
            let snapshot = transmitter.sample(&OPEN);
            assert!(!snapshot.conditions.sensor_break && snapshot.pressure.status & STATUS_INVALID != 0);
        }
        let found = transmitter.sample(&OPEN);
        assert!(found.conditions.sensor_break && found.pressure.status & STATUS_INVALID != 0);
        for _ in 1..1000 {
            assert!(transmitter.sample(&GOOD).conditions.sensor_break);
        }
        assert!(!transmitter.sample(&GOOD).conditions.sensor_break);
    }

    /// A transducer shorted to its supply is above its limits and below the rail of the converter.
    #[test]
    fn a_break_that_ends_before_the_check_is_invalid_too() {
        let shorted = RawSample { pressure: 16 * 2000, ..GOOD };
        let mut transmitter = Transmitter::new(CHIP, &Parameters::default());
        transmitter.sample(&GOOD);
        let status = [shorted, GOOD, GOOD].map(|raw| {
            let snapshot = transmitter.sample(&raw);
            assert_eq!(snapshot.conditions, Conditions::default());
            snapshot.pressure.status
        });
        assert_eq!(
            status,
            [STATUS_INVALID | STATUS_ABOVE, STATUS_INVALID, 0],
            "the sample after a fault settles"
        );
    }

    /// The first valid value after a fault is right, whatever the last faulty sample contains.
    #[test]
    fn a_fault_holds_until_the_filter_is_full_of_good_samples() {
        let rail = RawSample { pressure: 0, ..GOOD };
        let half_over = RawSample { pressure: 16 * 500, ..GOOD };
        let mut parameters = Parameters::default();
        (parameters.pressure.filter_type, parameters.pressure.filter_constant) = (2, 100);
        let mut transmitter = Transmitter::new(CHIP, &parameters);
        transmitter.sample(&GOOD);
        for _ in 0..50 {
            transmitter.sample(&rail);
        }
        let after = |sample: &RawSample, transmitter: &mut Transmitter| {
            let snapshot = transmitter.sample(sample);
            (snapshot.pressure.status & STATUS_INVALID != 0, snapshot.conditions.pressure_rail)
        };
        assert_eq!(after(&half_over, &mut transmitter), (true, true));
        for sample in 1..100 {
            assert_eq!(after(&GOOD, &mut transmitter), (true, true), "{sample}");
        }
        let snapshot = transmitter.sample(&GOOD);
        assert_eq!((snapshot.pressure.status, snapshot.conditions), (0, Conditions::default()));
        assert!((snapshot.pressure.process_value - 5.0).abs() < 1e-5);
    }

    #[test]
    fn a_recovered_temperature_keeps_its_fault_until_the_filter_is_full() {
        let none = RawSample { temperature: 0, ..GOOD };
        let half_over = RawSample { temperature: 16 * 470, ..GOOD };
        let mut transmitter = Transmitter::new(CHIP, &Parameters::default());
        transmitter.sample(&none);
        let snapshot = transmitter.sample(&half_over);
        assert!(snapshot.conditions.temperature_rail && snapshot.temperature.status & STATUS_INVALID != 0);
        assert_eq!(snapshot.pressure.status, 0);
        let snapshot = transmitter.sample(&GOOD);
        assert_eq!((snapshot.conditions, snapshot.temperature.status), (Conditions::default(), 0));
    }

    #[test]
    fn every_fault_makes_its_own_channel_invalid() {
        let rail = RawSample { pressure: 16 * 4095, supply: 16 * 4094, ..GOOD };
        let no_temperature = RawSample { temperature: 0, ..GOOD };
        for (raw, pressure, temperature) in [
            (OPEN, STATUS_INVALID | STATUS_BELOW, 0),
            (rail, STATUS_INVALID | STATUS_ABOVE, 0),
            (no_temperature, 0, STATUS_INVALID | STATUS_BELOW),
        ] {
            // With limits beyond this rail, so that the rail alone is the fault.
            let mut parameters = Parameters::default();
            parameters.calibration.pressure.break_high = 1.1;
            let snapshot = Transmitter::new(CHIP, &parameters).sample(&raw);
            assert_eq!((snapshot.pressure.status, snapshot.temperature.status), (pressure, temperature));
            let conditions = Conditions {
                sensor_break: raw == OPEN,
                pressure_rail: raw == rail,
                temperature_rail: raw == no_temperature,
            };
            assert_eq!(snapshot.conditions, conditions);
        }
    }

    #[test]
    fn a_pressure_without_its_compensation_says_so() {
        let no_temperature = RawSample { temperature: 0, ..GOOD };
        for (drift, status) in [(0.0, 0), (2e-4, 1 << 3)] {
            let mut parameters = Parameters::default();
            parameters.calibration.pressure.zero.linear = drift;
            let mut transmitter = Transmitter::new(CHIP, &parameters);
            assert_eq!(transmitter.sample(&GOOD).pressure.status, 0);
            assert_eq!(transmitter.sample(&no_temperature).pressure.status, status, "{drift}");
        }
    }

    #[test]
    fn new_parameters_hold_from_the_next_sample() {
        let mut transmitter = Transmitter::new(CHIP, &Parameters::default());
        transmitter.sample(&GOOD);
        let mut parameters = Parameters::default();
        parameters.calibration.pressure.end = 2_000_000.0;
        parameters.pressure.offset = 1.0;
        parameters.temperature.offset = -1.0;
        transmitter.apply(&parameters);
        let snapshot = transmitter.sample(&GOOD);
        assert!((snapshot.pressure.process_value - 11.0).abs() < 1e-5);
        assert!((snapshot.temperature.process_value - 29.0).abs() < 1e-3);
    }

    #[test]
    fn a_calibration_is_valid_when_both_are() {
        let good = Calibration::default();
        assert!(good.is_valid());
        let pressure = PressureCalibration { span: Polynomial::constant(0.0), ..good.pressure };
        let temperature = TemperatureCalibration { factor: 0.0, ..good.temperature };
        assert!(!Calibration { pressure, ..good }.is_valid());
        assert!(!Calibration { temperature, ..good }.is_valid());
    }
}
