//! The values of one node: present, saved, and what a download or a reset must have made of them.

use std::collections::BTreeMap;

use crate::sheet::{APPLICATION, COMMUNICATION, Initial, Sheet};
use crate::{Findings, Key, Rule};

/// "save" and "load", as their downloads carry them (1010h, 1011h).
const SAVE: &[u8] = b"save";
const LOAD: &[u8] = b"load";
/// Node-ID-dependent default CAN-IDs of the first four TPDOs (CiA 301, 7.3.3).
const TPDO_CAN_IDS: [u32; 4] = [0x180, 0x280, 0x380, 0x480];

/// Knowledge about the saved value.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum Saved {
    #[default]
    Unknown,
    /// Nothing is saved: the default is used.
    Default,
    Value(Vec<u8>),
    /// A COB-ID that follows the node-ID: the node-ID plus this number.
    NodeId(u32),
}

/// The last event of a value, which the next read must confirm.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum Event {
    #[default]
    None,
    Written,
    Aborted {
        tried: Vec<u8>,
    },
    /// A reset has loaded the saved value, or the default after a restore.
    Loaded,
    Restored,
}

/// One value.
#[derive(Clone, Debug, Default)]
struct Held {
    present: Option<Vec<u8>>,
    /// Nothing has changed the value without the bus since it was seen.
    is_sure: bool,
    saved: Saved,
    /// A restore is accepted and acts with the next reset.
    is_restored: bool,
    event: Event,
}

/// The values.
#[derive(Debug, Default)]
pub(crate) struct Values {
    sheet: Option<Sheet>,
    held: BTreeMap<Key, Held>,
    node_id: u8,
    /// The sub-index of 1010h that is requested and not answered.
    saving: Option<u8>,
    /// The object that a client writes: the node may act by the new value before its answer is on the bus.
    pending: Option<Key>,
}

/// The values that a reset loads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    Communication,
    All,
}

impl Values {
    /// Takes the data sheet. `is_new`: nothing is saved in the node.
    pub(crate) fn set_sheet(&mut self, sheet: Sheet, is_new: bool) {
        self.held = sheet.entries.keys().map(|key| (*key, Held::default())).collect();
        if is_new {
            self.held.values_mut().for_each(|held| held.saved = Saved::Default);
        }
        self.sheet = Some(sheet);
        self.load(Scope::All);
    }

    pub(crate) fn sheet(&self) -> Option<&Sheet> {
        self.sheet.as_ref()
    }

    /// Forgets the data sheet: the node has become another device.
    pub(crate) fn forget_sheet(&mut self) {
        *self = Values { node_id: self.node_id, ..Values::default() };
    }

    /// Forgets what is saved: the flash was changed.
    pub(crate) fn forget_saved(&mut self) {
        self.held.values_mut().for_each(|held| *held = Held::default());
    }

    pub(crate) fn set_node_id(&mut self, node_id: u8) {
        if node_id != self.node_id {
            self.node_id = node_id;
            self.load(Scope::All);
        }
    }

    /// The present value, where it is known.
    pub(crate) fn number(&self, index: u16, sub: u8) -> Option<u32> {
        let held = self.held.get(&(index, sub))?;
        Some(number(held.present.as_ref()?))
    }

    /// The present value, where nothing can have changed it since it was seen.
    pub(crate) fn sure_number(&self, index: u16, sub: u8) -> Option<u32> {
        let is_pending = self.pending == Some((index, sub));
        self.held.get(&(index, sub)).filter(|held| held.is_sure && !is_pending)?;
        self.number(index, sub)
    }

