//! From what the hardware has read to the movement of one sensor.

use crate::board::RawEncoder;
use core::num::NonZeroU32;

use super::{Fault, Scale, Sensor, Tracker};

/// Sensor state: the encoder does not answer.
pub const SENSOR_NO_SIGNAL: u8 = 1 << 0;
/// Sensor state: the parity of the frame is wrong.
pub const SENSOR_PARITY: u8 = 1 << 1;
/// Sensor state: the encoder sends its alarm bit.
pub const SENSOR_ALARM: u8 = 1 << 2;
/// Sensor state: the position is further away than the sensor can have moved.
pub const SENSOR_IMPLAUSIBLE: u8 = 1 << 3;
/// Sensor state: the index came where it should not: steps were lost or are too many.
pub const SENSOR_INDEX: u8 = 1 << 4;
/// Sensor state: the index has not been seen yet.
pub const SENSOR_UNREFERENCED: u8 = 1 << 5;
/// Sensor state: more steps in a millisecond than the sensor can follow.
pub const SENSOR_TOO_FAST: u8 = 1 << 6;
/// Sensor state: the position is not accurate.
pub const SENSOR_POSITION_ERROR: u8 = 1 << 7;

/// Sensor state: there is no reading of this millisecond, the position is the last one that was read.
pub const SENSOR_HELD: u8 = SENSOR_NO_SIGNAL | SENSOR_PARITY | SENSOR_IMPLAUSIBLE;

/// Milliseconds without a good reading that are no position error: one disturbed frame is none, the position is then
/// one millisecond old.
const TOLERATED_MISSES: u32 = 2;

/// Steps by which the index may come too early or too late: it is one quarter period wide and is seen at one edge
/// forwards and at the other backwards; the capture may fall on either side of the step that causes it.
const INDEX_TOLERANCE: u64 = 2;

/// What one sample says about the movement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Observation {
    /// Bits of the sensor state.
    pub(super) state: u8,
    /// Steps moved.
    pub(super) moved: i32,
    /// The position as it was coded on the line.
    pub(super) code: u32,
}

/// Where a position was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Left {
    /// Steps from the origin.
    pub(super) total: i64,
    /// The index had been seen.
    pub(super) referenced: bool,
}

/// The sensor at work.
#[derive(Clone, Copy, Debug)]
pub(super) struct Input {
    sensor: Sensor,
    /// From the sensor's own zero to that of the encoder (650Ah:1).
    offset: i32,
    left: Option<Left>,
    referenced: bool,
    /// `None` until the first good reading.
    tracker: Option<Tracker>,
    /// Milliseconds since the last good reading.
    missed: u32,
}

impl Input {
    /// A sensor that has not been read yet.
    pub(super) fn new(sensor: Sensor, offset: i32, left: Option<Left>) -> Input {
        let referenced = left.is_some_and(|left| left.referenced);
        Input { sensor, offset, left, referenced, tracker: None, missed: 0 }
    }

    /// The sensor.
    pub(super) fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// Takes another description of the same sensor, moves the zero, and counts in the turns of this scale.
    pub(super) fn apply(&mut self, sensor: Sensor, scale: &Scale, offset: i32) {
        self.sensor = sensor;
        let moved = i64::from(offset) - i64::from(self.offset);
        self.offset = offset;
        if let Some(tracker) = &mut self.tracker {
            tracker.set_turn(scale.turn());
            tracker.correct(moved);
        }
    }

    /// Where the shaft is; `None` until the first good reading.
    pub(super) fn tracker(&self) -> Option<&Tracker> {
        self.tracker.as_ref()
    }

    /// Position in the sensor's own steps, from the zero of the encoder on (650Ah).
    pub(super) fn native(&self) -> i64 {
        let Some(tracker) = &self.tracker else { return 0 };
        if !self.sensor.kind.is_absolute() {
            return tracker.total();
        }
        i64::from(tracker.word()) + i64::from(self.offset)
    }

    /// Where it would go on after a loss of power.
    pub(super) fn left(&self) -> Option<Left> {
        let at = |tracker: &Tracker| Left { total: tracker.total(), referenced: self.referenced };
        self.tracker.as_ref().map(at).or(self.left)
    }

    /// Takes a sample.
    pub(super) fn read(&mut self, raw: &RawEncoder, scale: &Scale) -> Observation {
        if self.sensor.kind.is_absolute() { self.read_frame(raw, scale) } else { self.count(raw, scale) }
    }

