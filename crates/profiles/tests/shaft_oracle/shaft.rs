//! The shaft, its sensor, and the positions that a device should show.

use profiles::board::{RawEncoder, SsiFrame};
use profiles::encoder::{Format, Scale, SensorType};

use crate::devices::{Device, Shown};
use crate::tally::{Reset, Tally};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    pub(crate) kind: SensorType,
    /// The sensor type of the second position: the same sensor, or another one.
    pub(crate) second: SensorType,
    pub(crate) index: bool,
    pub(crate) is_scaled: bool,
    /// An endless axis behind a gear.
    pub(crate) is_geared: bool,
}

impl Case {
    /// The sensor types of the two positions.
    pub(crate) fn kinds(&self) -> [SensorType; 2] {
        [self.kind, self.second]
    }

    fn any(&self, has: impl Fn(SensorType) -> bool) -> bool {
        self.kinds().into_iter().any(has)
    }

    /// Whether all sensors are read over SSI.
    fn is_absolute(&self) -> bool {
        !self.any(|kind| !kind.is_absolute())
    }

    /// Whether the sensor with an index is linear.
    fn has_one_mark(&self) -> bool {
        self.any(|kind| !kind.is_absolute() && kind.is_linear())
    }
}

/// Numbers that look random (SplitMix64).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ (mixed >> 31)) % limit
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }

    /// Between -1 and 1.
    fn signed(&mut self) -> f64 {
        self.below(2_000_001) as f64 / 1e6 - 1.0
    }
}

/// The position that a device should show: `value` where the shaft was at `steps`.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    value: u32,
    steps: i64,
    scale: Scale,
}

impl Anchor {
    fn expected(&self, steps: i64) -> u32 {
        let moved = units(&self.scale, steps) - units(&self.scale, self.steps);
        let range = i128::from(self.scale.range().get());
        (i128::from(self.value) + moved).rem_euclid(range) as u32
    }
}

/// Units from the zero of the sensor.
fn units(scale: &Scale, steps: i64) -> i128 {
    let seen = if scale.is_reversed() { -1 - steps } else { steps };
    (i128::from(seen) * i128::from(scale.units())).div_euclid(i128::from(scale.turn().get()))
}

/// A disturbance of the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    Silent,
    Jump(i64),
    NoIndex,
}

pub(crate) struct World<D> {
    case: Case,
    device: D,
    random: Random,
    pub(crate) tally: Tally,
    reset: Reset,
    /// Position and speed of the shaft, in steps and in steps a millisecond.
    at: f64,
    speed: f64,
    target: f64,
    /// Where the timer has started to count.
    counted_from: i64,
    /// The samples before: the position may be as old as the disturbances that are tolerated.
    before: [i64; 4],
    fault: Fault,
    anchors: [Option<Anchor>; 2],
    stored: [Option<Anchor>; 2],
    /// The readings of the last millisecond.
    raw: RawEncoder,
    shown: [Shown; 2],
    /// Milliseconds of the run.
    age: u32,
}

/// Steps of a revolution of the incremental encoder.
const REVOLUTION: i64 = 4096;

impl<D: Device> World<D> {
    pub(crate) fn new(case: Case, device: D, seed: u64) -> World<D> {
        let mut world = World {
            case,
            device,
            random: Random(seed),
            tally: Tally::default(),
            reset: Reset::Warm,
            at: 100_000.5,
            speed: 0.0,
            target: 0.0,
            counted_from: 100_000,
            before: [100_000; 4],
            fault: Fault::None,
            anchors: [None; 2],
            stored: [None; 2],
            raw: RawEncoder::default(),
            shown: [Shown { position: 0, is_condemned: false, awaits_index: false }; 2],
            age: 0,
        };
        world.age = 10;
        world.reference();
        (0..2).for_each(|at| world.preset(at));
        world
    }

    fn fastest(&self) -> f64 {
        [0, 1].map(|at| f64::from(self.device.sensor(at).fastest)).into_iter().fold(f64::MAX, f64::min)
    }

