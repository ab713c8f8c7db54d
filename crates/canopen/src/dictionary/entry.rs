//! One entry of a dictionary at run time.

use super::limits::Limits;
use super::{Access, Field, Group, Mapping, Rule, Type};
use crate::sdo::Abort;

/// The attributes of an entry, without index, sub-index and offset in the image. Other entries can share them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attributes {
    pub(crate) limits: Limits,
    pub(crate) kind: Type,
    pub(crate) access: Access,
    pub(crate) mapping: Mapping,
    pub(crate) group: Option<Group>,
    pub(crate) rule: Rule,
    /// The default value is relative to the node-ID.
    pub(crate) node_relative: bool,
}

/// One entry of the dictionary.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub(crate) attributes: &'static Attributes,
    pub(crate) field: Field,
    pub(crate) sub: u8,
    pub(crate) index: u16,
}

impl Entry {
    /// Index.
    #[must_use]
    pub const fn index(&self) -> u16 {
        self.index
    }

    /// Sub-index.
    #[must_use]
    pub const fn sub(&self) -> u8 {
        self.sub
    }

    /// Location of the value in the image.
    #[must_use]
    pub const fn field(&self) -> Field {
        self.field
    }

    pub(crate) const fn rule(&self) -> Rule {
        self.attributes.rule
    }

    /// Whether every value of the right size is allowed. A PDO writes such a value to the image without a check.
    pub(crate) const fn takes_any(&self) -> bool {
        matches!(self.attributes.rule, Rule::Plain)
            && self.attributes.limits.is_none(self.field.size)
            && !matches!(self.attributes.kind, Type::Real32)
    }

    /// Whether the application holds the content, of any length.
    pub(crate) const fn is_domain(&self) -> bool {
        matches!(self.attributes.kind, Type::Domain)
    }

    /// Whether the value is a parameter of the application.
    pub(crate) const fn is_parameter(&self) -> bool {
        !matches!(self.attributes.group, None | Some(Group::Communication))
    }

    pub(crate) const fn is_writable(&self) -> bool {
        self.attributes.access.is_writable()
    }

    /// Checks the length of a value to be written. Only a string may be shorter than its size in the image.
    pub(crate) fn check_length(&self, len: usize) -> Result<(), Abort> {
        let size = usize::from(self.field.size);
        if len == size {
            return Ok(());
        }
        match self.attributes.kind {
            Type::VisibleString(_) if len < size => Ok(()),
            _ if len < size => Err(Abort::TooShort),
            _ => Err(Abort::TooLong),
        }
    }

    /// Checks a value to be written, by its first four bytes. The length must have been checked before.
    #[inline]
    pub(crate) fn check_value(&self, value: u32) -> Result<(), Abort> {
        match self.attributes.kind {
            Type::Real32 => check_real(f32::from_bits(value)),
            kind => self.attributes.limits.check(kind, self.field.size, value),
        }
    }
}

/// The first four bytes as a number; missing bytes count as 0.
pub(crate) fn little_endian(bytes: &[u8]) -> u32 {
    if let Some(bytes) = bytes.first_chunk() {
        return u32::from_le_bytes(*bytes);
    }
    bytes.iter().take(4).rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}

/// Refuses infinity and NaN: as a parameter, they would make every measured value invalid.
fn check_real(value: f32) -> Result<(), Abort> {
    if value.is_finite() { Ok(()) } else { Err(Abort::InvalidValue) }
}
