//! Rules: the effect of an entry beyond storing a value.

/// The effect of an entry beyond storing a value. The rules of CiA 301 follow from index and sub-index, so no row can
/// lack its rule. The methods of [`Object`](super::Object) set the other rules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rule {
    /// The entry only stores a value.
    Plain,
    /// 1003h:0, number of errors; writing 0 clears the list.
    ErrorCount,
    /// 1003h:1 and up, an entry of the error list.
    ErrorEntry,
    /// 1005h, COB-ID of SYNC.
    SyncCobId,
    /// 1005h of a device that can produce SYNC.
    SyncProducer,
    /// 1006h, communication cycle period.
    SyncPeriod,
    /// 1007h, synchronous window length.
    SyncWindow,
    /// 100Ch, guard time.
    GuardTime,
    /// 100Dh, life time factor.
    LifeTimeFactor,
    /// 1010h:1 and up, store parameters.
    Store,
    /// 1011h:1 and up, restore default parameters.
    Restore,
    /// 1012h, COB-ID of the time stamp.
    TimeCobId,
    /// 1014h, COB-ID of EMCY.
    EmcyCobId,
    /// 1015h, inhibit time of EMCY.
    EmcyInhibit,
    /// 1016h:1 and up, a node whose heartbeat is monitored.
    HeartbeatWatch,
    /// 1017h, heartbeat producer time.
    HeartbeatTime,
    /// 1019h, synchronous counter overflow value.
    SyncOverflow,
    /// 1028h:1 and up, COB-ID of the EMCY of another node.
    EmcyWatch,
    /// 1201h to 127Fh:1 and 2, COB-ID of a further SDO server.
    SdoServerCobId,
    /// 1280h to 12FFh:1 and 2, COB-ID of an SDO client.
    SdoClientCobId,
    /// 1F51h:1, program control of the running program (CiA 302-3).
    ProgramControl,
    /// 1F80h, NMT start-up.
    StartUp,
    /// 1400h.., 1800h..:1, COB-ID of a PDO.
    PdoCobId,
    /// The COB-ID of a PDO whose CAN-ID a profile defines: only the flags can change.
    PdoPredefined,
    /// 1400h.., 1800h..:2, transmission type.
    PdoType,
    /// 1800h..:3, inhibit time.
    PdoInhibit,
    /// 1400h.., 1800h..:5, event timer.
    PdoEventTimer,
    /// 1800h..:6, SYNC start value.
    PdoSyncStart,
    /// Another name of 1800h..:5, the event timer of the TPDO with this number, from 0.
    EventTimerOf(u8),
    /// 1600h.., 1A00h..:0, number of mapped objects.
    PdoCount,
    /// 1600h.., 1A00h..:1 and up, a mapped object.
    PdoSlot,
    /// 1FA0h:0, number of lines of the object scanner list.
    ScannerCount,
    /// 1FA0h:1 and up, a line of the object scanner list.
    ScannerLine,
    /// Stores the calibration.
    StoreCalibration,
    /// A setting that is stored at once.
    Setting,
    /// The application decides on each write.
    Application,
}

impl Rule {
    /// The rule of an entry of CiA 301 or 302; `Plain` for any other entry.
    pub(super) const fn of(index: u16, sub: u8) -> Rule {
        match (index, sub) {
            (0x1003, 0) => Rule::ErrorCount,
            (0x1003, _) => Rule::ErrorEntry,
            (0x1005, 0) => Rule::SyncCobId,
            (0x1006, 0) => Rule::SyncPeriod,
            (0x1007, 0) => Rule::SyncWindow,
            (0x100C, 0) => Rule::GuardTime,
            (0x100D, 0) => Rule::LifeTimeFactor,
            (0x1010, 1..) => Rule::Store,
            (0x1011, 1..) => Rule::Restore,
            (0x1012, 0) => Rule::TimeCobId,
            (0x1014, 0) => Rule::EmcyCobId,
            (0x1015, 0) => Rule::EmcyInhibit,
            (0x1016, 1..) => Rule::HeartbeatWatch,
            (0x1017, 0) => Rule::HeartbeatTime,
            (0x1019, 0) => Rule::SyncOverflow,
            (0x1028, 1..) => Rule::EmcyWatch,
            (0x1201..=0x127F, 1 | 2) => Rule::SdoServerCobId,
            (0x1280..=0x12FF, 1 | 2) => Rule::SdoClientCobId,
            (0x1F51, 1) => Rule::ProgramControl,
            (0x1F80, 0) => Rule::StartUp,
            (0x1FA0, 0) => Rule::ScannerCount,
            (0x1FA0, _) => Rule::ScannerLine,
            _ => Rule::of_pdo(index, sub),
        }
    }

