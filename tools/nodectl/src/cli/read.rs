//! `nodectl read`

use std::fmt;
use std::path::{Path, PathBuf};

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use clap::Args;
use eds::{Class, DataType};
use serde::{Serialize, Serializer};

use super::replacement::Replacement;
use super::{Failure, Session};
use crate::object::Place;
use crate::quantity::{Quantity, with_unit};
use crate::sdo::AbortCode;
use crate::value::{Value, data_type, guess};
use crate::{Catalogue, meaning};

/// "No data available" (CiA 301, table 22).
const NO_DATA: AbortCode = AbortCode(0x0800_0024);

/// Reads objects.
#[derive(Debug, Args)]
pub(super) struct Read {
    /// Objects by index (1018:1, 0x1018sub1), by name ("Producer heartbeat time") or by words of the name in any order. A record
    /// or an array without a sub-index is read as a whole.
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,

    /// Their data type, where no data sheet has it: UNSIGNED32 or u32, REAL32 or r32 ...
    #[arg(long = "type", value_name = "TYPE", value_parser = parse_type)]
    data_type: Option<DataType>,

    /// Read in blocks.
    #[arg(long)]
    block: bool,

    /// Write the bytes of one object to this file ("-" for the standard output) instead of printing the value.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// The data type of a name, for the command line.
pub(super) fn parse_type(name: &str) -> Result<DataType, String> {
    data_type(name).ok_or_else(|| "there are UNSIGNED8 (u8) to UNSIGNED64, INTEGER8 (i8) to INTEGER64, REAL32 (r32), REAL64, BOOLEAN (b), VISIBLE_STRING (vs), OCTET_STRING (os), UNICODE_STRING (us) and DOMAIN (d)".to_owned())
}

/// The value of an object, with its name, unit and meaning.
#[derive(Serialize)]
pub(super) struct Reading {
    node: u8,
    #[serde(rename = "object", serialize_with = "place")]
    at: Multiplexer,
    name: Option<String>,
    #[serde(rename = "type")]
    data_type: String,
    value: Value,
    unit: String,
    /// The number on the wire, where it differs from the value.
    #[serde(skip_serializing_if = "Option::is_none")]
    raw: Option<Value>,
    /// The meaning of the number.
    #[serde(skip_serializing_if = "Option::is_none")]
    meaning: Option<String>,
    #[serde(skip)]
    class: Class,
    /// Whether the text has the number of the node.
    #[serde(skip)]
    is_named: bool,
}

impl Read {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let nodes = session.options.node.list()?;
        if nodes.len() > 1 && self.out.is_some() {
            return Err(Failure::Usage("--out is for one node".to_owned()));
        }
        if self.objects.len() > 1 && self.out.is_some() {
            return Err(Failure::Usage("--out is for one object".to_owned()));
        }
        let mut failures = Vec::new();
        let mut all = 0;
        for node in &nodes {
            match self.read_node(session, *node, nodes.len() > 1, &mut failures) {
                Ok(count) => all += count,
                // A node that does not answer does not stop the reading of the others.
                Err(failure @ Failure::Sdo(_)) if nodes.len() > 1 => {
                    all += 1;
                    session.tell(&failure)?;
                    failures.push(failure);
                }
                Err(failure) => return Err(failure),
            }
        }
        match failures.first() {
            None => Ok(()),
            Some(first) => {
                Err(Failure::Objects { failed: failures.len(), all, exit_code: first.exit_code() })
            }
        }
    }

    /// Reads the objects of a node. Returns their number. With `is_named`, each line has the number of the node.
    fn read_node(
        &self,
        session: &mut Session,
        node: NodeId,
        is_named: bool,
        failures: &mut Vec<Failure>,
    ) -> Result<usize, Failure> {
        let mut objects = Vec::new();
        for query in &self.objects {
            let meant = self.meant(session, node, query)?;
            let is_whole = meant.len() > 1;
            objects.extend(meant.into_iter().map(|at| (at, is_whole)));
        }
        for (at, is_whole) in objects.iter().copied() {
            match self.read(session, node, at, is_named) {
                // An empty entry of a list, such as an error that has not occurred (1003h).
                Err(Failure::Sdo(error)) if is_whole && error.abort() == Some(NO_DATA) => (),
                // An object that cannot be read does not stop the reading of the others.
                Err(failure @ Failure::Sdo(_)) if objects.len() > 1 && !failure.is_silence() => {
                    session.tell(&failure)?;
                    failures.push(failure);
                }
                result => result?,
            }
        }
        Ok(objects.len())
    }

