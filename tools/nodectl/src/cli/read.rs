//! `nodectl read`

use std::fmt;
use std::path::{Path, PathBuf};

use canopen::sdo::Multiplexer;
use clap::Args;
use eds::{Class, DataType};
use serde::{Serialize, Serializer};

use super::replacement::Replacement;
use super::{Failure, Session};
use crate::object::Place;
use crate::text::visible;
use crate::value::{Value, data_type, guess};
use crate::{Catalogue, unit};

/// Reads objects.
#[derive(Debug, Args)]
pub(super) struct Read {
    /// Objects by index (1018:1, 0x1018sub1) or by name ("Producer heartbeat time").
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,

    /// Their data type, where no data sheet tells it: UNSIGNED32 or u32, REAL32 or r32 ...
    #[arg(long = "type", value_name = "TYPE", value_parser = parse_type)]
    data_type: Option<DataType>,

    /// Read in blocks.
    #[arg(long)]
    block: bool,

    /// Write the bytes to this file ("-" for the standard output) instead of printing the value.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// The type of a name, for the command line.
pub(super) fn parse_type(name: &str) -> Result<DataType, String> {
    data_type(name).ok_or_else(|| "there are UNSIGNED8 (u8) to UNSIGNED64, INTEGER8 (i8) to INTEGER64, REAL32 (r32), REAL64, BOOLEAN (b), VISIBLE_STRING (vs), OCTET_STRING (os), UNICODE_STRING (us) and DOMAIN (d)".to_owned())
}

/// The value of an object and what is known about it.
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
    #[serde(skip)]
    class: Class,
}

impl Read {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?;
        for query in &self.objects {
            let at = session.find(node, query)?;
            let mut client = session.client(node);
            let bytes = if self.block { client.block_upload(at) } else { client.upload(at) };
            let bytes = bytes.map_err(|error| session.named(error))?;
            match &self.out {
                Some(path) => write_out(session, path, &bytes)?,
                None => {
                    let reading = self.reading(session, at, &bytes)?;
                    session.print(&reading)?;
                }
            }
        }
        Ok(())
    }

    fn reading(&self, session: &mut Session, at: Multiplexer, bytes: &[u8]) -> Result<Reading, Failure> {
        let node = session.options.node.one()?;
        let catalogue = session.catalogue(node)?;
        // The unit is that of the type of the data sheet.
        let unit = match self.data_type {
            Some(_) => String::new(),
            None => unit::of(&mut session.client(node), &catalogue, at)?,
        };
        Ok(Reading::new(node.get(), at, bytes, &catalogue, unit, self.data_type))
    }
}

impl Reading {
    pub(super) fn new(
        node: u8,
        at: Multiplexer,
        bytes: &[u8],
        catalogue: &Catalogue,
        unit: String,
        data_type: Option<DataType>,
    ) -> Reading {
        let data_type = data_type.or_else(|| catalogue.data_type(at)).unwrap_or_else(|| guess(bytes));
        Reading {
            node,
            at,
            name: catalogue.name(at),
            data_type: data_type.to_string(),
            value: Value::decode(bytes, data_type),
            unit,
            class: data_type.class(),
        }
    }
}

fn write_out(session: &mut Session, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    if path.as_os_str() == "-" {
        return Ok(session.output.write(bytes)?);
    }
    Replacement::write(path, bytes)
}

/// As a person writes it.
pub(super) fn place<S: Serializer>(at: &Multiplexer, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&Place(*at))
}

/// `1017h:0 Producer heartbeat time = 1000 ms`
impl fmt::Display for Reading {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} ", Place(self.at))?;
        if let Some(name) = &self.name {
            write!(f, "{name} ")?;
        }
        write!(f, "= {}", visible(&self.value.to_string()))?;
        // Identifiers, units and mappings are read digit by digit.
        if let (Value::Integer(value), Class::Unsigned(bits @ 32..)) = (&self.value, self.class) {
            write!(f, " ({value:0width$X}h)", width = usize::from(bits / 4))?;
        }
        if !self.unit.is_empty() {
            write!(f, " {}", self.unit)?;
        }
        Ok(())
    }
}
