//! Plain values that the board and the profiles exchange. Every profile sees the same board; the profile and its
//! parameters decide which inputs are used.

/// Digital inputs of the board: its buttons.
pub const DIGITAL_INPUTS: usize = 2;
/// Digital outputs of the board: its lamps.
pub const DIGITAL_OUTPUTS: usize = 2;
/// Number of words that the battery retains through a loss of power.
pub const RETAINED_WORDS: usize = 10;
/// Number of words in the record that the parameter store holds about the retained words.
pub const POSITION_RECORD_WORDS: usize = 2;

/// All readings of one millisecond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// Analogue inputs.
    pub analogue: RawSample,
    /// Inputs of position sensors.
    pub position: RawEncoder,
    /// Digital inputs, debounced: `true` for a pressed button.
    pub digital: [bool; DIGITAL_INPUTS],
}

/// Outputs of a profile to the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// Digital outputs: `true` for a lit lamp.
    pub digital: [bool; DIGITAL_OUTPUTS],
}

/// Sums of `count` conversions of 12 bits each, taken in the same millisecond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RawSample {
    /// Output of the pressure transducer.
    pub pressure: u32,
    /// Supply of the pressure transducer, through the same divider as its output.
    pub supply: u32,
    /// Temperature sensor in the chip.
    pub temperature: u32,
    /// Voltage reference in the chip.
    pub reference: u32,
    /// Thermistor, with its resistor to the converter's supply; 0 without one.
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

    /// Whether every conversion in a sum was at an end of the converter's range.
    #[must_use]
    pub fn is_rail(&self, sum: u32) -> bool {
        sum == 0 || sum >= FULL_SCALE * u32::from(self.count)
    }
}

/// Characteristic of the temperature sensor in the chip: `T = offset + slope * temperature / reference`, in K, with the
/// sums of [`RawSample`]. The board takes both numbers from the data of the chip's manufacturer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChipThermometer {
    /// Offset in K.
    pub offset: f32,
    /// Slope in K.
    pub slope: f32,
}

impl ChipThermometer {
    /// No characteristic is known, so no temperature can be measured.
    pub const UNKNOWN: ChipThermometer = ChipThermometer { offset: f32::NAN, slope: f32::NAN };
}

/// Readings of the position sensors. There is one input of each kind, and channels of the same kind share it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RawEncoder {
    /// Timer in encoder mode: all quarter periods, modulo 2^16.
    pub counter: u16,
    /// Counter value at the last index pulse; `None` if there was no pulse since the last sample.
    pub index: Option<u16>,
    /// SSI frame, `None` when none was read.
    pub ssi: Option<SsiFrame>,
    /// More than a millisecond may have passed since the last sample, or an index may have been missed.
    pub has_gap: bool,
    /// The board around the sensors.
    pub board: Board,
}

/// Bits clocked in from an absolute encoder with synchronous serial interface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SsiFrame {
    /// The bits, the last one in bit 0.
    pub bits: u64,
    /// Number of bits, from the rest level on: at least two more than the word has.
    pub clocks: u32,
}

/// Measurements and findings of the board besides positions; `None` for a value that the board does not measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Board {
    /// Supply of the sensors in mV.
    pub supply: Option<u16>,
    /// Current of the sensors in mA.
    pub current: Option<u16>,
    /// Voltage of the battery that supplies the retained memory, in mV.
    pub battery: Option<u16>,
    /// The last reset came from the watchdog.
    pub watchdog_reset: bool,
    /// A memory test has failed.
    pub memory_error: bool,
}

/// Settings of the board's position inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PositionInputs {
    /// Whether the position inputs are used.
    pub are_used: bool,
    /// Bits of the word to be read over SSI; `None` if no sensor uses SSI.
    pub ssi_bits: Option<u32>,
}

/// State of the board at power-on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerOn {
    /// Characteristic of the chip's temperature sensor.
    pub thermometer: ChipThermometer,
    /// The state that the battery has kept while the main supply was off.
    pub retained: Retained,
    /// The record in the parameter store about the retained state; `None` on a board that has never been started.
    pub stored: Option<[u32; POSITION_RECORD_WORDS]>,
    /// The main supply was off, and the battery has not kept the memory: the battery is empty or missing, or the board
    /// is new. `false` also if the main supply was never off, because then the battery was not needed.
    pub battery_failed: bool,
}

impl Default for PowerOn {
    /// A new board whose chip has no calibration.
    fn default() -> PowerOn {
        PowerOn {
            thermometer: ChipThermometer::UNKNOWN,
            retained: Retained::Nothing,
            stored: None,
            battery_failed: false,
        }
    }
}

/// Content of the battery-backed memory when the power came back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Retained {
    /// Empty: the first start, or an empty battery.
    #[default]
    Nothing,
    /// The words that the profile wrote last.
    Words([u32; RETAINED_WORDS]),
    /// Damaged words.
    Damaged,
}
