//! `nodectl write`

use std::fs;
use std::path::PathBuf;

use canopen::sdo::Multiplexer;
use clap::Args;
use eds::DataType;

use super::read::{Reading, parse_type};
use super::{Failure, Session};
use crate::Catalogue;
use crate::object::Place;
use crate::quantity::Quantity;
use crate::value::{Value, ValueError};

/// Writes an object, and prints what was written.
#[derive(Debug, Args)]
pub(super) struct Write {
    /// Object by index (1017, 0x1018sub1) or by name ("Producer heartbeat time").
    object: String,

    /// The value: decimal or after 0x hexadecimal; text; bytes as pairs of hexadecimal digits. A decimal number is the
    /// value in its unit, as `read` shows it (2.5). Units (mbar, kPa) and signatures (save, load, zero, cali) are words.
    #[arg(required_unless_present = "file", conflicts_with = "file", allow_hyphen_values = true)]
    value: Option<String>,

    /// Its data type, where no data sheet has it: UNSIGNED32 or u32, REAL32 or r32 ...
    #[arg(long = "type", value_name = "TYPE", value_parser = parse_type)]
    data_type: Option<DataType>,

    /// The value is the number on the wire, not the value in its unit.
    #[arg(long)]
    raw: bool,

    /// Write in blocks.
    #[arg(long)]
    block: bool,

    /// The bytes of this file instead of a value.
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
}

impl Write {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?;
        let at = session.find(node, &self.object)?;
        let catalogue = session.catalogue(node)?;
        let data_type = self.data_type.or_else(|| catalogue.data_type(at));
        let quantity = Quantity::of(&mut session.client(node), &catalogue, at)?;
        let bytes = self.bytes(at, &catalogue, data_type, &quantity)?;
        let mut client = session.client(node);
        let written = if self.block {
            client.block_download(at, &bytes, |_| ())
        } else {
            client.download(at, &bytes, |_| ())
        };
        written.map_err(|error| session.named(error))?;
        // If the unit itself was written, the new unit applies already.
        let quantity = Quantity::of(&mut session.client(node), &catalogue, at)?;
        session.print(&Reading::new(node.get(), at, &bytes, &catalogue, &quantity, data_type))
    }

    fn bytes(
        &self,
        at: Multiplexer,
        catalogue: &Catalogue,
        data_type: Option<DataType>,
        quantity: &Quantity,
    ) -> Result<Vec<u8>, Failure> {
        if let Some(path) = &self.file {
            return fs::read(path).map_err(|error| Failure::file(path, error));
        }
        let text = self.value.as_deref().unwrap_or_default();
        let data_type = data_type.ok_or_else(|| {
            let missing = catalogue.missing(at);
            let is_known = missing.starts_with("the data sheet");
            let hint = if is_known { "" } else { ": give it with --type" };
            Failure::Usage(format!("{missing}{hint}"))
        })?;
        let word = catalogue.word(at, text);
        match word.map_or_else(|| self.parse(text, data_type, quantity), Ok) {
            Ok(value) => Ok(value.encode(data_type)),
            Err(error) => Err(Failure::Usage(format!("{}: {error}{}", Place(at), catalogue.words(at)))),
        }
    }

    fn parse(&self, text: &str, data_type: DataType, quantity: &Quantity) -> Result<Value, ValueError> {
        if self.raw { Value::parse(text, data_type) } else { quantity.parse(text, data_type) }
    }
}
