//! The analogue front end of a board: the circuits between the pins and the sensors, and the sensors (docs/board.md).

/// The front end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrontEnd {
    /// The supply of the transducer in millivolts.
    pub supply: u32,
    /// The divider at PA0 and the one at PA1.
    pub divider: Divider,
    /// The sensor at PA0.
    pub transducer: Transducer,
    /// The sensor at PC2.
    pub thermistor: Thermistor,
}

/// Two resistors in ohms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Divider {
    /// From the sensor to the pin.
    pub upper: u32,
    /// From the pin to ground.
    pub lower: u32,
}

/// A ratiometric pressure transducer: its output is a share of its supply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transducer {
    /// The output without pressure, in permille of the supply.
    pub zero: u32,
    /// The output at the end of the range.
    pub full: u32,
    /// The end of the range in pascal.
    pub range: u32,
}

/// A thermistor (NTC) to ground, with a resistor to VDDA.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Thermistor {
    /// Its resistance at 25 degC in ohms.
    pub ohms: u32,
    /// Its beta in kelvin.
    pub beta: u32,
    /// The resistor to VDDA in ohms.
    pub series: u32,
}

/// The front end of docs/board.md, with the sensors of the default parameters (2200h, 2201h).
pub(super) const DEFAULT: FrontEnd = FrontEnd {
    supply: 5000,
    divider: Divider { upper: 10_000, lower: 15_000 },
    transducer: Transducer { zero: 100, full: 900, range: 1_000_000 },
    thermistor: Thermistor { ohms: 10_000, beta: 3950, series: 10_000 },
};

impl FrontEnd {
    /// The highest voltage at PA0 and PA1 in millivolts.
    #[must_use]
    pub const fn highest_input(&self) -> u32 {
        self.supply * self.divider.lower / (self.divider.upper + self.divider.lower)
    }

    /// The highest source resistance of an analogue input in ohms.
    #[must_use]
    pub const fn source_resistance(&self) -> u32 {
        let Divider { upper, lower } = self.divider;
        let divider = upper * (lower / 100) / ((upper + lower) / 100);
        if divider > self.thermistor.series { divider } else { self.thermistor.series }
    }
}
