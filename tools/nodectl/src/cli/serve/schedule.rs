//! The order of jobs. An SDO server serves one transfer at a time, so a node has one job at a time. Jobs of pages with the
//! token come first, then the other pages take turns, and a page that leaves takes its waiting jobs with it.

use std::collections::BTreeMap;

use crate::page::PageId;
use canopen::NodeId;

/// The resource that a job needs exclusively.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lane {
    /// The SDO server of a node.
    Node(NodeId),
    /// The SDO servers of all nodes, and LSS.
    Everything,
    /// LSS, which selects nodes.
    Lss,
    /// Nothing: the job sends a single frame.
    Nothing,
}

/// The urgency of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Haste {
    /// A page with the token waits for the job. Other jobs of the lane make way for it between two of their transfers.
    Token,
    /// A page without the token waits for the job, or several pages do.
    Asked,
    /// No page waits for the job. Such jobs run one at a time, and after all other jobs of their lane.
    Background,
}

/// A job that waits.
struct Waiting<J> {
    lane: Lane,
    haste: Haste,
    page: Option<PageId>,
    job: J,
}

/// A job that has begun.
struct Running {
    number: u64,
    lane: Lane,
    haste: Haste,
    /// The job has stopped between two transfers, and waits for its turn.
    is_parked: bool,
}

/// The jobs that wait, and the lanes of the running jobs.
pub(super) struct Schedule<J> {
    waiting: Vec<Waiting<J>>,
    running: Vec<Running>,
    next: u64,
    /// The number of the last job of each page.
    served: BTreeMap<Option<PageId>, u64>,
}

impl<J> Default for Schedule<J> {
    fn default() -> Schedule<J> {
        Schedule { waiting: Vec::new(), running: Vec::new(), next: 0, served: BTreeMap::new() }
    }
}

impl Lane {
    fn excludes(self, other: Lane) -> bool {
        match (self, other) {
            (Lane::Nothing, _) | (_, Lane::Nothing) => false,
            (Lane::Everything, _) | (_, Lane::Everything) => true,
            (lane, other) => lane == other,
        }
    }
}

impl<J> Schedule<J> {
    pub(super) fn add(&mut self, lane: Lane, haste: Haste, page: Option<PageId>, job: J) {
        self.waiting.push(Waiting { lane, haste, page, job });
    }

    /// A job that may begin now, with its number. Later jobs do not overtake an earlier one, so that a job that needs
    /// everything gets its turn. A job of a node waits while another client of the bus uses the SDO server of the node.
    pub(super) fn next(&mut self, is_used: impl Fn(NodeId) -> bool) -> Option<(u64, J)> {
        let is_free = |lane: Lane| !matches!(lane, Lane::Node(node) if is_used(node));
        let order = self.order();
        let place = (0..order.len())
            .find(|&turn| is_free(self.waiting[order[turn]].lane) && self.may_begin(&order, turn))
            .map(|turn| order[turn])?;
        let Waiting { lane, haste, page, job } = self.waiting.remove(place);
        self.next += 1;
        self.served.insert(page, self.next);
        self.running.push(Running { number: self.next, lane, haste, is_parked: false });
        Some((self.next, job))
    }

