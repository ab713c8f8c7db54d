//! The pages, and the events that each page wants.

use std::collections::{BTreeMap, BTreeSet};

use crate::page::{Hub, PageId};
use canopen::NodeId;

use super::live::{Batch, Key};
use super::tracer::Row;
use crate::trace::Kind;

/// The number of requests of a page that may wait for their answers.
const REQUESTS: usize = 32;
/// After more faulty messages than this, the page is disconnected.
const MISTAKES: u32 = 64;

/// The trace rows that a page wants. An empty set of kinds or nodes stands for all.
#[derive(Clone, Debug, Default)]
pub(super) struct Filter {
    pub(super) kinds: Vec<Kind>,
    pub(super) nodes: BTreeSet<NodeId>,
}

/// The state of a page.
#[derive(Default)]
pub(super) struct Page {
    pub(super) writes: bool,
    pub(super) trace: Option<Filter>,
    pub(super) follows: BTreeSet<Key>,
    /// The followed signals that are read by SDO while their TPDO does not come.
    pub(super) reads: BTreeSet<Key>,
    /// The file that the page has last sent for an update, with its number.
    pub(super) file: Option<(u64, Vec<u8>)>,
    requests: usize,
    mistakes: u32,
    /// Whether the page has missed a list of nodes.
    is_behind: bool,
    lost_rows: u64,
    lost_samples: u64,
    /// The number of lost rows that the page has not been told yet.
    untold: u64,
}

/// All pages.
#[derive(Default)]
pub(super) struct Pages(BTreeMap<PageId, Page>);

impl Filter {
    fn takes(&self, row: &Row) -> bool {
        let is_node = self.nodes.is_empty() || row.node.is_some_and(|node| self.nodes.contains(&node));
        is_node && (self.kinds.is_empty() || self.kinds.contains(&row.kind))
    }
}

impl Page {
    /// Counts a request; `false` when too many requests wait.
    pub(super) fn ask(&mut self) -> bool {
        let may = self.requests < REQUESTS;
        self.requests += usize::from(may);
        may
    }

    pub(super) fn answered(&mut self) {
        self.requests = self.requests.saturating_sub(1);
    }

    /// Counts a faulty message; `true` when there were too many.
    pub(super) fn mistake(&mut self) -> bool {
        self.mistakes += 1;
        self.mistakes > MISTAKES
    }

    pub(super) fn lost(&self) -> serde_json::Value {
        serde_json::json!({ "trace": self.lost_rows, "live": self.lost_samples })
    }
}

impl Pages {
    pub(super) fn come(&mut self, page: PageId, writes: bool) {
        self.0.insert(page, Page { writes, ..Page::default() });
    }

    pub(super) fn leave(&mut self, page: PageId) {
        self.0.remove(&page);
    }

    pub(super) fn get(&mut self, page: PageId) -> Option<&mut Page> {
        self.0.get_mut(&page)
    }

    pub(super) fn count(&self) -> usize {
        self.0.len()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (PageId, &Page)> {
        self.0.iter().map(|(page, entry)| (*page, entry))
    }

    pub(super) fn follows(&self) -> BTreeSet<Key> {
        self.0.values().flat_map(|page| page.follows.iter().copied()).collect()
    }

    pub(super) fn reads(&self) -> BTreeSet<Key> {
        self.0.values().flat_map(|page| page.reads.iter().copied()).collect()
    }

    pub(super) fn have_trace(&self) -> bool {
        self.0.values().any(|page| page.trace.is_some())
    }

    /// Sends an event to all pages. A page whose queue is full misses the event.
    pub(super) fn tell(&self, hub: &Hub, event: &serde_json::Value) {
        let text = event.to_string();
        self.0.keys().filter(|page| hub.has_room(**page)).for_each(|page| hub.send(*page, text.clone()));
    }

    /// Sends the changed nodes. A page that has missed a list gets all nodes once its queue has room.
    pub(super) fn tell_nodes(&mut self, hub: &Hub, changed: Option<&str>, all: impl Fn() -> String) {
        for (page, entry) in &mut self.0 {
            match (hub.has_room(*page), entry.is_behind) {
                (true, true) => hub.send(*page, all()),
                (true, false) => changed.into_iter().for_each(|text| hub.send(*page, text.to_owned())),
                (false, _) if changed.is_none() => continue,
                (false, _) => {}
            }
            entry.is_behind = !hub.has_room(*page);
        }
    }

    /// Sends trace rows to the pages that want them.
    pub(super) fn tell_rows(&mut self, hub: &Hub, rows: &[Row], lost: u64) {
        for (page, entry) in &mut self.0 {
            let Some(filter) = &entry.trace else { continue };
            let wanted: Vec<&str> =
                rows.iter().filter(|row| filter.takes(row)).map(|row| row.json.as_str()).collect();
            entry.lost_rows += lost;
            entry.untold += lost;
            if !hub.has_room(*page) {
                entry.lost_rows += wanted.len() as u64;
                entry.untold += wanted.len() as u64;
            } else if !wanted.is_empty() || entry.untold > 0 {
                let lost = std::mem::take(&mut entry.untold);
                hub.send(
                    *page,
                    format!(r#"{{"event":"trace","lost":{lost},"rows":[{}]}}"#, wanted.join(",")),
                );
            }
        }
    }

    /// Sends samples to the pages that follow their signals.
    pub(super) fn tell_samples(&mut self, hub: &Hub, t: f64, batches: &BTreeMap<Key, Batch>, lost: u64) {
        for (page, entry) in &mut self.0 {
            let wanted: Vec<&Batch> = entry.follows.iter().filter_map(|key| batches.get(key)).collect();
            if wanted.is_empty() {
                continue;
            }
            entry.lost_samples += lost;
            if hub.has_room(*page) {
                let signals: Vec<&str> = wanted.iter().map(|batch| batch.json.as_str()).collect();
                let lost = entry.lost_samples;
                let signals = signals.join(",");
                hub.send(*page, format!(r#"{{"event":"live","t":{t},"lost":{lost},"signals":[{signals}]}}"#));
            } else {
                entry.lost_samples += wanted.iter().map(|batch| batch.samples).sum::<u64>();
            }
        }
    }
}
