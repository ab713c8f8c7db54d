//! The index of a sensor, and what it says about the [`Trust`] in the count.
//!
//! The first index corrects the position. From then on:
//!
//! * An index within two steps of its place confirms the count.
//! * An index elsewhere is not accepted: the position follows the count and is reported as an error. If the next index
//!   agrees with it to whole turns, the count was wrong and is corrected. If the next index is in its place, the odd
//!   index was a disturbance.
//! * A turn and a quarter without an index means that the index is missing.
//!
//! Movement faster than the sensor can follow puts the count in doubt, until an index confirms the count. Turns that
//! were lost with the retained state are not restored by an index, unless the position repeats with every turn. A
//! preset is a new reference and ends all of these errors.

use core::num::NonZeroU32;

use super::input::{SENSOR_INDEX, SENSOR_POSITION_ERROR, SENSOR_UNREFERENCED};
use super::trust::{ALL, Trust};

/// Steps by which the index may come too early or too late. The index is one quarter period wide and is seen at one
/// edge forwards and at the other backwards, and the capture may fall on either side of the step that causes it.
const TOLERANCE: u64 = 2;
/// Least distance in steps between two indexes of a linear encoder: a closer one is the same index again.
const ROD_APART: u32 = 64;

/// Result of the last index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Index {
    /// The index was in its place, or there was none yet.
    Right,
    /// The index did not come.
    Missing,
    /// The distance of the index from its place, in steps.
    Elsewhere(i64),
}

/// Properties of a sensor's index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Marks {
    /// The sensor has an index, and it is used.
    pub(super) is_used: bool,
    /// Steps between two indexes; `None` for a linear encoder, which has one index only.
    pub(super) turn: Option<NonZeroU32>,
    /// The position repeats from one index to the next, so the index alone determines the position.
    pub(super) suffice: bool,
    /// A sensor of a type that counts from its start: without a reference it is no error.
    pub(super) from_start: bool,
    /// A bit for each user whose position is reported.
    pub(super) users: u8,
}

/// The reference of one sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    marks: Marks,
    trust: Trust,
    index: Index,
    /// Steps since the last index.
    since: i32,
    /// Number of steps without an index beyond which the index is missing.
    too_many: u32,
    /// Bits of the sensor state that result.
    state: u8,
    /// The users whose position is not known.
    unknown: u8,
}

impl Reference {
    pub(super) fn new(marks: Marks, trust: Trust) -> Reference {
        let trust = Trust { flags: trust.flags & Trust::REFERENCED, ..trust };
        let mut new = Reference {
            marks,
            trust,
            index: Index::Right,
            since: 0,
            too_many: u32::MAX,
            state: 0,
            unknown: 0,
        };
        new.settle();
        new
    }

    /// Takes other parameters of the same sensor.
    pub(super) fn apply(&mut self, marks: Marks) {
        if marks != self.marks {
            if !marks.is_used {
                self.index = Index::Right;
            }
            (self.marks, self.since) = (marks, 0);
            self.settle();
        }
    }

    /// Bits of the sensor state.
    pub(super) fn state(&self) -> u8 {
        self.state
    }

    /// A bit for each user whose position is not known.
    pub(super) fn unknown(&self) -> u8 {
        self.unknown
    }

    /// The trust to be retained for the next start.
    #[inline]
    pub(super) fn trust(&self) -> Trust {
        let mut trust = self.trust;
        if self.index != Index::Right {
            trust.doubt();
        }
        trust
    }

    /// Takes note of a movement.
    pub(super) fn moved(&mut self, steps: i32) {
        self.since = self.since.saturating_add(steps);
        if self.since.unsigned_abs() > self.too_many {
            self.index = Index::Missing;
            self.settle();
        }
    }

    /// An index may have gone unseen: the distance to the next one restarts.
    pub(super) fn forgive(&mut self) {
        self.since = 0;
    }