    /// The fastest movement of the sensors that are read over SSI.
    fn fastest_code(&self) -> i64 {
        let sensors = [0, 1].map(|at| self.device.sensor(at)).into_iter();
        sensors
            .filter(|sensor| sensor.kind.is_absolute())
            .map(|sensor| sensor.fastest.into())
            .max()
            .unwrap_or(0)
    }

    /// The positions of the shortest code.
    fn code(&self) -> i64 {
        let sensors = [0, 1].map(|at| self.device.sensor(at)).into_iter();
        let bits = sensors.filter(|sensor| sensor.kind.is_absolute()).map(|sensor| sensor.bits());
        1 << bits.min().unwrap_or_else(|| self.device.sensor(0).bits())
    }

    /// A movement, a few events, and a reset.
    pub(crate) fn cycle(&mut self) {
        for _ in 0..=self.random.below(3) {
            self.target = self.speed_of_choice();
            self.run_between(50, 450);
            self.event();
        }
        self.restart();
        self.target = if self.random.one_in(2) { self.target } else { 0.0 };
        self.run_between(20, 220);
        self.recover();
    }

    fn speed_of_choice(&mut self) -> f64 {
        let part = [0.0, 0.001, 0.05, 0.4, 0.98][self.random.below(5) as usize];
        self.random.signed().signum() * part * self.fastest()
    }

    fn run(&mut self, millis: u64) {
        (0..millis).for_each(|_| self.millisecond());
    }

    fn run_between(&mut self, least: u64, most: u64) {
        let millis = least + self.random.below(most - least);
        self.run(millis);
    }

    fn rest(&mut self, millis: u64) {
        self.target = 0.0;
        while self.speed != 0.0 {
            self.millisecond();
        }
        self.run(millis);
    }

    /// Turns until the index has come twice; a linear encoder passes its only mark, at zero.
    fn reference(&mut self) {
        self.run(3);
        if !self.shown.iter().any(|shown| shown.awaits_index) {
            return;
        }
        let (from, is_linear) = (self.at, self.case.has_one_mark());
        self.target = if is_linear { -0.9 * from.signum() } else { 0.2 } * self.fastest();
        let has_passed = |at: f64| {
            if is_linear { at.signum() != from.signum() } else { at - from > 2.5 * REVOLUTION as f64 }
        };
        while !has_passed(self.at) {
            self.millisecond();
        }
        self.run(2);
        self.rest(2);
    }

    fn event(&mut self) {
        match self.random.below(9) {
            0 => self.disturb(Fault::Silent, 20),
            1 => self.disturb(Fault::Silent, 600),
            2 if self.case.any(SensorType::is_absolute) => {
                // Further than the sensor can move, either way: a smaller jump looks like a movement.
                let least = 2 * self.fastest_code();
                let away = least + self.random.below((self.code() - 2 * least) as u64) as i64;
                self.disturb(Fault::Jump(away), 300);
            }
            3 => self.disturb(Fault::NoIndex, 200),
            4 => self.overspeed(),
            5 => {
                self.reference();
                let at = self.random.below(2) as usize;
                self.preset(at);
            }
            6 => self.turn_round(),
            _ => {}
        }
    }

    fn disturb(&mut self, fault: Fault, longest: u64) {
        self.fault = fault;
        self.run_between(1, longest + 1);
        self.fault = Fault::None;
        self.run(5);
    }

    /// A quarter faster than allowed.
    fn overspeed(&mut self) {
        self.target = 1.25 * self.fastest() * self.random.signed().signum();
        self.run(150);
        self.target = 0.0;
        self.run(100);
    }

    /// Counts the other way, which leaves the position as it is. Where a position is not known, only a preset says what
    /// it is afterwards.
    fn turn_round(&mut self) {
        let steps = self.steps();
        self.device.turn_round();
        let scales = [0, 1].map(|at| self.device.scale(at));
        for ((anchor, shown), scale) in self.anchors.iter_mut().zip(&self.shown).zip(scales) {
            let known = anchor.filter(|_| !shown.is_condemned);
            *anchor = known.map(|anchor| Anchor { value: anchor.expected(steps), steps, scale });
        }
    }

