//! Storage groups: which values are stored and restored together (objects 1010h and 1011h).

/// A storage group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum Group {
    /// Communication parameters, sub-index 2 of 1010h and 1011h.
    Communication,
    /// Application parameters, sub-index 3.
    Application,
    /// The calibration. It has a store command of its own; 1010h and 1011h do not affect it.
    Calibration,
    /// A group of the product, sub-index 4.
    Own4,
    /// A group of the product, sub-index 5.
    Own5,
    /// A group of the product, sub-index 6.
    Own6,
    /// A group of the product, sub-index 7.
    Own7,
    /// A group of the product, sub-index 8.
    Own8,
}

impl Group {
    /// The groups that every product can have without sub-indexes of its own.
    pub const COMMON: [Group; 3] = [Group::Communication, Group::Application, Group::Calibration];
    /// The groups of the product: sub-indexes 4 to 8 of 1010h and 1011h.
    pub const OWN: [Group; 5] = [Group::Own4, Group::Own5, Group::Own6, Group::Own7, Group::Own8];
    /// All groups.
    pub const ALL: [Group; 8] = [
        Group::Communication,
        Group::Application,
        Group::Calibration,
        Group::Own4,
        Group::Own5,
        Group::Own6,
        Group::Own7,
        Group::Own8,
    ];

    /// The group at a position of [`ALL`](Group::ALL).
    pub(crate) const fn of(position: usize) -> Option<Group> {
        Some(match position {
            0 => Group::Communication,
            1 => Group::Application,
            2 => Group::Calibration,
            3 => Group::Own4,
            4 => Group::Own5,
            5 => Group::Own6,
            6 => Group::Own7,
            7 => Group::Own8,
            _ => return None,
        })
    }

    /// The sub-index of the group in 1010h and 1011h; 0 for the calibration.
    #[must_use]
    pub const fn sub(self) -> u8 {
        match self {
            Group::Communication => 2,
            Group::Application => 3,
            Group::Calibration => 0,
            Group::Own4 => 4,
            Group::Own5 => 5,
            Group::Own6 => 6,
            Group::Own7 => 7,
            Group::Own8 => 8,
        }
    }

    /// Whether the group is one of the product.
    pub(crate) const fn is_own(self) -> bool {
        self as u8 >= Group::Own4 as u8
    }
}

/// A set of storage groups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Groups(u8);

impl Groups {
    /// No group.
    pub const NONE: Groups = Groups(0);
    /// The groups of sub-index 1 of 1010h and 1011h: communication and application. A product with groups of its own has
    /// them beside these.
    pub const ALL_PARAMETERS: Groups =
        Groups(1 << Group::Communication as u8 | 1 << Group::Application as u8);

    /// One group.
    #[must_use]
    pub const fn one(group: Group) -> Groups {
        Groups(1 << group as u8)
    }

    /// The groups of a sub-index of 1010h or 1011h; `None` for a sub-index that names no group here.
    #[must_use]
    pub const fn of_sub(sub: u8) -> Option<Groups> {
        match sub {
            1 => Some(Groups::ALL_PARAMETERS),
            2 => Some(Groups::one(Group::Communication)),
            3 => Some(Groups::one(Group::Application)),
            4 => Some(Groups::one(Group::Own4)),
            5 => Some(Groups::one(Group::Own5)),
            6 => Some(Groups::one(Group::Own6)),
            7 => Some(Groups::one(Group::Own7)),
            8 => Some(Groups::one(Group::Own8)),
            _ => None,
        }
    }

    /// Whether a group is in the set.
    #[must_use]
    pub const fn contains(self, group: Group) -> bool {
        self.0 & 1 << group as u8 != 0
    }

    /// Adds a group or removes it.
    pub fn set(&mut self, group: Group, contains: bool) {
        let bit = 1 << group as u8;
        self.0 = if contains { self.0 | bit } else { self.0 & !bit };
    }

    /// The set as bits, in the order of [`Group::ALL`].
    pub(crate) const fn bits(self) -> u8 {
        self.0
    }

    /// Whether two sets have a group in common.
    pub(crate) const fn meets(self, other: Groups) -> bool {
        self.0 & other.0 != 0
    }

    /// Adds groups or removes them.
    pub(crate) fn set_all(&mut self, groups: Groups, contains: bool) {
        self.0 = if contains { self.0 | groups.0 } else { self.0 & !groups.0 };
    }

    /// The groups of the set.
    pub fn iter(self) -> impl Iterator<Item = Group> {
        Group::ALL.into_iter().filter(move |group| self.contains(*group))
    }
}
