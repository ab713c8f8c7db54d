//! The wire: stations with bit clocks of their own drive it and sample it, from a start of frame until it is idle.

use crate::bits::{DOMINANT, Level, RECESSIVE};
use crate::faults::{Flip, SeenBy};
use crate::station::{Notice, Station};
use crate::{Attachment, BitTiming, Frame, Time};

/// What makes participants alike on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Nature {
    pub(crate) attachment: Attachment,
    /// What it begins to send.
    pub(crate) frame: Option<Frame>,
}

/// A station and its bit clock.
pub(crate) struct Tap {
    /// The participants that it stands for.
    pub(crate) members: Vec<usize>,
    /// What its members have in common; `None` for one that is unlike all others.
    pub(crate) nature: Option<Nature>,
    contender: bool,
    station: Station,
    timing: BitTiming,
    /// When the current bit began by the bit clock, and its number.
    began: Time,
    number: usize,
    /// What is driven since when, and what was driven before.
    drives: Level,
    driven: Time,
    drove: Level,
    /// When what is driven last changed from recessive to dominant.
    turned: Option<Time>,
    /// What was sampled last, and when.
    last: Level,
    sampled: Time,
    /// One edge in a bit moves the clock.
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

    /// Whether the next frame has to wait for it. A station at another rate can delay it by a flag only.
    fn is_busy(&self, timing: BitTiming) -> bool {
        if self.timing.is_near(timing) { !self.station.is_done() } else { self.station.threatens() }
    }

    fn level_at(&self, at: Time) -> Level {
        if at < self.driven { self.drove } else { self.drives }
    }

    /// Until when it holds the level that it has at `at`.
    fn holds_until(&self, at: Time) -> Time {
        if at < self.driven { self.driven } else { self.began + self.timing.bit() }
    }

    /// Whether an edge between its last sample point and its next one would move its clock.
    fn looks_for_edges(&self) -> bool {
        !self.is_synchronised && self.last == RECESSIVE
    }

    /// An edge from recessive to dominant that others have made since its last sample point: resynchronisation.
    fn on_edge(&mut self, edge: Time) {
        if edge < self.began {
            let began = self.began - self.timing.sooner(self.began - edge);
            let driven = began.max(edge);
            self.turned = self.turned.map(|at| if at == self.driven { driven } else { at });
            (self.began, self.driven) = (began, driven);
        } else if self.drives == RECESSIVE {
            // Somebody who sends a dominant bit does not follow an edge that comes late: it may be the echo of its own.
            self.began += self.timing.longer(edge - self.began);
        }
        self.is_synchronised = true;
    }

    fn sample(&mut self, wire: Level, flips: &[Flip]) -> Option<(Time, Notice)> {
        let flipped = flips.iter().any(|flip| flip.bit == self.number && self.is_hit_by(flip));
        let level = wire ^ flipped;
        (self.last, self.sampled) = (level, self.sample_point());
        let notice = self.station.sample(level);
        // An error is reported for the instant at which the last flag has ended, the rest for the end of its bit.
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

/// Something that happened to the members of a tap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Happening {
    pub(crate) at: Time,
    pub(crate) tap: usize,
    pub(crate) notice: Notice,
}

/// Everything that happened, in order, and when the wire was free again.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) happenings: Vec<Happening>,
    /// When the last dominant bit ended.
    pub(crate) recessive: Time,
    /// End of the intermission.
    pub(crate) end: Time,
}

/// Runs the wire from the start of frame at `start` until the stations at about the rate of the transmitter are ready for the
/// next frame. `flips` are the bits that some of them read inverted.
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

/// Moves the bit clocks to the edges that came since their last sample points. An edge at the begin of a bit moves none.
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

/// A station at another rate may still be in its flag or delimiter. The next frame overtakes it: it reports now.
fn finish(taps: &mut [Tap], course: &mut Course) {
    for (n, tap) in taps.iter_mut().enumerate() {
        let report = tap.station.take_report();
        course.happenings.extend(report.map(|notice| Happening { at: course.end, tap: n, notice }));
    }
    course.happenings.iter_mut().for_each(|happening| happening.at = happening.at.min(course.end));
    course.happenings.sort_by_key(|happening| happening.at);
}
