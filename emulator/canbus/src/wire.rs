//! The wire: stations with their own bit clocks drive and sample it, from a start of frame until the wire is idle.

use crate::bits::{DOMINANT, Level, RECESSIVE};
use crate::faults::{Flip, SeenBy};
use crate::station::{Notice, Station};
use crate::{Attachment, BitTiming, Frame, Time};

/// The properties in which participants with identical behaviour on the wire agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Nature {
    pub(crate) attachment: Attachment,
    /// The frame that the participant begins to send.
    pub(crate) frame: Option<Frame>,
}

/// A station and its bit clock.
pub(crate) struct Tap {
    /// The participants that the tap stands for.
    pub(crate) members: Vec<usize>,
    /// The common properties of the members; `None` for a participant that has no equal.
    pub(crate) nature: Option<Nature>,
    contender: bool,
    station: Station,
    timing: BitTiming,
    /// The instant at which the current bit began by the bit clock; `number` is the number of the bit.
    began: Time,
    number: usize,
    /// The driven level, the instant since which it is driven, and the level driven before.
    drives: Level,
    driven: Time,
    drove: Level,
    /// The instant of the last change of the driven level from recessive to dominant.
    turned: Option<Time>,
    /// The last sampled level, and the instant of the sample.
    last: Level,
    sampled: Time,
    /// Whether an edge has moved the clock in this bit: at most one edge does.
    is_synchronised: bool,
}

impl Tap {
    /// A tap for one participant. An `unlike` one takes no further members.
    pub(crate) fn new(member: usize, nature: Nature, timing: BitTiming, unlike: bool) -> Tap {
        let station = Station::new(nature.attachment, nature.frame.as_ref());
        let drives = station.drives();
        Tap {
            members: vec![member],
            nature: (!unlike).then_some(nature),
            contender: nature.frame.is_some(),
            station,
            timing,
            began: Time::ZERO,
            number: 0,
            drives,
            driven: Time::ZERO,
            drove: RECESSIVE,
            turned: None,
            last: RECESSIVE,
            sampled: Time::ZERO,
            is_synchronised: true,
        }
    }

    /// Hard synchronisation: the edge of the start of frame begins the first bit.
    fn start(&mut self, at: Time) {
        (self.began, self.driven, self.sampled) = (at, at, at);
        self.turned = (self.drives == DOMINANT).then_some(at);
    }

    fn sample_point(&self) -> Time {
        self.began + self.timing.sample_point()
    }

    /// Whether the next frame has to wait for the station. A station at another rate can delay the next frame by its
    /// flag only.
    fn is_busy(&self, timing: BitTiming) -> bool {
        if self.timing.is_near(timing) { !self.station.is_done() } else { self.station.threatens() }
    }

    fn level_at(&self, at: Time) -> Level {
        if at < self.driven { self.drove } else { self.drives }
    }

    /// The instant until which the station holds the level that it drives at `at`.
    fn holds_until(&self, at: Time) -> Time {
        if at < self.driven { self.driven } else { self.began + self.timing.bit() }
    }

    /// Whether an edge between the last and the next sample point would move the clock.
    fn looks_for_edges(&self) -> bool {
        !self.is_synchronised && self.last == RECESSIVE
    }

    /// Resynchronisation: another station has made an edge from recessive to dominant since the last sample point.
    fn on_edge(&mut self, edge: Time) {
        if edge < self.began {
            let began = self.began - self.timing.sooner(self.began - edge);
            let driven = began.max(edge);
            self.turned = self.turned.map(|at| if at == self.driven { driven } else { at });
            (self.began, self.driven) = (began, driven);
        } else if self.drives == RECESSIVE {
            // A station that sends a dominant bit does not follow a late edge: the edge may be an echo of its own bit.
            self.began += self.timing.longer(edge - self.began);
        }
        self.is_synchronised = true;
    }

