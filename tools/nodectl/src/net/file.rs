//! The file of a bus, in YAML.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use schemars::{JsonSchema, schema_for};
use serde::Deserialize;

use super::Date;

/// The bus: its nodes, and their start.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// How the nodes are started once they are configured.
    #[serde(default)]
    pub start: Start,
    /// The nodes, in the order in which they are configured and started.
    pub nodes: Vec<Member>,
}

/// The start of the nodes (CiA 302-2, 1F80h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// All with one command, after the last node is configured and if no node that must be there has failed.
    #[default]
    All,
    /// Each after its own configuration.
    Each,
    /// Something else starts them.
    None,
}

/// A node of the bus.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// The node-ID.
    #[schemars(range(min = 1, max = 127))]
    pub node: u8,
    /// A name for messages.
    pub name: Option<String>,
    /// The data sheet (EDS), relative to this file. Without it, that of `configuration`, or the one that fits the
    /// identity of the node.
    pub sheet: Option<PathBuf>,
    /// The configuration file (DCF), relative to this file. Its values are written.
    pub configuration: Option<PathBuf>,
    /// The required identity.
    #[serde(default)]
    pub identity: Identity,
    /// The hardware version (1009h).
    pub hardware: Option<String>,
    /// The software version (100Ah).
    pub software: Option<String>,
    /// The date of the configuration (1020h), such as 2026-11-24 10:30. A node with this date has its configuration
    /// already; after a configuration it gets the date.
    pub date: Option<Date>,
    /// The time of the heartbeat in ms (1017h).
    pub heartbeat: Option<u16>,
    /// The nodes whose heartbeat this one monitors, each with the time in ms (1016h).
    #[serde(default)]
    pub consumes: BTreeMap<u8, u16>,
    /// Node guarding (100Ch, 100Dh).
    pub guarding: Option<Guarding>,
    /// Values beside those of the configuration file: by index and sub-index or by name.
    #[serde(default)]
    pub values: BTreeMap<String, Number>,
    /// Whether the node is started.
    #[serde(default = "yes")]
    pub start: bool,
    /// Whether the node may be missing.
    #[serde(default)]
    pub optional: bool,
    /// Whether the node saves its configuration.
    #[serde(default)]
    pub save: bool,
}

/// The required identity of a node (CiA 302-2, 1F84h to 1F88h). A key that is left out is not compared.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Identity {
    /// 1000h
    pub device_type: Option<u32>,
    /// 1018h:1
    pub vendor: Option<u32>,
    /// 1018h:2
    pub product: Option<u32>,
    /// 1018h:3
    pub revision: Option<u32>,
    /// 1018h:4
    pub serial: Option<u32>,
}

/// Node guarding.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Guarding {
    /// The guard time in ms (100Ch).
    pub time: u16,
    /// The life time factor (100Dh).
    pub factor: u8,
}

/// A value as YAML has it.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Number {
    /// An integer.
    Integer(i64),
    /// A number with a fraction.
    Real(f64),
    /// A text, such as a unit or a signature.
    Text(String),
}

const fn yes() -> bool {
    true
}

impl File {
    /// Reads a file.
    ///
    /// # Errors
    /// The first mistake, with its line.
    pub fn parse(text: &str) -> Result<File, String> {
        serde_saphyr::from_str(text).map_err(|error| error.to_string())
    }
}

/// The value as a person types it.
impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Number::Integer(value) => write!(f, "{value}"),
            Number::Real(value) => write!(f, "{value:?}"),
            Number::Text(text) => f.write_str(text),
        }
    }
}

/// The schema of the file (JSON Schema), for editors.
#[must_use]
pub fn schema() -> serde_json::Value {
    schema_for!(File).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_with_numbers_in_any_form() {
        let file = File::parse(
            "start: each\nnodes:\n  - node: 5\n    identity: { vendor: 0x1A2, product: 7 }\n    date: 2026-11-24 10:30\n    \
             values:\n      1800:5: 100\n      6131:1: kPa\n      6124:1: -0.5\n    consumes: { 1: 1500 }\n",
        )
        .unwrap();
        let node = &file.nodes[0];
        assert_eq!((file.start, node.identity.vendor, node.start), (Start::Each, Some(0x1A2), true));
        assert_eq!(node.date.unwrap().to_string(), "2026-11-24 10:30");
        let values: Vec<String> = node.values.iter().map(|(at, value)| format!("{at}={value}")).collect();
        assert_eq!(values, ["1800:5=100", "6124:1=-0.5", "6131:1=kPa"]);
        assert_eq!(node.consumes[&1], 1500);
    }

    #[test]
    fn a_mistake_is_named_with_its_line() {
        for (text, words) in [
            ("nodes:\n  - node: 5\n    hartbeat: 3\n", "hartbeat"),
            ("nodes:\n  - node: 300\n", "2"),
            ("nodes:\n  - name: x\n", "node"),
            ("nodes:\n  - node: 5\n    date: yesterday\n", "yesterday"),
            ("nodes: [\n", "1"),
            ("start: now\nnodes: []\n", "now"),
        ] {
            let error = File::parse(text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    #[test]
    fn the_schema_has_every_key() {
        let text = schema().to_string();
        for key in
            ["\"start\"", "\"nodes\"", "\"consumes\"", "\"guarding\"", "\"device_type\"", "\"optional\""]
        {
            assert!(text.contains(key), "{key}");
        }
    }
}