    /// The keys with this sub-index in a range of indexes.
    pub(crate) fn keys(&self, from: u16, to: u16, sub: u8) -> impl Iterator<Item = u16> + '_ {
        self.held.range((from, 0)..=(to, 0xFF)).filter(move |(key, _)| key.1 == sub).map(|(key, _)| key.0)
    }

    /// The values that a read must confirm.
    pub(crate) fn unconfirmed(&self) -> impl Iterator<Item = Key> + '_ {
        let held = self.held.iter().filter(|(_, held)| held.event != Event::None && held.present.is_some());
        held.map(|(key, _)| *key).filter(|key| self.holds_value(*key))
    }

    /// Whether the object holds a value of a client.
    pub(crate) fn holds_value(&self, key: Key) -> bool {
        Sheet::holds_value(self.sheet.as_ref(), key)
    }

    /// A value was read.
    pub(crate) fn read(&mut self, key: Key, bytes: &[u8], findings: &mut Findings) {
        self.pending = None;
        let is_parameter = Sheet::is_parameter(self.sheet.as_ref(), key);
        let held = self.held.entry(key).or_default();
        let before = held.present.replace(bytes.to_vec());
        let (was_sure, event) = (std::mem::replace(&mut held.is_sure, true), std::mem::take(&mut held.event));
        let Some(before) = before.filter(|before| was_sure && !is_same(before, bytes)) else {
            // An aborted download may have acted before the value was known: then nothing can be said.
            return;
        };
        let has_default = event == Event::Restored || held.saved == Saved::Default;
        if has_default && Sheet::follows_calibration(self.sheet.as_ref(), key) {
            return;
        }
        let (was, is) = (hex(&before), hex(bytes));
        let (index, sub) = key;
        let mut report = |rule, text: String| findings.push((rule, format!("{index:04X}h:{sub} {text}")));
        match event {
            Event::Aborted { tried } if is_parameter || tried == bytes => {
                let tried = hex(&tried);
                report(
                    Rule::AbortActed,
                    format!("reads {is} after an aborted download of {tried}, before {was}"),
                );
            }
            Event::Written if is_parameter => {
                report(Rule::ReadBack, format!("reads {is} after an accepted download of {was}"));
            }
            Event::Loaded if is_parameter && matches!(held.saved, Saved::NodeId(_)) => {
                report(Rule::CanId, format!("reads {is} and does not follow the node-ID: {was}"));
            }
            Event::Loaded if is_parameter => {
                report(Rule::SaveLost, format!("reads {is} after a reset, saved is {was}"));
            }
            Event::Restored if is_parameter => {
                report(Rule::RestoreLost, format!("reads {is} after a restore and a reset, default {was}"));
            }
            _ => (),
        }
    }

    /// A download begins.
    pub(crate) fn begins(&mut self, key: Key, value: Option<&[u8]>) {
        self.pending = Some(key);
        if key.0 == 0x1010 && value == Some(SAVE) {
            self.saving = Some(key.1);
        }
    }

    /// A download was aborted.
    pub(crate) fn aborted(&mut self, key: Key, tried: &[u8]) {
        self.pending = None;
        if key.0 == 0x1010 {
            self.saving = None;
        }
        let held = self.held.entry(key).or_default();
        // An accepted value that was not read yet is still to be confirmed.
        if held.event == Event::None {
            held.event = Event::Aborted { tried: tried.to_vec() };
        }
    }

    /// A download was accepted.
    pub(crate) fn written(&mut self, key: Key, bytes: &[u8]) {
        self.pending = None;
        match (key.0, bytes) {
            (0x1010, SAVE) => self.save(key.1),
            (0x1011, LOAD) => self.restore(key.1),
            _ if Sheet::is_parameter(self.sheet.as_ref(), key) => {
                self.disturb(key);
                let held = self.held.entry(key).or_default();
                (held.present, held.is_sure, held.event) = (Some(bytes.to_vec()), true, Event::Written);
            }
            _ => {
                self.disturb(key);
                if let Some(held) = self.held.get_mut(&key) {
                    (held.is_sure, held.event) = (false, Event::None);
                }
            }
        }
    }

    /// An object outside the communication profile may change others, and the event timer of a TPDO has other names.
    fn disturb(&mut self, key: Key) {
        let is_event_timer = (0x1800..0x1A00).contains(&key.0) && key.1 == 5;
        if key.0 < 0x2000 && !is_event_timer {
            return;
        }
        let reaches_pdos = Sheet::may_change_pdos(self.sheet.as_ref(), key.0);
        for (other, held) in &mut self.held {
            let is_reached = other.0 >= 0x2000 || (0x1400..0x1C00).contains(&other.0) && reaches_pdos;
            if is_reached && *other != key {
                (held.is_sure, held.event) = (false, Event::None);
            }
        }
    }

    fn save(&mut self, sub: u8) {
        self.saving = None;
        let (sheet, node_id) = (self.sheet.as_ref(), self.node_id);
        for (key, held) in &mut self.held {
            if !is_in(sheet, *key, sub) {
                continue;
            }
            held.is_restored = false;
            held.saved = match &held.present {
                Some(value) if held.is_sure => saved(sheet, *key, value, node_id),
                _ => Saved::Unknown,
            };
        }
    }

    fn restore(&mut self, sub: u8) {
        let sheet = self.sheet.as_ref();
        for (key, held) in &mut self.held {
            held.is_restored |= is_in(sheet, *key, sub);
        }
    }

    /// A reset.
    pub(crate) fn reset(&mut self, scope: Scope) {
        if let Some(sub) = self.saving.take() {
            let sheet = self.sheet.as_ref();
            for (key, held) in &mut self.held {
                if is_in(sheet, *key, sub) {
                    held.saved = Saved::Unknown;
                }
            }
        }
        self.load(scope);
    }

    fn load(&mut self, scope: Scope) {
        let (sheet, node_id) = (self.sheet.as_ref(), self.node_id);
        for (key, held) in &mut self.held {
            if scope == Scope::Communication && key.0 >= 0x2000 {
                continue;
            }
            let is_restored = std::mem::take(&mut held.is_restored);
            if is_restored {
                held.saved = Saved::Default;
            }
            let entry = sheet.and_then(|sheet| sheet.entries.get(key));
            held.event = match held.saved {
                Saved::Value(_) | Saved::NodeId(_) => Event::Loaded,
                _ if is_restored => Event::Restored,
                _ => Event::None,
            };
            held.present = match (&held.saved, entry.map(|entry| &entry.initial)) {
                (Saved::Value(value), _) => Some(value.clone()),
                (Saved::NodeId(base), _) | (Saved::Default, Some(Initial::NodeId(base))) => {
                    Some((base + u32::from(node_id)).to_le_bytes().to_vec())
                }
                (Saved::Default, Some(Initial::Bytes(bytes))) => Some(bytes.clone()),
                _ => None,
            };
            held.is_sure = held.present.is_some();
        }
    }
}

