//! Periodic work of the pump: events for the pages, and jobs that no page has requested.

use canopen::{Duration, Instant, NodeId};
use serde_json::json;

use super::{ASK_AGAIN, Pump, SETTLED};
use crate::bus::clock;
use crate::cli::serve::jobs;
use crate::cli::serve::nodes::Node;
use crate::cli::serve::schedule::{Haste, Lane};

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
        let settled: Vec<NodeId> =
            self.remapped.iter().filter(|(_, since)| t - since > SETTLED).map(|(node, _)| *node).collect();
        self.remapped.retain(|(node, _)| !settled.contains(node));
        for node in settled {
            if self.live.survey(node).is_some() {
                self.live.forget(node);
                self.survey(node);
            }
        }
        self.identify(t);
        let changed = self.nodes.changed().map(|rows| rows.to_string());
        self.pages.tell_nodes(&self.setup.hub, changed.as_deref(), || self.nodes.all().to_string());
    }

    /// Requests the identities of nodes that were heard and have not been asked yet.
    pub(super) fn identify(&mut self, t: f64) {
        if self.setup.silent || self.bus.is_err() {
            return;
        }
        let is_to_be_asked = |entry: &Node| {
            let is_deaf = entry.state() == Some(canopen::nmt::State::Stopped) || entry.updating;
            let is_new = entry.asked.is_none_or(|asked| entry.identity.is_none() && t - asked > ASK_AGAIN);
            entry.is_alive() && is_new && !is_deaf
        };
        let unknown: Vec<NodeId> =
            self.nodes.iter().filter(|(_, entry)| is_to_be_asked(entry)).map(|(node, _)| node).collect();
        for node in unknown {
            self.nodes.change(node).asked = Some(t);
            self.enqueue(None, Lane::Node(node), Haste::Background, Some(node), jobs::identify(node));
        }
    }

    /// Reads the followed signals that no TPDO carries, and surveys the nodes of followed signals that have no survey
    /// yet.
    pub(super) fn poll(&mut self) {
        for node in self.live.wanted_nodes() {
            let is_free = !self.schedule.has(Lane::Node(node));
            if !is_free
                || self.bus.is_err()
                || !self.nodes.get(node).is_some_and(super::super::nodes::Node::is_alive)
            {
                continue;
            }
            if self.live.survey(node).is_none() {
                self.survey(node);
                continue;
            }
            let objects = self.live.polled(node);
            if !objects.is_empty() {
                let job = jobs::poll(node, objects);
                self.enqueue(None, Lane::Node(node), Haste::Background, Some(node), job);
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
        }
        for (page, entry) in self.pages.iter().filter(|(page, _)| self.setup.hub.has_room(*page)) {
            let status = json!({
                "event": "status", "t": t, "open": self.bus.is_ok(), "reason": reason, "bit_rate": self.bit_rate,
                "load": self.rate.load(self.bit_rate), "frames": self.rate.frames, "total": self.count.total,
                "pages": self.pages.count(), "lost": entry.lost(),
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
