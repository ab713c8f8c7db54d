//! The configuration as a file (CiA 306).

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use eds::{Commissioning, Eds, Entry, Formula, Reals};

use super::{Configuration, cob_id, same};
use crate::object::at;
use crate::value::Value;

/// A configuration file.
#[derive(Clone, Debug, PartialEq)]
pub struct Dcf {
    /// The text of the file.
    pub text: String,
    /// The parameters whose values cannot stand in a file, which has no quotes: an empty text, and one with a line break,
    /// spaces at its ends or a comment. The file has neither a value nor a default of them, so nothing is written to
    /// them.
    pub left_out: Vec<Multiplexer>,
}

impl Configuration {
    /// The configuration file of this name: the data sheet with the values that differ from the defaults, or with all
    /// values.
    #[must_use]
    pub fn to_dcf(
        &self,
        sheet: &Eds,
        name: &str,
        commissioning: Commissioning,
        all: bool,
        reals: Reals,
    ) -> Dcf {
        let node = NodeId::new(commissioning.node_id);
        let mut file = Eds { commissioning: Some(commissioning), ..sheet.clone() };
        if let Some(node) = node {
            self.write(&mut file, &Configuration::of_sheet(sheet, node), node, all);
        }
        let text = file.to_dcf(name, reals);
        let left_out = node.map(|node| self.lost(&text, node)).unwrap_or_default();
        if left_out.is_empty() {
            return Dcf { text, left_out };
        }
        for entry in entries(&mut file).filter(|entry| left_out.contains(&at(entry.index, entry.sub))) {
            (entry.value, entry.default) = (None, None);
        }
        Dcf { text: file.to_dcf(name, reals), left_out }
    }

    fn write(&self, file: &mut Eds, defaults: &Configuration, node: NodeId, all: bool) {
        for entry in entries(file) {
            let key = (entry.index, entry.sub);
            let value = self.values.get(&key);
            let is_wanted = all || !same(value, defaults.values.get(&key));
            let formula = |value| cob_id::formula(entry, value, node).or_else(|| encode(value));
            entry.value = value.filter(|_| is_wanted).and_then(formula);
        }
    }

    /// The parameters to which a file gives another value.
    fn lost(&self, text: &str, node: NodeId) -> Vec<Multiplexer> {
        let read = Eds::parse(text).map(|file| Configuration::of_sheet(&file, node)).unwrap_or_default();
        let lost = self.values.iter().filter(|(key, value)| !same(read.values.get(key), Some(value)));
        lost.map(|(key, _)| at(key.0, key.1)).collect()
    }
}

fn entries(file: &mut Eds) -> impl Iterator<Item = &mut Entry> {
    file.objects.values_mut().flat_map(|object| object.entries.values_mut())
}

/// The value in the form of a file; `None` for a text with a line break.
fn encode(value: &Value) -> Option<Formula> {
    let value = match value {
        Value::Integer(value) | Value::Decimal(value, _) => eds::Value::Integer(*value),
        Value::Real32(value) => eds::Value::Real(f64::from(*value)),
        Value::Real64(value) => eds::Value::Real(*value),
        Value::Text(text) if text.is_empty() || text.chars().any(char::is_control) => return None,
        Value::Text(text) => eds::Value::Text(text.clone()),
        Value::Bytes(_) => eds::Value::Text(value.to_string()),
    };
    Some(Formula::Constant(value))
}