/// Whether a sub-index of 1010h or 1011h covers the object.
fn is_in(sheet: Option<&Sheet>, key: Key, sub: u8) -> bool {
    match (sub, Sheet::group(sheet, key)) {
        (1, Some(COMMUNICATION | APPLICATION)) => true,
        (_, group) => group == Some(sub),
    }
}

/// The saved form of a value. A COB-ID that equals the pre-defined one follows the node-ID.
fn saved(sheet: Option<&Sheet>, key: Key, value: &[u8], node_id: u8) -> Saved {
    let node_id = u32::from(node_id);
    let entry = sheet.and_then(|sheet| sheet.entries.get(&key));
    let base = match (entry.map(|entry| &entry.initial), key) {
        (Some(Initial::NodeId(base)), _) => Some(base & 0x7FF),
        (None, (0x1014, 0)) => Some(0x80),
        (None, (0x1800..=0x1803, 1)) => TPDO_CAN_IDS.get(usize::from(key.0 - 0x1800)).copied(),
        _ => None,
    };
    match base {
        Some(base) if value.len() == 4 && number(value) & 0x7FF == base + node_id => {
            Saved::NodeId(number(value) - node_id)
        }
        _ => Saved::Value(value.to_vec()),
    }
}

fn number(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

/// Equal, as far as both reach: an expedited transfer without a size always has four bytes.
fn is_same(a: &[u8], b: &[u8]) -> bool {
    a.iter().zip(b).all(|(a, b)| a == b) && (a.is_empty() == b.is_empty())
}

fn hex(bytes: &[u8]) -> String {
    const SHOWN: usize = 16;
    let shown: Vec<String> = bytes.iter().take(SHOWN).map(|byte| format!("{byte:02X}")).collect();
    let more = if bytes.len() > SHOWN { " …" } else { "" };
    format!("[{}{more}]", shown.join(" "))
}
