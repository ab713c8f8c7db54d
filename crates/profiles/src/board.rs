//! What the board gives to the profiles and takes from them, as plain values. Every profile sees the same board; which of
//! its inputs are used is a matter of the profile and its parameters.

/// Digital inputs of the board: its buttons.
pub const DIGITAL_INPUTS: usize = 2;
/// Digital outputs of the board: its lamps.
pub const DIGITAL_OUTPUTS: usize = 2;
/// Words that a battery keeps through a loss of power.
pub const RETAINED_WORDS: usize = 10;
/// Words that the parameter store holds of them.
pub const LASTING_WORDS: usize = 2;

/// Everything that was read in one millisecond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inputs {
    /// Analogue inputs.
    pub analogue: RawSample,
    /// Inputs of position sensors.
    pub position: RawEncoder,
    /// Digital inputs, debounced: `true` for a button that is pressed.
    pub digital: [bool; DIGITAL_INPUTS],
}

/// What a profile wants the board to show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// Digital outputs: `true` for a lamp that is lit.
    pub digital: [bool; DIGITAL_OUTPUTS],
}

/// Sums of `count` conversions of 12 bits each, taken in the same millisecond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawSample {
    /// Output of the pressure transducer.
    pub pressure: u32,
    /// Supply of the pressure transducer, through the same divider as its output.
    pub supply: u32,
    /// Temperature sensor in the chip.
    pub temperature: u32,
    /// Voltage reference in the chip.
    pub reference: u32,
    /// Thermistor, with its resistor to the converter's supply; 0 where there is none.
    pub thermistor: u32,
    /// Conversions in each sum, at least 1.
    pub count: u16,
}

/// Largest reading of a 12-bit conversion.
const FULL_SCALE: u32 = 4095;

impl RawSample {
    /// Transducer output divided by transducer supply; 0 without a supply, which counts as a break.
    #[must_use]
    #[allow(clippy::cast_precision_loss)] // Exact up to 2^24: sums of 4096 conversions.
    pub fn ratio(&self) -> f32 {
        if self.supply == 0 { 0.0 } else { self.pressure as f32 / self.supply as f32 }
    }

    /// Whether every conversion of a sum was at an end of the converter's range.
    #[must_use]
    pub fn is_rail(&self, sum: u32) -> bool {
        sum == 0 || sum >= FULL_SCALE * u32::from(self.count)
    }
}

/// Characteristic of the temperature sensor in the chip: `T = offset + slope * temperature / reference`, in K, with the sums
/// of [`RawSample`]. The board knows both numbers from the maker of the chip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChipThermometer {
    /// In K.
    pub offset: f32,
    /// In K.
    pub slope: f32,
}

impl ChipThermometer {
    /// No characteristic is known: nothing is measured.
    pub const UNKNOWN: ChipThermometer = ChipThermometer { offset: f32::NAN, slope: f32::NAN };
}

/// What was read of the position sensors. There is one input of each kind: channels of the same kind share it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RawEncoder {
    /// Timer in encoder mode: all quarter periods, modulo 2^16.
    pub counter: u16,
    /// What the timer stood at when the last index pulse came; `None` when none came since the last sample.
    pub index: Option<u16>,
    /// SSI frame, `None` when none was read.
    pub ssi: Option<SsiFrame>,
    /// More than a millisecond may have passed since the last sample, or an index have come that nobody saw.
    pub has_gap: bool,
    /// The board around the sensors.
    pub board: Board,
}

/// What was clocked in from an absolute encoder with synchronous serial interface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SsiFrame {
    /// The bits, the last one in bit 0.
    pub bits: u64,
    /// How many, from the rest level on: at least two more than the word has.
    pub clocks: u32,
}

/// What the board knows besides positions; `None` where it does not measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Board {
    /// Supply of the sensors in mV.
    pub supply: Option<u16>,
    /// Current of the sensors in mA.
    pub current: Option<u16>,
    /// Battery behind what outlives a loss of power, in mV.
    pub battery: Option<u16>,
    /// The last reset came from the watchdog.
    pub watchdog_reset: bool,
    /// A memory test has failed.
    pub memory_error: bool,
}

/// How the board has to read the position sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PositionInputs {
    /// Whether they are used at all.
    pub are_used: bool,
    /// Bits of the word to be read over SSI; `None` when no sensor has one.
    pub ssi_bits: Option<u32>,
}

/// What the board knows when the power comes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerOn {
    /// Characteristic of the chip's temperature sensor.
    pub thermometer: ChipThermometer,
    /// What has outlived the loss of power.
    pub retained: Retained,
    /// What the parameter store holds of what is retained; `None` on a board that has never been started.
    pub stored: Option<[u32; LASTING_WORDS]>,
    /// The main supply was gone, and the battery has not kept the memory: the battery is empty or missing, or the board is new.
    /// `false` also where the main supply was never gone, so that nothing can be said of the battery.
    pub battery_failed: bool,
}

impl Default for PowerOn {
    /// A new board, whose chip has no calibration.
    fn default() -> PowerOn {
        PowerOn {
            thermometer: ChipThermometer::UNKNOWN,
            retained: Retained::Nothing,
            stored: None,
            battery_failed: false,
        }
    }
}

/// What the memory that a battery keeps had when the power came back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Retained {
    /// Nothing yet: the first start.
    #[default]
    Nothing,
    /// The words that a profile gave before.
    Words([u32; RETAINED_WORDS]),
    /// Words that are no longer right.
    Damaged,
}