    fn read_frame(&mut self, raw: &RawEncoder, scale: &Scale) -> Observation {
        let reading = match raw.ssi.map(|frame| self.sensor.format.read(frame)) {
            None | Some(Err(Fault::NoSignal)) => return self.miss(SENSOR_NO_SIGNAL),
            Some(Err(Fault::Parity)) => return self.miss(SENSOR_PARITY),
            Some(Ok(reading)) => reading,
        };
        let word = reading.position & (u32::MAX >> (32 - self.sensor.bits().clamp(1, 32)));
        // The longer nothing was read, the further it may have moved.
        let most = self.sensor.fastest.saturating_mul(self.missed.saturating_add(1));
        let distance = self.tracker.as_ref().map_or(0, |tracker| tracker.distance(word));
        if self.sensor.fastest > 0 && distance.unsigned_abs() > most {
            return self.miss(SENSOR_IMPLAUSIBLE);
        }
        self.missed = 0;
        let state = if reading.alarm { SENSOR_ALARM | SENSOR_POSITION_ERROR } else { 0 };
        Observation { state, moved: self.follow(word, scale), code: reading.code }
    }

    fn miss(&mut self, state: u8) -> Observation {
        self.missed = self.missed.saturating_add(1);
        let error = if self.missed > TOLERATED_MISSES { SENSOR_POSITION_ERROR } else { 0 };
        Observation { state: state | error, ..Observation::default() }
    }

    fn count(&mut self, raw: &RawEncoder, scale: &Scale) -> Observation {
        let moved = self.follow(raw.counter.into(), scale);
        let is_fast = self.sensor.fastest > 0 && moved.unsigned_abs() > self.sensor.fastest;
        let index = raw.index.filter(|_| self.sensor.index);
        let lost = index.map_or(0, |index| self.reference(index));
        let unreferenced = if self.sensor.index && !self.referenced { SENSOR_UNREFERENCED } else { 0 };
        let state = lost | unreferenced | if is_fast { SENSOR_TOO_FAST } else { 0 };
        Observation { state, moved, code: raw.counter.into() }
    }

    fn follow(&mut self, word: u32, scale: &Scale) -> i32 {
        if let Some(tracker) = &mut self.tracker {
            return tracker.follow(word);
        }
        let (turn, bits) = (scale.turn(), self.sensor.bits());
        let total = match self.left {
            Some(left) if self.sensor.kind.is_absolute() => {
                // Where it was left, and from there the shorter way to where it is now.
                let then = low_word(left.total.wrapping_sub(self.offset.into()));
                let moved = Tracker::new(turn, bits, then, left.total).distance(word);
                left.total.saturating_add(moved.into())
            }
            Some(left) => left.total,
            None if self.sensor.kind.is_absolute() => i64::from(word) + i64::from(self.offset),
            None => self.offset.into(),
        };
        self.tracker = Some(Tracker::new(turn, bits, word, total));
        0
    }

    /// The index is the zero of a rod, and of every turn of a shaft. The first one puts the position right; from then on
    /// one that comes elsewhere means that the count was wrong, and puts it right again.
    fn reference(&mut self, captured: u16) -> u8 {
        let Some(tracker) = &mut self.tracker else { return 0 };
        let since = i64::from(tracker.distance(captured.into()));
        let mut index = *tracker;
        index.correct(since - i64::from(self.offset));
        let error = if self.sensor.kind.is_linear() {
            index.total()
        } else {
            nearest(&index, self.sensor.resolution)
        };
        let is_first = !core::mem::replace(&mut self.referenced, true);
        let is_wrong = error.unsigned_abs() > INDEX_TOLERANCE;
        if is_first || is_wrong {
            tracker.correct(error.wrapping_neg());
        }
        if is_wrong && !is_first { SENSOR_INDEX | SENSOR_POSITION_ERROR } else { 0 }
    }
}

/// Steps to the nearest zero of a revolution.
fn nearest(tracker: &Tracker, revolution: NonZeroU32) -> i64 {
    let step = i64::from(tracker.step_in(revolution));
    let revolution = i64::from(revolution.get());
    if step > revolution / 2 { step - revolution } else { step }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn low_word(total: i64) -> u32 {
    total as u32
}