    /// The object that a person means. For a record or an array without a sub-index, all its sub-indices.
    fn meant(&self, session: &mut Session, node: NodeId, query: &str) -> Result<Vec<Multiplexer>, Failure> {
        let at = session.find(node, query)?;
        let catalogue = session.catalogue(node)?;
        let subs = catalogue.subs(at.index);
        let is_whole = at.sub == 0 && names_no_sub(query) && subs.len() > 1;
        if is_whole && self.out.is_some() {
            let words =
                format!("--out is for one object: choose a sub-index of {:04X}h, as {0:04X}:1", at.index);
            return Err(Failure::Usage(words));
        }
        Ok(if is_whole && self.data_type.is_none() { subs } else { vec![at] })
    }

    fn read(
        &self,
        session: &mut Session,
        node: NodeId,
        at: Multiplexer,
        is_named: bool,
    ) -> Result<(), Failure> {
        let mut client = session.client(node);
        let bytes = if self.block { client.block_upload(at) } else { client.upload(at) };
        let bytes = bytes.map_err(|error| session.named(error))?;
        match &self.out {
            Some(path) => write_out(session, path, &bytes),
            None => {
                let mut reading = self.reading(session, node, at, &bytes)?;
                reading.is_named = is_named;
                session.print(&reading)
            }
        }
    }

    fn reading(
        &self,
        session: &mut Session,
        node: NodeId,
        at: Multiplexer,
        bytes: &[u8],
    ) -> Result<Reading, Failure> {
        let catalogue = session.catalogue(node)?;
        // With another type than the one of the data sheet, its unit does not apply.
        let quantity = match self.data_type {
            Some(_) => Quantity::default(),
            None => Quantity::of(&mut session.client(node), &catalogue, at)?,
        };
        Ok(Reading::new(node.get(), at, bytes, &catalogue, &quantity, self.data_type))
    }
}

/// Whether a query has no sub-index: an index alone, or a name without a path.
fn names_no_sub(query: &str) -> bool {
    !query.contains(':') && !query.to_ascii_lowercase().contains("sub") && !query.contains('/')
}

impl Reading {
    pub(super) fn new(
        node: u8,
        at: Multiplexer,
        bytes: &[u8],
        catalogue: &Catalogue,
        quantity: &Quantity,
        data_type: Option<DataType>,
    ) -> Reading {
        let data_type = data_type.or_else(|| catalogue.data_type(at)).unwrap_or_else(|| guess(bytes));
        let raw = Value::decode(bytes, data_type);
        Reading::of(
            node,
            at,
            catalogue.name(at),
            data_type,
            raw.clone(),
            quantity,
            meaning::of(catalogue, at, &raw),
        )
    }

    /// The value with its unit and its meaning.
    pub(super) fn value_text(&self) -> String {
        let meaning = self.meaning.as_ref().map(|meaning| format!(" [{meaning}]")).unwrap_or_default();
        format!("{}{meaning}", with_unit(&self.value, "", &self.unit))
    }

    /// The value in the form of JSON.
    pub(super) fn json_value(&self) -> serde_json::Value {
        serde_json::to_value(&self.value).unwrap_or_default()
    }

    /// The reading of a decoded value.
    pub(super) fn of(
        node: u8,
        at: Multiplexer,
        name: Option<String>,
        data_type: DataType,
        raw: Value,
        quantity: &Quantity,
        meaning: Option<String>,
    ) -> Reading {
        let value = quantity.apply(raw.clone());
        Reading {
            node,
            at,
            name,
            data_type: data_type.to_string(),
            raw: (value != raw).then_some(raw),
            value,
            unit: quantity.unit.clone(),
            meaning,
            class: data_type.class(),
            is_named: false,
        }
    }
}

fn write_out(session: &mut Session, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    if path.as_os_str() == "-" {
        return Ok(session.output.write(bytes)?);
    }
    Replacement::write(path, bytes)
}

/// Serialises an address in the form `1018h:1`.
pub(super) fn place<S: Serializer>(at: &Multiplexer, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&Place(*at))
}

/// `1017h:0 Producer heartbeat time = 1000 ms`
impl fmt::Display for Reading {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.is_named {
            write!(f, "node {}: ", self.node)?;
        }
        write!(f, "{} ", Place(self.at))?;
        if let Some(name) = &self.name {
            write!(f, "{name} ")?;
        }
        // Identifiers, units and mappings are also shown in hexadecimal, because people read them digit by digit.
        let hexadecimal = match (&self.value, self.class) {
            (Value::Integer(value), Class::Unsigned(bits @ 32..)) => {
                format!(" ({value:0width$X}h)", width = usize::from(bits / 4))
            }
            _ => String::new(),
        };
        write!(f, "= {}", with_unit(&self.value, &hexadecimal, &self.unit))?;
        self.meaning.iter().try_for_each(|meaning| write!(f, " [{meaning}]"))
    }
}
