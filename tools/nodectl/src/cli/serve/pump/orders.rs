//! Handling of the orders of pages, jobs and the simulator.

use std::collections::BTreeSet;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration as StdDuration;

use crate::page::{FromPage, LARGEST, PageId};
use canopen::NodeId;
use serde_json::{Value as Json, json};

use super::{AT_ONCE, Asker, Order, PAUSE, PROTOCOL, Pump, Refusal, Waiting};
use crate::bus::clock;
use crate::cli::serve::jobs;
use crate::cli::serve::live::Key;
use crate::cli::serve::pages::{Filter, Page};
use crate::cli::serve::request::{self, What, Whom};
use crate::cli::serve::schedule::{Haste, Lane};

impl Pump {
    /// Handles the waiting orders. Fails when all senders of orders are gone.
    pub(super) fn take_orders(&mut self) -> Result<(), RecvTimeoutError> {
        // Wait a little while jobs run, because jobs depend on quick handling of their orders. Without a bus there is
        // no other work at all.
        let mut pause = match &self.bus {
            Ok(_) if self.outlets.is_empty() => StdDuration::ZERO,
            Ok(_) => PAUSE,
            Err(_) => StdDuration::from_millis(20),
        };
        for _ in 0..AT_ONCE {
            match self.inbox.recv_timeout(pause) {
                Ok(order) => self.obey(order),
                Err(RecvTimeoutError::Timeout) => break,
                Err(error) => return Err(error),
            }
            pause = StdDuration::ZERO;
        }
        Ok(())
    }

    pub(super) fn obey(&mut self, order: Order) {
        match order {
            Order::Page(FromPage::Came { page, writes }) => self.welcome(page, writes),
            Order::Page(FromPage::Left { page }) => {
                self.pages.leave(page);
                self.want();
                self.drop_jobs(page);
            }
            Order::Page(FromPage::Said { page, text }) => self.hear(page, &text),
            // Without a bus the outlet is dropped, and the job notices the loss at its port.
            Order::Open(outlet) if self.bus.is_ok() => self.outlets.push(outlet),
            Order::Open(_) => {}
            Order::Send(frame) => self.send(&frame),
            Order::Progress(number, progress) => self.tell_progress(number, &progress),
            Order::Tell(event) => self.pages.tell(&self.setup.hub, &event),
            Order::Learned(node, learned) => self.learn(node, learned),
            Order::Parked(number) => self.park(number),
            Order::Done(number, result) => self.finish(number, result),
            Order::Stimuli(news) => self.on_stimuli(news),
        }
    }

    pub(super) fn welcome(&mut self, page: PageId, writes: bool) {
        self.pages.come(page, writes);
        let hello = json!({
            "event": "hello", "protocol": PROTOCOL, "version": env!("CARGO_PKG_VERSION"),
            "bus": self.setup.options.bus.to_string(), "writes": writes,
            "simulator": self.setup.control.is_some(), "t": self.now(), "largest": LARGEST,
        });
        self.setup.hub.send(page, hello.to_string());
        self.setup.hub.send(page, self.nodes.all().to_string());
        self.due.status = clock::now();
    }

    pub(super) fn hear(&mut self, page: PageId, text: &str) {
        let request = match request::parse(text) {
            Ok(request) => request,
            Err((id, reason)) => {
                self.setup.hub.send(page, json!({ "id": id, "error": reason }).to_string());
                if self.pages.get(page).is_some_and(Page::mistake) {
                    self.setup.hub.close(page);
                }
                return;
            }
        };
        let Some(entry) = self.pages.get(page) else { return };
        let asker = Asker { page, id: request.id };
        if !entry.ask() {
            return self.answer_now(&asker, Err(Refusal::new("too many requests at once")));
        }
        if request.what.writes() && !entry.writes {
            let words = "read only: open the address that the terminal shows";
            return self.answer(&asker, Err(Refusal::new(words)));
        }
        match request.what.fault() {
            Some(fault) => self.answer(&asker, Err(Refusal::new(fault))),
            None => self.serve(asker, request.what),
        }
    }

