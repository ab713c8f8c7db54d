//! The signals that pages follow, with every sample.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt;
use std::str::FromStr;

use canopen::sdo::Multiplexer;
use canopen::{Frame, NodeId};
use serde_json::{Value as Json, json};

use crate::acquisition::{Kind, Signal};
use crate::object::at;
use crate::quantity::Quantity;
use crate::tpdo::Tpdo;
use crate::trace::Knowledge;
use crate::value::Value;
use crate::{Catalogue, meaning};

/// The number of samples of a signal between two events: more than one TPDO can bring in this time at 1 Mbit/s.
const SAMPLES: usize = 4096;
/// A signal without a sample from its TPDO for this time is read by SDO for the pages that want it, in seconds.
const RARE: f64 = 2.0;

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

/// The TPDOs and signals of a node, and the numbers that their units depend on.
#[derive(Clone, Default)]
pub(super) struct Survey {
    pub(super) tpdos: Vec<Tpdo>,
    pub(super) signals: Vec<Signal>,
    pub(super) knowledge: Knowledge,
}

impl Survey {
    /// The signals in the form for pages.
    pub(super) fn describe(&self, node: NodeId) -> Vec<Json> {
        self.signals.iter().map(|signal| shape(Key::new(node, signal.at), signal)).collect()
    }

    /// The signal of an object, in a TPDO or read by SDO.
    fn signal(&self, object: Multiplexer) -> Signal {
        let found = self.signals.iter().find(|signal| signal.at == object).cloned();
        found.unwrap_or_else(|| {
            let mut signal = Signal::read(object, self.knowledge.catalogue());
            if let Some(quantity) = self.knowledge.measured(object) {
                signal.measure(quantity);
            }
            signal
        })
    }
}

/// A signal that a page follows.
struct Track {
    signal: Signal,
    samples: Vec<(f64, Value)>,
    /// The time of the newest sample from a TPDO.
    newest: Option<f64>,
}

/// All signals that pages follow.
#[derive(Default)]
pub(super) struct Live {
    surveys: BTreeMap<NodeId, Survey>,
    /// The nodes whose survey may be wrong. Their signals stay as they are until the next survey.
    doubtful: BTreeSet<NodeId>,
    wanted: BTreeSet<Key>,
    /// The followed signals that are read by SDO while their TPDO does not come.
    read: BTreeSet<Key>,
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
    /// The survey of a node; `None` where it is forgotten.
    pub(super) fn survey(&self, node: NodeId) -> Option<&Survey> {
        self.surveys.get(&node).filter(|_| !self.doubtful.contains(&node))
    }

    /// Takes the survey of a node.
    pub(super) fn learn(&mut self, node: NodeId, survey: Survey) {
        self.surveys.insert(node, survey);
        self.doubtful.remove(&node);
        self.arrange();
    }

    /// Forgets the survey of a node, because the node may have another mapping now. Its samples are taken as before
    /// until the node has a new one.
    pub(super) fn forget(&mut self, node: NodeId) {
        self.doubtful.insert(node);
    }

    /// Sets the signals to follow, and those of them to read by SDO while their TPDO does not come.
    pub(super) fn want(&mut self, wanted: BTreeSet<Key>, read: BTreeSet<Key>) {
        (self.wanted, self.read) = (wanted, read);
        self.arrange();
    }

    /// The nodes of the followed signals.
    pub(super) fn wanted_nodes(&self) -> BTreeSet<NodeId> {
        self.wanted.iter().map(|key| key.node).collect()
    }

    /// The followed signals of a node that no TPDO brings.
    pub(super) fn polled(&self, node: NodeId, t: f64) -> Vec<Multiplexer> {
        let is_rare = |track: &Track| track.newest.is_none_or(|newest| t - newest > RARE);
        let is_polled =
            |key: &Key, track: &Track| track.is_polled() || self.read.contains(key) && is_rare(track);
        let tracks = self.tracks.iter().filter(|(key, track)| key.node == node && is_polled(key, track));
        tracks.map(|(key, _)| key.at()).collect()
    }

