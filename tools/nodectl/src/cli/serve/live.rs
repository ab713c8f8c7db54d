//! The signals that pages follow, with every sample.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt;
use std::str::FromStr;

use canopen::sdo::Multiplexer;
use canopen::{Frame, NodeId};
use serde_json::{Value as Json, json};

use crate::acquisition::{Kind, Signal};
use crate::object::at;
use crate::tpdo::Tpdo;
use crate::value::Value;
use crate::{Catalogue, meaning};

/// The number of samples of a signal between two events: more than one TPDO can bring in this time at 1 Mbit/s.
const SAMPLES: usize = 4096;

/// Names a signal: node and object, `5:6130:1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Key {
    pub(super) node: NodeId,
    pub(super) index: u16,
    pub(super) sub: u8,
}

impl Key {
    pub(super) fn new(node: NodeId, at: Multiplexer) -> Key {
        Key { node, index: at.index, sub: at.sub }
    }

    pub(super) fn at(self) -> Multiplexer {
        at(self.index, self.sub)
    }
}

impl FromStr for Key {
    type Err = String;

    fn from_str(text: &str) -> Result<Key, String> {
        let parse = || {
            let mut parts = text.split(':');
            let node = NodeId::new(parts.next()?.parse().ok()?)?;
            let index = u16::from_str_radix(parts.next()?, 16).ok()?;
            let sub = parts.next()?.parse().ok()?;
            parts.next().is_none().then_some(Key { node, index, sub })
        };
        parse().ok_or_else(|| format!("{text:?} is no signal, as 5:6130:1 (node, index, sub-index)"))
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}:{:04X}:{}", self.node.get(), self.index, self.sub)
    }
}

/// The TPDOs and signals of a node.
#[derive(Clone, Default)]
pub(super) struct Survey {
    pub(super) tpdos: Vec<Tpdo>,
    pub(super) signals: Vec<Signal>,
    pub(super) catalogue: Option<std::sync::Arc<Catalogue>>,
}

impl Survey {
    /// The signals in the form for pages.
    pub(super) fn describe(&self, node: NodeId) -> Vec<Json> {
        self.signals.iter().map(|signal| shape(Key::new(node, signal.at), signal)).collect()
    }
}

/// A signal that a page follows.
struct Track {
    signal: Signal,
    samples: Vec<(f64, Value)>,
}

/// All signals that pages follow.
#[derive(Default)]
pub(super) struct Live {
    surveys: BTreeMap<NodeId, Survey>,
    wanted: BTreeSet<Key>,
    tracks: BTreeMap<Key, Track>,
    /// The TPDOs that carry a followed signal, by CAN-ID.
    tpdos: HashMap<u16, Vec<(NodeId, Tpdo)>>,
    /// Samples that were dropped because there were too many.
    lost: u64,
}

/// The new samples of a signal, in the form for an event.
pub(super) struct Batch {
    pub(super) json: String,
    pub(super) samples: u64,
}

impl Live {
    pub(super) fn survey(&self, node: NodeId) -> Option<&Survey> {
        self.surveys.get(&node)
    }

    /// Takes the survey of a node.
    pub(super) fn learn(&mut self, node: NodeId, survey: Survey) {
        self.surveys.insert(node, survey);
        self.arrange();
    }

    /// Forgets the survey of a node, because the node may have another mapping now.
    pub(super) fn forget(&mut self, node: NodeId) {
        self.surveys.remove(&node);
    }

    /// Sets the signals to follow, instead of the former ones.
    pub(super) fn want(&mut self, wanted: BTreeSet<Key>) {
        self.wanted = wanted;
        self.arrange();
    }

    /// The nodes of the followed signals.
    pub(super) fn wanted_nodes(&self) -> BTreeSet<NodeId> {
        self.wanted.iter().map(|key| key.node).collect()
    }

    /// The followed signals of a node that no TPDO carries.
    pub(super) fn polled(&self, node: NodeId) -> Vec<Multiplexer> {
        let is_polled = |key: &&Key| self.tracks.get(key).is_some_and(|track| track.signal.tpdo.is_none());
        self.wanted.iter().filter(|key| key.node == node).filter(is_polled).map(|key| key.at()).collect()
    }

