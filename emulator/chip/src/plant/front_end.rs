//! The board's analogue front end, as ratios of VDDA.
//!
//! ```text
//! supply 5 V ──┬── transducer ──[ divider 0.66 ]── PA0      10 % of the supply at 0 Pa, 90 % at 1 MPa
//!              └───────────────[ divider 0.66 ]── PA1
//! VDDA ── 10 kohm ──┬── PC2
//!                   └── thermistor ── ground                10 kohm at 25 degrees Celsius, beta 3950 K
//! ```
//!
//! The transducer is ratiometric and both dividers bring 5 V to 3.3 V. So the ratio of PA0 to PA1 is the pressure at
//! any supply voltage. At 5 V, the ratio of PA0 to VDDA equals the ratio of the transducer's output to its supply. A
//! broken wire leaves PA0 to the divider's lower resistor: 0 V. A broken wire of the thermistor leaves PC2 to the
//! resistor to VDDA. The chip's own temperature sensor and reference follow the factory calibration words in system
//! memory (DS10693, temperature sensor and reference voltage).

/// Full scale of the transducer in pascal.
pub const FULL_SCALE: f64 = 1_000_000.0;

/// The ratio of both dividers.
const DIVIDER: f64 = 0.66;
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

/// Resistance of the thermistor at its reference temperature, and of the resistor to VDDA.
const THERMISTOR_OHM: f64 = 10_000.0;
const SERIES_OHM: f64 = 10_000.0;
const THERMISTOR_KELVIN: f64 = 298.15;
const THERMISTOR_BETA: f64 = 3950.0;

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

impl Default for Rails {
    fn default() -> Self {
        Self { transducer: 5.0, vdda: CALIBRATION_VDDA }
    }
}

impl Rails {
    /// The voltage of PA0 as a ratio of VDDA; `output` is a ratio of the transducer's supply.
    pub(super) fn transducer_ratio(&self, output: f64) -> f64 {
        output * self.supply_ratio()
    }

    /// The voltage of PA1, as a ratio of VDDA.
    pub(super) fn supply_ratio(&self) -> f64 {
        self.transducer * DIVIDER / self.vdda
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

/// The output of the transducer at a pressure in pascal, as a ratio of its supply; limited to its rails.
pub(super) fn transducer(pascal: f64) -> f64 {
    (0.1 + 0.8 * pascal / FULL_SCALE).clamp(0.0, 1.0)
}

/// The voltage across the thermistor at a temperature in kelvin, as a ratio of VDDA.
pub(super) fn thermistor(kelvin: f64) -> f64 {
    let resistance = THERMISTOR_OHM * (THERMISTOR_BETA * (1.0 / kelvin - 1.0 / THERMISTOR_KELVIN)).exp();
    1.0 / (1.0 + SERIES_OHM / resistance)
}

/// The 12-bit code of a ratio of VDDA: the first transition is at half a code.
pub(crate) fn quantise(ratio: f64) -> u32 {
    // The cast saturates at 0 for a voltage below ground.
    (ratio * CODES).round().min(CODES - 1.0) as u32
}