    /// The objects that the units of the followed signals depend on and that the node has not told.
    pub(super) fn unasked(&self, node: NodeId) -> BTreeSet<(u16, u8)> {
        let Some(survey) = self.surveys.get(&node) else { return BTreeSet::new() };
        let tracks = self.tracks.keys().filter(|key| key.node == node);
        tracks.flat_map(|key| survey.knowledge.unasked(key.at())).map(|at| (at.index, at.sub)).collect()
    }

    /// Takes the value of an object that a transfer of any client has shown. Returns whether a signal has another unit
    /// or scale.
    pub(super) fn hear(&mut self, node: NodeId, object: Multiplexer, bytes: &[u8]) -> bool {
        let Some(survey) = self.surveys.get_mut(&node) else { return false };
        survey.knowledge.tell(object, bytes);
        self.measure(node, object)
    }

    /// Takes the answer to a request for an object of [`Live::unasked`]; `None` where the node refuses it.
    pub(super) fn answer(&mut self, node: NodeId, object: Multiplexer, bytes: Option<&[u8]>) -> bool {
        let Some(survey) = self.surveys.get_mut(&node) else { return false };
        survey.knowledge.answer(object, bytes);
        self.measure(node, object)
    }

    /// Renews the units and scales that depend on an object. Returns whether one is new.
    fn measure(&mut self, node: NodeId, source: Multiplexer) -> bool {
        let Some(Survey { signals, knowledge, .. }) = self.surveys.get_mut(&node) else { return false };
        let new = |of: Multiplexer| {
            let depends = Quantity::sources(knowledge.catalogue(), of).contains(&source);
            if depends { knowledge.measured(of) } else { None }
        };
        let mut is_new = false;
        for signal in signals {
            new(signal.at).into_iter().for_each(|quantity| is_new |= signal.measure(quantity));
        }
        for (key, track) in self.tracks.iter_mut().filter(|(key, _)| key.node == node) {
            new(key.at()).into_iter().for_each(|quantity| is_new |= track.measure(quantity));
        }
        is_new
    }

    /// Assigns the followed signals to TPDOs. The signals of a node without a survey stay unchanged.
    fn arrange(&mut self) {
        let wanted = self.wanted.clone();
        self.tracks.retain(|key, _| wanted.contains(key));
        for &key in &wanted {
            let Some(survey) = self.surveys.get(&key.node) else { continue };
            let signal = survey.signal(key.at());
            match self.tracks.get_mut(&key) {
                Some(track) => track.change(signal),
                None => drop(self.tracks.insert(key, Track { signal, samples: Vec::new(), newest: None })),
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
                    track.newest = Some(t);
                    self.lost += u64::from(!track.push(t, value));
                }
            }
        }
    }

    /// Takes a sample that was read by SDO.
    pub(super) fn on_reading(&mut self, key: Key, t: f64, bytes: &[u8]) {
        let is_read = self.read.contains(&key);
        if let Some(track) = self.tracks.get_mut(&key).filter(|track| track.is_polled() || is_read) {
            let value = track.signal.decode(bytes);
            self.lost += u64::from(!track.push(t, value));
        }
    }

    /// The samples since the last call, and the number of lost samples.
    pub(super) fn take(&mut self) -> (BTreeMap<Key, Batch>, u64) {
        let surveys = &self.surveys;
        let batches =
            self.tracks.iter_mut().filter(|(_, track)| !track.samples.is_empty()).map(|(key, track)| {
                let catalogue = surveys.get(&key.node).map(|survey| survey.knowledge.catalogue());
                (*key, track.batch(*key, catalogue))
            });
        (batches.collect(), std::mem::take(&mut self.lost))
    }

    /// A signal in the form for pages; `None` without a survey of its node.
    pub(super) fn describe(&self, key: Key) -> Option<Json> {
        self.survey(key.node).map(|survey| shape(key, &survey.signal(key.at())))
    }

    /// The signals that a node sends.
    pub(super) fn signals(&self, node: NodeId) -> Option<Vec<Json>> {
        self.survey(node).map(|survey| survey.describe(node))
    }
}

