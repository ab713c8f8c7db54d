//! Faults: communication faults, which the device detects itself, and faults of the application.

use crate::dictionary::{Group, Groups};

/// A fault that the device signals by EMCY.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
// First those without a number, in the order of their bits: the compiler then needs no table.
pub enum Fault {
    /// Received frames were lost (8110h). The fault ends when none was lost for half a second.
    Overrun,
    /// The CAN controller is error passive (8120h).
    ErrorPassive,
    /// The CAN controller was bus-off and has recovered (8140h).
    BusOffRecovered,
    /// SYNC has not arrived within its period (8100h).
    SyncMissing,
    /// A SYNC had another length than 1019h requires (8240h).
    SyncLength,
    /// A multiplexed PDO for this node names an object that does not accept it (8230h). The fault ends half a second after
    /// the last one.
    MpdoNotTaken,
    /// A guarding master has sent no remote frame within the life time (8130h).
    LifeGuard,
    /// The heartbeat of a node is missing (8130h). The number is the entry of 1016h, from 0.
    Heartbeat(u8),
    /// The RPDO with this number, 1 to 512, was shorter than its mapping and is not processed (8210h).
    RpdoTooShort(u16),
    /// The RPDO with this number was longer than its mapping (8220h).
    RpdoTooLong(u16),
    /// The RPDO with this number has not arrived in time (8250h).
    RpdoDeadline(u16),
    /// The stored values of a group could not be loaded, so the defaults are in use (6302h communication, 6303h
    /// application, 6300h calibration, 6304h to 6308h groups of the product; the first byte of the error field is 2).
    StoredData(Group),
    /// The newest stored values of a group could not be loaded, so the values of the save before are in use (the same
    /// codes; the first byte of the error field is 1).
    OlderData(Group),
    /// A condition of the application, by its position in [`Application::CONDITIONS`](crate::Application::CONDITIONS).
    Application(u8),
}

/// A fault as EMCY, error register and object 1029h treat it.
// Whole words are copied without a call of `memcpy`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(align(4))]
pub struct Condition {
    /// Emergency error code (CiA 301, table 26, and the device profile).
    pub code: u16,
    /// Bits of the error register (1001h) that the fault sets. Bit 0, the generic error, is always set.
    pub register: u8,
    /// Manufacturer-specific error field of the EMCY.
    pub detail: [u8; 5],
    /// The sub-index of object 1029h that applies to the fault; `None` for a fault that never changes the NMT state.
    pub class: Option<ErrorClass>,
}

impl Condition {
    /// A condition with this error code. The condition sets the generic error only in the error register, and does not
    /// change the NMT state.
    #[must_use]
    pub const fn new(code: u16) -> Condition {
        Condition { code, register: 0, detail: [0; 5], class: None }
    }

    /// A group whose newest stored values could not be loaded. `in_use`: the values in use instead.
    const fn of_storage(group: Group, in_use: u8) -> Condition {
        let code = 0x6300 | group.sub() as u16;
        Condition { code, register: 0, detail: [in_use, 0, 0, 0, 0], class: Some(ErrorClass::DEVICE) }
    }

    /// Applies a sub-index of object 1029h to the condition.
    #[must_use]
    pub const fn of_class(mut self, class: ErrorClass) -> Condition {
        self.class = Some(class);
        self
    }
}

/// A class of errors: a sub-index of object 1029h, which defines the change of the NMT state (CiA 301, 7.5.2.33); 1 to 7.
/// Another number is no error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ErrorClass(pub u8);

impl ErrorClass {
    /// Communication errors, sub-index 1.
    pub const COMMUNICATION: ErrorClass = ErrorClass(1);
    /// Errors of the device itself: sub-index 2, the first sub-index for a device profile or the manufacturer.
    pub const DEVICE: ErrorClass = ErrorClass(2);
}

/// First byte of the error field of an EMCY about stored data: the values that are in use instead.
const OLDER_HOLDS: u8 = 1;
const DEFAULTS_HOLD: u8 = 2;

/// Bits of the error register: generic error, and communication error.
const GENERIC: u8 = 1;
const COMMUNICATION: u8 = 1 << 4;

