//! The commissioning diagnostic: object 6000h bit 1, with its result in alarm bit 1 (6503h).
//!
//! CiA 406 wants "an extensive check of the components responsible for position detection" and leaves it to the maker.
//! This is what is checked while the bit is set, in one channel each:
//!
//! * every frame of an absolute encoder is there, has its parity, shows no alarm of the encoder, and lies no further
//!   from the one before than the sensor can have moved: so a line, a supply or a code with a gap fails at standstill,
//!   within a second;
//! * over two turns (of a rod: 8192 steps) made without a rest, every bit of the code within a turn is both 0 and 1: one
//!   that never changes is stuck. Only bits that such a movement cannot step over are judged, so the slower the
//!   shaft turns, the more bits are: all of them at one step a millisecond, or 7 rpm with 13 bits;
//! * an incremental encoder is not faster than it may be, shows its index within two turns, and shows it whole turns
//!   apart.
//!
//! The diagnostic starts when the bit is set and ends when it is cleared or something fails.

use core::num::NonZeroU64;

use super::Sensor;
use super::input::{
    Observation, SENSOR_ALARM, SENSOR_HELD, SENSOR_INDEX, SENSOR_TOO_FAST, SENSOR_UNREFERENCED,
};

/// Milliseconds after which standstill is checked.
const STANDSTILL_MILLIS: u32 = 1000;
/// Milliseconds without movement that are a rest.
const REST_MILLIS: u32 = 100;
/// Bits of a rod's code that are checked: those of 4096 steps.
const ROD_BITS: u32 = 12;

/// How far the commissioning diagnostic is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Progress {
    /// It is not asked for.
    #[default]
    Off = 0,
    /// It runs.
    Running = 1,
    /// One second was good.
    GoodAtRest = 2,
    /// Two turns were good.
    GoodOverTurns = 3,
    /// A reading was bad: the sensor state said why.
    BadReading = 0x81,
    /// A bit of the code does not change.
    StuckBit = 0x82,
    /// The index did not come, or not where it should.
    BadIndex = 0x83,
    /// Faster than the sensor can follow.
    TooFast = 0x84,
}

impl Progress {
    /// As an object.
    #[must_use]
    pub fn code(self) -> u8 {
        self as u8
    }

    /// Whether something was found.
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
    /// Bits of the code that have been 1, and those that have been 0.
    ones: u32,
    zeros: u32,
}

impl Run {
    fn follow(&mut self, seen: &Observation) {
        self.millis = self.millis.saturating_add(1);
        self.travel = self.travel.saturating_add(seen.moved.into());
        (self.ones, self.zeros) = (self.ones | seen.code, self.zeros | !seen.code);
    }

    /// Whether one of the lowest so many bits never changed, though the movement was slow enough to show it: a bit keeps
    /// its value for as many steps as it is worth, or twice as many in Gray code.
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

    /// Looks at a sample.
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

    /// Whether the run was two turns long.
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
