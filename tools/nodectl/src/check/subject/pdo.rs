//! PDOs of the device and their configuration (CiA 301, 7.5.2.36 and 7.5.2.38).

use canopen::nmt::State;
use canopen::pdo::MappedObject;
use canopen::sdo::Multiplexer;
use eds::Entry;

use super::Subject;
use super::sheet::size;
use super::verdict::{Outcome, fail, skip};
use crate::object::at;
use crate::pdo_parameters::slots;

/// Bit 31 of a COB-ID: the PDO does not exist.
pub(in crate::check) const OFF: u32 = 1 << 31;
/// Bit 30 of the COB-ID of a TPDO: the device answers no remote frame.
const NO_RTR: u32 = 1 << 30;

/// The first communication object of each direction.
pub(in crate::check) const RPDO: u16 = 0x1400;
pub(in crate::check) const TPDO: u16 = 0x1800;

/// A PDO of the device, switched off.
#[derive(Clone, Copy, Debug)]
pub(in crate::check) struct Pdo {
    /// The index of the communication object.
    pub(in crate::check) index: u16,
    /// The value of the COB-ID entry when the PDO is on.
    pub(in crate::check) cob_id: u32,
}

impl Pdo {
    /// The CAN-ID.
    #[allow(clippy::cast_possible_truncation)] // Eleven bits.
    pub(in crate::check) const fn id(self) -> u16 {
        (self.cob_id & 0x7FF) as u16
    }

    /// The index of the mapping object.
    pub(in crate::check) const fn mapping(self) -> u16 {
        self.index | 0x0200
    }
}

