//! `nodectl map` and `nodectl unmap`: the mapping of a PDO in one command.

use std::fmt;
use std::path::PathBuf;

use canopen::NodeId;
use canopen::sdo::Multiplexer;
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use super::can_id::can_id;
use super::{Failure, Session};
use crate::Catalogue;
use crate::object::{Place, at};

/// Maps objects into a PDO, in the five steps of CiA 301: off, empty, objects, their number, on.
#[derive(Debug, Args)]
pub(super) struct Map {
    #[arg(required_unless_present = "dbc")]
    direction: Option<Direction>,

    /// The number of the PDO, from 1.
    #[arg(required_unless_present = "dbc", value_parser = clap::value_parser!(u16).range(1..=512))]
    number: Option<u16>,

    /// Objects by index or name, from the first bit on.
    #[arg(required_unless_present = "dbc", value_name = "OBJECT")]
    objects: Vec<String>,

    /// Write the present TPDOs of the nodes to a DBC file instead ("-" for the standard output).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["direction", "number", "objects"])]
    dbc: Option<PathBuf>,

    /// The transmission type; unchanged if it is left out.
    #[arg(long = "transmission", value_name = "TYPE")]
    transmission: Option<u8>,

    /// The CAN-ID in hexadecimal digits (181, 0x181, 181h); unchanged if it is left out.
    #[arg(long, value_name = "CAN-ID", value_parser = can_id)]
    cob_id: Option<u16>,

    /// The inhibit time in units of 100 us.
    #[arg(long, value_name = "100 US")]
    inhibit: Option<u16>,

    /// The event timer in ms.
    #[arg(long, value_name = "MS")]
    event_timer: Option<u16>,

    /// The SYNC start value.
    #[arg(long, value_name = "COUNTER")]
    sync_start: Option<u8>,
}

/// Switches a PDO off and empties its mapping.
#[derive(Debug, Args)]
pub(super) struct Unmap {
    direction: Direction,

    /// The number of the PDO, from 1.
    #[arg(value_parser = clap::value_parser!(u16).range(1..=512))]
    number: u16,
}

#[derive(Clone, Copy, Debug, Deserialize, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(super) enum Direction {
    /// The node sends the PDO.
    Tpdo,
    /// The node receives the PDO.
    Rpdo,
}

#[derive(Serialize)]
struct Done {
    node: u8,
    pdo: String,
    cob_id: u32,
    objects: usize,
    bits: u32,
}

/// Bit 31 of a COB-ID: the PDO is switched off.
pub(super) const OFF: u32 = 1 << 31;

/// A larger number of entries stands for a multiplexed PDO (CiA 301, 7.5.2.36).
const SLOTS: u8 = 64;

/// The mapping, the transmission type and the COB-ID of a PDO.
pub(super) struct Mapped {
    pub(super) cob_id: u32,
    pub(super) entries: Vec<u32>,
    pub(super) transmission: Option<u8>,
}

/// A PDO of a node.
pub(super) struct Pdo {
    pub(super) node: NodeId,
    pub(super) communication: u16,
    mapping: u16,
}

impl Pdo {
    pub(super) fn new(node: NodeId, direction: Direction, number: u16) -> Pdo {
        let first = match direction {
            Direction::Tpdo => 0x1800,
            Direction::Rpdo => 0x1400,
        };
        let communication = first + number - 1;
        Pdo { node, communication, mapping: communication + 0x0200 }
    }

    fn cob_id(&self, session: &mut Session) -> Result<u32, Failure> {
        session.word(self.node, at(self.communication, 1))?.ok_or_else(|| {
            Failure::Usage(format!("node {} has no such PDO ({:04X}h)", self.node.get(), self.communication))
        })
    }

    pub(super) fn write(
        &self,
        session: &mut Session,
        object: Multiplexer,
        bytes: &[u8],
    ) -> Result<(), Failure> {
        let written = session.client(self.node).download(object, bytes, |_| ());
        written.map_err(|error| session.named(error))
    }