    /// Assigns the followed signals to TPDOs. The signals of a node without a survey stay unchanged.
    fn arrange(&mut self) {
        let wanted = self.wanted.clone();
        self.tracks.retain(|key, _| wanted.contains(key));
        for &key in &wanted {
            let Some(survey) = self.surveys.get(&key.node) else { continue };
            let found = survey.signals.iter().find(|signal| signal.at == key.at());
            let signal = found.cloned().unwrap_or_else(|| unmapped(survey, key.at()));
            match self.tracks.get_mut(&key) {
                Some(track) => track.signal = signal,
                None => drop(self.tracks.insert(key, Track { signal, samples: Vec::new() })),
            }
        }
        self.tpdos.clear();
        for (&node, survey) in &self.surveys {
            let is_wanted = |tpdo: &&Tpdo| {
                tpdo.mapping
                    .iter()
                    .any(|mapped| wanted.contains(&Key::new(node, at(mapped.index, mapped.sub))))
            };
            for tpdo in survey.tpdos.iter().filter(is_wanted) {
                self.tpdos.entry(tpdo.id).or_default().push((node, tpdo.clone()));
            }
        }
    }

    /// Takes the samples of a frame.
    pub(super) fn on_frame(&mut self, frame: &Frame, t: f64) {
        let Some(tpdos) = self.tpdos.get(&frame.id()) else { return };
        for (node, tpdo) in tpdos {
            for (object, bytes) in tpdo.values(frame.data()) {
                let Some(track) = self.tracks.get_mut(&Key::new(*node, object)) else { continue };
                if track.signal.tpdo == Some(tpdo.number) {
                    let value = track.signal.decode(&bytes);
                    self.lost += u64::from(!track.push(t, value));
                }
            }
        }
    }

    /// Takes a sample that was read by SDO.
    pub(super) fn on_reading(&mut self, key: Key, t: f64, bytes: &[u8]) {
        if let Some(track) = self.tracks.get_mut(&key).filter(|track| track.signal.tpdo.is_none()) {
            let value = track.signal.decode(bytes);
            self.lost += u64::from(!track.push(t, value));
        }
    }

    /// The samples since the last call, and the number of lost samples.
    pub(super) fn take(&mut self) -> (BTreeMap<Key, Batch>, u64) {
        let surveys = &self.surveys;
        let batches =
            self.tracks.iter_mut().filter(|(_, track)| !track.samples.is_empty()).map(|(key, track)| {
                let catalogue = surveys.get(&key.node).and_then(|survey| survey.catalogue.as_deref());
                (*key, track.batch(*key, catalogue))
            });
        (batches.collect(), std::mem::take(&mut self.lost))
    }

    /// A signal in the form for pages; `None` without a survey of its node.
    pub(super) fn describe(&self, key: Key) -> Option<Json> {
        let survey = self.surveys.get(&key.node)?;
        let found = survey.signals.iter().find(|signal| signal.at == key.at());
        Some(shape(key, &found.cloned().unwrap_or_else(|| unmapped(survey, key.at()))))
    }

    /// The signals that a node sends.
    pub(super) fn signals(&self, node: NodeId) -> Option<Vec<Json>> {
        self.surveys.get(&node).map(|survey| survey.describe(node))
    }
}

impl Track {
    fn push(&mut self, t: f64, value: Value) -> bool {
        let fits = self.samples.len() < SAMPLES;
        if fits {
            self.samples.push((t, value));
        }
        fits
    }

    fn batch(&mut self, key: Key, catalogue: Option<&Catalogue>) -> Batch {
        let samples = std::mem::take(&mut self.samples);
        let newest = samples.last().map(|(_, value)| value);
        let meaning =
            catalogue.zip(newest).and_then(|(catalogue, value)| meaning::of(catalogue, key.at(), value));
        let times: Vec<f64> = samples.iter().map(|(t, _)| *t).collect();
        let values: Vec<&Value> = samples.iter().map(|(_, value)| value).collect();
        let mut json = json!({ "signal": key.to_string(), "t": times, "v": values });
        if let Some(meaning) = meaning {
            json["meaning"] = meaning.into();
        }
        Batch { json: json.to_string(), samples: samples.len() as u64 }
    }
}

