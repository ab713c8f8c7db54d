//! One row of a dictionary table: everything there is to say about an entry, documentation included.

use super::Type;

/// Access by SDO (CiA 306).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Never changes.
    Const,
    /// Changes by itself.
    ReadOnly,
    /// A command.
    WriteOnly,
    /// A parameter.
    ReadWrite,
}

impl Access {
    /// Whether an SDO upload is allowed.
    #[must_use]
    pub const fn is_readable(self) -> bool {
        !matches!(self, Access::WriteOnly)
    }

    /// Whether an SDO download is allowed.
    #[must_use]
    pub const fn is_writable(self) -> bool {
        matches!(self, Access::WriteOnly | Access::ReadWrite)
    }
}

/// Into which PDOs an entry can be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mapping {
    /// None.
    No,
    /// TPDOs only.
    Tpdo,
    /// RPDOs only.
    Rpdo,
}

/// With which parameters an entry is saved and restored (objects 1010h, 1011h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Not saved.
    Volatile,
    /// Communication parameters, sub-index 2.
    Communication,
    /// Application parameters, sub-index 3.
    Application,
    /// Calibration, saved by [`Rule::StoreCalibration`]: 1010h and 1011h do not touch it.
    Calibration,
}

/// The value after a reset with nothing saved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DefaultValue {
    /// Of any integer type.
    Integer(i64),
    /// Of REAL32.
    Real(f32),
    /// Of `VISIBLE_STRING`.
    Text(&'static str),
    /// This plus the node-ID.
    NodeId(u32),
    /// Of DOMAIN: the application's.
    None,
}

/// What an entry does beyond holding a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Nothing.
    Plain,
    /// 1003h:0, number of errors; writing 0 clears the list.
    ErrorCount,
    /// 1003h:1 and up, an error of the list.
    ErrorEntry,
    /// 1005h, COB-ID of SYNC.
    SyncCobId,
    /// 1006h, communication cycle period.
    SyncPeriod,
    /// 1007h, synchronous window length.
    SyncWindow,
    /// 1010h:1 and up, store parameters.
    Store,
    /// 1011h:1 and up, restore default parameters.
    Restore,
    /// 1014h, COB-ID of EMCY.
    EmcyCobId,
    /// 1015h, inhibit time of EMCY.
    EmcyInhibit,
    /// 1016h:1 and up, a node whose heartbeat is watched.
    HeartbeatWatch,
    /// 1017h, heartbeat producer time.
    HeartbeatTime,
    /// 1019h, synchronous counter overflow value.
    SyncOverflow,
    /// 1F51h:1, program control of a program that runs (CiA 302-3).
    ProgramControl,
    /// 1F80h, NMT start-up.
    StartUp,
    /// 1400h.., 1800h..:1, COB-ID of a PDO.
    PdoCobId,
    /// The same of a PDO to which a profile has given its CAN-ID: only the flags change. The profile may have chosen a
    /// CAN-ID that CiA 301 restricts, as CiA 417 does with 180h.
    PdoPredefined,
    /// 1400h.., 1800h..:2, transmission type.
    PdoType,
    /// 1800h..:3, inhibit time.
    PdoInhibit,
    /// 1400h.., 1800h..:5, event timer.
    PdoEventTimer,
    /// 1800h..:6, SYNC start value.
    PdoSyncStart,
    /// Another name of 1800h..:5, the event timer of this TPDO, from 0: the cyclic timer of a device profile. Both have
    /// one place in the image.
    EventTimerOf(u8),
    /// 1600h.., 1A00h..:0, number of mapped objects.
    PdoCount,
    /// 1600h.., 1A00h..:1 and up, a mapped object.
    PdoSlot,
    /// 1FA0h:1 and up, a line of the object scanner list.
    ScannerLine,
    /// Stores the calibration, as 1010h does the other parameters.
    StoreCalibration,
    /// A setting that is stored at once: a write is answered when it is, and the application then shows it.
    Setting,
    /// The application decides, by this number.
    Application(u8),
}

