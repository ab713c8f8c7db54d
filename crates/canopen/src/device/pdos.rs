//! The PDO objects 1400h.., 1600h.., 1800h.. and 1A00h..: checks of a write, and the settings of a PDO from its
//! objects.
//!
//! A new mapping takes five steps (CiA 301, 7.5.2.36), and each step is a condition of the next: COB-ID invalid, count
//! 0, entries, count, COB-ID valid.

use super::Application;
use super::Definition;
use super::inner::Inner;
use super::rpdos::filter_bit;
use crate::dictionary::{Direction, Entry, Rule, Services};
use crate::pdo::{
    Addressing, Chain, Content, Layout, Links, Located, MappedObject, RpdoSettings, ScannerSettings,
    Settings, Transmission, locate,
};
use crate::sdo::Abort;
use crate::{CobId, Tick};

/// A PDO of the dictionary, by the index of its communication object.
///
/// A dictionary may use any of the 512 PDO numbers. The device keeps its PDOs in the first elements of an array, in the
/// order of their numbers ([`Inner::place`]).
#[derive(Clone, Copy, Debug)]
struct Pdo {
    communication: u16,
}

impl Pdo {
    /// The PDO to which an entry belongs.
    fn of(entry: &Entry) -> Pdo {
        match entry.rule() {
            Rule::EventTimerOf(number) => Pdo { communication: 0x1800 | u16::from(number) },
            _ => Pdo { communication: entry.index() & !0x0200 },
        }
    }

    /// The number of the PDO, 1 to 512.
    fn number(self) -> u16 {
        (self.communication & 0x01FF) + 1
    }

    fn mapping(self) -> u16 {
        self.communication | 0x0200
    }

    fn direction(self) -> Direction {
        if self.communication & 0x0800 != 0 { Direction::Transmit } else { Direction::Receive }
    }
}

impl<D: Definition> Inner<D> {
    /// The PDO at a place; `None` beyond the last one.
    fn pdo_at(&self, direction: Direction, place: u16) -> Option<Pdo> {
        self.dictionary.pdo(direction, place).map(|communication| Pdo { communication })
    }

    /// The PDOs in one direction, by place.
    fn pdos(&self, direction: Direction) -> impl Iterator<Item = Pdo> {
        (0..).map_while(move |place| self.pdo_at(direction, place))
    }

    /// Gives every PDO its settings.
    pub(super) fn configure_pdos(&mut self, now: Tick) {
        self.configure_each(now, |_, _, _| true);
        self.link_pdos();
        self.restart_scanner();
    }

    /// Reads the settings and the objects of the multiplexed TPDO from the dictionary.
    pub(super) fn restart_scanner(&mut self) {
        if Self::has(Services::MULTIPLEXED_TPDO) {
            self.configure_scanner(None);
        }
        self.update_scanner();
    }

    /// Gives the PDOs that meet a condition their settings. Returns whether there are any.
    fn configure_each(&mut self, now: Tick, condition: impl Fn(&Self, Pdo, u16) -> bool) -> bool {
        let mut has_any = false;
        for direction in Direction::BOTH {
            let mut place = 0;
            while let Some(pdo) = self.pdo_at(direction, place) {
                if condition(self, pdo, place) {
                    self.configure_one(pdo, place, now);
                    has_any = true;
                }
                place += 1;
            }
        }
        has_any
    }

    /// Gives the multiplexed TPDO its settings, if the rows have one.
    fn update_scanner(&mut self) {
        if Self::has(Services::MULTIPLEXED_TPDO) {
            self.configure_scanner(self.scanner_settings());
        }
    }

    /// Gives the PDO to which the entry belongs its settings.
    pub(super) fn configure_pdo(&mut self, entry: &Entry, now: Tick) {
        let pdo = Pdo::of(entry);
        if let Some(place) = self.place(pdo) {
            self.configure_one(pdo, place, now);
        }
        self.link_pdos();
        self.update_scanner();
    }

    /// Reconfigures the PDOs that the application has switched on or off.
    pub(super) fn apply_application_changes(&mut self, now: Tick) {
        let is_switched = |inner: &Self, pdo, place| {
            // The settings are costly, and most PDOs have not changed.
            let is_used = inner.is_used(pdo, place);
            inner.cob_id(pdo).is_some() != is_used && inner.is_valid(pdo) != is_used
        };
        if self.configure_each(now, is_switched) {
            self.link_pdos();
            self.pending.identifiers_changed();
        }
        self.update_scanner();
    }