    /// Answers a request that needs no bus at once. Any other request becomes a job.
    pub(super) fn serve(&mut self, asker: Asker, what: What) {
        match what {
            What::Follow { signals, read } => {
                let result = self.follow(asker.page, &signals, &read);
                self.answer(&asker, result);
            }
            What::Trace { on, kinds, nodes } => {
                let nodes = nodes.into_iter().filter_map(NodeId::new).collect();
                let filter = Filter { kinds: kinds.into_iter().map(|kind| kind.0).collect(), nodes };
                if let Some(page) = self.pages.get(asker.page) {
                    page.trace = on.then_some(filter);
                }
                self.answer(&asker, Ok(json!({})));
            }
            What::Stimuli => {
                let known = self.stimuli.clone();
                let result = known.ok_or_else(|| Refusal::new("no simulator is connected"));
                self.answer(&asker, result);
            }
            What::Signals { node } if self.live.survey(node.0).is_some() => {
                let signals = self.live.signals(node.0);
                self.answer(&asker, Ok(json!({ "signals": signals })));
            }
            what => self.make_job(asker, what),
        }
    }

    pub(super) fn make_job(&mut self, asker: Asker, what: What) {
        let file = match &what {
            What::UpdateStart { file, .. } => {
                let kept = self.pages.get(asker.page).and_then(|page| page.file.take());
                kept.filter(|(number, _)| number == file).map(|(_, bytes)| bytes)
            }
            What::UpdateInspect { .. } => {
                self.files += 1;
                None
            }
            _ => None,
        };
        let only_reads = !what.writes();
        let ordered = match what {
            What::Nmt { node: Whom::Node(node), .. } => Lane::Node(node.0),
            What::Nmt { node: Whom::All(_), .. } => Lane::Everything,
            _ => Lane::Nothing,
        };
        let means = jobs::Means { control: self.setup.control, file, number: self.files };
        let task = match jobs::task(what, means) {
            Ok(task) => task,
            Err(text) => return self.answer(&asker, Err(Refusal::new(text))),
        };
        if let Some(page) = self.pages.get(asker.page)
            && task.keeps.is_some()
        {
            page.file = task.keeps;
        }
        if let Some(node) = self.updated(task.lane).or_else(|| self.updated(ordered)) {
            let words = format!("node {} is being updated", node.get());
            return self.answer(&asker, Err(Refusal::new(words)));
        }
        let node = if let Lane::Node(node) = task.lane { Some(node) } else { None };
        if let Some(node) = node.filter(|_| task.job.is_update) {
            self.nodes.change(node).updating = true;
        }
        let has_token = self.pages.get(asker.page).is_some_and(|page| page.writes);
        let haste = if has_token { Haste::Token } else { Haste::Asked };
        let waiting = Waiting { asker: Some(asker), node, only_reads, job: task.job };
        self.enqueue(task.lane, haste, waiting);
    }

    /// The node in this lane that is being updated.
    fn updated(&self, lane: Lane) -> Option<NodeId> {
        match lane {
            Lane::Node(node) => self.nodes.get(node).is_some_and(|node| node.updating).then_some(node),
            Lane::Everything => self.nodes.iter().find(|(_, node)| node.updating).map(|(node, _)| node),
            Lane::Lss | Lane::Nothing => None,
        }
    }

    pub(super) fn follow(
        &mut self,
        page: PageId,
        signals: &[String],
        read: &[String],
    ) -> Result<Json, Refusal> {
        const MOST: usize = 256;
        if signals.len() > MOST {
            return Err(Refusal::new(format!("{} signals; at most {MOST}", signals.len())));
        }
        let parse = |signals: &[String]| -> Result<BTreeSet<Key>, Refusal> {
            signals.iter().map(|signal| signal.parse().map_err(Refusal::new)).collect()
        };
        let (keys, mut reads) = (parse(signals)?, parse(read)?);
        reads.retain(|key| keys.contains(key));
        let known: Vec<Json> = keys.iter().filter_map(|key| self.live.describe(*key)).collect();
        if let Some(page) = self.pages.get(page) {
            (page.follows, page.reads) = (keys, reads);
        }
        self.want();
        for node in self.live.wanted_nodes() {
            if self.live.survey(node).is_none() {
                self.survey(node);
            }
        }
        Ok(json!({ "signals": known }))
    }

    fn want(&mut self) {
        self.live.want(self.pages.follows(), self.pages.reads());
    }

    /// Surveys a node, unless a job of this node waits or runs.
    pub(super) fn survey(&mut self, node: NodeId) {
        if self.bus.is_ok() && !self.schedule.has(Lane::Node(node)) {
            self.enqueue(Lane::Node(node), Haste::Asked, Waiting::of_server(node, jobs::survey(node)));
        }
    }
}
