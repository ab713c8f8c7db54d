//! The requests of pages.

use std::collections::BTreeSet;

use canopen::NodeId;
use canopen::lss::Identity;
use canopen::sdo::Multiplexer;
use serde::{Deserialize, Deserializer};
use serde_json::Value as Json;

use crate::cli::map::Direction;
use crate::cli::nmt::Command;
use crate::cli::store::Group;
use crate::object::at;
use crate::trace::Kind;

/// The number of objects that one request may read.
const OBJECTS: usize = 64;

/// A message of a page.
#[derive(Debug, Deserialize)]
pub(super) struct Request {
    /// The ID that the page has given the request.
    pub(super) id: Json,
    #[serde(flatten)]
    pub(super) what: What,
}

/// A node, by its ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Node(pub(super) NodeId);

/// A node or all nodes.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Whom {
    Node(Node),
    All(All),
}

#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) enum All {
    #[serde(rename = "all")]
    All,
}

/// A new mapping.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Mapping {
    pub(super) direction: Direction,
    pub(super) number: u16,
    pub(super) objects: Vec<Object>,
    pub(super) transmission: Option<u8>,
    pub(super) event: Option<u16>,
    pub(super) inhibit: Option<u16>,
    pub(super) cob_id: Option<u16>,
}

/// Index and sub-index.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) struct Object(u16, u8);

/// The identity of an LSS slave.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) struct Slave {
    vendor: u32,
    product: u32,
    revision: u32,
    serial: u32,
}

/// The requests.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", rename_all_fields = "snake_case")]
pub(super) enum What {
    Scan,
    Nmt {
        node: Whom,
        command: Command,
    },
    Save {
        node: Node,
        #[serde(default)]
        group: Group,
    },
    Restore {
        node: Node,
        #[serde(default)]
        group: Group,
    },
    Signals {
        node: Node,
    },
    Follow {
        signals: Vec<String>,
        #[serde(default)]
        read: Vec<String>,
    },
    Dictionary {
        node: Node,
    },
    Read {
        node: Node,
        objects: Vec<Object>,
    },
    Values {
        node: Node,
    },
    Write {
        node: Node,
        index: u16,
        sub: u8,
        value: Json,
    },
    Differences {
        node: Node,
    },
    Dcf {
        node: Node,
        #[serde(default)]
        all: bool,
    },
    Apply {
        node: Node,
        text: String,
        #[serde(flatten)]
        how: Apply,
    },
    Trace {
        on: bool,
        #[serde(default)]
        kinds: Vec<KindName>,
        #[serde(default)]
        nodes: BTreeSet<u8>,
    },
    #[serde(rename = "lss.scan")]
    LssScan,
    #[serde(rename = "lss.assign")]
    LssAssign {
        identity: Slave,
        node_id: Node,
        #[serde(default = "yes")]
        store: bool,
    },
    #[serde(rename = "lss.bit_rate")]
    LssBitRate {
        kbit: u16,
        identity: Option<Slave>,
        #[serde(default)]
        store: bool,
        #[serde(default)]
        activate: u16,
    },
    Pdos {
        node: Node,
    },
    Map {
        node: Node,
        #[serde(flatten)]
        mapping: Mapping,
    },
    #[serde(rename = "update.inspect")]
    UpdateInspect {
        node: Node,
        name: String,
        data: String,
    },
    #[serde(rename = "update.start")]
    UpdateStart {
        node: Node,
        file: u64,
        #[serde(default)]
        force: bool,
    },
    Stimuli,
    Stimulate {
        board: u8,
        kind: String,
        spec: String,
    },
}

/// How a configuration is applied.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub(super) struct Apply {
    #[serde(default)]
    pub(super) dry_run: bool,
    #[serde(default)]
    pub(super) save: bool,
    #[serde(default)]
    pub(super) force: bool,
}

/// A service by its name.
#[derive(Clone, Copy, Debug)]
pub(super) struct KindName(pub(super) Kind);

fn yes() -> bool {
    true
}

impl What {
    /// Whether the request changes anything on the bus.
    pub(super) fn writes(&self) -> bool {
        !matches!(
            self,
            What::Scan
                | What::Signals { .. }
                | What::Follow { .. }
                | What::Dictionary { .. }
                | What::Read { .. }
                | What::Values { .. }
                | What::Differences { .. }
                | What::Dcf { .. }
                | What::Trace { .. }
                | What::Pdos { .. }
                | What::UpdateInspect { .. }
                | What::Stimuli
        )
    }

    /// The error of a request that can be found before anything is done.
    pub(super) fn fault(&self) -> Option<String> {
        match self {
            What::Read { objects, .. } if objects.len() > OBJECTS => {
                Some(format!("{} objects at once; at most {OBJECTS}", objects.len()))
            }
            What::Map { mapping, .. } if !(1..=512).contains(&mapping.number) => {
                Some("PDOs are numbered from 1 to 512".to_owned())
            }
            What::Map { mapping, .. } if mapping.objects.len() > 64 => {
                Some("a PDO has at most 64 objects".to_owned())
            }
            _ => None,
        }
    }
}