    fn sample(&mut self, wire: Level, flips: &[Flip]) -> Option<(Time, Notice)> {
        let flipped = flips.iter().any(|flip| flip.bit == self.number && self.is_hit_by(flip));
        let level = wire ^ flipped;
        (self.last, self.sampled) = (level, self.sample_point());
        let notice = self.station.sample(level);
        // An error is reported for the end of the last error flag, any other notice for the end of its bit.
        let began = self.began;
        self.began += self.timing.bit();
        self.number += 1;
        self.is_synchronised = false;
        self.drove = self.drives;
        self.drives = self.station.drives();
        self.driven = self.began;
        if (self.drove, self.drives) == (RECESSIVE, DOMINANT) {
            self.turned = Some(self.began);
        }
        notice.map(|notice| (if matches!(notice, Notice::Error(_)) { began } else { self.began }, notice))
    }

    fn is_hit_by(&self, flip: &Flip) -> bool {
        match flip.seen_by {
            SeenBy::Everyone => true,
            SeenBy::Transmitters => self.contender,
            SeenBy::Participant(n) => self.members.contains(&n),
        }
    }
}

/// An event for the members of a tap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Happening {
    pub(crate) at: Time,
    pub(crate) tap: usize,
    pub(crate) notice: Notice,
}

/// All events in order, and the instant at which the wire is free again.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) happenings: Vec<Happening>,
    /// The end of the last dominant bit.
    pub(crate) recessive: Time,
    /// End of the intermission.
    pub(crate) end: Time,
}

/// Runs the wire from the start of frame at `start` until all stations at about the transmitter's bit rate are ready
/// for the next frame. `flips` are the bits that some stations read inverted.
pub(crate) fn run(taps: &mut [Tap], start: Time, timing: BitTiming, flips: &[Flip]) -> Course {
    let mut course = Course { happenings: Vec::new(), recessive: start, end: start };
    taps.iter_mut().for_each(|tap| tap.start(start));
    while taps.iter().any(|tap| tap.is_busy(timing)) {
        synchronise(taps);
        let Some(at) = taps.iter().map(Tap::sample_point).min() else { break };
        let dominant =
            taps.iter().filter(|tap| tap.level_at(at) == DOMINANT).map(|tap| tap.holds_until(at)).max();
        let level = if dominant.is_some() { DOMINANT } else { RECESSIVE };
        course.recessive = dominant.unwrap_or(course.recessive);
        for (n, tap) in taps.iter_mut().enumerate().filter(|(_, tap)| tap.sample_point() == at) {
            let happening = tap.sample(level, flips);
            course.happenings.extend(happening.map(|(at, notice)| Happening { at, tap: n, notice }));
        }
    }
    course.end =
        taps.iter().filter(|tap| tap.timing.is_near(timing)).map(|tap| tap.began).max().unwrap_or(start);
    finish(taps, &mut course);
    course
}

/// Moves the bit clocks to the edges since their last sample points. An edge at the begin of a bit moves no clock.
fn synchronise(taps: &mut [Tap]) {
    for n in 0..taps.len() {
        let tap = &taps[n];
        if !tap.looks_for_edges() {
            continue;
        }
        let window = |at: &Time| *at > tap.sampled && *at <= tap.sample_point();
        let others = taps.iter().enumerate().filter(|(other, _)| *other != n);
        let edge = others.filter_map(|(_, other)| other.turned).filter(window).min();
        if let Some(edge) = edge.filter(|edge| *edge != tap.began) {
            taps[n].on_edge(edge);
        }
    }
}

/// A station at another bit rate may still be in its flag or delimiter. It reports its error now, because the next
/// frame begins.
fn finish(taps: &mut [Tap], course: &mut Course) {
    for (n, tap) in taps.iter_mut().enumerate() {
        let report = tap.station.take_report();
        course.happenings.extend(report.map(|notice| Happening { at: course.end, tap: n, notice }));
    }
    course.happenings.iter_mut().for_each(|happening| happening.at = happening.at.min(course.end));
    course.happenings.sort_by_key(|happening| happening.at);
}
