//! The order of jobs. An SDO server serves one transfer at a time, so a node has one job at a time, in the order of the
//! requests.

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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Haste {
    /// A page waits for the job.
    Asked,
    /// No page waits for the job. Such jobs run one at a time, and after all other jobs of their lane.
    Background,
}

/// The jobs that wait, and the lanes of the running jobs.
pub(super) struct Schedule<J> {
    waiting: Vec<(Lane, Haste, J)>,
    running: Vec<(u64, Lane, Haste)>,
    next: u64,
}

impl<J> Default for Schedule<J> {
    fn default() -> Schedule<J> {
        Schedule { waiting: Vec::new(), running: Vec::new(), next: 0 }
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
    pub(super) fn add(&mut self, lane: Lane, haste: Haste, job: J) {
        self.waiting.push((lane, haste, job));
    }

    /// A job that may begin now, with its number. Older jobs of the same lane come first. Later jobs do not overtake an
    /// urgent older one, so that a job that needs everything gets its turn. A job of a node waits while another client
    /// of the bus uses the SDO server of the node.
    pub(super) fn next(&mut self, is_used: impl Fn(NodeId) -> bool) -> Option<(u64, J)> {
        let is_free = |lane: Lane| !matches!(lane, Lane::Node(node) if is_used(node));
        let place =
            (0..self.waiting.len()).find(|&place| is_free(self.waiting[place].0) && self.may_begin(place))?;
        let (lane, haste, job) = self.waiting.remove(place);
        self.next += 1;
        self.running.push((self.next, lane, haste));
        Some((self.next, job))
    }

    fn may_begin(&self, place: usize) -> bool {
        let (lane, haste, _) = &self.waiting[place];
        let is_background = *haste == Haste::Background;
        let is_held_up_by = |other: Lane, other_haste: Haste| {
            lane.excludes(other) || (is_background && other_haste == Haste::Background)
        };
        let by_running = self.running.iter().any(|(_, other, haste)| is_held_up_by(*other, *haste));
        let by_older = self.waiting[..place]
            .iter()
            .any(|(other, haste, _)| lane.excludes(*other) && (*haste == Haste::Asked || is_background));
        let by_hasty = is_background
            && self.waiting.iter().any(|(other, haste, _)| lane.excludes(*other) && *haste == Haste::Asked);
        !by_running && !by_older && !by_hasty
    }

    /// Removes a finished job.
    pub(super) fn done(&mut self, number: u64) {
        self.running.retain(|(running, ..)| *running != number);
    }

    /// Whether a job of this lane waits or runs.
    pub(super) fn has(&self, lane: Lane) -> bool {
        self.waiting.iter().any(|(other, ..)| *other == lane)
            || self.running.iter().any(|(_, other, _)| *other == lane)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(id: u8) -> Lane {
        Lane::Node(NodeId::new(id).unwrap())
    }

    fn begun(schedule: &mut Schedule<&'static str>) -> Vec<&'static str> {
        std::iter::from_fn(|| schedule.next(|_| false)).map(|(_, job)| job).collect()
    }

    #[test]
    fn a_node_has_one_job_at_a_time_in_their_order() {
        let mut schedule = Schedule::default();
        schedule.add(node(1), Haste::Asked, "a");
        schedule.add(node(1), Haste::Asked, "b");
        schedule.add(node(2), Haste::Asked, "c");
        schedule.add(Lane::Nothing, Haste::Asked, "d");
        assert_eq!(begun(&mut schedule), ["a", "c", "d"]);
        schedule.done(1);
        assert_eq!(begun(&mut schedule), ["b"]);
    }

    #[test]
    fn what_needs_everything_waits_for_all_and_is_not_overtaken() {
        let mut schedule = Schedule::default();
        schedule.add(node(1), Haste::Asked, "a");
        schedule.add(Lane::Everything, Haste::Asked, "b");
        schedule.add(node(2), Haste::Asked, "c");
        schedule.add(Lane::Lss, Haste::Asked, "d");
        assert_eq!(begun(&mut schedule), ["a"]);
        schedule.done(1);
        assert_eq!(begun(&mut schedule), ["b"]);
        schedule.done(2);
        assert_eq!(begun(&mut schedule), ["c", "d"]);
    }

    #[test]
    fn a_job_waits_while_another_client_uses_its_node() {
        let mut schedule = Schedule::default();
        schedule.add(node(1), Haste::Asked, "a");
        schedule.add(node(2), Haste::Asked, "b");
        let one = NodeId::new(1).unwrap();
        assert_eq!(schedule.next(|node| node == one), Some((1, "b")));
        assert_eq!(schedule.next(|node| node == one), None);
        assert_eq!(schedule.next(|_| false), Some((2, "a")));
    }

    #[test]
    fn what_is_good_to_know_comes_one_at_a_time_and_last() {
        let mut schedule = Schedule::default();
        schedule.add(node(1), Haste::Background, "a");
        schedule.add(node(2), Haste::Background, "b");
        schedule.add(node(1), Haste::Asked, "c");
        assert_eq!(begun(&mut schedule), ["b", "c"]);
        schedule.done(1);
        assert_eq!(begun(&mut schedule), [""; 0]);
        schedule.done(2);
        assert_eq!(begun(&mut schedule), ["a"]);
        assert!(schedule.has(node(1)) && !schedule.has(node(2)));
    }
}