impl Fault {
    /// The number of faults that can be active only once: those of communication, then those of the storage groups.
    const SINGLES: usize = 7 + 2 * Group::ALL.len();
    /// The number of places for [`FaultSet::at`].
    pub(crate) const PLACES: usize = Fault::SINGLES + 32;
    /// The bits of the communication faults.
    const OF_COMMUNICATION: u32 = 0x7F;

    /// The fault with this bit.
    fn single(bit: usize) -> Option<Fault> {
        Some(match bit {
            0 => Fault::Overrun,
            1 => Fault::ErrorPassive,
            2 => Fault::BusOffRecovered,
            3 => Fault::SyncMissing,
            4 => Fault::SyncLength,
            5 => Fault::MpdoNotTaken,
            6 => Fault::LifeGuard,
            7..=14 => Fault::StoredData(Group::of(bit - 7)?),
            15..=22 => Fault::OlderData(Group::of(bit - 15)?),
            _ => return None,
        })
    }

    /// The faults of the storage groups.
    pub(crate) fn of_storage() -> impl Iterator<Item = Fault> {
        (7..Fault::SINGLES).filter_map(Fault::single)
    }

    /// The bit of a fault that can be active only once; `None` for a fault with a number.
    const fn bit(self) -> Option<u8> {
        match self {
            Fault::StoredData(group) => Some(7 + group as u8),
            Fault::OlderData(group) => Some(15 + group as u8),
            _ => self.plain_bit(),
        }
    }

    // By itself: the compiler then takes the bit from the fault, without a table.
    const fn plain_bit(self) -> Option<u8> {
        Some(match self {
            Fault::Overrun => 0,
            Fault::ErrorPassive => 1,
            Fault::BusOffRecovered => 2,
            Fault::SyncMissing => 3,
            Fault::SyncLength => 4,
            Fault::MpdoNotTaken => 5,
            Fault::LifeGuard => 6,
            _ => return None,
        })
    }

    /// The codes of the fault in EMCY and error register. For a heartbeat, the first two bytes of the error field are
    /// the sub-index of 1016h; for an RPDO, its number. For stored data, the first byte gives the values in use.
    /// `conditions` are the conditions of the application.
    #[must_use]
    pub fn condition(self, conditions: &[Condition]) -> Condition {
        const UNKNOWN: &Condition = &Condition::new(0x1000);
        match self {
            Fault::Application(number) => *conditions.get(usize::from(number)).unwrap_or(UNKNOWN),
            Fault::StoredData(group) => Condition::of_storage(group, DEFAULTS_HOLD),
            Fault::OlderData(group) => Condition::of_storage(group, OLDER_HOLDS),
            Fault::Heartbeat(_) | Fault::LifeGuard => {
                self.of_communication().of_class(ErrorClass::COMMUNICATION)
            }
            _ => self.of_communication(),
        }
    }

    /// The condition of a communication fault.
    const fn of_communication(self) -> Condition {
        let (code, number) = match self {
            Fault::Overrun => (0x8110, 0),
            Fault::ErrorPassive => (0x8120, 0),
            Fault::BusOffRecovered => (0x8140, 0),
            Fault::SyncMissing => (0x8100, 0),
            Fault::SyncLength => (0x8240, 0),
            Fault::MpdoNotTaken => (0x8230, 0),
            Fault::Heartbeat(number) => (0x8130, number as u16 + 1),
            Fault::LifeGuard => (0x8130, 0),
            Fault::RpdoTooShort(number) => (0x8210, number),
            Fault::RpdoTooLong(number) => (0x8220, number),
            Fault::RpdoDeadline(number) => (0x8250, number),
            Fault::StoredData(_) | Fault::OlderData(_) | Fault::Application(_) => (0, 0),
        };
        let [low, high] = number.to_le_bytes();
        Condition { code, register: COMMUNICATION, detail: [low, high, 0, 0, 0], class: None }
    }
}

/// The active faults. Of heartbeats and RPDOs only the number of active faults is kept: their consumers know which
/// of them are active.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FaultSet {
    single: u32,
    application: u32,
    several: u16,
}

impl FaultSet {
    pub(crate) const EMPTY: FaultSet = FaultSet { single: 0, application: 0, several: 0 };

