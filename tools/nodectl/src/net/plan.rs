//! The settings in a file for each node: its identity, and the values of its parameters.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use canopen::{Duration, NodeId};
use eds::{DeviceInfo, Eds};
use thiserror::Error;

use super::{File, Member, Start};
use crate::Catalogue;
use crate::configuration::{Configuration, is_parameter};
use crate::object::{Place, at};
use crate::value::Value;

/// The CAN-ID in a COB-ID.
const CAN_ID: i128 = 0x7FF;
/// Bit 31 of a COB-ID: off.
const OFF: i128 = 1 << 31;

/// The intended state of a bus.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The start of the nodes.
    pub start: Start,
    /// The nodes in their order.
    pub nodes: Vec<PlannedNode>,
}

/// The intended state of a node.
#[derive(Clone, Debug)]
pub struct PlannedNode {
    /// The node-ID.
    pub node: NodeId,
    /// The entry of the file.
    pub member: Member,
    /// The data sheet of the file; `None` where the identity of the node decides.
    pub catalogue: Option<Arc<Catalogue>>,
    /// The configuration file.
    dcf: Option<Eds>,
}

/// A mistake in the file, or in one that it names.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlanError {
    /// A node-ID is wrong.
    #[error("{0} is no node-ID, 1 to 127")]
    NodeId(u8),
    /// Two nodes have the same node-ID.
    #[error("node {0} is there twice")]
    Twice(u8),
    /// A value does not fit its object.
    #[error("node {node}: {reason}")]
    Value {
        /// The node.
        node: u8,
        /// The reason.
        reason: String,
    },
}

impl Plan {
    /// The plan of a file. `sheet` reads the data sheet of a path in it, `configuration` the configuration file.
    ///
    /// # Errors
    /// A data sheet or a configuration file cannot be read, or the file has a mistake.
    pub fn new<E: From<PlanError>>(
        file: File,
        mut sheet: impl FnMut(&Path) -> Result<Eds, E>,
        mut configuration: impl FnMut(&Path) -> Result<Eds, E>,
    ) -> Result<Plan, E> {
        let mut nodes: Vec<PlannedNode> = Vec::new();
        for member in file.nodes {
            let node = NodeId::new(member.node).ok_or(PlanError::NodeId(member.node))?;
            if nodes.iter().any(|other| other.node == node) {
                return Err(PlanError::Twice(member.node).into());
            }
            check_consumes(node, &member)?;
            let eds = member.sheet.as_deref().map(&mut sheet).transpose()?;
            let dcf = member.configuration.as_deref().map(&mut configuration).transpose()?;
            if let (Some(sheet), Some(dcf)) = (&eds, &dcf) {
                check_device(node, &sheet.device, &dcf.device)?;
            }
            let catalogue = eds.or_else(|| dcf.clone()).map(|sheet| Arc::new(Catalogue::new(sheet)));
            let planned = PlannedNode { node, member, catalogue, dcf };
            if let Some(catalogue) = &planned.catalogue {
                planned.wanted(catalogue)?;
            }
            nodes.push(planned);
        }
        Ok(Plan { start: file.start, nodes })
    }

    /// CAN-IDs with which several nodes send, each with the nodes: by the TPDOs and the EMCY that the data sheets and the
    /// file tell.
    #[must_use]
    pub fn shared_can_ids(&self) -> Vec<(u16, Vec<NodeId>)> {
        let mut senders: BTreeMap<u16, BTreeSet<NodeId>> = BTreeMap::new();
        for planned in &self.nodes {
            for id in planned.sent_can_ids() {
                senders.entry(id).or_default().insert(planned.node);
            }
        }
        let several = senders.into_iter().filter(|(_, nodes)| nodes.len() > 1);
        several.map(|(id, nodes)| (id, nodes.into_iter().collect())).collect()
    }
}

/// Refuses nodes whose heartbeat 1016h cannot monitor.
fn check_consumes(node: NodeId, member: &Member) -> Result<(), PlanError> {
    let why = |other: &u8| match NodeId::new(*other) {
        None => Some(format!("consumes: {}", PlanError::NodeId(*other))),
        Some(own) if own == node => Some(format!("consumes: {other} is the node itself")),
        Some(_) => None,
    };
    let reason = member.consumes.keys().find_map(why);
    reason.map_or(Ok(()), |reason| Err(PlanError::Value { node: node.get(), reason }))
}

/// Refuses a configuration file for another device than that of the data sheet, as far as both name one.
fn check_device(node: NodeId, sheet: &DeviceInfo, dcf: &DeviceInfo) -> Result<(), PlanError> {
    let pairs = [(sheet.vendor_number, dcf.vendor_number), (sheet.product_number, dcf.product_number)];
    if pairs.into_iter().all(|(sheet, dcf)| sheet == dcf || sheet == 0 || dcf == 0) {
        return Ok(());
    }
    let device = |info: &DeviceInfo| {
        format!("vendor {:08X}h, product {:08X}h", info.vendor_number, info.product_number)
    };
    let reason =
        format!("the configuration file is for {}, and the data sheet for {}", device(dcf), device(sheet));
    Err(PlanError::Value { node: node.get(), reason })
}

impl PlannedNode {
    /// The name of the node in messages.
    #[must_use]
    pub fn title(&self) -> String {
        match &self.member.name {
            Some(name) => format!("node {} ({name})", self.node.get()),
            None => format!("node {}", self.node.get()),
        }
    }