    fn preset(&mut self, at: usize) {
        self.rest(2);
        let scale = self.device.scale(at);
        let value = self.random.below(scale.range().get()) as u32;
        self.device.preset(at, value, &self.raw);
        self.anchors[at] = Some(Anchor { value, steps: self.steps(), scale });
        // A preset stores all parameters, those of the other position included.
        self.stored = self.anchors;
        self.run(2);
        if self.shown[at].is_condemned {
            self.tally.stuck.push(format!("{:?}: condemned after a preset", self.case));
        }
    }

    /// The remedy of a user for a condemned position: a request, which is enough where the code is, then a preset.
    fn recover(&mut self) {
        self.rest(2);
        let is_to_be_believed =
            |world: &Self, at: usize| world.shown[at].is_condemned && world.code_is_enough(at);
        if (0..2).any(|at| is_to_be_believed(self, at)) && self.device.acknowledge() {
            self.run(2);
            if (0..2).any(|at| is_to_be_believed(self, at)) {
                self.tally.stuck.push(format!("{:?}: condemned after a request", self.case));
            }
        }
        for at in 0..2 {
            if self.shown[at].is_condemned && self.random.one_in(2) {
                self.reference();
                self.preset(at);
            }
        }
    }

    fn code_is_enough(&self, at: usize) -> bool {
        let (scale, sensor) = (self.device.scale(at), self.device.sensor(at));
        let range = u128::from(scale.range().get()) * u128::from(scale.turn().get());
        let units = (1_u128 << sensor.bits()) * u128::from(scale.units());
        sensor.kind.is_absolute() && units.is_multiple_of(range)
    }

    fn restart(&mut self) {
        let reset = [Reset::Warm, Reset::Battery, Reset::NoBattery][self.random.below(3) as usize];
        let is_at_rest = self.random.one_in(2);
        if is_at_rest {
            self.rest(120);
            self.run_between(0, 200);
        } else {
            self.target = self.speed_of_choice();
            self.run(100);
        }
        let millis =
            if reset == Reset::Warm { 60 + self.random.below(1500) } else { self.random.below(20_000) };
        self.device.restart(reset);
        if is_at_rest {
            self.at += self.movement_at_rest(reset);
        } else {
            self.coast(millis, reset);
        }
        self.start(reset);
    }

    /// A shaft without a drive may be turned: less than half of a code with a battery, a quarter without. An
    /// incremental one must rest, unless it still turns when the node is back.
    fn movement_at_rest(&mut self, reset: Reset) -> f64 {
        let part = if reset == Reset::NoBattery { 0.24 } else { 0.45 };
        let part_of_code = part * self.code() as f64;
        if self.case.is_absolute() {
            return (self.random.signed() * part_of_code).trunc();
        }
        if self.random.one_in(4) {
            // One that creeps is seen when it has left its place by more than a step: some milliseconds later.
            let part = self.random.signed();
            // A code beside it has the limits of a code, which the first milliseconds count to as well.
            let has_code = self.case.any(SensorType::is_absolute);
            let (share, most) = if has_code { (0.4, 0.24 * self.code() as f64) } else { (1.0, 50_000.0) };
            self.speed = share * part * self.fastest() + 4.0 * part.signum();
            self.target = self.speed;
            return self.random.signed() * most;
        }
        0.0
    }

    /// The shaft turns on, slower and slower, or driven by a motor.
    fn coast(&mut self, millis: u64, reset: Reset) {
        let is_driven = reset == Reset::Warm || self.random.one_in(3);
        let mut way = self.speed * millis as f64;
        if !is_driven {
            let stop = 300.0 + self.random.below(5000) as f64;
            let time = (millis as f64).min(stop);
            way = self.speed * (time - time * time / (2.0 * stop));
            self.speed *= 1.0 - time / stop;
        }
        // A long code is longer than the way of its shaft while the power is off.
        let most = 0.24 * self.code() as f64;
        let is_long =
            self.case.any(|kind| matches!(kind, SensorType::MultiTurn | SensorType::LinearAbsolute));
        self.at += if is_long { way.clamp(-most, most) } else { way };
    }