/// Reads a message.
///
/// # Errors
/// The ID of the request, where there is one, and the error.
pub(super) fn parse(text: &str) -> Result<Request, (Json, String)> {
    let json: Json = serde_json::from_str(text).map_err(|error| (Json::Null, format!("no JSON: {error}")))?;
    let id = json.get("id").cloned().unwrap_or_default();
    serde_json::from_value(json).map_err(|error| (id, error.to_string()))
}

impl From<Object> for Multiplexer {
    fn from(Object(index, sub): Object) -> Multiplexer {
        at(index, sub)
    }
}

impl From<Slave> for Identity {
    fn from(Slave { vendor, product, revision, serial }: Slave) -> Identity {
        Identity { vendor, product, revision, serial }
    }
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Node, D::Error> {
        let id = u8::deserialize(deserializer)?;
        let node = NodeId::new(id).map(Node);
        node.ok_or_else(|| serde::de::Error::custom(format!("{id} is no node-ID; there are 1 to 127")))
    }
}

impl<'de> Deserialize<'de> for KindName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<KindName, D::Error> {
        let name = String::deserialize(deserializer)?;
        let kind = <Kind as clap::ValueEnum>::from_str(&name, false);
        kind.map(KindName).map_err(|_| serde::de::Error::custom(format!("{name:?} is no service")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_of_the_protocol() {
        for text in [
            r#"{"id":1,"do":"scan"}"#,
            r#"{"id":1,"do":"nmt","node":5,"command":"reset-communication"}"#,
            r#"{"id":1,"do":"nmt","node":"all","command":"start"}"#,
            r#"{"id":1,"do":"save","node":5}"#,
            r#"{"id":1,"do":"restore","node":5,"group":"application"}"#,
            r#"{"id":1,"do":"follow","signals":["5:6130:1"]}"#,
            r#"{"id":1,"do":"read","node":5,"objects":[[4096,0],[24880,1]]}"#,
            r#"{"id":1,"do":"write","node":5,"index":4119,"sub":0,"value":"500"}"#,
            r#"{"id":1,"do":"apply","node":5,"text":"","dry_run":true}"#,
            r#"{"id":1,"do":"trace","on":true,"kinds":["pdo","heartbeat"],"nodes":[5]}"#,
            r#"{"id":1,"do":"lss.scan"}"#,
            r#"{"id":1,"do":"lss.assign","identity":{"vendor":0,"product":1,"revision":1,"serial":7},"node_id":7}"#,
            r#"{"id":1,"do":"lss.bit_rate","kbit":500,"identity":null}"#,
            r#"{"id":1,"do":"map","node":5,"direction":"tpdo","number":1,"objects":[[24880,1]],"event":100}"#,
            r#"{"id":1,"do":"update.inspect","node":5,"name":"a","data":""}"#,
            r#"{"id":1,"do":"update.start","node":5,"file":1}"#,
            r#"{"id":1,"do":"stimulate","board":1,"kind":"pressure","spec":"const:1"}"#,
        ] {
            let request = parse(text).unwrap();
            assert_eq!((request.id, request.what.fault()), (1.into(), None), "{text}");
        }
    }

    #[test]
    fn errors_have_the_number_of_their_request() {
        for (text, id, words) in [
            ("", Json::Null, "no JSON"),
            ("[1]", Json::Null, ""),
            (r#"{"id":3,"do":"fly"}"#, 3.into(), "fly"),
            (r#"{"id":4,"do":"read","node":128,"objects":[]}"#, 4.into(), "128 is no node-ID"),
            (r#"{"id":5,"do":"read","node":5,"objects":[[70000,0]]}"#, 5.into(), "70000"),
            (r#"{"id":6,"do":"nmt","node":"some","command":"start"}"#, 6.into(), ""),
        ] {
            let (told, reason) = parse(text).unwrap_err();
            assert!(told == id && reason.contains(words), "{text}: {told} {reason}");
        }
        let many = format!(r#"{{"id":1,"do":"read","node":1,"objects":[{}[1,0]]}}"#, "[1,0],".repeat(64));
        assert_eq!(parse(&many).unwrap().what.fault().as_deref(), Some("65 objects at once; at most 64"));
    }

    #[test]
    fn writing_requests_are_known() {
        let writes = |text: &str| parse(text).unwrap().what.writes();
        assert!(writes(r#"{"id":1,"do":"nmt","node":"all","command":"start"}"#));
        assert!(writes(r#"{"id":1,"do":"stimulate","board":1,"kind":"pressure","spec":"const:1"}"#));
        assert!(writes(r#"{"id":1,"do":"lss.scan"}"#), "it selects nodes");
        assert!(!writes(r#"{"id":1,"do":"pdos","node":1}"#));
    }
}