    /// Steps may have been lost.
    #[cold]
    #[inline(never)]
    pub(super) fn doubt(&mut self) {
        self.trust.doubt();
        self.settle();
    }

    /// Turns may have been lost.
    #[cold]
    #[inline(never)]
    pub(super) fn lose(&mut self) {
        self.trust.lose();
        self.settle();
    }

    /// The sensor may have moved unseen, by any distance.
    #[cold]
    #[inline(never)]
    pub(super) fn unseen(&mut self) {
        self.trust = self.trust.unseen();
        self.settle();
    }

    /// Takes an index that came `error` steps from its place; the sensor has moved `since` steps after it. Returns the
    /// steps by which to correct the count.
    #[inline]
    pub(super) fn index(&mut self, error: i64, since: i32) -> i64 {
        let is_right = error.unsigned_abs() <= TOLERANCE;
        if is_right && self.trust.has(Trust::REFERENCED) && self.unknown == 0 && self.index == Index::Right {
            self.since = since;
            return 0;
        }
        self.doubtful_index(error, since)
    }

    /// Takes an index that is the first one, is wrong, or comes after an error.
    #[inline(never)]
    fn doubtful_index(&mut self, error: i64, since: i32) -> i64 {
        let apart = self.since.wrapping_sub(since).unsigned_abs();
        self.since = since;
        let is_first = !self.trust.has(Trust::REFERENCED);
        self.trust.flags |= Trust::REFERENCED;
        let is_right = error.unsigned_abs() <= TOLERANCE;
        let is_believed = is_first || is_right || self.agrees(error, apart);
        if is_believed {
            self.index = Index::Right;
            self.trust.users = if self.marks.suffice { 0 } else { self.trust.lost() };
        } else if self.is_another(apart) || !matches!(self.index, Index::Elsewhere(_)) {
            self.index = Index::Elsewhere(error);
        }
        self.settle();
        if is_first || (is_believed && !is_right) { error.wrapping_neg() } else { 0 }
    }

    /// Takes a preset of one user: its position is known, whatever was wrong before. What was wrong until now stays so
    /// for the other users. Returns the steps by which to correct the count.
    pub(super) fn preset(&mut self, user: u8) -> i64 {
        let correction = self.correction();
        if self.index == Index::Missing {
            self.since = 0;
        }
        self.trust = self.trust();
        self.index = Index::Right;
        self.trust.users &= !(user | user << 4);
        self.settle();
        correction
    }

    /// The steps by which to correct the count if the last index were accepted.
    #[inline]
    pub(super) fn correction(&self) -> i64 {
        if let Index::Elsewhere(error) = self.index { error.wrapping_neg() } else { 0 }
    }

    /// Whether the last index was as far from its place, apart from whole turns.
    fn agrees(&self, error: i64, apart: u32) -> bool {
        let Index::Elsewhere(before) = self.index else { return false };
        let difference = error.abs_diff(before);
        let is_turn = self.marks.turn.is_some_and(|turn| difference.abs_diff(turn.get().into()) <= TOLERANCE);
        self.is_another(apart) && (difference <= TOLERANCE || is_turn)
    }

    /// Whether an index `apart` steps from the last one is another index, and not the same one again.
    fn is_another(&self, apart: u32) -> bool {
        apart > self.marks.turn.map_or(ROD_APART, |turn| turn.get() / 2)
    }