    /// The time of the heartbeat; `None` where the file has none, or switches it off.
    #[must_use]
    pub fn heartbeat(&self) -> Option<Duration> {
        self.member.heartbeat.filter(|time| *time > 0).map(|time| Duration::from_millis(time.into()))
    }

    /// The parameters that the file sets, with this data sheet: the values of the configuration file, heartbeats,
    /// guarding, and single values. The date of the configuration is not among them where the file has one.
    ///
    /// # Errors
    /// An object is not in the data sheet, or a value does not fit its object.
    pub fn wanted(&self, catalogue: &Catalogue) -> Result<Configuration, PlanError> {
        let mut wanted = self.of_file();
        let mut single: Vec<(String, String)> = Vec::new();
        single.extend(self.member.heartbeat.map(|time| ("1017".to_owned(), time.to_string())));
        for (number, (node, time)) in self.member.consumes.iter().enumerate() {
            let value = u32::from(*node) << 16 | u32::from(*time);
            single.push((format!("1016:{}", number + 1), value.to_string()));
        }
        if let Some(guarding) = self.member.guarding {
            single.push(("100C".to_owned(), guarding.time.to_string()));
            single.push(("100D".to_owned(), guarding.factor.to_string()));
        }
        single.extend(self.member.values.iter().map(|(name, value)| (name.clone(), value.to_string())));
        wanted.values.extend(self.single_values(catalogue, single)?);
        if self.member.date.is_some() {
            wanted.values.retain(|(index, _), _| *index != 0x1020);
        }
        Ok(wanted)
    }

    /// Values by their names. An object has one value, in whatever way the file names it.
    fn single_values(
        &self,
        catalogue: &Catalogue,
        single: Vec<(String, String)>,
    ) -> Result<BTreeMap<(u16, u8), Value>, PlanError> {
        let mut values = BTreeMap::new();
        for (name, text) in single {
            let (key, value) = self.value(catalogue, &name, &text)?;
            if let Some(other) = values.insert(key, value.clone()).filter(|other| *other != value) {
                let place = Place(at(key.0, key.1));
                let reason = format!("{place} is to be {other} and {value}: the file sets it twice");
                return Err(PlanError::Value { node: self.node.get(), reason });
            }
        }
        Ok(values)
    }

    fn value(&self, catalogue: &Catalogue, name: &str, text: &str) -> Result<((u16, u8), Value), PlanError> {
        let wrong = |reason: String| PlanError::Value { node: self.node.get(), reason };
        let object = catalogue.find(name).map_err(|error| wrong(error.to_string()))?;
        let entry = catalogue.sheet().get(object.index, object.sub);
        let data_type = entry
            .filter(|entry| entry.access.is_writable())
            .map(|entry| entry.data_type)
            .ok_or_else(|| wrong(format!("{} is no object that the data sheet lets write", Place(object))))?;
        let value = match catalogue.word(object, text) {
            Some(value) => value,
            None => {
                Value::parse(text, data_type).map_err(|error| wrong(format!("{}: {error}", Place(object))))?
            }
        };
        Ok(((object.index, object.sub), value))
    }

    /// The values of the configuration file, and the whole PDOs to which they belong: a PDO is written as a whole.
    fn of_file(&self) -> Configuration {
        let Some(file) = &self.dcf else { return Configuration::default() };
        let all = Configuration::of_sheet(file, self.node);
        let written: BTreeSet<(u16, u8)> = file
            .entries()
            .filter(|entry| is_parameter(entry) && entry.value.is_some())
            .map(|entry| (entry.index, entry.sub))
            .collect();
        let pdo = |index: u16| Some(index & !0x0200).filter(|_| (0x1400..=0x1BFF).contains(&index));
        let pdos: BTreeSet<u16> = written.iter().filter_map(|key| pdo(key.0)).collect();
        let belongs = |key: &(u16, u8)| {
            let is_part = key.0 & 0x0200 != 0 || key.1 == 1;
            written.contains(key) || (is_part && pdo(key.0).is_some_and(|pdo| pdos.contains(&pdo)))
        };
        Configuration { values: all.values.into_iter().filter(|(key, _)| belongs(key)).collect() }
    }

    /// The CAN-IDs with which the node sends PDOs and EMCY.
    fn sent_can_ids(&self) -> Vec<u16> {
        let Some(catalogue) = &self.catalogue else { return Vec::new() };
        let mut values = Configuration::of_sheet(catalogue.sheet(), self.node).values;
        values.extend(self.wanted(catalogue).unwrap_or_default().values);
        let is_sent = |key: &(u16, u8)| matches!(key, (0x1800..=0x19FF, 1) | (0x1014, 0));
        let id = |value: &Value| match value {
            Value::Integer(value) if value & OFF == 0 => u16::try_from(value & CAN_ID).ok(),
            _ => None,
        };
        values.iter().filter(|(key, _)| is_sent(key)).filter_map(|(_, value)| id(value)).collect()
    }

    /// Whether the data sheet has the date of the configuration.
    #[must_use]
    pub fn has_date(catalogue: &Catalogue) -> bool {
        [1, 2].into_iter().all(|sub| catalogue.sheet().get(0x1020, sub).is_some())
    }
}