    /// The present mapping of the PDO.
    pub(super) fn mapped(&self, session: &mut Session) -> Result<Mapped, Failure> {
        let cob_id = self.cob_id(session)?;
        let byte = |bytes: Option<Vec<u8>>| bytes.and_then(|bytes| bytes.first().copied());
        let transmission = byte(session.optional(self.node, at(self.communication, 2))?);
        let count = byte(session.optional(self.node, at(self.mapping, 0))?).unwrap_or(0);
        let mut entries = Vec::new();
        for sub in 1..=if count > SLOTS { 0 } else { count } {
            entries.extend(session.word(self.node, at(self.mapping, sub))?);
        }
        Ok(Mapped { cob_id, entries, transmission })
    }

    /// Changes the mapping of the PDO, in the five steps of CiA 301 (7.5.2.36). If the node refuses the change, the
    /// former mapping is restored.
    pub(super) fn remap(
        &self,
        session: &mut Session,
        before: &Mapped,
        wanted: &Mapped,
    ) -> Result<(), Failure> {
        self.switch(session, before.cob_id | OFF)?;
        let changed = self.change(session, wanted);
        if changed.is_err() {
            let _ = self.change(session, before);
        }
        changed
    }

    /// Switches the PDO off and empties its mapping.
    pub(super) fn clear(&self, session: &mut Session) -> Result<u32, Failure> {
        let cob_id = self.cob_id(session)?;
        self.switch(session, cob_id | OFF)?;
        self.write(session, at(self.mapping, 0), &[0])?;
        Ok(cob_id)
    }

    /// Steps 2 to 5 for a PDO that is off: clear the mapping, write the objects, write their number, write the COB-ID.
    fn change(&self, session: &mut Session, to: &Mapped) -> Result<(), Failure> {
        self.write(session, at(self.mapping, 0), &[0])?;
        for (entry, sub) in to.entries.iter().zip(1..) {
            self.write(session, at(self.mapping, sub), &entry.to_le_bytes())?;
        }
        if let Some(transmission) = to.transmission {
            self.write(session, at(self.communication, 2), &[transmission])?;
        }
        let count = u8::try_from(to.entries.len()).unwrap_or(u8::MAX);
        self.write(session, at(self.mapping, 0), &[count])?;
        self.switch(session, to.cob_id)
    }

    /// Writes inhibit time, event timer and SYNC start value, by sub-index, while the PDO is off (CiA 301, 7.5.2.37). The
    /// PDO is off afterwards; if the node refuses a value, the PDO is as it was before.
    pub(super) fn set_times(
        &self,
        session: &mut Session,
        before: &Mapped,
        times: &[(u8, Vec<u8>)],
    ) -> Result<(), Failure> {
        for (sub, bytes) in times {
            self.switch(session, before.cob_id | OFF)?;
            if let Err(failure) = self.write(session, at(self.communication, *sub), bytes) {
                self.switch(session, before.cob_id)?;
                return Err(failure);
            }
        }
        Ok(())
    }

    pub(super) fn switch(&self, session: &mut Session, cob_id: u32) -> Result<(), Failure> {
        self.write(session, at(self.communication, 1), &cob_id.to_le_bytes())
    }
}