    /// Whether the PDO is valid according to its objects.
    fn is_valid(&self, pdo: Pdo) -> bool {
        match pdo.direction() {
            Direction::Transmit => self.tpdo_settings(pdo).is_some(),
            Direction::Receive => Self::has(Services::RPDO) && self.rpdo_settings(pdo).is_some(),
        }
    }

    /// Whether the PDO is configured as valid in the device.
    fn is_used(&self, pdo: Pdo, place: u16) -> bool {
        let place = usize::from(place);
        match pdo.direction() {
            Direction::Transmit => {
                self.tpdos.as_ref().get(place).is_some_and(|tpdo| tpdo.settings().is_some())
            }
            Direction::Receive => self.rpdos.as_ref().get(place).is_some_and(|rpdo| rpdo.id().is_some()),
        }
    }

    /// The position of a PDO in the array of the device: its rank among the PDOs of the dictionary in this direction.
    fn place(&self, pdo: Pdo) -> Option<u16> {
        self.dictionary.pdo_place(pdo.communication)
    }

    /// The position of a TPDO by its number, 1 to 512.
    pub(super) fn tpdo_place(&self, number: u16) -> Option<u16> {
        let number = number.checked_sub(1).filter(|number| *number < 512)?;
        self.place(Pdo { communication: 0x1800 | number })
    }

    fn configure_one(&mut self, pdo: Pdo, place: u16, now: Tick) {
        match pdo.direction() {
            Direction::Transmit => self.configure_tpdo(pdo, place),
            Direction::Receive if Self::has(Services::RPDO) => self.configure_rpdo(pdo, place, now),
            Direction::Receive => (),
        }
    }

    fn configure_tpdo(&mut self, pdo: Pdo, place: u16) {
        let settings = self.tpdo_settings(pdo);
        if let Some(tpdo) = self.tpdos.as_mut().get_mut(usize::from(place)) {
            tpdo.configure(settings);
            if self.state.has_pdos() {
                tpdo.start();
            }
            self.begin_events(usize::from(place));
        }
    }

    fn configure_rpdo(&mut self, pdo: Pdo, place: u16, now: Tick) {
        let settings = self.rpdo_settings(pdo);
        if let Some(rpdo) = self.rpdos.as_mut().get_mut(usize::from(place)) {
            rpdo.configure(settings);
            rpdo.index = pdo.communication;
        }
        self.forget_rpdo_faults(place, now);
    }

    /// Links the valid PDOs to chains, after a change of their settings.
    fn link_pdos(&mut self) {
        (self.first_tpdos, self.first_rpdos) = (Links::END, Links::END);
        self.sends_events =
            D::Application::SENDS_EVENTS && self.tpdos.as_ref().iter().any(|tpdo| tpdo.events_of().is_some());
        for (place, tpdo) in self.tpdos.as_mut().iter_mut().enumerate().rev() {
            tpdo.links = self.first_tpdos;
            let Some(settings) = tpdo.settings() else { continue };
            let sends_values = settings.transmission.is_synchronous() && settings.events_of.is_none();
            self.first_tpdos.prepend(Chain::Valid, place);
            if sends_values {
                self.first_tpdos.prepend(Chain::Synchronous, place);
            }
        }
        (self.rpdo_filter, self.all_nodes) = (0, None);
        for (place, rpdo) in self.rpdos.as_mut().iter_mut().enumerate().rev() {
            rpdo.links = self.first_rpdos;
            let Some(id) = rpdo.id() else { continue };
            self.rpdo_filter |= filter_bit(id.get());
            if rpdo.is_multiplexed() && self.application.takes_all_nodes(rpdo.number()) {
                self.rpdo_filter = u32::MAX;
                self.all_nodes = u16::try_from(place).ok().map(|place| (id, place));
            }
            self.first_rpdos.prepend(Chain::Valid, place);
            if rpdo.is_synchronous() {
                self.first_rpdos.prepend(Chain::Synchronous, place);
            }
        }
    }

    fn tpdo_settings(&self, pdo: Pdo) -> Option<Settings> {
        let (cob_id, transmission) = self.transmission(pdo)?;
        let Content::Objects(layout) = self.content(pdo)? else { return None };
        Some(Settings {
            id: cob_id.id,
            answers_remote: !cob_id.bit30,
            transmission,
            inhibit: low_half(self.parameter(pdo, 3)),
            event: low_half(self.parameter(pdo, 5)),
            sync_start: low_byte(self.parameter(pdo, 6)),
            events_of: self.events_of(pdo.number()),
            layout,
        })
    }

