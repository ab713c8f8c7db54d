//! From the readings of the hardware to the movement of one sensor.

use crate::board::RawEncoder;
use core::num::{NonZeroU32, NonZeroU64};

use super::implausible::ImplausibleReadings;
use super::reference::{Marks, Reference, Trust};
use super::{Fault, Scale, Sensor, Tracker};

/// Sensor state: the encoder does not answer.
pub const SENSOR_NO_SIGNAL: u8 = 1 << 0;
/// Sensor state: the parity of the frame is wrong.
pub const SENSOR_PARITY: u8 = 1 << 1;
/// Sensor state: the encoder sends its alarm bit.
pub const SENSOR_ALARM: u8 = 1 << 2;
/// Sensor state: the readings are further away than the sensor can have moved. The position stays at the last good
/// reading.
pub const SENSOR_IMPLAUSIBLE: u8 = 1 << 3;
/// Sensor state: the index did not come, or came in the wrong place. Steps were lost or counted twice.
pub const SENSOR_INDEX: u8 = 1 << 4;
/// Sensor state: the index has not been seen yet. Together with a position error: the number of turns is unknown.
pub const SENSOR_UNREFERENCED: u8 = 1 << 5;
/// Sensor state: more steps in a millisecond than the sensor can follow.
pub const SENSOR_TOO_FAST: u8 = 1 << 6;
/// Sensor state: the position is not accurate.
pub const SENSOR_POSITION_ERROR: u8 = 1 << 7;

/// Sensor state: this millisecond has no usable reading, so the position is that of the last good one.
pub const SENSOR_HELD: u8 = SENSOR_NO_SIGNAL | SENSOR_PARITY | SENSOR_IMPLAUSIBLE;

/// Milliseconds without a good reading before a position error is reported: after one disturbed frame the position is
/// only one millisecond old, which is no error.
const TOLERATED_MISSES: u32 = 2;

/// Longest gap between two samples in milliseconds: within this time the sampling is restarted.
const GAP_MILLIS: u32 = 10;
/// Samples that a gap affects: an SSI word belongs to the sample before.
const GAP_SAMPLES: u8 = 2;

/// Divisor for the two ends of the code's range (1/512 each) in which a sensor may leave the range while the power is
/// off.
const EDGE: i64 = 512;

/// Result of one sample: state and movement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Observation {
    /// Bits of the sensor state.
    pub(super) state: u8,
    /// Movement in steps.
    pub(super) moved: i32,
    /// The position as coded on the line.
    pub(super) code: u32,
}

/// The position at the last loss of power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LastPosition {
    /// Steps from the origin.
    pub(super) total: i64,
    /// How far the position can be trusted.
    pub(super) trust: Trust,
    /// See [`Input::needs_memory`].
    pub(super) needs_memory: bool,
}

/// Retained knowledge of a sensor at start.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StartPosition {
    /// The retained position.
    pub(super) last: Option<LastPosition>,
    /// A position should have been retained, and was lost.
    pub(super) lost: bool,
}

/// The input of one sensor, with its state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Input {
    sensor: Sensor,
    /// Distance from the zero of the sensor to the zero of the encoder (650Ah:1).
    offset: i32,
    last: Option<LastPosition>,
    reference: Reference,
    /// The code wraps before the position does, so the number of wraps matters.
    comes_round: bool,
    /// The code has come near one of its ends: from then on only retained memory tells how often the code has wrapped.
    needs_memory: bool,
    /// The counted position; `None` until the first good reading.
    tracker: Option<Tracker>,
    /// Milliseconds since the last good reading.
    missed: u32,
    /// Steps moved in the last millisecond with a good reading.
    step: i32,
    /// Readings rejected as implausible.
    implausible: Option<ImplausibleReadings>,
    /// Number of coming samples in which the sensor may have moved further than in a millisecond.
    gap: u8,
}

impl Input {
    /// A sensor that has not been read yet.
    pub(super) fn new(sensor: Sensor, scale: &Scale, offset: i32, start: StartPosition) -> Input {
        let StartPosition { last, lost } = start;
        let trust = last.map_or(Trust { lost, ..Trust::default() }, |last| last.trust);
        Input {
            sensor,
            offset,
            last,
            reference: Reference::new(marks(&sensor, scale), trust),
            comes_round: comes_round(&sensor, scale),
            needs_memory: last.is_some_and(|last| last.needs_memory),
            tracker: None,
            missed: 0,
            step: 0,
            implausible: None,
            gap: 0,
        }
    }

    /// The sensor.
    pub(super) fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// Takes other parameters of the same sensor: moves the zero, and counts in the turns of this scale.
    pub(super) fn apply(&mut self, sensor: Sensor, scale: &Scale, offset: i32) {
        self.sensor = sensor;
        self.reference.apply(marks(&sensor, scale));
        self.comes_round = comes_round(&sensor, scale);
        self.needs_memory &= self.comes_round;
        let moved = i64::from(offset) - i64::from(self.offset);
        self.offset = offset;
        if let Some(tracker) = &mut self.tracker {
            tracker.set_turn(scale.turn());
            tracker.correct(moved);
        }
    }

