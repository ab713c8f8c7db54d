//! The wire: stations with bit clocks of their own drive it and sample it, from a start of frame until it is idle.

use crate::bits::{DOMINANT, Level, RECESSIVE};
use crate::faults::{Flip, SeenBy};
use crate::station::{Notice, Station};
use crate::{Attachment, Frame, Time};

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
    bit: Time,
    /// When the current bit began, its number, what is driven in it, and what was driven before.
    began: Time,
    number: usize,
    drives: Level,
    drove: Level,
}

impl Tap {
    /// A tap for one participant. An `unlike` one takes no further members.
    pub(crate) fn new(member: usize, nature: Nature, bit: Time, unlike: bool) -> Tap {
        let station = Station::new(nature.attachment, nature.frame.as_ref());
        let drives = station.drives();
        Tap {
            members: vec![member],
            nature: (!unlike).then_some(nature),
            contender: nature.frame.is_some(),
            station,
            bit,
            began: Time::ZERO,
            number: 0,
            drives,
            drove: RECESSIVE,
        }
    }

    /// The sample point at 87.5 % of the bit, as CiA 301 recommends.
    fn sample_point(&self) -> Time {
        self.began + Time(self.bit.0 / 8 * 7)
    }

    /// Whether the next frame has to wait for it. A station at another rate can delay it by a flag only.
    fn is_busy(&self, bit: Time) -> bool {
        if self.bit == bit { !self.station.is_done() } else { self.station.threatens() }
    }

    fn level_at(&self, at: Time) -> Level {
        if at < self.began { self.drove } else { self.drives }
    }

    /// Until when it holds the level that it has at `at`.
    fn holds_until(&self, at: Time) -> Time {
        if at < self.began { self.began } else { self.began + self.bit }
    }

    fn sample(&mut self, wire: Level, flips: &[Flip]) -> Option<(Time, Notice)> {
        let flipped = flips.iter().any(|flip| flip.bit == self.number && self.is_hit_by(flip));
        let notice = self.station.sample(wire ^ flipped);
        // An error is reported for the instant at which the last flag has ended, the rest for the end of its bit.
        let began = self.began;
        self.began += self.bit;
        self.number += 1;
        self.drove = self.drives;
        self.drives = self.station.drives();
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

/// Runs the wire from the start of frame at `start` until the stations at the rate `bit` are ready for the next
/// frame. `flips` are the bits that some of them read inverted.
pub(crate) fn run(taps: &mut [Tap], start: Time, bit: Time, flips: &[Flip]) -> Course {
    let mut course = Course { happenings: Vec::new(), recessive: start, end: start };
    taps.iter_mut().for_each(|tap| tap.began = start);
    while taps.iter().any(|tap| tap.is_busy(bit)) {
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
    course.end = taps.iter().filter(|tap| tap.bit == bit).map(|tap| tap.began).max().unwrap_or(start);
    finish(taps, &mut course);
    course
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