    /// The number of a TPDO that sends events.
    fn events_of(&self, number: u16) -> Option<u16> {
        let sends_events = self.application.sends_events(number);
        debug_assert!(D::Application::SENDS_EVENTS || !sends_events, "`SENDS_EVENTS` is not set");
        (D::Application::SENDS_EVENTS && sends_events).then_some(number)
    }

    fn rpdo_settings(&self, pdo: Pdo) -> Option<RpdoSettings> {
        let (cob_id, transmission) = self.transmission(pdo)?;
        let deadline = low_half(self.parameter(pdo, 5));
        RpdoSettings::new(cob_id.id, transmission, deadline, self.content(pdo)?)
    }

    /// COB-ID and transmission type of a valid PDO.
    fn transmission(&self, pdo: Pdo) -> Option<(CobId, Transmission)> {
        Some((self.cob_id(pdo)?, Transmission::parse(low_byte(self.parameter(pdo, 2)))?))
    }

    /// Whether every mapping contains mappable objects only. A stored mapping may come from an older dictionary.
    pub(super) fn mappings_are_sound(&self) -> bool {
        Direction::BOTH
            .into_iter()
            .flat_map(|direction| self.pdos(direction))
            .all(|pdo| self.content(pdo).is_some())
    }

    /// The settings of the multiplexed TPDO. Only one can exist (CiA 301, 7.2.2.6): the first valid one is used.
    fn scanner_settings(&self) -> Option<ScannerSettings> {
        self.pdos(Direction::Transmit).find_map(|pdo| {
            let Content::Multiplexed(addressing) = self.content(pdo)? else { return None };
            let (cob_id, _) = self.transmission(pdo)?;
            let inhibit = low_half(self.parameter(pdo, 3));
            let event = low_half(self.parameter(pdo, 5));
            Some(ScannerSettings { id: cob_id.id, addressing, own: self.node_id?, inhibit, event })
        })
    }

    /// The addressing mode of a multiplexed PDO; `None` for a number of mapped objects, and where the rows have no
    /// multiplexed PDO in this direction.
    fn addressing(pdo: Pdo, count: u8) -> Option<Addressing> {
        let is_possible = match pdo.direction() {
            Direction::Transmit => Self::has(Services::MULTIPLEXED_TPDO),
            Direction::Receive => Self::has(Services::MULTIPLEXED_RPDO),
        };
        if is_possible { Addressing::from_count(count) } else { None }
    }

    /// The content that the mapping of a PDO describes; `None` when an entry of the mapping cannot be mapped.
    fn content(&self, pdo: Pdo) -> Option<Content> {
        let count = self.mapped(pdo);
        match Self::addressing(pdo, count) {
            Some(addressing) => Some(Content::Multiplexed(addressing)),
            None => self.layout(pdo, count).ok().map(Content::Objects),
        }
    }

    /// Excludes the objects of all TPDOs, valid or not, from the multiplexed TPDO.
    pub(super) fn deselect_mapped(&mut self) {
        let mut place = 0;
        while let Some(pdo) = self.pdo_at(Direction::Transmit, place) {
            if let Some(Content::Objects(layout)) = self.content(pdo) {
                self.scanner.deselect(&layout);
            }
            place += 1;
        }
    }

    /// The number of mapped objects.
    fn mapped(&self, pdo: Pdo) -> u8 {
        low_byte(self.number(pdo.mapping(), 0))
    }

    /// The layout of the first `count` mapping entries.
    fn layout(&self, pdo: Pdo, count: u8) -> Result<Layout, Abort> {
        let mut layout = Layout::EMPTY;
        for slot in 0..count {
            let mapped = MappedObject::parse(self.number(pdo.mapping(), slot + 1));
            layout.push(self.locate(mapped, pdo.direction())?)?;
        }
        Ok(layout)
    }

    fn locate(&self, mapped: MappedObject, direction: Direction) -> Result<Located, Abort> {
        locate(self.dictionary, mapped, direction, |entry| self.application.stores(entry).is_some())
    }

    fn parameter(&self, pdo: Pdo, sub: u8) -> u32 {
        self.number(pdo.communication, sub)
    }

    /// The COB-ID of a valid PDO; `None` when the PDO is not valid or has no objects in the dictionary.
    fn cob_id(&self, pdo: Pdo) -> Option<CobId> {
        CobId::parse(self.number_or(pdo.communication, 1, u32::MAX)).filter(|cob_id| !cob_id.bit31)
    }

