//! The knowledge about a node that decoding needs: its data sheet, and values that the node has told.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::sync::Arc;

use canopen::NodeId;
use canopen::sdo::Multiplexer;

use crate::Catalogue;
use crate::object::at;
use crate::pdo_parameters::{PDOS, slots, walk};
use crate::quantity::Quantity;
use crate::sdo::{Client, Error};

/// The first communication parameter of RPDOs and the first of TPDOs.
const COMMUNICATION: [u16; 2] = [0x1400, 0x1800];

/// The data sheet of a node, and the numbers that the node has told.
#[derive(Clone, Debug)]
pub struct Knowledge {
    catalogue: Arc<Catalogue>,
    /// The numbers of up to four bytes.
    numbers: BTreeMap<(u16, u8), u32>,
    /// The objects that the node was asked for, and that have no number.
    without: BTreeSet<(u16, u8)>,
}

impl Default for Knowledge {
    /// The knowledge about an unknown node.
    fn default() -> Knowledge {
        Knowledge::new(Catalogue::unknown())
    }
}

impl Knowledge {
    /// The knowledge about a node with a data sheet. Until the node tells its values, the defaults of the data sheet
    /// apply.
    #[must_use]
    pub fn new(catalogue: impl Into<Arc<Catalogue>>) -> Knowledge {
        Knowledge { catalogue: catalogue.into(), numbers: BTreeMap::new(), without: BTreeSet::new() }
    }

    /// Reads the PDOs in force from a node, and the units of their objects.
    ///
    /// # Errors
    /// SDO errors.
    pub fn ask(client: &mut Client, catalogue: impl Into<Arc<Catalogue>>) -> Result<Knowledge, Error> {
        let mut known = Knowledge::new(catalogue);
        for first in COMMUNICATION {
            known.ask_pdos(client, first)?;
        }
        for object in known.mapped() {
            known.ask_quantity(client, object)?;
        }
        Ok(known)
    }

    fn ask_pdos(&mut self, client: &mut Client, first: u16) -> Result<(), Error> {
        let catalogue = Arc::clone(&self.catalogue);
        walk(&catalogue, first, |pdo| {
            if self.fetch(client, at(pdo.communication, 1))?.is_none() {
                return Ok(false);
            }
            let count = self.fetch(client, at(pdo.mapping, 0))?.unwrap_or(0);
            for slot in slots(count) {
                self.fetch(client, at(pdo.mapping, slot))?;
            }
            Ok(true)
        })
    }

    /// Reads the unit and the decimal point of an object.
    pub(crate) fn ask_quantity(&mut self, client: &mut Client, of: Multiplexer) -> Result<Quantity, Error> {
        let catalogue = Arc::clone(&self.catalogue);
        Quantity::by(&catalogue, of, |at| self.fetch(client, at))
    }

    fn fetch(&mut self, client: &mut Client, at: Multiplexer) -> Result<Option<u32>, Error> {
        match client.upload(at) {
            Ok(bytes) => Ok(self.answer(at, Some(&bytes))),
            Err(error) if error.abort().is_some() => Ok(self.answer(at, None)),
            Err(error) => Err(error),
        }
    }

    /// Takes the answer of the node to a request for an object; `None` where the node refuses the object. Returns its
    /// number.
    pub(crate) fn answer(&mut self, at: Multiplexer, bytes: Option<&[u8]>) -> Option<u32> {
        bytes.into_iter().for_each(|bytes| self.tell(at, bytes));
        let number = self.told(at);
        if number.is_none() {
            self.without.insert((at.index, at.sub));
        }
        number
    }

    /// The quantity of an object by the numbers of the node; `None` while the node has not told them.
    pub(crate) fn measured(&self, of: Multiplexer) -> Option<Quantity> {
        Quantity::by(&self.catalogue, of, |at| if self.is_asked(at) { Ok(self.told(at)) } else { Err(()) })
            .ok()
    }

    /// The objects that the quantity of an object depends on and that the node has not told.
    pub(crate) fn unasked(&self, of: Multiplexer) -> impl Iterator<Item = Multiplexer> {
        Quantity::sources(&self.catalogue, of).into_iter().filter(|at| !self.is_asked(*at))
    }

    fn is_asked(&self, at: Multiplexer) -> bool {
        self.told(at).is_some() || self.without.contains(&(at.index, at.sub))
    }

    /// Takes a value that the node has told. Values of more than four bytes and values of unknown objects are ignored,
    /// so that a trace of any length needs limited memory.
    pub(crate) fn tell(&mut self, at: Multiplexer, bytes: &[u8]) {
        let is_pdo = (0x1400..0x1C00).contains(&at.index);
        if bytes.len() <= 4 && (is_pdo || self.catalogue.entry(at).is_some()) {
            let mut word = [0; 4];
            word[..bytes.len()].copy_from_slice(bytes);
            self.numbers.insert((at.index, at.sub), u32::from_le_bytes(word));
        }
    }

    fn told(&self, at: Multiplexer) -> Option<u32> {
        self.numbers.get(&(at.index, at.sub)).copied()
    }

    /// The number that the node has told, else the default of its data sheet.
    pub(super) fn number(&self, at: Multiplexer, node: NodeId) -> Option<u32> {
        self.told(at).or_else(|| {
            // Without a data sheet the objects are known, but not their defaults.
            let entry = self.catalogue.entry(at).filter(|_| self.catalogue.is_of_a_device())?;
            match entry.default.as_ref()?.evaluate(node) {
                eds::Value::Integer(number) => u32::try_from(number).ok(),
                _ => None,
            }
        })
    }

    /// The unit and the decimal point of an object.
    pub(super) fn quantity(&self, of: Multiplexer, node: NodeId) -> Quantity {
        let asked = Quantity::by(&self.catalogue, of, |at| Ok::<_, Infallible>(self.number(at, node)));
        asked.unwrap_or_default()
    }

    pub(crate) fn catalogue(&self) -> &Catalogue {
        &self.catalogue
    }

    /// The known PDOs, from the data sheet or told by the node: the indices of their communication parameters.
    pub(super) fn pdos(&self) -> BTreeSet<u16> {
        let is_one = |index: &u16| COMMUNICATION.iter().any(|first| (*first..first + PDOS).contains(index));
        let told = self.numbers.keys().filter(|(_, sub)| *sub == 1).map(|(index, _)| *index);
        told.chain(self.catalogue.indices()).filter(is_one).collect()
    }

    /// The objects in the mappings that the node has told.
    fn mapped(&self) -> Vec<Multiplexer> {
        let is_slot = |index: u16, sub: u8| sub > 0 && matches!(index, 0x1600..=0x17FF | 0x1A00..=0x1BFF);
        let slots = self.numbers.iter().filter(|((index, sub), _)| is_slot(*index, *sub));
        slots
            .map(|(_, &slot)| canopen::pdo::MappedObject::parse(slot))
            .map(|object| at(object.index, object.sub))
            .collect()
    }
}
