//! Periodic work of the pump: events for the pages, and jobs that no page has requested.

use canopen::nmt::State;
use canopen::{Duration, Instant, NodeId};
use serde_json::json;

use super::{ACTIVE, AFTER_BOOT, ALONE, ASK_AGAIN, CALM, Pump, SETTLED, Waiting};
use crate::bus::clock;
use crate::cli::serve::jobs;
use crate::cli::serve::nodes::Node;
use crate::cli::serve::schedule::{Haste, Lane};
use crate::cli::serve::status;
use crate::object::at;

impl Pump {
    pub(super) fn tick(&mut self) {
        self.reopen();
        let now = clock::now();
        if is_due(&mut self.due.live, now, 40) {
            let t = self.now();
            let (batches, lost) = self.live.take();
            self.pages.tell_samples(&self.setup.hub, t, &batches, lost);
        }
        if is_due(&mut self.due.trace, now, 50) {
            let (rows, lost) = self.tracer.take();
            self.pages.tell_rows(&self.setup.hub, &rows, lost);
        }
        if is_due(&mut self.due.nodes, now, 200) {
            self.look_at_nodes();
        }
        if is_due(&mut self.due.polls, now, 500) {
            self.poll();
        }
        if is_due(&mut self.due.status, now, 1000) {
            self.tell_status(now);
        }
    }

    pub(super) fn look_at_nodes(&mut self) {
        let t = self.now();
        let is_settled = |(node, since): &&(NodeId, f64)| t - since > SETTLED && self.is_calm(*node, t);
        let settled: Vec<NodeId> = self.remapped.iter().filter(is_settled).map(|(node, _)| *node).collect();
        self.remapped.retain(|(node, _)| !settled.contains(node));
        for node in settled {
            let had_one = self.live.survey(node).is_some();
            self.live.forget(node);
            if had_one && self.pages.count() > 0 {
                self.survey(node);
            }
        }
        self.show_other_clients();
        self.identify(t);
        let changed = self.nodes.changed().map(|rows| rows.to_string());
        self.pages.tell_nodes(&self.setup.hub, changed.as_deref(), || self.nodes.all().to_string());
    }

    /// Whether no master configures a node now: the node has not just booted, and no other client sends requests.
    fn is_calm(&self, node: NodeId, t: f64) -> bool {
        let since_request = self.others.since_request(node, clock::now());
        since_request.is_none_or(|time| time > CALM)
            && self.nodes.get(node).is_none_or(|entry| entry.since_boot(t) > AFTER_BOOT)
    }

    /// Marks the nodes that another client talks to.
    fn show_other_clients(&mut self) {
        let now = clock::now();
        let is_active = |node| self.others.since_request(node, now).is_some_and(|time| time < ACTIVE);
        let changed: Vec<(NodeId, bool)> = self
            .nodes
            .iter()
            .map(|(node, entry)| (node, entry.other_client, is_active(node)))
            .filter(|(_, before, after)| before != after)
            .map(|(node, _, after)| (node, after))
            .collect();
        for (node, is_active) in changed {
            self.nodes.change(node).other_client = is_active;
        }
    }

    /// Requests the identities of the nodes that are still unknown, while a page is open. Nothing is sent for pages that
    /// are not there, nor to a node that boots or has another client: the request of that client might get the answer.
    pub(super) fn identify(&mut self, t: f64) {
        if self.setup.silent || self.bus.is_err() || self.pages.count() == 0 {
            return;
        }
        let now = clock::now();
        let is_to_be_asked = |node: NodeId, entry: &Node| {
            let is_deaf = entry.state() == Some(State::Stopped) || entry.updating;
            let is_new = entry.asked.is_none_or(|asked| entry.is_unknown() && t - asked > ASK_AGAIN);
            let is_alone = self.others.since_request(node, now).is_none_or(|time| time > ALONE);
            entry.is_alive() && is_new && !is_deaf && is_alone && entry.since_boot(t) > AFTER_BOOT
        };
        let unknown: Vec<NodeId> = self
            .nodes
            .iter()
            .filter(|(node, entry)| is_to_be_asked(*node, entry))
            .map(|(node, _)| node)
            .collect();
        for node in unknown {
            self.nodes.change(node).asked = Some(t);
            let waiting = Waiting::of_server(node, jobs::identify(node));
            self.enqueue(Lane::Node(node), Haste::Background, waiting);
        }
    }

    /// Reads the followed signals that no TPDO carries, and surveys the nodes of followed signals that have no survey
    /// yet.
    pub(super) fn poll(&mut self) {
        for node in self.live.wanted_nodes() {
            let is_free = !self.schedule.has(Lane::Node(node)) && self.is_calm(node, self.now());
            // A stopped node has no SDO server.
            let answers = |entry: &Node| entry.is_alive() && entry.state() != Some(State::Stopped);
            if !is_free || self.bus.is_err() || !self.nodes.get(node).is_some_and(answers) {
                continue;
            }
            if self.live.survey(node).is_none() {
                self.survey(node);
                continue;
            }
            let unasked = self.live.unasked(node).into_iter().map(|(index, sub)| at(index, sub)).collect();
            let objects = self.live.polled(node, self.now());
            if !objects.is_empty() {
                let waiting = Waiting::of_server(node, jobs::poll(node, unasked, objects));
                self.enqueue(Lane::Node(node), Haste::Background, waiting);
            }
        }
    }

    pub(super) fn tell_status(&mut self, now: Instant) {
        #[allow(clippy::cast_precision_loss)]
        let seconds = now.0.saturating_sub(self.looked.0) as f64 / 1e6;
        let t = self.now();
        let reason = self.bus.as_ref().err().map(ToString::to_string);
        // Half a second is the least time for a useful rate. This function also runs whenever a page connects.
        if seconds > 0.5 {
            self.looked = now;
            self.nodes.look(t, seconds, self.bit_rate);
            self.rate = self.count.rate(seconds);
            self.busiest = status::busiest(&mut self.peak, self.bit_rate);
            self.controller = self.bus.as_mut().map(|bus| bus.controller()).unwrap_or_default();
        }
        for (page, entry) in self.pages.iter().filter(|(page, _)| self.setup.hub.has_room(*page)) {
            let status = json!({
                "event": "status", "t": t, "open": self.bus.is_ok(), "reason": reason, "bit_rate": self.bit_rate,
                "load": self.rate.load(self.bit_rate), "frames": self.rate.frames, "total": self.count.total,
                "pages": self.pages.count(), "lost": entry.lost(), "peak": self.busiest, "controller": self.controller,
            });
            self.setup.hub.send(page, status.to_string());
        }
    }
}

/// Whether an event is due. If so, the next one is due `period` milliseconds later.
fn is_due(due: &mut Instant, now: Instant, period: u64) -> bool {
    let is_due = now >= *due;
    if is_due {
        *due = now + Duration::from_millis(period);
    }
    is_due
}
