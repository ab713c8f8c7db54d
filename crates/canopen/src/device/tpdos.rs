//! The TPDO objects 1800h.. and 1A00h..: their interlocks, and from them the settings of a TPDO.

use super::{Application, Core};
use crate::dictionary::Entry;
use crate::pdo::{Direction, Layout, MappedObject, Settings, Transmission, locate};
use crate::sdo::Abort;
use crate::{CobId, Duration};

const COMMUNICATION: u16 = 0x1800;
const MAPPING: u16 = 0x1A00;

/// Which TPDO an entry of 1800h.. or 1A00h.. belongs to, from 0.
pub(super) fn number(entry: &Entry) -> usize {
    usize::from(entry.index() & 0x1FF)
}

impl<A: Application, const N: usize> Core<A, N> {
    /// The five steps of a new mapping (CiA 301, 7.5.2.36) in which each object guards the next: COB-ID invalid,
    /// count 0, entries, count, COB-ID valid.
    pub(super) fn configure_tpdo(&mut self, number: usize) {
        let settings = self.tpdo_settings(number);
        if let Some(tpdo) = self.tpdos.get_mut(number) {
            tpdo.configure(settings);
            if self.state.has_pdos() {
                tpdo.start();
            }
        }
    }

    fn tpdo_settings(&self, number: usize) -> Option<Settings> {
        let number = u16::try_from(number).ok()?;
        let parameter = |sub| self.number(COMMUNICATION | number, sub);
        let cob_id = self.number_or(COMMUNICATION | number, 1, u32::MAX);
        let mut settings = Settings::new(cob_id, low_byte(parameter(2)))?;
        settings.inhibit = Duration::from_inhibit(parameter(3));
        settings.event = Duration::from_millis(parameter(5).into());
        settings.sync_start = low_byte(parameter(6));
        settings.layout = self.tpdo_layout(number, self.number(MAPPING | number, 0)).ok()?;
        Some(settings)
    }

    /// The layout of the first `count` mapping entries.
    fn tpdo_layout(&self, number: u16, count: u32) -> Result<Layout, Abort> {
        let mut layout = Layout::default();
        for sub in (1..=u8::MAX).take(usize::from(low_byte(count))) {
            let mapped = MappedObject::parse(self.number(MAPPING | number, sub));
            layout.push(locate(self.dictionary, mapped, Direction::Transmit)?)?;
        }
        Ok(layout)
    }

    fn tpdo_cob_id(&self, entry: &Entry) -> Option<CobId> {
        CobId::parse(self.number(COMMUNICATION | entry.index() & 0x1FF, 1))
    }

    pub(super) fn tpdo_is_valid(&self, entry: &Entry) -> bool {
        self.tpdo_cob_id(entry).is_some_and(|cob_id| !cob_id.bit31)
    }

    /// The CAN-ID changes only while the PDO does not exist; to exist, it needs a CAN-ID that is free for PDOs, a
    /// mapping, and remote frames if its type lives on them.
    pub(super) fn admit_tpdo_cob_id(&self, entry: &Entry, value: u32) -> Result<(), Abort> {
        let new = CobId::parse(value).ok_or(Abort::InvalidValue)?;
        let moves = self.tpdo_cob_id(entry).is_some_and(|old| !old.bit31 && old.id != new.id);
        let transmission = Transmission::parse(low_byte(self.number(entry.index(), 2)));
        let contradicts = new.bit30 && transmission.is_some_and(Transmission::needs_remote);
        let is_empty = self.number(MAPPING | entry.index() & 0x1FF, 0) == 0;
        let cannot_exist = moves || contradicts || is_empty || new.id.is_restricted();
        if !new.bit31 && cannot_exist { Err(Abort::InvalidValue) } else { Ok(()) }
    }

    pub(super) fn admit_tpdo_type(&self, entry: &Entry, value: u32) -> Result<(), Abort> {
        let transmission = Transmission::parse(low_byte(value)).ok_or(Abort::InvalidValue)?;
        let no_remote = self.tpdo_cob_id(entry).is_some_and(|cob_id| !cob_id.bit31 && cob_id.bit30);
        if no_remote && transmission.needs_remote() { Err(Abort::InvalidValue) } else { Ok(()) }
    }

    /// A mapping is switched on as a whole: only now is its length known.
    pub(super) fn admit_tpdo_count(&self, entry: &Entry, count: u32) -> Result<(), Abort> {
        if self.tpdo_is_valid(entry) {
            return Err(Abort::Access);
        }
        self.tpdo_layout(entry.index() & 0x1FF, count).map(|_| ())
    }

    pub(super) fn admit_tpdo_slot(&self, entry: &Entry, value: u32) -> Result<(), Abort> {
        if self.tpdo_is_valid(entry) || self.number(entry.index(), 0) != 0 {
            return Err(Abort::Access);
        }
        if value == 0 {
            return Ok(());
        }
        locate(self.dictionary, MappedObject::parse(value), Direction::Transmit).map(|_| ())
    }
}

/// Entries whose type is UNSIGNED8 have no more.
fn low_byte(value: u32) -> u8 {
    value.to_le_bytes()[0]
}
