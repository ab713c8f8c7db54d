//! One row of a dictionary table: everything there is to say about an entry, documentation included.

use super::{Group, Rule, Type};

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
    /// The group with which the value is stored; `None` for a value that no job stores.
    pub group: Option<Group>,
    /// Physical unit, for documents; empty where there is none.
    pub unit: &'static str,
    /// The behaviour of the entry beyond holding a value.
    pub rule: Rule,
}

impl Object {
    /// A row with default 0 and no special attribute. The rule of an object of CiA 301 follows from its index.
    #[must_use]
    pub const fn new(index: u16, sub: u8, name: &'static str, kind: Type, access: Access) -> Object {
        let default = match kind {
            Type::Real32 => DefaultValue::Real(0.0),
            Type::VisibleString(_) => DefaultValue::Text(""),
            Type::Domain => DefaultValue::None,
            _ => DefaultValue::Integer(0),
        };
        let (mapping, group, rule) = (Mapping::No, None, Rule::of(index, sub));
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

    /// Makes it a parameter that is stored with a group.
    #[must_use]
    pub const fn stored(mut self, group: Group) -> Object {
        self.group = Some(group);
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

    /// Lets the application decide on each write ([`Application::write`](crate::Application::write)).
    #[must_use]
    pub const fn handled(self) -> Object {
        self.with(Rule::Application)
    }

    /// Fixes the CAN-ID of a PDO to the default: only the flags of the COB-ID change. A device profile pre-defines such a
    /// PDO, and may choose a CAN-ID that CiA 301 restricts, as CiA 417 does with 180h.
    ///
    /// # Panics
    /// During compilation, for an entry that is no COB-ID of a PDO.
    #[must_use]
    pub const fn predefined(self) -> Object {
        assert!(matches!(self.rule, Rule::PdoCobId), "only the COB-ID of a PDO is pre-defined");
        self.with(Rule::PdoPredefined)
    }

    /// Makes the entry another name of the event timer of a TPDO (1800h + `tpdo`, sub-index 5), as the cyclic timer of
    /// CiA 406 is. Both names have one place in the image.
    #[must_use]
    pub const fn event_timer_of(self, tpdo: u8) -> Object {
        self.with(Rule::EventTimerOf(tpdo))
    }

    /// Makes the entry a setting of eight bits that is stored at once: a write is answered when the value is stored
    /// ([`Job::Setting`](crate::Job::Setting)), and the application then shows the value.
    #[must_use]
    pub const fn setting(self) -> Object {
        self.with(Rule::Setting)
    }

    /// Makes the entry the command that stores the calibration, as 1010h stores the other groups.
    #[must_use]
    pub const fn stores_calibration(self) -> Object {
        self.with(Rule::StoreCalibration)
    }

    const fn with(mut self, rule: Rule) -> Object {
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
