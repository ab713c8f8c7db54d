//! From the readings of the hardware to the movement of one sensor.

use crate::board::RawEncoder;
use core::num::NonZeroU32;

use super::implausible::ImplausibleReadings;
use super::parameters::automatic;
use super::reference::{Marks, Reference};
use super::trust::{ALL, Basis, Rest, Trust, deviation};
use super::{Fault, RetainedChannel, Scale, Sensor, Tracker};

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

/// Part of a long code at each of its ends in which the sensor may leave the code while the power is off.
const EDGE: i64 = 4;

/// Readings after a start in which a shaft that moves has moved before too.
const YOUNG: u8 = 10;

/// Result of one sample: state and movement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Observation {
    /// Bits of the sensor state.
    pub(super) state: u8,
    /// Movement in steps.
    pub(super) moved: i32,
    /// The position as coded on the line.
    pub(super) code: u32,
    /// The encoder has not answered for longer than is tolerated.
    pub(super) is_broken: bool,
}

/// The input of one sensor, with its state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Input {
    sensor: Sensor,
    /// Distance from the zero of the sensor to the zero of the encoder (650Ah:1).
    offset: i32,
    /// The retained state, until the sensor has been read.
    last: RetainedChannel,
    basis: Basis,
    reference: Reference,
    /// A long code has come near one of its ends: from then on only retained memory tells how often the code has
    /// wrapped.
    /// [`Trust::NEEDS_MEMORY`] or 0.
    needs_memory: u8,
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
    rest: Rest,
    /// Number of coming readings in which a movement means that the sensor has moved unseen.
    young: u8,
}

impl Input {
    /// A sensor that has not been read yet, with the retained state of the channel.
    pub(super) fn new(
        sensor: Sensor,
        scale: &Scale,
        offset: i32,
        users: u8,
        retained: &RetainedChannel,
    ) -> Input {
        let (basis, marks) = marks(&sensor, scale, users);
        let is_same = retained.is_of(sensor.kind, sensor.resolution());
        let is_forgotten = retained.kind == 0 && retained.trust.lost() != 0;
        let needs_memory =
            if basis == Basis::LongCode { retained.trust.flags & Trust::NEEDS_MEMORY } else { 0 };
        let is_lost = if is_forgotten {
            basis != Basis::LongCode || needs_memory != 0
        } else {
            retained.kind != 0 && !is_same && sensor.kind.is_counted()
        };
        let known = if is_same { retained.trust } else { Trust::default() };
        let trust = Trust::at_start(if is_lost { Trust::NONE } else { known }, basis);
        Input {
            sensor,
            offset,
            last: if is_same { *retained } else { RetainedChannel::default() },
            basis,
            reference: Reference::new(marks, trust),
            needs_memory,
            tracker: None,
            missed: 0,
            step: 0,
            implausible: None,
            gap: 0,
            rest: Rest::new(is_same && retained.trust.has(Trust::MOVING)),
            young: if is_same && matches!(basis, Basis::ShortCode | Basis::Count) { YOUNG } else { 0 },
        }
    }

    /// The sensor.
    pub(super) fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// Takes other parameters of the same sensor: moves the zero, and counts in the turns of this scale.
    pub(super) fn apply(&mut self, sensor: Sensor, scale: &Scale, offset: i32, users: u8) {
        self.sensor = sensor;
        let (basis, marks) = marks(&sensor, scale, users);
        self.basis = basis;
        self.reference.apply(marks);
        if basis != Basis::LongCode {
            self.needs_memory = 0;
        }
        let moved = i64::from(offset) - i64::from(self.offset);
        self.offset = offset;
        if let Some(tracker) = &mut self.tracker {
            tracker.set_turn(scale.turn());
            tracker.correct(moved);
        }
    }

    /// A preset makes the position of a user known: the present reading is accepted, and the count is corrected.
    #[inline(never)]
    pub(super) fn refer(&mut self, user: u8) {
        if self.implausible.is_some() {
            self.reference.lose();
        }
        let correction = self.reference.preset(user);
        self.accept();
        if let Some(tracker) = &mut self.tracker {
            tracker.correct(correction);
        }
        if self.reference.unknown() == 0 && !self.has_wrapped() {
            self.needs_memory = 0;
        }
    }

    /// Accepts rejected readings of a sensor that answers, where the reading alone is the position.
    pub(super) fn believe(&mut self) {
        if self.basis == Basis::Code && self.missed == 0 {
            self.accept();
        }
    }

