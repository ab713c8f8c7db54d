//! The commissioning diagnostic: object 6000h bit 1, with its result in alarm bit 1 (6503h).
//!
//! CiA 406 wants "an extensive check of the components responsible for position detection" and leaves the check to the
//! manufacturer. While the bit is set, each channel is checked as follows:
//!
//! * Absolute encoder, every frame: the frame is there, its parity is right, it shows no alarm, and its position is no
//!   further from the one before than the sensor can have moved. A fault of the line, the supply or the code therefore
//!   shows at standstill, within a second.
//! * Absolute encoder, over two turns without a rest (linear encoder: 8192 steps): every bit of the code within a turn
//!   must have been both 0 and 1; a bit that never changes is stuck. Only bits that such a movement cannot step over
//!   are judged. The slower the shaft turns, the more bits are judged: all of them at one step a millisecond, or 7 rpm
//!   with 13 bits.
//! * Incremental encoder: it is not faster than allowed, its index comes within two turns, and indexes are whole turns
//!   apart.
//!
//! The diagnostic starts when the bit is set. It ends when the bit is cleared or something fails.

use core::num::NonZeroU64;

use super::Sensor;
use super::input::{
    Observation, SENSOR_ALARM, SENSOR_HELD, SENSOR_INDEX, SENSOR_TOO_FAST, SENSOR_UNREFERENCED,
};

/// Milliseconds after which standstill is checked.
const STANDSTILL_MILLIS: u32 = 1000;
/// Milliseconds without movement that count as a rest.
const REST_MILLIS: u32 = 100;
/// Bits of a linear encoder's code that are checked: 4096 steps.
const ROD_BITS: u32 = 12;

/// Progress of the commissioning diagnostic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Progress {
    /// The diagnostic is off.
    #[default]
    Off = 0,
    /// The diagnostic runs, without a result so far.
    Running = 1,
    /// One second without a fault.
    GoodAtRest = 2,
    /// Two turns without a fault.
    GoodOverTurns = 3,
    /// A reading was bad; the sensor state has said why.
    BadReading = 0x81,
    /// A bit of the code does not change.
    StuckBit = 0x82,
    /// The index did not come, or came in the wrong place.
    BadIndex = 0x83,
    /// Faster than the sensor can follow.
    TooFast = 0x84,
}

impl Progress {
    /// The value of the object.
    #[must_use]
    pub fn code(self) -> u8 {
        self as u8
    }

    /// Whether the diagnostic has failed.
    #[must_use]
    pub fn is_failure(self) -> bool {
        self.code() & 0x80 != 0
    }
}

/// The diagnostic of one channel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Commissioning {
    progress: Progress,
    millis: u32,
    /// Milliseconds since the last movement.
    rest: u32,
    run: Run,
}

/// A movement without a rest.
#[derive(Clone, Copy, Debug, Default)]
struct Run {
    millis: u32,
    travel: i64,
    /// Bits of the code that have been 1; `zeros` has the bits that have been 0.
    ones: u32,
    zeros: u32,
}

impl Run {
    fn follow(&mut self, seen: &Observation) {
        self.millis = self.millis.saturating_add(1);
        self.travel = self.travel.saturating_add(seen.moved.into());
        (self.ones, self.zeros) = (self.ones | seen.code, self.zeros | !seen.code);
    }

    /// Whether one of the lowest `bits` bits never changed, though the movement was slow enough to show a change: a bit
    /// of weight n keeps its value for n steps, or for 2n steps in Gray code.
    fn has_stuck_bit(&self, bits: u32) -> bool {
        let millis = NonZeroU64::new(self.millis.into()).unwrap_or(NonZeroU64::MIN);
        let mean = self.travel.unsigned_abs().saturating_add(millis.get() - 1) / millis;
        let hidden = mean.checked_next_power_of_two().and_then(|steps| u32::try_from(steps - 1).ok());
        let judged = (u32::MAX >> (32 - bits.clamp(1, 32))) & !hidden.unwrap_or(u32::MAX);
        self.ones & self.zeros & judged != judged
    }
}

impl Commissioning {
    /// Follows bit 1 of 6000h.
    pub(super) fn set(&mut self, on: bool) {
        if on != (self.progress != Progress::Off) {
            let progress = if on { Progress::Running } else { Progress::Off };
            *self = Commissioning { progress, ..Commissioning::default() };
        }
    }

    pub(super) fn progress(&self) -> Progress {
        self.progress
    }

    /// Checks a sample.
    pub(super) fn observe(&mut self, sensor: &Sensor, seen: &Observation) {
        if self.progress != Progress::Off && !self.progress.is_failure() {
            self.go_on(sensor, seen);
        }
    }

    #[inline(never)]
    fn go_on(&mut self, sensor: &Sensor, seen: &Observation) {
        self.millis = self.millis.saturating_add(1);
        self.rest = if seen.moved == 0 { self.rest.saturating_add(1) } else { 0 };
        self.run.follow(seen);
        self.progress = self.judge(sensor, seen);
        if self.rest > REST_MILLIS || self.is_over(sensor) {
            self.run = Run::default();
        }
    }

    fn judge(&self, sensor: &Sensor, seen: &Observation) -> Progress {
        let is_over = self.is_over(sensor);
        match seen.state {
            state if state & (SENSOR_HELD | SENSOR_ALARM) != 0 => Progress::BadReading,
            state if state & SENSOR_TOO_FAST != 0 => Progress::TooFast,
            state if state & SENSOR_INDEX != 0 => Progress::BadIndex,
            state if is_over && state & SENSOR_UNREFERENCED != 0 => Progress::BadIndex,
            _ if is_over && self.has_stuck_bit(sensor) => Progress::StuckBit,
            _ if is_over || self.progress == Progress::GoodOverTurns => Progress::GoodOverTurns,
            _ if self.millis >= STANDSTILL_MILLIS => Progress::GoodAtRest,
            _ => Progress::Running,
        }
    }

    /// Whether the movement was two turns long.
    fn is_over(&self, sensor: &Sensor) -> bool {
        self.run.travel.unsigned_abs() >= 2 * turn(sensor)
    }

    fn has_stuck_bit(&self, sensor: &Sensor) -> bool {
        let bits = if sensor.kind.is_linear() { ROD_BITS } else { sensor.format.step_bits() };
        sensor.kind.is_absolute() && self.run.has_stuck_bit(bits.min(sensor.bits()))
    }
}

/// Steps in a turn.
fn turn(sensor: &Sensor) -> u64 {
    if sensor.kind.is_linear() { 1 << ROD_BITS } else { sensor.resolution().into() }
}