    /// Whether a PDO object accepts a value. Most PDO objects can change only while the PDO is not valid.
    pub(super) fn check_pdo(&self, entry: &Entry, value: u32) -> Result<(), Abort> {
        let pdo = Pdo::of(entry);
        let present = self.cob_id(pdo);
        match entry.rule() {
            Rule::PdoCobId | Rule::PdoPredefined => self.check_cob_id(pdo, present, entry, value),
            Rule::PdoType => self.check_type(pdo, present, low_byte(value)),
            Rule::PdoInhibit | Rule::PdoSyncStart if present.is_some() => Err(Abort::InvalidValue),
            Rule::PdoCount | Rule::PdoSlot if present.is_some() => Err(Abort::Access),
            Rule::PdoCount => self.check_count(pdo, low_byte(value)),
            Rule::PdoSlot => self.check_slot(pdo, value),
            _ => Ok(()),
        }
    }

    /// The CAN-ID can change only while the PDO is not valid. A valid PDO needs a CAN-ID that CiA 301 does not
    /// restrict, a mapping, and, for a type that depends on remote frames, remote frames allowed. A device that ignores
    /// remote frames does not allow them. A multiplexed PDO needs an event-driven type.
    ///
    /// A CAN-ID that a profile has pre-defined never changes, and is allowed for this PDO even if CiA 301 restricts it.
    fn check_cob_id(&self, pdo: Pdo, present: Option<CobId>, entry: &Entry, value: u32) -> Result<(), Abort> {
        let new = CobId::parse(value).ok_or(Abort::InvalidValue)?;
        let is_predefined = entry.rule() == Rule::PdoPredefined;
        if is_predefined && CobId::parse(self.default_number(entry)).is_none_or(|own| own.id != new.id) {
            return Err(Abort::InvalidValue);
        }
        let moves = present.is_some_and(|old| old.id != new.id);
        let transmission = Transmission::parse(low_byte(self.parameter(pdo, 2)));
        let is_asked = !Self::has(Services::REMOTE) && !new.bit30 && pdo.direction() == Direction::Transmit;
        let contradicts = is_asked || new.bit30 && transmission.is_some_and(Transmission::needs_remote);
        let mapped = self.mapped(pdo);
        let is_not_sent = Self::addressing(pdo, mapped).is_some()
            && !transmission.is_some_and(Transmission::is_event_driven);
        let is_taken = !is_predefined && new.id.is_restricted();
        let cannot_exist = moves || contradicts || mapped == 0 || is_not_sent || is_taken;
        if !new.bit31 && cannot_exist { Err(Abort::InvalidValue) } else { Ok(()) }
    }

    /// An RPDO is not requested by remote frames, so its type cannot depend on them.
    fn check_type(&self, pdo: Pdo, present: Option<CobId>, kind: u8) -> Result<(), Abort> {
        let transmission = Transmission::parse(kind).ok_or(Abort::InvalidValue)?;
        let is_ignored = !Self::has(Services::REMOTE) || pdo.direction() == Direction::Receive;
        let no_remote = is_ignored || present.is_some_and(|cob_id| cob_id.bit30);
        let is_multiplexed = present.is_some() && Self::addressing(pdo, self.mapped(pdo)).is_some();
        let is_not_sent = is_multiplexed && !transmission.is_event_driven();
        let has_no_sync = !Self::has(Services::SYNC) && transmission.is_synchronous();
        if is_not_sent || has_no_sync || transmission.needs_remote() && no_remote {
            return Err(Abort::InvalidValue);
        }
        Ok(())
    }

    /// Checks the mapping as a whole: its length is known only when the count is written.
    fn check_count(&self, pdo: Pdo, count: u8) -> Result<(), Abort> {
        if Self::addressing(pdo, count).is_some() {
            return Ok(());
        }
        let has_room = count == 0 || self.dictionary.find(pdo.mapping(), count).is_ok();
        if has_room { self.layout(pdo, count).map(|_| ()) } else { Err(Abort::ValueTooHigh) }
    }

    fn check_slot(&self, pdo: Pdo, value: u32) -> Result<(), Abort> {
        if self.mapped(pdo) != 0 {
            return Err(Abort::Access);
        }
        if value == 0 {
            return Ok(());
        }
        self.locate(MappedObject::parse(value), pdo.direction()).map(|_| ())
    }
}

/// The value of an entry of type UNSIGNED8.
fn low_byte(value: u32) -> u8 {
    value.to_le_bytes()[0]
}

/// The value of an entry of type UNSIGNED16.
pub(super) fn low_half(value: u32) -> u16 {
    let [low, high, ..] = value.to_le_bytes();
    u16::from_le_bytes([low, high])
}
