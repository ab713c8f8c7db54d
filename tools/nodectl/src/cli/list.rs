//! `nodectl list`

use std::fmt;

use canopen::sdo::Multiplexer;
use clap::Args;
use serde::Serialize;

use super::read::{Reading, place};
use super::{Failure, Session};
use crate::object::{Place, at};
use crate::quantity::Quantity;

/// Lists the objects of the data sheet, with the values that the node has.
#[derive(Debug, Args)]
pub(super) struct List {
    /// Only objects whose address or name has all these words or parts of words.
    filter: Vec<String>,

    /// Do not ask the node.
    #[arg(long)]
    no_values: bool,
}

#[derive(Serialize)]
struct Row {
    #[serde(rename = "object", serialize_with = "place")]
    at: Multiplexer,
    name: String,
    #[serde(rename = "type")]
    data_type: String,
    access: &'static str,
    /// The PDOs that can carry the object: `TPDO`, `RPDO` or both.
    pdo: String,
    range: Option<String>,
    value: Option<serde_json::Value>,
    unit: String,
    #[serde(skip)]
    shown: String,
}

impl List {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?;
        let sheet = session.sheet_of(node)?;
        let catalogue = session.catalogue(node)?;
        session.begin_all();
        let mut count = 0;
        for entry in sheet.entries() {
            let object = at(entry.index, entry.sub);
            let name = sheet.path(entry);
            if !self.is_meant(object, &name) {
                continue;
            }
            count += 1;
            let (mut value, mut shown, mut unit) = (None, String::new(), entry.unit.clone());
            let is_domain = entry.data_type == eds::DataType::DOMAIN;
            let is_asked = !self.no_values && entry.access.is_readable() && !is_domain;
            let bytes = if is_asked { session.optional(node, object)? } else { None };
            if let Some(bytes) = bytes {
                let quantity = Quantity::of(&mut session.client(node), &catalogue, object)?;
                let reading = Reading::new(node.get(), object, &bytes, &catalogue, &quantity, None);
                unit.clone_from(&quantity.unit);
                shown = reading.value_text();
                value = Some(reading.json_value());
            }
            let pdo = [(entry.is_tpdo_mappable(), "TPDO"), (entry.is_rpdo_mappable(), "RPDO")];
            let pdo: Vec<&str> = pdo.into_iter().filter(|(can, _)| *can).map(|(_, pdo)| pdo).collect();
            session.print(&Row {
                at: object,
                name,
                data_type: entry.data_type.to_string(),
                access: entry.access.text(),
                pdo: pdo.join("/"),
                range: catalogue.range(object, node),
                value,
                unit,
                shown,
            })?;
        }
        if count == 0 {
            return Err(Failure::Usage("no object has all of these words".to_owned()));
        }
        Ok(())
    }

    fn is_meant(&self, object: Multiplexer, name: &str) -> bool {
        let text = format!("{} {name}", Place(object)).to_lowercase();
        self.filter.iter().all(|word| text.contains(&word.to_lowercase()))
    }
}

/// `1017h:0   rw    UNSIGNED16  Producer heartbeat time = 1000 ms`
impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Row { at, name, data_type, access, pdo, range, unit, shown, .. } = self;
        write!(f, "{:<9} {access:<5} {data_type:<14} {pdo:<5} {name}", Place(*at))?;
        match shown.as_str() {
            "" if unit.is_empty() => (),
            "" => write!(f, " [{unit}]")?,
            value => write!(f, " = {value}")?,
        }
        range.iter().try_for_each(|range| write!(f, " ({range})"))
    }
}
