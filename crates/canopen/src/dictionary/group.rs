//! Storage groups: which values are stored and restored together (objects 1010h and 1011h).

/// A storage group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Group {
    /// Communication parameters, sub-index 2 of 1010h and 1011h.
    Communication,
    /// Application parameters, sub-index 3.
    Application,
    /// The calibration. It has a store command of its own; 1010h and 1011h do not affect it.
    Calibration,
}

impl Group {
    /// All groups.
    pub const ALL: [Group; 3] = [Group::Communication, Group::Application, Group::Calibration];
}

/// A set of storage groups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Groups(u8);

impl Groups {
    /// No group.
    pub const NONE: Groups = Groups(0);
    /// The groups of sub-index 1 of 1010h and 1011h: communication and application.
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

    /// The groups of the set.
    pub fn iter(self) -> impl Iterator<Item = Group> {
        Group::ALL.into_iter().filter(move |group| self.contains(*group))
    }
}