impl Track {
    /// Whether no TPDO carries the signal.
    fn is_polled(&self) -> bool {
        self.signal.tpdo.is_none()
    }

    /// Sets the signal. Waiting samples in another unit are dropped, but not those from before the unit was known.
    fn change(&mut self, signal: Signal) {
        if !self.signal.unit.is_empty() && self.signal.unit != signal.unit {
            self.samples.clear();
        }
        self.signal = signal;
    }

    fn measure(&mut self, quantity: Quantity) -> bool {
        let mut signal = self.signal.clone();
        let is_new = signal.measure(quantity);
        self.change(signal);
        is_new
    }

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
        Survey {
            tpdos: vec![Tpdo { number: 1, id: 0x185, mapping }],
            signals,
            knowledge: Knowledge::default(),
        }
    }

    fn node() -> NodeId {
        NodeId::new(5).unwrap()
    }

    #[test]
    fn every_sample_of_a_followed_signal_comes_once() {
        let mut live = Live::default();
        live.learn(node(), survey(&[(0x2000, 1, 8), (0x2000, 2, 8)]));
        live.want(BTreeSet::from([Key::new(node(), at(0x2000, 2))]), BTreeSet::new());
        live.on_frame(&Frame::new(0x185, &[1, 2]).unwrap(), 0.5);
        live.on_frame(&Frame::new(0x185, &[3, 4]).unwrap(), 0.75);
        live.on_frame(&Frame::new(0x186, &[3, 4]).unwrap(), 0.75);
        let (batches, lost) = live.take();
        let batch = batches.values().next().unwrap();
        assert_eq!(batch.json, r#"{"signal":"5:2000:2","t":[0.5,0.75],"v":[2,4]}"#);
        assert_eq!((batches.len(), batch.samples, lost), (1, 2, 0));
        assert!(live.take().0.is_empty());
    }

    /// Meanwhile another node is surveyed, too.
    #[test]
    fn the_samples_of_a_node_that_is_surveyed_again_are_kept() {
        let (mut live, key) = (Live::default(), Key::new(node(), at(0x2000, 1)));
        live.learn(node(), survey(&[(0x2000, 1, 8)]));
        live.want(BTreeSet::from([key]), BTreeSet::new());
        live.on_frame(&Frame::new(0x185, &[1]).unwrap(), 0.5);
        live.forget(node());
        assert!(
            live.survey(node()).is_none() && live.signals(node()).is_none() && live.describe(key).is_none()
        );
        live.learn(NodeId::new(6).unwrap(), Survey::default());
        live.want(BTreeSet::from([key]), BTreeSet::from([key]));
        live.on_frame(&Frame::new(0x185, &[2]).unwrap(), 1.0);
        live.learn(node(), survey(&[(0x2000, 2, 8), (0x2000, 1, 8)]));
        live.on_frame(&Frame::new(0x185, &[9, 3]).unwrap(), 1.5);
        assert_eq!(live.take().0[&key].json, r#"{"signal":"5:2000:1","t":[0.5,1.0,1.5],"v":[1,2,3]}"#);
        assert!(live.survey(node()).is_some());
    }

    #[test]
    fn a_new_mapping_is_followed_and_unmapped_signals_are_polled() {
        let mut live = Live::default();
        live.learn(node(), survey(&[(0x2000, 1, 8), (0x2000, 2, 8)]));
        live.want(
            BTreeSet::from([Key::new(node(), at(0x2000, 1)), Key::new(node(), at(0x2000, 2))]),
            BTreeSet::new(),
        );
        live.learn(node(), survey(&[(0x2000, 2, 8)]));
        live.on_frame(&Frame::new(0x185, &[9]).unwrap(), 1.0);
        let (batches, _) = live.take();
        assert_eq!(batches.values().next().unwrap().json, r#"{"signal":"5:2000:2","t":[1.0],"v":[9]}"#);
        assert_eq!(live.polled(node(), 1.0), [at(0x2000, 1)]);
        live.on_reading(Key::new(node(), at(0x2000, 1)), 2.0, &[7]);
        assert_eq!(live.take().0.len(), 1);
    }

    #[test]
    fn a_signal_whose_tpdo_does_not_come_is_read_by_sdo() {
        let (mut live, key) = (Live::default(), Key::new(node(), at(0x2000, 1)));
        live.learn(node(), survey(&[(0x2000, 1, 8)]));
        live.want(BTreeSet::from([key]), BTreeSet::from([key]));
        assert_eq!(live.polled(node(), 0.0), [at(0x2000, 1)]);
        live.on_reading(key, 0.1, &[7]);
        live.on_frame(&Frame::new(0x185, &[9]).unwrap(), 1.0);
        assert_eq!(live.polled(node(), 2.9), []);
        assert_eq!(live.polled(node(), 3.1), [at(0x2000, 1)]);
        assert_eq!(live.take().0[&key].json, r#"{"signal":"5:2000:1","t":[0.1,1.0],"v":[7,9]}"#);
        live.want(BTreeSet::from([key]), BTreeSet::new());
        live.on_reading(key, 3.2, &[7]);
        assert!(live.polled(node(), 9.0).is_empty() && live.take().0.is_empty());
    }

    /// The unit of an object, its decimal digits or its step, as another client writes them, on all devices.
    #[test]
    fn a_unit_on_the_bus_is_used_from_then_on() {
        const BAR: u32 = 0x004E_0000;
        const KILOPASCAL: u32 = 0x0322_0000;
        for (product, of, numbers, former, new) in [
            (1, 0x7130, [(0x6131, BAR, KILOPASCAL), (0x6132, 2, 1)], ("bar", 2.5), ("kPa", 25.0)),
            (3, 0x7930, [(0x6931, BAR, KILOPASCAL), (0x6932, 2, 1)], ("bar", 2.5), ("kPa", 25.0)),
            (4, 0x6383, [(0x6384, 100, 50), (0x6384, 100, 50)], ("mm", 250.0), ("mm", 125.0)),
        ] {
            let catalogue = Catalogue::built_in(profiles::product::VENDOR_ID, product).expect("a device");
            let (mut live, key) = (Live::default(), Key::new(node(), at(of, 1)));
            live.learn(node(), Survey { knowledge: Knowledge::new(catalogue), ..Survey::default() });
            live.want(BTreeSet::from([key]), BTreeSet::new());
            let unit =
                |live: &Live| live.describe(key).expect("a survey")["unit"].as_str().map(str::to_owned);
            let sample = |live: &mut Live| {
                live.on_reading(key, 1.0, &250_u32.to_le_bytes());
                let json: Json = serde_json::from_str(&live.take().0[&key].json).expect("JSON");
                json["v"][0].as_f64()
            };
            assert_eq!(unit(&live).as_deref(), Some(""), "no unit until the node has told it");
            let asked: BTreeSet<_> = numbers.iter().map(|(index, ..)| (*index, 1)).collect();
            assert_eq!(live.unasked(node()), asked);
            live.on_reading(key, 0.5, &250_u32.to_le_bytes());
            for (index, number, _) in numbers {
                live.answer(node(), at(index, 1), Some(&u32::to_le_bytes(number)));
            }
            assert!(!live.take().0.is_empty(), "a sample from before the unit is known is kept");
            assert_eq!((unit(&live).as_deref(), sample(&mut live)), (Some(former.0), Some(former.1)));
            assert!(live.unasked(node()).is_empty());
            live.on_reading(key, 1.0, &250_u32.to_le_bytes());
            for (index, _, number) in numbers {
                live.hear(node(), at(index, 1), &u32::to_le_bytes(number));
            }
            assert_eq!(live.take().0.is_empty(), former.0 != new.0, "samples in the former unit are dropped");
            assert_eq!((unit(&live).as_deref(), sample(&mut live)), (Some(new.0), Some(new.1)));
            assert!(!live.hear(node(), at(numbers[0].0, 1), &u32::to_le_bytes(numbers[0].2)), "nothing new");
            assert!(!live.hear(node(), at(0x1017, 0), &[1, 0]), "no unit");
        }
    }
}