    /// Adds a fault or removes it. Returns whether this is a change.
    #[inline(never)]
    pub(crate) fn set(&mut self, fault: Fault, is_active: bool) -> bool {
        let (set, bit) = match (fault, fault.bit()) {
            (Fault::Application(number), _) => (&mut self.application, application_bit(number)),
            (_, Some(bit)) => (&mut self.single, 1 << bit),
            (_, None) => {
                let before = self.several;
                self.several = if is_active { before.saturating_add(1) } else { before.saturating_sub(1) };
                return self.several != before;
            }
        };
        let before = *set;
        *set = if is_active { before | bit } else { before & !bit };
        *set != before
    }

    /// Replaces the faults of the storage groups. Returns the changes.
    pub(crate) fn set_stored(&mut self, lost: Groups, older: Groups) -> FaultSet {
        let before = self.single;
        let groups = u32::from(lost.bits()) | u32::from(older.bits()) << 8;
        self.single = before & Fault::OF_COMMUNICATION | groups << 7;
        FaultSet { single: before ^ self.single, ..FaultSet::EMPTY }
    }

    /// Whether a fault is active that can be active only once; never for others.
    pub(crate) fn has(self, fault: Fault) -> bool {
        fault.bit().is_some_and(|bit| self.single & 1 << bit != 0)
    }

    /// Whether stored values could not be loaded.
    pub(crate) fn has_stored_data(self) -> bool {
        self.single & !Fault::OF_COMMUNICATION != 0
    }

    pub(crate) fn is_empty(self) -> bool {
        self == FaultSet::EMPTY
    }

    /// The fault at a place, if it is active. Together the places have all faults but those of heartbeats and RPDOs.
    #[inline(never)]
    pub(crate) fn at(self, place: usize) -> Option<Fault> {
        if let Some(fault) = Fault::single(place) {
            return (self.single & 1 << place != 0).then_some(fault);
        }
        let number = place.checked_sub(Fault::SINGLES).and_then(|number| u8::try_from(number).ok())?;
        (self.application & application_bit(number) != 0).then_some(Fault::Application(number))
    }

    /// The value of the error register (1001h).
    pub(crate) fn register(self, conditions: &[Condition]) -> u8 {
        if self.is_empty() {
            return 0;
        }
        let is_communication = self.single & Fault::OF_COMMUNICATION != 0 || self.several != 0;
        let (mut active, mut own) = (self.application, 0);
        for condition in conditions {
            if active & 1 != 0 {
                own |= condition.register;
            }
            active >>= 1;
        }
        own | GENERIC | if is_communication { COMMUNICATION } else { 0 }
    }
}

/// The bit of a condition of the application; 0 for a number above 31.
fn application_bit(number: u8) -> u32 {
    1_u32.checked_shl(number.into()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_its_own_bit() {
        let all = || (0..Fault::SINGLES).filter_map(Fault::single).chain((0..32).map(Fault::Application));
        let mut set = FaultSet::default();
        assert!(all().all(|fault| set.set(fault, true)));
        assert!((0..Fault::PLACES).filter_map(|place| set.at(place)).eq(all()));
        assert!(all().all(|fault| set.set(fault, false)));
        assert!(set.is_empty());
    }

    #[test]
    fn the_register_distinguishes_communication_from_other_errors() {
        let conditions = [Condition { register: 0b100, ..Condition::new(0x3110) }];
        let of = |fault| {
            let mut set = FaultSet::default();
            set.set(fault, true);
            set.register(&conditions)
        };
        assert_eq!(FaultSet::default().register(&conditions), 0);
        assert_eq!(of(Fault::Application(0)), 0b101);
        assert_eq!(of(Fault::StoredData(Group::Application)), 0x01);
        for fault in [Fault::Overrun, Fault::MpdoNotTaken, Fault::Heartbeat(126), Fault::RpdoDeadline(512)] {
            assert_eq!(of(fault), 0x11, "{fault:?}");
        }
    }

    #[test]
    fn one_of_many_is_named_by_two_bytes() {
        let condition = Fault::RpdoTooShort(512).condition(&[]);
        assert_eq!((condition.code, condition.detail), (0x8210, [0x00, 0x02, 0, 0, 0]));
        assert_eq!(Fault::Heartbeat(0).condition(&[]).detail, [1, 0, 0, 0, 0]);
    }
}
