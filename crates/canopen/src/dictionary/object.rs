//! One row of a dictionary table: all attributes of an entry, including its documentation.

use super::{Group, Rule, Type};

/// Access by SDO (CiA 306).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The value never changes.
    Const,
    /// Only the device changes the value.
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

/// The PDOs into which an entry can be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mapping {
    /// None.
    No,
    /// TPDOs only.
    Tpdo,
    /// RPDOs only.
    Rpdo,
    /// PDOs of both directions.
    Both,
}

impl Mapping {
    /// Whether a TPDO can carry the entry.
    #[must_use]
    pub const fn allows_tpdo(self) -> bool {
        matches!(self, Mapping::Tpdo | Mapping::Both)
    }

    /// Whether an RPDO can write the entry.
    #[must_use]
    pub const fn allows_rpdo(self) -> bool {
        matches!(self, Mapping::Rpdo | Mapping::Both)
    }
}

/// The value after a reset if no value is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DefaultValue {
    /// The default of an entry of integer type.
    Integer(i64),
    /// The default of an entry of type REAL32, a finite number.
    Real(f32),
    /// The default of an entry of type `VISIBLE_STRING`.
    Text(&'static str),
    /// The node-ID plus this number.
    NodeId(u32),
    /// An entry of type DOMAIN has no default: the application holds its content.
    None,
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
    /// Smallest and largest accepted value; `None` for the range of the type.
    pub limits: Option<(i64, i64)>,
    /// Value after a reset.
    pub default: DefaultValue,
    /// The group with which the value is stored; `None` for a value that no job stores.
    pub group: Option<Group>,
    /// Physical unit, for documents; empty without a unit.
    pub unit: &'static str,
    /// The behaviour of the entry beyond holding a value. Only the methods below set it, so that no row of CiA 301 loses
    /// its rule.
    pub(crate) rule: Rule,
    /// A write makes the device act, although the value is stored: a preset, for example.
    pub acts: bool,
}

impl Object {
    /// A row with default 0 and no special attribute. The rule of an object of CiA 301 follows from its index.
    #[must_use]
    pub const fn new(index: u16, sub: u8, name: &'static str, kind: Type, access: Access) -> Object {
        let default = match kind {
            Type::Real32 => DefaultValue::Real(0.0),
            Type::VisibleString(_) => DefaultValue::Text(""),
            Type::Domain | Type::OctetString(_) => DefaultValue::None,
            _ => DefaultValue::Integer(0),
        };
        let (mapping, group, rule) = (Mapping::No, None, Rule::of(index, sub));
        Object {
            index,
            sub,
            name,
            kind,
            access,
            mapping,
            limits: None,
            default,
            group,
            unit: "",
            rule,
            acts: false,
        }
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

    /// Sets a REAL32 default value, a finite number.
    #[must_use]
    pub const fn real(self, value: f32) -> Object {
        self.default(DefaultValue::Real(value))
    }

    /// Default of a REAL64.
    #[must_use]
    pub const fn real64(self, value: f64) -> Object {
        self.default(DefaultValue::Integer(value.to_bits().cast_signed()))
    }

    /// Sets the limits.
    #[must_use]
    pub const fn limits(mut self, low: i64, high: i64) -> Object {
        self.limits = Some((low, high));
        self
    }

    /// Makes the entry a parameter that is stored with a group.
    #[must_use]
    pub const fn stored(mut self, group: Group) -> Object {
        self.group = Some(group);
        self
    }

    /// Excludes a stored entry from the configuration, because a write makes the device act
    /// ([`is_configuration`](Object::is_configuration)).
    ///
    /// # Panics
    /// During compilation, for an entry that is not stored: it is no part of the configuration in any case.
    #[must_use]
    pub const fn acts(mut self) -> Object {
        assert!(self.group.is_some(), "only a stored entry can be excluded from the configuration");
        self.acts = true;
        self
    }

    /// Whether the entry is a parameter that a master writes with a stored configuration (CiA 306, `ObjFlags`): a
    /// parameter that the device stores with 1010h and that does not make the device act. The calibration belongs to
    /// the device itself.
    #[must_use]
    pub const fn is_configuration(&self) -> bool {
        let is_stored = !matches!(self.group, None | Some(Group::Calibration));
        is_stored && matches!(self.access, Access::ReadWrite) && !self.acts
    }

    /// Whether an upload of the entry is of no use to a master that reads the configuration: a domain, an entry that is
    /// empty most of the time, or a command that cannot be read.
    #[must_use]
    pub const fn is_skipped_by_scans(&self) -> bool {
        let is_readable = self.access.is_readable();
        !is_readable || matches!(self.kind, Type::Domain) || matches!(self.rule, Rule::ErrorEntry)
    }

    /// `ObjFlags` of the entry (CiA 306): bit 0 refuses a write when a configuration is downloaded, bit 1 refuses a
    /// read when the device is scanned.
    #[must_use]
    pub const fn flags(&self) -> u8 {
        let refuses_write = self.access.is_writable() && !self.is_configuration();
        refuses_write as u8 | (self.is_skipped_by_scans() as u8) << 1
    }

    /// Makes the entry mappable.
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

    /// Lets the application decide on each write ([`Application::write`](crate::Application::write)).
    #[must_use]
    pub const fn handled(self) -> Object {
        self.with(Rule::Application)
    }

    /// Fixes the CAN-ID of a PDO to its default: a write can change the flags of the COB-ID only. A device profile
    /// pre-defines such a PDO, and may choose a CAN-ID that CiA 301 restricts, as CiA 417 does with 180h.
    ///
    /// # Panics
    /// During compilation, for an entry that is not the COB-ID of a PDO.
    #[must_use]
    pub const fn predefined(self) -> Object {
        assert!(matches!(self.rule, Rule::PdoCobId), "only the COB-ID of a PDO is pre-defined");
        self.with(Rule::PdoPredefined)
    }

    /// Makes the entry another name of the event timer of a TPDO (1800h + `tpdo`, sub-index 5), such as the cyclic
    /// timer of CiA 406. Both entries have the same location in the image.
    #[must_use]
    pub const fn event_timer_of(self, tpdo: u8) -> Object {
        self.with(Rule::EventTimerOf(tpdo))
    }

    /// Makes the entry a setting of eight bits that is stored at once. The response to a write is sent when the value
    /// is stored ([`Job::Setting`](crate::Job::Setting)); then the application changes the value in the image.
    #[must_use]
    pub const fn setting(self) -> Object {
        self.with(Rule::Setting)
    }

    /// Makes the entry the command that stores the calibration, as 1010h does for the other groups.
    #[must_use]
    pub const fn stores_calibration(self) -> Object {
        self.with(Rule::StoreCalibration)
    }

    /// The row with this rule, for tables that are made at run time out of a data sheet.
    #[doc(hidden)]
    #[must_use]
    pub const fn with(mut self, rule: Rule) -> Object {
        self.rule = rule;
        self
    }

    /// The behaviour of the entry beyond holding a value.
    #[must_use]
    pub const fn rule(&self) -> Rule {
        self.rule
    }

    /// Index and sub-index as one number. Rows are sorted by this number.
    #[must_use]
    pub const fn key(&self) -> u32 {
        (self.index as u32) << 8 | self.sub as u32
    }

    /// Size of the value in the image in bytes.
    pub(crate) const fn stored_size(&self) -> usize {
        if self.rule.has_place() { self.kind.size() as usize } else { 0 }
    }
}
