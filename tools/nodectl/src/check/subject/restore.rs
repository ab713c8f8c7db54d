//! Values that are written back, and the settings of SYNC and EMCY that the checks expect.

use std::collections::{BTreeMap, BTreeSet};

use canopen::sdo::Multiplexer;

use super::verdict::{Outcome, ensure};
use super::{OFF, Refusal, Subject};
use crate::configuration::{Configuration, looked_at, plan};
use crate::object::{Place, at};
use crate::value::Value;

/// The number of times that values are written which are still different: some parameters change others.
const PASSES: usize = 3;

/// The bytes of objects, by index and sub-index.
pub(in crate::check) type Values = BTreeMap<(u16, u8), Vec<u8>>;

/// The values for a plan: numbers of up to eight bytes without their type.
fn configuration(values: &Values) -> Configuration {
    let value = |bytes: &Vec<u8>| match bytes.len() {
        1..=8 => Value::Integer(bytes.iter().rev().fold(0, |value, byte| value << 8 | i128::from(*byte))),
        _ => Value::Bytes(bytes.clone()),
    };
    Configuration { values: values.iter().map(|(key, bytes)| (*key, value(bytes))).collect() }
}

/// The bytes of a value of a plan.
fn bytes(value: &Value, size: usize) -> Vec<u8> {
    match value {
        Value::Integer(number) => number.to_le_bytes()[..size.min(8)].to_vec(),
        Value::Bytes(bytes) => bytes.clone(),
        _ => Vec::new(),
    }
}

impl Subject<'_> {
    /// The values of objects. One that the device refuses is missing.
    pub(in crate::check) fn values(&mut self, keys: impl IntoIterator<Item = (u16, u8)>) -> Outcome<Values> {
        let mut values = Values::new();
        for (index, sub) in keys {
            if let Ok(bytes) = self.try_read(index, sub)? {
                values.insert((index, sub), bytes);
            }
        }
        Ok(values)
    }

    /// Brings objects to their values, in the steps that their services need. Returns those that stay different, with the
    /// reason.
    pub(in crate::check) fn bring(&mut self, wanted: &Values) -> Outcome<Vec<String>> {
        let to = configuration(wanted);
        let mut keys: BTreeSet<(u16, u8)> = looked_at(&to);
        // The entries that were not written are as before, and have no node of the others.
        keys.retain(|key| key.0 != 0x1016 || wanted.contains_key(key));
        let mut refusals: BTreeMap<(u16, u8), Refusal> = BTreeMap::new();
        for _ in 0..PASSES {
            let now = self.values(keys.iter().copied())?;
            let steps = plan(&configuration(&now), &to);
            if steps.is_empty() {
                return Ok(Vec::new());
            }
            refusals.clear();
            for step in steps {
                let key = (step.at.index, step.at.sub);
                let Some(size) = wanted.get(&key).or_else(|| now.get(&key)).map(Vec::len) else { continue };
                if let Err(refusal) = self.try_write(key.0, key.1, &bytes(&step.value, size))? {
                    refusals.insert(key, refusal);
                }
            }
        }
        let now = self.values(wanted.keys().copied())?;
        let left = wanted.iter().filter(|(key, bytes)| now.get(key) != Some(bytes));
        let words = |(key, _): (&(u16, u8), _)| {
            let reason =
                refusals.get(key).map_or("the value stays another one".to_owned(), Refusal::to_string);
            format!("{}: {reason}", Place(at(key.0, key.1)))
        };
        Ok(left.map(words).collect())
    }

    /// Writes back the objects that were written since a length of the list, with their first values.
    pub(in crate::check) fn put_back_since(&mut self, length: usize) -> Outcome {
        let written = self.written.split_off(length.min(self.written.len()));
        // In reverse order, the first value of an object replaces the later ones.
        let former =
            written.into_iter().rev().map(|(Multiplexer { index, sub }, bytes)| ((index, sub), bytes));
        let left = self.sheltered(|s| s.bring(&former.collect()))?;
        ensure(left.is_empty(), "what was changed is taken back", left.join(", "))
    }

    /// Writes back the objects whose value has changed.
    pub(in crate::check) fn put_back(&mut self) -> Outcome {
        self.put_back_since(0)
    }

    /// Sets 1006h to 0 for a change of 1019h (CiA 301, 7.5.2.22).
    pub(in crate::check) fn unlock_counter(&mut self) -> Outcome {
        match self.optional(0x1006, 0)? {
            Some(1..) => self.set(0x1006, 0, 0),
            _ => Ok(()),
        }
    }

    /// Sets 1005h and 1019h for the SYNC that the checks send: CAN-ID 80h, without a counter. A refusal shows in the check.
    pub(in crate::check) fn plain_sync(&mut self) -> Outcome {
        if let Some(1..) = self.optional(0x1019, 0)? {
            self.unlock_counter()?;
            let _ = self.change(0x1019, 0, &[0])?;
        }
        match self.optional(0x1005, 0)? {
            Some(cob_id) if cob_id & 0x7FF != 0x80 => {
                // Off, if the device produces SYNC: the CAN-ID changes only then.
                for value in [cob_id & !(1 << 30), 0x80] {
                    let _ = self.change(0x1005, 0, &value.to_le_bytes())?;
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Sets 1014h to the COB-ID at which the checks expect an EMCY, the pre-defined one. A refusal shows in the check.
    pub(in crate::check) fn plain_emcy(&mut self) -> Outcome {
        let wanted = 0x80 + u32::from(self.id());
        if let Some(present) = self.optional(0x1014, 0)?.filter(|present| *present != wanted) {
            for value in [present | OFF, wanted] {
                let _ = self.change(0x1014, 0, &value.to_le_bytes())?;
            }
        }
        Ok(())
    }
}