    /// A preset makes the position known: the present reading is accepted, and the count is corrected.
    #[inline(never)]
    pub(super) fn refer(&mut self) {
        let correction = self.reference.preset();
        if let Some(tracker) = &mut self.tracker {
            if let Some(implausible) = self.implausible.take() {
                tracker.follow(implausible.word());
            }
            tracker.correct(correction);
        }
    }

    /// The position by rejected readings or by a rejected index; `None` while nothing is rejected.
    #[inline]
    pub(super) fn doubtful(&self) -> Option<Tracker> {
        let is_believed = self.implausible.is_none() && self.reference.state() & SENSOR_INDEX == 0;
        if is_believed { None } else { self.as_read() }
    }

    #[inline(never)]
    fn as_read(&self) -> Option<Tracker> {
        let correction = self.reference.correction();
        let mut tracker = self.tracker?;
        if let Some(implausible) = self.implausible {
            tracker.follow(implausible.word());
        }
        tracker.correct(correction);
        Some(tracker)
    }

    /// The counted position; `None` until the first good reading.
    pub(super) fn tracker(&self) -> Option<&Tracker> {
        self.tracker.as_ref()
    }

    /// Position in native steps of the sensor, from the zero of the encoder (650Ah).
    pub(super) fn native(&self) -> i64 {
        let Some(tracker) = &self.tracker else { return 0 };
        if !self.sensor.kind.is_absolute() {
            return tracker.total();
        }
        i64::from(tracker.word()) + i64::from(self.offset)
    }

    /// How far the position can be trusted at the next start: bits of [`Trust`]. While readings are rejected, the
    /// position counts as lost.
    #[inline]
    pub(super) fn trust(&self) -> u8 {
        self.reference.trust() | if self.implausible.is_some() { Trust::LOST } else { 0 }
    }

    /// Whether only retained memory tells how often the code has wrapped.
    #[inline]
    pub(super) fn needs_memory(&self) -> bool {
        self.needs_memory
    }

    /// The retained position, until the sensor has been read.
    pub(super) fn last(&self) -> Option<LastPosition> {
        self.last
    }

    /// Takes a sample.
    pub(super) fn read(&mut self, raw: &RawEncoder, scale: &Scale) -> Observation {
        self.gap = self.gap.saturating_sub(1);
        if raw.has_gap {
            self.gap = GAP_SAMPLES;
            self.reference.forgive();
        }
        if self.sensor.kind.is_absolute() { self.read_frame(raw, scale) } else { self.count(raw, scale) }
    }

    fn read_frame(&mut self, raw: &RawEncoder, scale: &Scale) -> Observation {
        let reading = match raw.ssi.map(|frame| self.sensor.format.read(frame)) {
            None | Some(Err(Fault::NoSignal)) => return self.miss(SENSOR_NO_SIGNAL),
            Some(Err(Fault::Parity)) => return self.miss(SENSOR_PARITY),
            Some(Ok(reading)) => reading,
        };
        let word = reading.position & (u32::MAX >> (32 - self.sensor.bits().clamp(1, 32)));
        if !self.is_plausible(word) {
            return self.stay();
        }
        if self.missed > 0 {
            self.come_back();
        }
        self.step = self.follow(word, scale);
        self.note_edge();
        let alarm = if reading.alarm { SENSOR_ALARM | SENSOR_POSITION_ERROR } else { 0 };
        Observation { state: alarm | self.reference.state(), moved: self.step, code: reading.code }
    }

    /// Whether the sensor can have moved to this reading.
    #[inline]
    fn is_plausible(&mut self, word: u32) -> bool {
        let fastest = self.sensor.fastest;
        let Some(tracker) = &self.tracker else { return true };
        let is_back = match &mut self.implausible {
            _ if fastest == 0 => true,
            Some(implausible) => implausible.is_back(word, fastest),
            // The longer there was no reading, the further the sensor may have moved.
            None if self.missed == 0 && self.gap == 0 => tracker.distance(word).unsigned_abs() <= fastest,
            None => {
                let gap = if self.gap > 0 { GAP_MILLIS } else { 0 };
                let millis = self.missed.saturating_add(1).saturating_add(gap);
                tracker.distance(word).unsigned_abs() <= fastest.saturating_mul(millis)
            }
        };
        if is_back {
            self.implausible = None;
        } else if self.implausible.is_none() {
            self.implausible =
                Some(ImplausibleReadings::new(self.sensor.bits(), tracker.word(), self.step, word, fastest));
        }
        is_back
    }