    #[inline(never)]
    fn settle(&mut self) {
        let referenced = self.trust.has(Trust::REFERENCED);
        let Marks { is_used, from_start, users, .. } = self.marks;
        let is_wrong = self.index != Index::Right;
        self.unknown = if is_wrong { ALL } else { self.trust.unknown() };
        let (lost, doubted) = (self.trust.users & users != 0, self.trust.users >> 4 & users != 0);
        let bit = |set: bool, bits: u8| if set { bits } else { 0 };
        self.state = bit(lost || (is_used && !referenced), SENSOR_UNREFERENCED)
            | bit((lost && !from_start) || doubted, SENSOR_POSITION_ERROR)
            | bit(is_wrong, SENSOR_INDEX | SENSOR_POSITION_ERROR);
        // A missing index stays missing until it comes.
        let is_due = is_used && referenced && self.index != Index::Missing;
        let turn = self.marks.turn.filter(|_| is_due).map_or(u32::MAX, NonZeroU32::get);
        self.too_many = turn.saturating_add(turn / 4).saturating_add(4);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURN: i32 = 4096;
    const BAD: u8 = SENSOR_INDEX | SENSOR_POSITION_ERROR;

    fn marks() -> Marks {
        Marks { is_used: true, turn: NonZeroU32::new(4096), suffice: false, from_start: false, users: 1 }
    }

    /// A reference that has seen its index.
    fn seen() -> Reference {
        Reference::new(marks(), Trust { users: 0, flags: Trust::REFERENCED })
    }

    #[test]
    fn a_turn_and_a_quarter_without_an_index_is_a_missing_one() {
        for sign in [1, -1] {
            let mut reference = seen();
            reference.moved(sign * (TURN + TURN / 4 + 4));
            assert_eq!(reference.state(), 0);
            reference.moved(sign);
            assert_eq!(reference.state(), BAD);
            reference.moved(sign * i32::MAX);
            assert_eq!((reference.index(1, 0), reference.state()), (0, 0), "back in its place");
            reference.moved(sign * 2 * TURN);
            assert_eq!(reference.state(), BAD, "and missed again");
            assert_eq!((reference.preset(ALL), reference.state()), (0, 0));
            reference.moved(sign * 2 * TURN);
            assert_eq!(reference.state(), BAD, "a preset does not bring it back");
        }
    }

    #[test]
    fn one_index_elsewhere_is_not_believed_and_two_that_agree_are() {
        let mut reference = seen();
        reference.moved(TURN);
        assert_eq!((reference.index(96, 0), reference.state()), (0, BAD));
        for _ in 0..10 {
            reference.moved(-3);
            assert_eq!((reference.index(96, 0), reference.state()), (0, BAD), "the same one again");
        }
        reference.moved(TURN);
        assert_eq!((reference.index(97, 0), reference.state()), (-97, 0));
    }

    #[test]
    fn an_index_that_moves_on_is_never_believed() {
        let mut reference = seen();
        for n in 1..20 {
            reference.moved(4000);
            assert_eq!((reference.index(96 * n, 0), reference.state()), (0, BAD));
        }
    }

    #[test]
    fn a_disturbance_between_two_indexes_ends_at_the_next() {
        let mut reference = seen();
        reference.moved(1000);
        assert_eq!((reference.index(1000, 0), reference.state()), (0, BAD));
        reference.moved(3096);
        assert_eq!((reference.index(0, 0), reference.state()), (0, 0));
    }

    #[test]
    fn half_a_turn_is_as_far_one_way_as_the_other() {
        let mut reference = seen();
        reference.moved(TURN);
        reference.index(2048, 0);
        reference.moved(TURN);
        assert_eq!((reference.index(-2047, 0), reference.state()), (2047, 0));
    }

    #[test]
    fn doubt_ends_with_an_index_and_lost_turns_end_with_a_preset() {
        let mut reference = seen();
        reference.doubt();
        assert_eq!(reference.state(), SENSOR_POSITION_ERROR);
        reference.index(0, 0);
        assert_eq!(reference.state(), 0);
        reference.lose();
        reference.index(0, 0);
        assert_eq!(reference.state(), SENSOR_UNREFERENCED | SENSOR_POSITION_ERROR);
        assert_eq!(reference.trust().lost(), ALL);
        reference.preset(ALL);
        assert_eq!(reference.state(), 0);
        let mut reference = Reference::new(Marks { suffice: true, ..marks() }, Trust::default());
        reference.lose();
        assert_eq!(
            (reference.index(500, 0), reference.state()),
            (-500, 0),
            "the position repeats every turn"
        );
    }
}