    const fn of_pdo(index: u16, sub: u8) -> Rule {
        match (index, sub) {
            (0x1400..=0x15FF | 0x1800..=0x19FF, 1) => Rule::PdoCobId,
            (0x1400..=0x15FF | 0x1800..=0x19FF, 2) => Rule::PdoType,
            (0x1400..=0x15FF | 0x1800..=0x19FF, 3) => Rule::PdoInhibit,
            (0x1400..=0x15FF | 0x1800..=0x19FF, 5) => Rule::PdoEventTimer,
            (0x1400..=0x15FF | 0x1800..=0x19FF, 6) => Rule::PdoSyncStart,
            (0x1600..=0x17FF | 0x1A00..=0x1BFF, 0) => Rule::PdoCount,
            (0x1600..=0x17FF | 0x1A00..=0x1BFF, _) => Rule::PdoSlot,
            _ => Rule::Plain,
        }
    }

    /// Whether a write is a command that does not change the stored value.
    #[must_use]
    pub const fn is_command(self) -> bool {
        matches!(
            self,
            Rule::Store | Rule::Restore | Rule::StoreCalibration | Rule::ProgramControl | Rule::Setting
        )
    }

    /// A unique number: constant functions cannot compare rules.
    pub(super) const fn code(self) -> u16 {
        match self {
            Rule::Plain => 0,
            Rule::ErrorCount => 1,
            Rule::ErrorEntry => 2,
            Rule::SyncCobId => 3,
            Rule::SyncPeriod => 4,
            Rule::SyncWindow => 5,
            Rule::Store => 6,
            Rule::Restore => 7,
            Rule::EmcyCobId => 8,
            Rule::EmcyInhibit => 9,
            Rule::HeartbeatWatch => 10,
            Rule::HeartbeatTime => 11,
            Rule::SyncOverflow => 12,
            Rule::ProgramControl => 13,
            Rule::StartUp => 14,
            Rule::PdoCobId => 15,
            Rule::PdoPredefined => 16,
            Rule::PdoType => 17,
            Rule::PdoInhibit => 18,
            Rule::PdoEventTimer => 19,
            Rule::PdoSyncStart => 20,
            Rule::PdoCount => 21,
            Rule::PdoSlot => 22,
            Rule::ScannerLine => 23,
            Rule::StoreCalibration => 24,
            Rule::Setting => 25,
            Rule::Application => 26,
            Rule::SyncProducer => 27,
            Rule::TimeCobId => 28,
            Rule::GuardTime => 29,
            Rule::LifeTimeFactor => 30,
            Rule::EmcyWatch => 31,
            Rule::SdoServerCobId => 32,
            Rule::SdoClientCobId => 33,
            Rule::ScannerCount => 34,
            Rule::EventTimerOf(number) => 0x100 | number as u16,
        }
    }

    /// Whether the entry has its own space in the image.
    pub(crate) const fn has_place(self) -> bool {
        !matches!(self, Rule::ErrorCount | Rule::ErrorEntry | Rule::EventTimerOf(_))
    }

    /// Whether the value is not in the image but computed when it is read.
    pub(crate) const fn is_computed(self) -> bool {
        matches!(self, Rule::ErrorCount | Rule::ErrorEntry)
    }

    /// The size in bytes that the data type of an entry with this rule must have; `None` for any size.
    #[must_use]
    pub const fn size(self) -> Option<u8> {
        match self {
            Rule::Plain | Rule::Application => None,
            Rule::ErrorCount
            | Rule::LifeTimeFactor
            | Rule::SyncOverflow
            | Rule::ProgramControl
            | Rule::PdoType
            | Rule::PdoSyncStart
            | Rule::PdoCount
            | Rule::ScannerCount
            | Rule::Setting => Some(1),
            Rule::EmcyInhibit
            | Rule::GuardTime
            | Rule::HeartbeatTime
            | Rule::PdoInhibit
            | Rule::PdoEventTimer
            | Rule::EventTimerOf(_) => Some(2),
            _ => Some(4),
        }
    }
}
