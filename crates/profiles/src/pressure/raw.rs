//! What the converter delivers once a millisecond.

/// Sums of `count` conversions of 12 bits each, taken in the same millisecond, and the chip's factory calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawSample {
    /// Output of the pressure transducer.
    pub pressure: u32,
    /// Supply of the pressure transducer, through the same divider as its output.
    pub supply: u32,
    /// Internal temperature sensor.
    pub temperature: u32,
    /// Internal voltage reference.
    pub vrefint: u32,
    /// Thermistor, with its resistor to VDDA; 0 where there is none.
    pub thermistor: u32,
    /// Conversions in each sum, at least 1.
    pub count: u16,
    /// Words the chip's maker measured.
    pub factory: FactoryCalibration,
}

/// Conversions that the chip's maker took at VDDA = 3.3 V and left in system memory (STM32F446 datasheet, 6.3.22 and 6.3.24).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FactoryCalibration {
    /// `TS_CAL1`: temperature sensor at 30 degC.
    pub ts_cal1: u16,
    /// `TS_CAL2`: temperature sensor at 110 degC.
    pub ts_cal2: u16,
    /// `VREFINT_CAL`: voltage reference at 30 degC.
    pub vrefint_cal: u16,
}