    fn start(&mut self, reset: Reset) {
        self.reset = reset;
        self.counted_from = self.steps();
        self.before = [self.steps(); 4];
        self.anchors = self.stored;
        self.fault = Fault::None;
        self.age = 0;
        let kinds = self.case.kinds().map(SensorType::code);
        let sensors = if kinds[0] == kinds[1] { &kinds[..1] } else { &kinds };
        sensors.iter().for_each(|kind| self.tally.row(*kind, reset).resets += 1);
        self.run(5);
        let steps = self.steps();
        for (at, kind) in kinds.into_iter().enumerate() {
            let Some(anchor) = self.anchors[at] else { continue };
            if self.shown[at].is_condemned {
                let is_right = self.error(at, anchor.expected(steps)) <= self.tolerance(at);
                let row = self.tally.row(kind, reset);
                row.condemned += 1;
                row.condemned_right += u32::from(is_right);
            }
        }
    }

    fn steps(&self) -> i64 {
        self.at.floor() as i64
    }

    fn millisecond(&mut self) {
        let most = self.fastest() / 40.0;
        self.speed += (self.target - self.speed).clamp(-most, most);
        let last = self.steps();
        self.at += self.speed;
        self.before.rotate_right(1);
        self.before[0] = self.steps();
        self.raw = self.readings(last);
        self.age += 1;
        self.shown = self.device.sample(&self.raw);
        self.judge();
    }

    /// The index is at the zero of a revolution, or at the only zero of a linear encoder.
    fn readings(&mut self, last: i64) -> RawEncoder {
        let steps = self.steps();
        let count = |steps: i64| (steps - self.counted_from) as u16;
        let mark = if self.case.has_one_mark() { i64::MAX / 4 } else { REVOLUTION };
        let has_crossed = last.div_euclid(mark) != steps.div_euclid(mark);
        let zero = last.div_euclid(mark).max(steps.div_euclid(mark)) * mark;
        let jump = if let Fault::Jump(away) = self.fault { away } else { 0 };
        // The first word comes a millisecond after the start.
        let has_word = self.age > 0 && self.fault != Fault::Silent;
        RawEncoder {
            counter: count(steps),
            index: (self.case.index && has_crossed && self.fault != Fault::NoIndex).then(|| count(zero)),
            ssi: has_word.then(|| frame(steps + jump)),
            ..RawEncoder::default()
        }
    }

    fn judge(&mut self) {
        let (reset, steps) = (self.reset, self.steps());
        if self.age < 2 {
            // The first word has not come yet.
            return;
        }
        for at in 0..2 {
            let Some(anchor) = self.anchors[at] else { continue };
            let expected = anchor.expected(steps);
            if self.shown[at].is_condemned || self.error(at, expected) <= self.tolerance(at) {
                continue;
            }
            self.tally.row(self.case.kinds()[at].code(), reset).wrong_as_right += 1;
            if self.tally.examples.len() < 3 {
                let shown = self.shown[at];
                self.tally.examples.push(format!(
                    "{:?} after {reset:?}, ms {}, {:?}: {shown:?} at {at} and not {expected}, {} steps/ms",
                    self.case, self.age, self.fault, self.speed
                ));
            }
        }
    }

    fn error(&self, at: usize, expected: u32) -> u64 {
        let range = self.device.scale(at).range().get();
        let difference = u64::from(self.shown[at].position.abs_diff(expected));
        difference.min(range.saturating_sub(difference))
    }

    /// The step at a limit of a unit, the tolerance of the index, and the age of a reading that is tolerated.
    fn tolerance(&self, at: usize) -> u64 {
        let moved = self.before.iter().map(|before| before.abs_diff(self.steps())).max().unwrap_or(0);
        let scale = self.device.scale(at);
        let units = u128::from(moved + 4) * u128::from(scale.units()) / u128::from(scale.turn().get());
        units as u64 + 2
    }
}

/// A frame of 12 + 13 bits in Gray code.
fn frame(steps: i64) -> SsiFrame {
    let bits = Format::COMMON.position_bits();
    let position = steps.rem_euclid(1 << bits) as u64;
    let code = position ^ (position >> 1);
    SsiFrame { bits: ((1 << bits) | code) << 2, clocks: bits + 3 }
}
