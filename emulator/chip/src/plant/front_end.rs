//! The board's analogue front end, as ratios of VDDA. The values are those of a NUCLEO as docs/board.md wires it.
//!
//! ```text
//! supply 5 V ──┬── transducer ──[ divider 0.6 ]── PA0      10 % of the supply at 0 Pa, 90 % at 1 MPa
//!              └───────────────[ divider 0.6 ]── PA1
//! VDDA ── 10 kohm ──┬── PC2
//!                   └── thermistor ── ground               10 kohm at 25 degrees Celsius, beta 3950 K
//! ```
//!
//! The transducer is ratiometric, so the ratio of PA0 to PA1 is the pressure at any supply voltage. A broken wire leaves
//! PA0 to the divider's lower resistor: 0 V. A broken wire of the thermistor leaves PC2 to the resistor to VDDA. The
//! chip's own temperature sensor and reference follow the factory calibration words in system memory (DS10693,
//! temperature sensor and reference voltage).

/// The circuits between sensors and chip, and the sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontEnd {
    /// Supply of the transducer in volts.
    pub supply: f64,
    /// The ratio of both dividers.
    pub divider: f64,
    /// The output of the transducer at 0 Pa and at full scale, as ratios of its supply.
    pub output: (f64, f64),
    /// Full scale of the transducer in pascal.
    pub full_scale: f64,
    /// Resistance of the thermistor at 25 degrees Celsius.
    pub thermistor: f64,
    /// Beta of the thermistor in kelvin.
    pub beta: f64,
    /// The resistor from the thermistor to VDDA.
    pub series: f64,
    /// The upper and the lower resistor of both dividers in parallel.
    pub divided: f64,
}

impl FrontEnd {
    /// The resistance of the source at an input of ADC1 in ohms; `None` for an input that the board does not use. The
    /// thermistor is taken as cold, so that the resistor to VDDA counts alone.
    pub(crate) fn source_resistance(&self, channel: u32) -> Option<f64> {
        match channel {
            0 | 1 => Some(self.divided),
            12 => Some(self.series),
            _ => None,
        }
    }
}

impl Default for FrontEnd {
    fn default() -> Self {
        let (supply, divider, output, full_scale) = (5.0, 0.6, (0.1, 0.9), 1_000_000.0);
        Self {
            supply,
            divider,
            output,
            full_scale,
            thermistor: 10_000.0,
            beta: 3950.0,
            series: 10_000.0,
            divided: 6_000.0,
        }
    }
}

/// VDDA at which the factory calibrates, in volts.
const CALIBRATION_VDDA: f64 = 3.3;
/// Number of codes of a 12-bit conversion.
const CODES: f64 = 4096.0;

/// Code of the temperature sensor at 30 degrees Celsius and 3.3 V: 0.7725 V.
pub(crate) const TS_CAL1: u16 = 959;
/// Code of the temperature sensor at 110 degrees Celsius and 3.3 V: 0.9725 V.
pub(crate) const TS_CAL2: u16 = 1207;
/// Code of the 1.21 V reference at 3.3 V.
pub(crate) const VREFIN_CAL: u16 = 1502;

/// The temperature of the thermistor's resistance: 25 degrees Celsius.
const THERMISTOR_KELVIN: f64 = 298.15;
const CAL1_KELVIN: f64 = 273.15 + 30.0;
const CAL2_KELVIN: f64 = 273.15 + 110.0;
/// Voltage of the internal reference in volts.
const VREFINT: f64 = 1.21;

/// Supplies of the board in volts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rails {
    /// Supply of the transducer: 5 V.
    pub transducer: f64,
    /// Supply and reference of the ADC: 3.3 V.
    pub vdda: f64,
}

impl Rails {
    pub(super) fn new(front_end: &FrontEnd) -> Self {
        Self { transducer: front_end.supply, vdda: CALIBRATION_VDDA }
    }

    /// The internal temperature sensor: the straight line through its two calibration points.
    pub(super) fn temperature_ratio(&self, kelvin: f64) -> f64 {
        let (low, high) = (f64::from(TS_CAL1), f64::from(TS_CAL2));
        let code = low + (high - low) * (kelvin - CAL1_KELVIN) / (CAL2_KELVIN - CAL1_KELVIN);
        code / CODES * CALIBRATION_VDDA / self.vdda
    }

    /// The internal reference.
    pub(super) fn reference_ratio(&self) -> f64 {
        VREFINT / self.vdda
    }
}

impl FrontEnd {
    /// The voltage of PA0 as a ratio of VDDA; `output` is a ratio of the transducer's supply.
    pub(super) fn output_ratio(&self, output: f64, rails: Rails) -> f64 {
        output * self.supply_ratio(rails)
    }

    /// The voltage of PA1, as a ratio of VDDA.
    pub(super) fn supply_ratio(&self, rails: Rails) -> f64 {
        rails.transducer * self.divider / rails.vdda
    }

    /// The output of the transducer at a pressure in pascal, as a ratio of its supply; limited to its rails.
    pub(super) fn transducer(&self, pascal: f64) -> f64 {
        let (zero, full) = self.output;
        (zero + (full - zero) * pascal / self.full_scale).clamp(0.0, 1.0)
    }

    /// The voltage across the thermistor at a temperature in kelvin, as a ratio of VDDA.
    pub(super) fn thermistor(&self, kelvin: f64) -> f64 {
        let resistance = self.thermistor * (self.beta * (1.0 / kelvin - 1.0 / THERMISTOR_KELVIN)).exp();
        1.0 / (1.0 + self.series / resistance)
    }
}

/// The 12-bit code of a ratio of VDDA: the first transition is at half a code.
pub(crate) fn quantise(ratio: f64) -> u32 {
    // The cast saturates at 0 for a voltage below ground.
    (ratio * CODES).round().min(CODES - 1.0) as u32
}