fn unmapped(survey: &Survey, object: Multiplexer) -> Signal {
    let unknown = || Signal::polled(object, "", "");
    survey.catalogue.as_deref().map_or_else(unknown, |catalogue| Signal::read(object, catalogue))
}

fn shape(key: Key, signal: &Signal) -> Json {
    let kind = match signal.kind() {
        Kind::Signed => "signed",
        Kind::Unsigned => "unsigned",
        Kind::Number => "number",
        Kind::Text => "text",
    };
    json!({
        "signal": key.to_string(), "node": key.node.get(), "index": key.index, "sub": key.sub,
        "name": signal.name, "path": signal.path, "unit": signal.unit, "tpdo": signal.tpdo,
        "type": signal.type_name(), "kind": kind,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::pdo::MappedObject;

    #[test]
    fn keys_are_read_as_they_are_written() {
        let key: Key = "5:6130:1".parse().unwrap();
        assert_eq!((key.node.get(), key.index, key.sub), (5, 0x6130, 1));
        assert_eq!(key.to_string(), "5:6130:1");
        for text in ["", "5", "5:6130", "0:6130:1", "128:6130:1", "5:x:1", "5:6130:256", "5:6130:1:1"] {
            assert!(text.parse::<Key>().is_err(), "{text}");
        }
    }

    fn survey(mapping: &[(u16, u8, u8)]) -> Survey {
        let mapping: Vec<MappedObject> =
            mapping.iter().map(|&(index, sub, bits)| MappedObject { index, sub, bits }).collect();
        let signal = |mapped: &MappedObject| {
            let mut signal = Signal::polled(at(mapped.index, mapped.sub), "value", "");
            signal.tpdo = Some(1);
            signal
        };
        let signals = mapping.iter().map(signal).collect();
        Survey { tpdos: vec![Tpdo { number: 1, id: 0x185, mapping }], signals, catalogue: None }
    }

    fn node() -> NodeId {
        NodeId::new(5).unwrap()
    }

    #[test]
    fn every_sample_of_a_followed_signal_comes_once() {
        let mut live = Live::default();
        live.learn(node(), survey(&[(0x2000, 1, 8), (0x2000, 2, 8)]));
        live.want(BTreeSet::from([Key::new(node(), at(0x2000, 2))]));
        live.on_frame(&Frame::new(0x185, &[1, 2]).unwrap(), 0.5);
        live.on_frame(&Frame::new(0x185, &[3, 4]).unwrap(), 0.75);
        live.on_frame(&Frame::new(0x186, &[3, 4]).unwrap(), 0.75);
        let (batches, lost) = live.take();
        let batch = batches.values().next().unwrap();
        assert_eq!(batch.json, r#"{"signal":"5:2000:2","t":[0.5,0.75],"v":[2,4]}"#);
        assert_eq!((batches.len(), batch.samples, lost), (1, 2, 0));
        assert!(live.take().0.is_empty());
    }

    #[test]
    fn a_new_mapping_is_followed_and_unmapped_signals_are_polled() {
        let mut live = Live::default();
        live.learn(node(), survey(&[(0x2000, 1, 8), (0x2000, 2, 8)]));
        live.want(BTreeSet::from([Key::new(node(), at(0x2000, 1)), Key::new(node(), at(0x2000, 2))]));
        live.learn(node(), survey(&[(0x2000, 2, 8)]));
        live.on_frame(&Frame::new(0x185, &[9]).unwrap(), 1.0);
        let (batches, _) = live.take();
        assert_eq!(batches.values().next().unwrap().json, r#"{"signal":"5:2000:2","t":[1.0],"v":[9]}"#);
        assert_eq!(live.polled(node()), [at(0x2000, 1)]);
        live.on_reading(Key::new(node(), at(0x2000, 1)), 2.0, &[7]);
        assert_eq!(live.take().0.len(), 1);
    }
}