impl Map {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        if let Some(file) = &self.dbc {
            let nodes = session.options.node.list()?;
            return super::dbc::write(session, &nodes, file);
        }
        let node = session.options.node.one()?;
        let (Some(direction), Some(number)) = (self.direction, self.number) else { return Ok(()) };
        let pdo = Pdo::new(node, direction, number);
        // Look up all objects before any change, so that an error leaves the PDO unchanged.
        let entries: Result<Vec<u32>, Failure> =
            self.objects.iter().map(|query| entry(session, direction, node, query)).collect();
        let entries = entries?;
        let bits = fitting_bits(&entries)?;
        let before = pdo.mapped(session)?;
        let can_id = self.cob_id.map_or(before.cob_id & 0x1FFF_FFFF, u32::from);
        let cob_id = before.cob_id & !OFF & !0x1FFF_FFFF | can_id;
        let wanted = Mapped { cob_id, entries, transmission: self.transmission.or(before.transmission) };
        pdo.set_times(session, &before, &self.times())?;
        pdo.remap(session, &before, &wanted)?;
        let entries = &wanted.entries;
        let name = format!("{direction:?} {number}").to_uppercase();
        session.print(&Done {
            node: node.get(),
            pdo: name,
            cob_id: cob_id & 0x1FFF_FFFF,
            objects: entries.len(),
            bits,
        })
    }

    /// The times to write, by sub-index of the communication parameter.
    fn times(&self) -> Vec<(u8, Vec<u8>)> {
        let word = |sub, time: Option<u16>| time.map(|time| (sub, time.to_le_bytes().to_vec()));
        let times =
            [word(3, self.inhibit), word(5, self.event_timer), self.sync_start.map(|at| (6, vec![at]))];
        times.into_iter().flatten().collect()
    }
}

/// The mapping entry of an object: index, sub-index, bits.
fn entry(session: &mut Session, direction: Direction, node: NodeId, query: &str) -> Result<u32, Failure> {
    let object = session.find(node, query)?;
    let catalogue = session.catalogue(node)?;
    let slot = slot(&catalogue, direction, object);
    slot.map_err(|words| Failure::Usage(format!("{query}: {words}")))
}

/// The mapping entry of an object (index, sub-index, bits), or the reason why the object cannot be mapped.
pub(super) fn slot(catalogue: &Catalogue, direction: Direction, object: Multiplexer) -> Result<u32, String> {
    let is_mappable = |entry: &eds::Entry| match direction {
        Direction::Tpdo => entry.is_tpdo_mappable(),
        Direction::Rpdo => entry.is_rpdo_mappable(),
    };
    if catalogue.entry(object).is_some_and(|entry| !is_mappable(entry)) {
        let direction = format!("{direction:?}").to_uppercase();
        return Err(format!("no {direction} can carry {}, says the data sheet", Place(object)));
    }
    let bits = catalogue.data_type(object).and_then(bits);
    let bits = bits.ok_or("no data sheet states how many bits it has, or it is no number")?;
    Ok(u32::from(object.index) << 16 | u32::from(object.sub) << 8 | u32::from(bits))
}

/// The bits of all entries together; an error where they are too many for a PDO.
pub(super) fn fitting_bits(entries: &[u32]) -> Result<u32, Failure> {
    let bits = entries.iter().map(|entry| entry & 0xFF).sum();
    if bits > 64 {
        return Err(Failure::Usage(format!("these objects have {bits} bits; a PDO has 64")));
    }
    Ok(bits)
}

fn bits(data_type: eds::DataType) -> Option<u8> {
    match data_type.class() {
        eds::Class::Signed(bits) | eds::Class::Unsigned(bits) | eds::Class::Real(bits) => Some(bits),
        eds::Class::Text | eds::Class::Bytes => None,
    }
}

impl Unmap {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?;
        session.catalogue(node)?;
        let pdo = Pdo::new(node, self.direction, self.number);
        let cob_id = pdo.clear(session)?;
        let name = format!("{:?} {}", self.direction, self.number).to_uppercase();
        session.print(&Done {
            node: node.get(),
            pdo: name,
            cob_id: cob_id & 0x1FFF_FFFF,
            objects: 0,
            bits: 0,
        })
    }
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Done { node, pdo, cob_id, objects, bits } = self;
        match objects {
            0 => write!(f, "node {node}: {pdo} is off and empty"),
            1 => write!(f, "node {node}: {pdo} ({cob_id:03X}h) has 1 object, {bits} bits"),
            _ => write!(f, "node {node}: {pdo} ({cob_id:03X}h) has {objects} objects, {bits} bits"),
        }
    }
}