impl Rule {
    /// Whether what is written is a command: the value that is read stays.
    pub(crate) const fn is_command(self) -> bool {
        matches!(
            self,
            Rule::Store | Rule::Restore | Rule::StoreCalibration | Rule::ProgramControl | Rule::Setting
        )
    }

    /// A number of its own, as constant functions cannot compare rules.
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
            Rule::EventTimerOf(number) => 0x100 | number as u16,
            Rule::Application(number) => 0x200 | number as u16,
        }
    }

    /// Whether the value has a place of its own in the image.
    pub(crate) const fn has_place(self) -> bool {
        !matches!(self, Rule::ErrorCount | Rule::ErrorEntry | Rule::EventTimerOf(_))
    }

    /// Whether the value lives outside the image.
    pub(crate) const fn is_computed(self) -> bool {
        matches!(self, Rule::ErrorCount | Rule::ErrorEntry)
    }
}

/// One row: an entry with all its attributes.
#[derive(Clone, Copy, Debug)]
pub struct Object {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
    /// Name, for documents.
    pub name: &'static str,
    /// Data type.
    pub kind: Type,
    /// SDO access.
    pub access: Access,
    /// PDO mapping.
    pub mapping: Mapping,
    /// Smallest and largest value accepted, where narrower than the type.
    pub limits: Option<(i64, i64)>,
    /// Value after a reset.
    pub default: DefaultValue,
    /// Storage group.
    pub group: Group,
    /// Physical unit, for documents; empty where there is none.
    pub unit: &'static str,
    /// Special behaviour.
    pub rule: Rule,
}

impl Object {
    /// A row with default 0 and no special attribute.
    #[must_use]
    pub const fn new(index: u16, sub: u8, name: &'static str, kind: Type, access: Access) -> Object {
        let default = match kind {
            Type::Real32 => DefaultValue::Real(0.0),
            Type::VisibleString(_) => DefaultValue::Text(""),
            Type::Domain => DefaultValue::None,
            _ => DefaultValue::Integer(0),
        };
        let (mapping, group, rule) = (Mapping::No, Group::Volatile, Rule::Plain);
        Object { index, sub, name, kind, access, mapping, limits: None, default, group, unit: "", rule }
    }

    /// Sub-index 0 of a record or an array: the highest sub-index.
    #[must_use]
    pub const fn highest(index: u16, highest: u8, name: &'static str) -> Object {
        Object::new(index, 0, name, Type::Unsigned8, Access::ReadOnly).value(highest as i64)
    }

    /// Sets the default value.
    #[must_use]
    pub const fn default(mut self, default: DefaultValue) -> Object {
        self.default = default;
        self
    }

    /// Sets an integer default value.
    #[must_use]
    pub const fn value(self, value: i64) -> Object {
        self.default(DefaultValue::Integer(value))
    }

    /// Sets a REAL32 default value.
    #[must_use]
    pub const fn real(self, value: f32) -> Object {
        self.default(DefaultValue::Real(value))
    }

    /// Sets the limits.
    #[must_use]
    pub const fn limits(mut self, low: i64, high: i64) -> Object {
        self.limits = Some((low, high));
        self
    }

    /// Sets the storage group.
    #[must_use]
    pub const fn saved(mut self, group: Group) -> Object {
        self.group = group;
        self
    }

    /// Makes it mappable.
    #[must_use]
    pub const fn mappable(mut self, mapping: Mapping) -> Object {
        self.mapping = mapping;
        self
    }

    /// Sets the physical unit.
    #[must_use]
    pub const fn unit(mut self, unit: &'static str) -> Object {
        self.unit = unit;
        self
    }

    /// Sets the special behaviour.
    #[must_use]
    pub const fn rule(mut self, rule: Rule) -> Object {
        self.rule = rule;
        self
    }

    /// Index and sub-index as one number, in the order of the table.
    #[must_use]
    pub const fn key(&self) -> u32 {
        (self.index as u32) << 8 | self.sub as u32
    }

    /// Bytes it takes in the image.
    pub(crate) const fn stored_size(&self) -> usize {
        if self.rule.has_place() { self.kind.size() as usize } else { 0 }
    }
}