    /// The places of the waiting jobs in the order of their turns: by urgency; of one urgency the page first that has
    /// waited longest for the begin of a job; of one page the oldest job.
    fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.waiting.len()).collect();
        order.sort_by_key(|&place| {
            let Waiting { haste, page, .. } = &self.waiting[place];
            (*haste, self.served.get(page).copied().unwrap_or(0))
        });
        order
    }

    fn may_begin(&self, order: &[usize], turn: usize) -> bool {
        let Waiting { lane, haste, .. } = &self.waiting[order[turn]];
        let is_background = *haste == Haste::Background;
        let by_running = self.running.iter().any(|running| {
            let makes_way = running.is_parked && *haste == Haste::Token;
            (lane.excludes(running.lane) && !makes_way)
                || (is_background && running.haste == Haste::Background)
        });
        let by_earlier = order[..turn].iter().any(|&place| lane.excludes(self.waiting[place].lane));
        !by_running && !by_earlier
    }

    /// The running jobs that have to make way for a job of a page with the token.
    pub(super) fn to_park(&self) -> impl Iterator<Item = u64> {
        let to_park = self.running.iter().filter(|running| {
            running.haste != Haste::Token && !running.is_parked && self.is_wanted(running.lane)
        });
        to_park.map(|running| running.number)
    }

    fn is_wanted(&self, lane: Lane) -> bool {
        self.waiting.iter().any(|waiting| waiting.haste == Haste::Token && lane.excludes(waiting.lane))
    }

    /// Notes that a job has stopped between two transfers.
    pub(super) fn park(&mut self, number: u64) {
        self.running
            .iter_mut()
            .filter(|running| running.number == number)
            .for_each(|running| running.is_parked = true);
    }

    /// A parked job that may continue.
    pub(super) fn resume(&mut self) -> Option<u64> {
        let place = (0..self.running.len()).find(|&place| {
            let Running { lane, is_parked, .. } = self.running[place];
            let is_free = !self.running.iter().any(|other| !other.is_parked && lane.excludes(other.lane));
            is_parked && is_free && !self.is_wanted(lane)
        })?;
        self.running[place].is_parked = false;
        Some(self.running[place].number)
    }

    /// Removes a finished job.
    pub(super) fn done(&mut self, number: u64) {
        self.running.retain(|running| running.number != number);
    }

    /// Removes the waiting jobs of a page that has left.
    pub(super) fn leave(&mut self, page: PageId) -> Vec<J> {
        self.served.remove(&Some(page));
        self.waiting.extract_if(.., |waiting| waiting.page == Some(page)).map(|waiting| waiting.job).collect()
    }

    /// Whether a job of this lane waits or runs.
    pub(super) fn has(&self, lane: Lane) -> bool {
        self.waiting.iter().any(|waiting| waiting.lane == lane)
            || self.running.iter().any(|running| running.lane == lane)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(id: u8) -> Lane {
        Lane::Node(NodeId::new(id).unwrap())
    }

    /// Three pages.
    fn pages() -> [PageId; 3] {
        [1, 2, 3].map(PageId::new)
    }

    fn begun(schedule: &mut Schedule<&'static str>) -> Vec<&'static str> {
        std::iter::from_fn(|| schedule.next(|_| false)).map(|(_, job)| job).collect()
    }

    #[test]
    fn a_node_has_one_job_at_a_time_in_their_order() {
        let mut schedule = Schedule::default();
        schedule.add(node(1), Haste::Asked, None, "a");
        schedule.add(node(1), Haste::Asked, None, "b");
        schedule.add(node(2), Haste::Asked, None, "c");
        schedule.add(Lane::Nothing, Haste::Asked, None, "d");
        assert_eq!(begun(&mut schedule), ["a", "c", "d"]);
        schedule.done(1);
        assert_eq!(begun(&mut schedule), ["b"]);
    }

    #[test]
    fn an_exclusive_job_waits_for_all_and_is_not_overtaken() {
        let mut schedule = Schedule::default();
        schedule.add(node(1), Haste::Asked, None, "a");
        schedule.add(Lane::Everything, Haste::Asked, None, "b");
        schedule.add(node(2), Haste::Asked, None, "c");
        schedule.add(Lane::Lss, Haste::Asked, None, "d");
        assert_eq!(begun(&mut schedule), ["a"]);
        schedule.done(1);
        assert_eq!(begun(&mut schedule), ["b"]);
        schedule.done(2);
        assert_eq!(begun(&mut schedule), ["c", "d"]);
    }

    #[test]
    fn a_job_waits_while_another_client_uses_its_node() {
        let mut schedule = Schedule::default();
        schedule.add(node(1), Haste::Asked, None, "a");
        schedule.add(node(2), Haste::Asked, None, "b");
        let one = NodeId::new(1).unwrap();
        assert_eq!(schedule.next(|node| node == one), Some((1, "b")));
        assert_eq!(schedule.next(|node| node == one), None);
        assert_eq!(schedule.next(|_| false), Some((2, "a")));
    }

    #[test]
    fn background_reads_run_one_at_a_time_and_last() {
        let mut schedule = Schedule::default();
        schedule.add(node(1), Haste::Background, None, "a");
        schedule.add(node(2), Haste::Background, None, "b");
        schedule.add(node(1), Haste::Asked, None, "c");
        assert_eq!(begun(&mut schedule), ["c", "b"]);
        schedule.done(2);
        assert_eq!(begun(&mut schedule), [""; 0]);
        schedule.done(1);
        assert_eq!(begun(&mut schedule), ["a"]);
        assert!(schedule.has(node(1)) && !schedule.has(node(2)));
    }

    #[test]
    fn the_token_comes_first_and_the_other_pages_take_turns() {
        let [one, two, token] = pages();
        let mut schedule = Schedule::default();
        for (page, job) in [(one, "a1"), (one, "a2"), (one, "a3"), (two, "b1"), (two, "b2")] {
            schedule.add(node(1), Haste::Asked, Some(page), job);
        }
        let mut order = Vec::new();
        for number in 1..=6 {
            order.extend(begun(&mut schedule));
            if number == 2 {
                schedule.add(node(1), Haste::Token, Some(token), "token");
            }
            schedule.done(number);
        }
        assert_eq!(order, ["a1", "b1", "token", "a2", "b2", "a3"]);
    }

    #[test]
    fn a_running_job_makes_way_for_the_token_and_continues_before_others() {
        let [one, two, token] = pages();
        let mut schedule = Schedule::default();
        schedule.add(node(1), Haste::Asked, Some(one), "long");
        assert_eq!(begun(&mut schedule), ["long"]);
        schedule.add(node(1), Haste::Asked, Some(two), "next");
        assert_eq!(schedule.to_park().count(), 0);
        schedule.add(node(1), Haste::Token, Some(token), "token");
        assert_eq!(schedule.to_park().collect::<Vec<_>>(), [1]);
        assert_eq!(begun(&mut schedule), [""; 0], "a transfer runs");
        schedule.park(1);
        assert_eq!((begun(&mut schedule), schedule.resume()), (vec!["token"], None));
        schedule.done(2);
        assert_eq!((begun(&mut schedule), schedule.resume(), schedule.resume()), (vec![], Some(1), None));
        schedule.done(1);
        assert_eq!(begun(&mut schedule), ["next"]);
    }

    #[test]
    fn a_page_that_leaves_takes_its_jobs_with_it() {
        let [one, two, _] = pages();
        let mut schedule = Schedule::default();
        for (page, job) in [(one, "a"), (two, "b"), (one, "c"), (one, "d")] {
            schedule.add(node(1), Haste::Asked, Some(page), job);
        }
        assert_eq!(begun(&mut schedule), ["a"]);
        assert_eq!(schedule.leave(one), ["c", "d"]);
        schedule.done(1);
        assert_eq!(begun(&mut schedule), ["b"]);
    }
}