    /// Accepts rejected readings.
    #[inline(never)]
    fn accept(&mut self) {
        if let (Some(tracker), Some(implausible)) = (&mut self.tracker, self.implausible.take()) {
            tracker.follow(implausible.word());
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

    /// Whether the sensor has been read, or should have been.
    pub(super) fn has_begun(&self) -> bool {
        self.tracker.is_some() || self.missed > GAP_MILLIS
    }

    /// A bit for each user whose position is not known.
    #[inline]
    pub(super) fn unknown(&self) -> u8 {
        if self.is_rejecting() { ALL } else { self.reference.unknown() }
    }

    /// The state to be retained for the next start. While readings are rejected, the position counts as lost.
    #[inline]
    pub(super) fn retained(&self, resolution: u32) -> RetainedChannel {
        let Some(tracker) = &self.tracker else { return self.unread() };
        let mut trust = self.reference.trust();
        trust.flags |= self.needs_memory | if self.rest.is_moving() { Trust::MOVING } else { 0 };
        if self.implausible.is_some() {
            trust.lose();
        }
        RetainedChannel { kind: self.sensor.kind.code(), resolution, total: tracker.total(), trust }
    }

    /// The same before the first reading.
    #[inline(never)]
    fn unread(&self) -> RetainedChannel {
        if self.last.kind != 0 {
            return self.last;
        }
        let trust = Trust { flags: self.needs_memory, ..self.reference.trust() };
        RetainedChannel { trust, ..RetainedChannel::default() }
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
        let moved = self.way(word);
        if !self.is_plausible(word, moved) {
            return self.stay();
        }
        self.take(word, moved, scale);
        self.missed = 0;
        self.note_edge();
        self.note_rest();
        let alarm = if reading.alarm { SENSOR_ALARM | SENSOR_POSITION_ERROR } else { 0 };
        Observation { state: alarm | self.reference.state(), moved, code: reading.code, is_broken: false }
    }

    /// Milliseconds since the last reading that was accepted.
    fn millis(&self) -> u32 {
        let rejected = self.implausible.map_or(0, |implausible| implausible.millis());
        self.missed.max(rejected).saturating_add(1)
    }

    /// Steps from the last good reading to this one: the way that is nearest to an even movement.
    #[inline]
    fn way(&self, word: u32) -> i32 {
        let Some(tracker) = &self.tracker else { return 0 };
        if self.missed == 0 && self.implausible.is_none() && self.gap == 0 {
            return tracker.distance(word);
        }
        self.long_way(tracker, word)
    }

    #[inline(never)]
    fn long_way(&self, tracker: &Tracker, word: u32) -> i32 {
        let even = if self.is_uncertain() || self.gap > 0 {
            0
        } else {
            self.step.saturating_mul(self.millis().cast_signed())
        };
        even.saturating_add(tracker.distance(word.wrapping_sub(even.cast_unsigned())))
    }

    /// Whether the code, or the counter, can have made half a round more or less than expected since the last reading.
    #[inline(never)]
    fn is_uncertain(&self) -> bool {
        let gap = if self.gap > 0 { GAP_MILLIS } else { 0 };
        // In a gap the time is not known, so the speed counts as uncertain too.
        let way = self.step.unsigned_abs().saturating_mul(gap);
        let away = deviation(self.limit(), self.millis().saturating_add(gap)).saturating_add(way);
        away >= 1 << (self.sensor.bits() - 1)
    }

    /// The fastest movement, also where 2104h sets no limit.
    fn limit(&self) -> u32 {
        if self.sensor.fastest == 0 { automatic(&self.sensor) } else { self.sensor.fastest }
    }

    /// Takes a reading that is `moved` steps from the last one.
    #[inline]
    fn take(&mut self, word: u32, moved: i32, scale: &Scale) {
        let Some(tracker) = &mut self.tracker else { return self.begin(word, scale) };
        tracker.advance(word, moved);
        self.step = moved;
        if self.missed > 0 || self.gap > 0 || self.implausible.is_some() {
            self.end_outage();
        }
    }

    /// Readings are back. If the code may have wrapped in the meantime, the number of wraps is not known.
    #[inline(never)]
    fn end_outage(&mut self) {
        // Cannot be zero.
        self.step = self.step.checked_div(self.millis().cast_signed()).unwrap_or(0);
        if self.basis.has_rounds() && self.is_uncertain() {
            self.reference.lose();
        }
        self.implausible = None;
    }

    /// Takes note of a movement, and of one right after the start: the sensor has moved before, unseen.
    #[inline]
    fn note_rest(&mut self) {
        let Some(tracker) = &self.tracker else { return };
        let has_left = self.rest.follow(tracker.count());
        if self.young > 0 {
            self.young -= 1;
            if has_left {
                self.reference.unseen();
            }
        }
    }

    /// Whether the sensor can have moved to this reading, `moved` steps from the last one.
    #[inline]
    fn is_plausible(&mut self, word: u32, moved: i32) -> bool {
        let fastest = self.sensor.fastest;
        let Some(tracker) = &self.tracker else { return true };
        let is_near = match &mut self.implausible {
            _ if fastest == 0 => true,
            Some(implausible) => return implausible.is_back(word, fastest),
            None if self.missed == 0 && self.gap == 0 => moved.unsigned_abs() <= fastest,
            None => {
                // The longer there was no reading, the further the sensor may have moved.
                let gap = if self.gap > 0 { GAP_MILLIS } else { 0 };
                let millis = self.missed.saturating_add(1).saturating_add(gap);
                moved.unsigned_abs() <= fastest.saturating_mul(millis)
            }
        };
        if !is_near {
            self.implausible =
                Some(ImplausibleReadings::new(self.sensor.bits(), tracker.word(), self.step, word, fastest));
        }
        is_near
    }

    /// Keeps the position where it was before the readings jumped.
    fn stay(&mut self) -> Observation {
        self.missed = 0;
        self.rest.miss();
        let error = if self.is_rejecting() { SENSOR_POSITION_ERROR } else { 0 };
        Observation { state: SENSOR_IMPLAUSIBLE | error | self.reference.state(), ..Observation::default() }
    }

    /// Whether readings are rejected for longer than is tolerated.
    fn is_rejecting(&self) -> bool {
        self.implausible.is_some_and(|implausible| implausible.millis() > TOLERATED_MISSES)
    }

    fn note_edge(&mut self) {
        if self.basis == Basis::LongCode && self.needs_memory == 0 {
            let code = 1_i64 << self.sensor.bits();
            let total = self.tracker.as_ref().map_or(0, Tracker::total).wrapping_sub(self.offset.into());
            let is_near = total < code / EDGE || total >= code - code / EDGE;
            self.needs_memory = if is_near { Trust::NEEDS_MEMORY } else { 0 };
        }
    }

    /// Whether the count has left the code in which it began.
    fn has_wrapped(&self) -> bool {
        let total = self.tracker.as_ref().map_or(0, Tracker::total).wrapping_sub(self.offset.into());
        self.tracker.is_some_and(|tracker| total != i64::from(tracker.word()))
    }

    fn miss(&mut self, state: u8) -> Observation {
        if let Some(implausible) = &mut self.implausible {
            implausible.skip();
        }
        self.missed = self.missed.saturating_add(1);
        self.rest.miss();
        let lasts = self.missed > TOLERATED_MISSES;
        let error = if lasts || self.is_rejecting() { SENSOR_POSITION_ERROR } else { 0 };
        Observation {
            state: state | error | self.reference.state(),
            is_broken: lasts && state == SENSOR_NO_SIGNAL,
            ..Observation::default()
        }
    }

    fn count(&mut self, raw: &RawEncoder, scale: &Scale) -> Observation {
        let word = raw.counter.into();
        let moved = if let Some(tracker) = &mut self.tracker {
            tracker.follow(word)
        } else {
            self.begin(word, scale);
            0
        };
        if self.gap > 0 && self.is_uncertain() {
            self.reference.unseen();
        }
        self.step = moved;
        self.note_rest();
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
        Observation { state, moved, code: word, is_broken: false }
    }

    /// The first reading: decides where counting continues.
    #[inline(never)]
    fn begin(&mut self, word: u32, scale: &Scale) {
        let (turn, bits) = (scale.turn(), self.sensor.bits());
        let last = (self.last.kind != 0).then_some(self.last.total);
        let total = match (self.basis, last) {
            (Basis::LongCode | Basis::ShortCode, Some(last)) => {
                // From the retained position, the shorter way to the present reading.
                let then = low_word(last.wrapping_sub(self.offset.into()));
                let moved = Tracker::new(turn, bits, then, last).distance(word);
                last.saturating_add(moved.into())
            }
            (Basis::Count, Some(last)) => last,
            (Basis::Start | Basis::Count, _) => self.offset.into(),
            _ => i64::from(word) + i64::from(self.offset),
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

/// The source of the position of a sensor, and the properties of its index.
#[inline(never)]
fn marks(sensor: &Sensor, scale: &Scale, users: u8) -> (Basis, Marks) {
    let basis = Basis::of(sensor, scale);
    let is_used = sensor.index && !sensor.kind.is_absolute();
    let is_linear = sensor.kind.is_linear();
    let marks = Marks {
        is_used,
        turn: (!is_linear).then_some(sensor.resolution),
        suffice: is_used && (is_linear || scale.repeats_after(sensor.resolution.get().into())),
        from_start: basis == Basis::Start,
        users,
    };
    (basis, marks)
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