impl Subject<'_> {
    /// The communication objects of a direction that the device has, out of the first eight of the data sheet; without
    /// a data sheet, out of the first eight indices.
    pub(in crate::check) fn pdos(&mut self, first: u16) -> Outcome<Vec<u16>> {
        let candidates: Vec<u16> = match self.sheet() {
            Ok(sheet) => sheet.objects.range(first..first + 0x200).map(|(index, _)| *index).take(8).collect(),
            Err(_) => (first..first + 8).collect(),
        };
        // In a lift these two PDOs carry calls: each call is one message, and nothing is sent before the first call.
        let is_lift = self.number(0x1000, 0)? & 0xFFFF == 417;
        let is_of_calls = |index: u16| is_lift && matches!(index, 0x1881 | 0x1900);
        let mut found = Vec::new();
        for index in candidates.into_iter().filter(|index| !is_of_calls(*index)) {
            if self.try_read(index, 1)?.is_ok() {
                found.push(index);
            }
        }
        Ok(found)
    }

    /// A PDO of a direction, switched off: the first PDO that is on, else the first PDO. Skipped where the device has
    /// none. Multiplexed PDOs do not count, because their mapping has no objects.
    pub(in crate::check) fn pdo(&mut self, first: u16) -> Outcome<Pdo> {
        let name = if first == TPDO { "TPDO" } else { "RPDO" };
        let mut candidates = self.pdos(first)?;
        let mut is_on = Vec::new();
        for index in std::mem::take(&mut candidates) {
            if self.number(index | 0x0200, 0)? <= 64 {
                candidates.push(index);
                is_on.push(self.number(index, 1)? & OFF == 0);
            }
        }
        let place = is_on.iter().position(|is_on| *is_on);
        let index = *candidates
            .get(place.unwrap_or(0))
            .ok_or_else(|| skip(format!("the device has no {name} with objects")))?;
        if place.is_none() && self.number(index | 0x0200, 0)? > 0 {
            self.need_free_mapping(index | 0x0200, name)?;
        }
        let before = self.number(index, 1)?;
        let free = if first == TPDO { 0x180 } else { 0x200 } + u32::from(self.id());
        let id = if before & 0x7FF == 0 { free } else { before & 0x7FF };
        let no_rtr = if first == TPDO { NO_RTR } else { 0 };
        // A device without remote frames accepts the COB-ID with bit 30 only. A device with remote frames accepts
        // either.
        let pdo = Pdo { index, cob_id: before & no_rtr | id };
        self.set_if_supported(index, 1, before | OFF)?;
        Ok(pdo)
    }

    /// Skips the check where a PDO is off by default and its mapping is fixed. Such a PDO needs an activation that no
    /// clause of CiA 301 names.
    fn need_free_mapping(&mut self, mapping: u16, name: &str) -> Outcome {
        let before = self.read(mapping, 0)?;
        match self.try_write(mapping, 0, &[0])? {
            Ok(()) => self
                .try_write(mapping, 0, &before)?
                .map_err(|refusal| fail("the mapping is taken back", refusal)),
            Err(refusal) => Err(skip(format!("every {name} is off, and the mapping is fixed: {refusal}"))),
        }
    }

    /// A TPDO with one mapped object, this transmission type and this event timer, still switched off.
    pub(in crate::check) fn tpdo(&mut self, transmission: u32, event_timer: u32) -> Outcome<Pdo> {
        if transmission <= 240 {
            self.plain_sync()?;
        }
        let pdo = self.pdo(TPDO)?;
        self.set_if_supported(pdo.index, 2, transmission)?;
        if let Some(1..) = self.optional(pdo.index, 3)? {
            self.set(pdo.index, 3, 0)?;
        }
        match self.optional(pdo.index, 5)? {
            Some(before) if before != event_timer => self.set(pdo.index, 5, event_timer)?,
            None if event_timer != 0 => return Err(skip("the TPDO has no event timer")),
            _ => (),
        }
        self.fill(pdo)?;
        Ok(pdo)
    }

    /// Maps an object into a PDO, if the PDO is empty.
    pub(in crate::check) fn fill(&mut self, pdo: Pdo) -> Outcome {
        if matches!(self.number(pdo.mapping(), 0)?, 1..=64) {
            return Ok(());
        }
        let is_transmit = pdo.index >= TPDO;
        let entry = self.mappable(is_transmit)?;
        self.set_if_supported(pdo.mapping(), 0, 0)?;
        self.set_if_supported(pdo.mapping(), 1, mapped(&entry))?;
        self.set(pdo.mapping(), 0, 1)
    }

    /// An object of the data sheet that a PDO of a direction can carry.
    pub(in crate::check) fn mappable(&self, is_transmit: bool) -> Outcome<Entry> {
        let name = if is_transmit { "object for a TPDO" } else { "object for an RPDO" };
        self.entry(name, |entry| {
            let fits = if is_transmit { entry.is_tpdo_mappable() } else { entry.is_rpdo_mappable() };
            fits && entry.index >= 0x2000 && matches!(size(entry), Some(1..=8))
        })
    }

    /// Switches a PDO on.
    pub(in crate::check) fn switch_on(&mut self, pdo: Pdo) -> Outcome {
        let on = pdo.cob_id.to_le_bytes();
        match self.try_write(pdo.index, 1, &on)? {
            Ok(()) => Ok(()),
            Err(refusal) => Err(fail(format!("{:04X}h:1 takes {:08X}h", pdo.index, pdo.cob_id), refusal)),
        }
    }

    /// Switches a configured TPDO on, enters a state, and counts the frames of the TPDO within a time.
    pub(in crate::check) fn count(&mut self, pdo: Pdo, state: State, ms: u64) -> Outcome<usize> {
        self.switch_on(pdo)?;
        self.enter(state)?;
        let mark = self.mark();
        self.pass(ms)?;
        Ok(self.heard(mark, pdo.id()).len())
    }

    /// Empties the mapping of a PDO that is off, so that a check can map objects. Skipped where the mapping is fixed.
    pub(in crate::check) fn empty(&mut self, pdo: Pdo) -> Outcome {
        let before = self.read(pdo.mapping(), 0)?;
        self.written.push((at(pdo.mapping(), 0), before));
        match self.try_write(pdo.mapping(), 0, &[0])? {
            Ok(()) => Ok(()),
            Err(refusal) => Err(skip(format!("the mapping of the device is fixed: {refusal}"))),
        }
    }

    /// The mapped objects of a PDO with their lengths in bits.
    pub(in crate::check) fn mapping(&mut self, pdo: u16) -> Outcome<Vec<(Multiplexer, u8)>> {
        let count = self.number(pdo | 0x0200, 0)?;
        let mut objects = Vec::new();
        for slot in slots(count) {
            let object = MappedObject::parse(self.number(pdo | 0x0200, slot)?);
            objects.push((at(object.index, object.sub), object.bits));
        }
        Ok(objects)
    }
}

/// The value of a mapping entry for an object.
pub(in crate::check) fn mapped(entry: &Entry) -> u32 {
    let bits = u32::try_from(size(entry).unwrap_or(0) * 8).unwrap_or(0);
    u32::from(entry.index) << 16 | u32::from(entry.sub) << 8 | bits
}