    /// Keeps the position where it was before the readings jumped.
    fn stay(&self) -> Observation {
        let lasts = self.implausible.is_some_and(|implausible| implausible.readings() > TOLERATED_MISSES);
        let error = if lasts { SENSOR_POSITION_ERROR } else { 0 };
        Observation { state: SENSOR_IMPLAUSIBLE | error | self.reference.state(), ..Observation::default() }
    }

    /// Good readings are back. If the code may have wrapped in the meantime, the number of wraps is unknown.
    #[inline(never)]
    fn come_back(&mut self) {
        let most = u64::from(self.sensor.fastest) * (u64::from(self.missed) + 1);
        let is_outage = self.missed > TOLERATED_MISSES && self.tracker.is_some();
        if self.comes_round && is_outage && most >= 1 << (self.sensor.bits() - 1) {
            self.reference.lose();
        }
        self.missed = 0;
    }

    fn note_edge(&mut self) {
        if self.comes_round && !self.needs_memory {
            let code = 1_i64 << self.sensor.bits();
            let total = self.tracker.as_ref().map_or(0, Tracker::total).wrapping_sub(self.offset.into());
            self.needs_memory = total < code / EDGE || total >= code - code / EDGE;
        }
    }

    fn miss(&mut self, state: u8) -> Observation {
        if let Some(implausible) = &mut self.implausible {
            implausible.skip();
        }
        self.missed = self.missed.saturating_add(1);
        let error = if self.missed > TOLERATED_MISSES { SENSOR_POSITION_ERROR } else { 0 };
        Observation { state: state | error | self.reference.state(), ..Observation::default() }
    }

    fn count(&mut self, raw: &RawEncoder, scale: &Scale) -> Observation {
        let moved = self.follow(raw.counter.into(), scale);
        let fastest = self.sensor.fastest;
        let is_fast = moved.unsigned_abs() > fastest && fastest > 0 && self.gap == 0;
        if is_fast {
            self.reference.doubt();
        }
        if self.sensor.index {
            self.reference.moved(moved);
            if let Some(captured) = raw.index {
                self.take_index(captured);
            }
        }
        let too_fast = if is_fast { SENSOR_TOO_FAST | SENSOR_POSITION_ERROR } else { 0 };
        let state = self.reference.state() | too_fast;
        Observation { state, moved, code: raw.counter.into() }
    }

    #[inline]
    fn follow(&mut self, word: u32, scale: &Scale) -> i32 {
        if let Some(tracker) = &mut self.tracker {
            return tracker.follow(word);
        }
        self.begin(word, scale);
        0
    }

    /// The first reading: decides where counting continues.
    #[inline(never)]
    fn begin(&mut self, word: u32, scale: &Scale) {
        let (turn, bits) = (scale.turn(), self.sensor.bits());
        let total = match self.last {
            Some(last) if self.sensor.kind.is_absolute() => {
                // From the retained position, the shorter way to the present reading.
                let then = low_word(last.total.wrapping_sub(self.offset.into()));
                let moved = Tracker::new(turn, bits, then, last.total).distance(word);
                last.total.saturating_add(moved.into())
            }
            Some(last) => last.total,
            None if self.sensor.kind.is_absolute() => i64::from(word) + i64::from(self.offset),
            None => self.offset.into(),
        };
        self.tracker = Some(Tracker::new(turn, bits, word, total));
    }

    /// Takes an index: the zero of a linear encoder, and of every turn of a shaft.
    fn take_index(&mut self, captured: u16) {
        let Some(tracker) = &mut self.tracker else { return };
        let ahead = tracker.distance(captured.into());
        let mut index = *tracker;
        index.correct(i64::from(ahead) - i64::from(self.offset));
        let error = if self.sensor.kind.is_linear() {
            index.total()
        } else {
            nearest(&index, self.sensor.resolution)
        };
        let correction = self.reference.index(error, ahead.wrapping_neg());
        if correction != 0 {
            tracker.correct(correction);
        }
    }
}

/// Properties of a sensor's index.
fn marks(sensor: &Sensor, scale: &Scale) -> Marks {
    let is_used = sensor.index && !sensor.kind.is_absolute();
    let is_linear = sensor.kind.is_linear();
    Marks {
        is_used,
        turn: (!is_linear).then_some(sensor.resolution),
        suffice: is_used && (is_linear || u64::from(scale.units()) % scale.range() == 0),
    }
}

/// Whether the code of an absolute sensor wraps before the position does: the code is not a whole number of ranges
/// long.
fn comes_round(sensor: &Sensor, scale: &Scale) -> bool {
    let units = (1 << sensor.bits().min(32)) * u64::from(scale.units());
    // A turn and a range have at most 2^32 steps each, so their product fits 64 bits.
    let range = NonZeroU64::from(scale.turn()).saturating_mul(scale.range());
    sensor.kind.is_absolute() && units % range != 0
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
