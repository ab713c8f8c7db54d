//! The start of jobs, their findings, and their results.

use std::sync::Arc;

use crate::page::PageId;
use canopen::NodeId;
use serde_json::{Value as Json, json};

use super::{Asker, Pump, Refusal, Running, Waiting};
use crate::bus::clock;
use crate::cli::serve::jobs::{self, Job, Known, Learned};
use crate::cli::serve::live::Key;
use crate::cli::serve::schedule::{Haste, Lane};
use crate::cli::serve::turn::Turn;
use crate::sdo::Channel;

impl Waiting {
    /// A job of a node that no page has requested.
    pub(super) fn of_server(node: NodeId, job: Job) -> Waiting {
        Waiting { asker: None, node: Some(node), only_reads: false, job }
    }
}

impl Pump {
    pub(super) fn enqueue(&mut self, lane: Lane, haste: Haste, waiting: Waiting) {
        let page = waiting.asker.as_ref().map(|asker| asker.page);
        self.schedule.add(lane, haste, page, waiting);
    }

    pub(super) fn begin_jobs(&mut self) {
        let now = clock::now();
        let others = &self.others;
        while let Some((number, waiting)) = self.schedule.next(|node| others.is_busy(node, now)) {
            let Waiting { asker, node, only_reads, job } = waiting;
            let (is_update, turn) = (job.is_update, Arc::<Turn>::default());
            self.running.push(Running {
                number,
                asker,
                node,
                is_update,
                only_reads,
                turn: Arc::clone(&turn),
            });
            let known = node.and_then(|node| {
                let catalogue = self.nodes.get(node)?.catalogue.clone()?;
                Some(Known { node, channel: others.channel(node), catalogue })
            });
            jobs::begin(job, number, known, turn, &self.setup.options, &self.orders);
        }
        let turn = |number| self.running.iter().find(move |running| running.number == number);
        self.schedule.to_park().filter_map(turn).for_each(|running| running.turn.hold());
        while let Some(number) = self.schedule.resume() {
            self.running.iter().filter(|running| running.number == number).for_each(|job| job.turn.resume());
        }
    }

    /// A job has stopped between two transfers, unless it was resumed meanwhile.
    pub(super) fn park(&mut self, number: u64) {
        if self.running.iter().any(|running| running.number == number && running.turn.is_waiting()) {
            self.schedule.park(number);
        }
    }

    /// Drops the jobs of a page that has left. A job that changes something on the bus is finished once it has begun.
    pub(super) fn drop_jobs(&mut self, page: PageId) {
        for Waiting { node, job, .. } in self.schedule.leave(page) {
            if let Some(node) = node.filter(|_| job.is_update) {
                self.nodes.change(node).updating = false;
            }
        }
        let of_page = |running: &&Running| running.asker.as_ref().is_some_and(|asker| asker.page == page);
        self.running
            .iter()
            .filter(of_page)
            .filter(|running| running.only_reads)
            .for_each(|running| running.turn.end());
    }

    pub(super) fn tell_progress(&mut self, number: u64, progress: &Json) {
        let running = self.running.iter().find(|running| running.number == number);
        if let Some(Asker { page, id }) = running.and_then(|running| running.asker.as_ref()) {
            self.setup.hub.send(*page, json!({ "id": id, "progress": progress }).to_string());
        }
    }

    pub(super) fn finish(&mut self, number: u64, result: Result<Json, Refusal>) {
        self.schedule.done(number);
        let Some(place) = self.running.iter().position(|running| running.number == number) else { return };
        let Running { asker, node, is_update, .. } = self.running.swap_remove(place);
        if let Some(node) = node.filter(|_| is_update) {
            let t = self.now();
            let entry = self.nodes.change(node);
            (entry.updating, entry.asked) = (false, None);
            self.remapped.push((node, t));
            let (step, key, value) = match &result {
                Ok(outcome) => ("done", "result", outcome.clone()),
                Err(refusal) => ("failed", "error", refusal.text.clone().into()),
            };
            let event = json!({ "event": "update", "node": node.get(), "step": step, key: value });
            self.pages.tell(&self.setup.hub, &event);
        }
        if let Some(asker) = asker {
            self.answer(&asker, result);
        }
    }

    /// Answers a request, which then no longer counts as waiting.
    pub(super) fn answer(&mut self, asker: &Asker, result: Result<Json, Refusal>) {
        if let Some(page) = self.pages.get(asker.page) {
            page.answered();
        }
        self.answer_now(asker, result);
    }

    pub(super) fn answer_now(&self, Asker { page, id }: &Asker, result: Result<Json, Refusal>) {
        let answer = match result {
            Ok(answer) => json!({ "id": id, "ok": answer }),
            Err(Refusal { text, abort: None }) => json!({ "id": id, "error": text }),
            Err(Refusal { text, abort }) => json!({ "id": id, "error": text, "abort": abort }),
        };
        self.setup.hub.send(*page, answer.to_string());
    }

    pub(super) fn learn(&mut self, node: NodeId, learned: Learned) {
        match learned {
            Learned::Present => drop(self.nodes.change(node)),
            Learned::Identity(identity, catalogue) => {
                // Nodes of the same product share a catalogue, because a data sheet is large.
                let kind = (identity.vendor, identity.product);
                let catalogue = Arc::clone(self.catalogues.entry(kind).or_insert(catalogue));
                self.tracer.know(node, &catalogue);
                let t = self.now();
                let entry = self.nodes.change(node);
                let is_other = entry.catalogue.as_ref().is_some_and(|known| !Arc::ptr_eq(known, &catalogue));
                (entry.identity, entry.catalogue) = (Some(identity), Some(catalogue));
                if is_other {
                    // The node has another data sheet than its survey.
                    self.note_remapped(node, t);
                }
            }
            Learned::Channel(channel) => {
                let additional = Some(channel).filter(|channel| *channel != Channel::default_of(node));
                self.others.set_channel(node, additional);
                self.outlets.iter_mut().for_each(|outlet| outlet.choose(node, channel));
            }
            Learned::Catalogue(catalogue) => {
                self.tracer.know(node, &catalogue);
                self.nodes.change(node).catalogue = Some(catalogue);
            }
            Learned::Survey(survey) => {
                self.tracer.learn(node, survey.knowledge.clone());
                self.live.learn(node, survey);
                self.tell_mapping(node);
            }
            Learned::Number(object, bytes) => {
                if self.live.answer(node, object, bytes.as_deref()) {
                    self.tell_mapping(node);
                }
            }
            Learned::Reading(object, bytes) => {
                let t = self.now();
                self.live.on_reading(Key::new(node, object), t, &bytes);
            }
        }
    }

    /// Sends the pages the new signals or units of a node.
    pub(super) fn tell_mapping(&self, node: NodeId) {
        self.pages.tell(&self.setup.hub, &json!({ "event": "mapping", "node": node.get() }));
    }

    pub(super) fn on_stimuli(&mut self, mut news: Json) {
        self.bit_rate = news["bit_rate"].as_u64().and_then(|rate| u16::try_from(rate).ok()).or(self.bit_rate);
        self.stimuli = Some(news.clone());
        news["event"] = "stimuli".into();
        self.pages.tell(&self.setup.hub, &news);
    }
}
