//! The parameter groups and what is said of each.

/// A set of parameters that is saved, restored and loaded as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Node-ID, bit rate and personality: what LSS (CiA 305) and the factory set. See [`crate::DeviceRecord`].
    Device,
    /// Communication parameters, 1000h to 1FFFh (1010h sub-index 2).
    Communication,
    /// Application parameters, 6000h to 9FFFh and the user storage 4000h (1010h sub-index 3).
    Application,
    /// Calibration of the measuring channels: set in production, not touched by 1011h.
    Calibration,
}

impl Group {
    /// Every group, in the order in which a transaction holds them.
    pub const ALL: [Group; 4] = [Group::Device, Group::Communication, Group::Application, Group::Calibration];

    /// The number that stands for the group in flash. Numbers are never used again for another purpose.
    pub(crate) const fn id(self) -> u8 {
        match self {
            Group::Device => 1,
            Group::Communication => 2,
            Group::Application => 3,
            Group::Calibration => 4,
        }
    }

    pub(crate) fn from_id(id: u8) -> Option<Group> {
        Group::ALL.into_iter().find(|group| group.id() == id)
    }
}

/// Whether the newest values of a group could be read, as found when the store was opened. Anything but
/// `Good` is worth an EMCY: 6301h for the device, 6302h for the communication and 6303h for the application group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Health {
    /// The newest saved value is read; a save that a power cut kept from completing counts as not made.
    #[default]
    Good,
    /// The newest saved value of this group is damaged: the value before it is read.
    FellBack,
    /// The saved value of this group is damaged, and there is no older one: nothing is read, the defaults hold.
    Lost,
}

/// One thing that a save does to one group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change<'a> {
    /// The group takes this value.
    Set {
        /// The group.
        group: Group,
        /// Version of the value's layout; `load` hands it back so that the caller can migrate or refuse old data.
        version: u16,
        /// The value, at most [`crate::MAX_VALUE`] bytes. Empty is a value too.
        value: &'a [u8],
    },
    /// The group has no stored value any more: the caller's defaults hold (1011h).
    Restore(Group),
}

impl Change<'_> {
    /// The group that changes.
    #[must_use]
    pub fn group(&self) -> Group {
        match *self {
            Change::Set { group, .. } | Change::Restore(group) => group,
        }
    }
}

/// The value that `load` has put into the caller's buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loaded {
    /// Version of the layout, as given when the value was saved.
    pub version: u16,
    /// Bytes of the value.
    pub len: usize,
}

/// A set of groups: bit 0 for the group with the number 1, and so on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct GroupSet(pub(crate) u8);

impl GroupSet {
    pub(crate) const NONE: GroupSet = GroupSet(0);
    pub(crate) const ALL: GroupSet = GroupSet(0xF);

    pub(crate) fn contains(self, group: Group) -> bool {
        self.0 & GroupSet::bit(group) != 0
    }

    pub(crate) fn insert(&mut self, group: Group) {
        self.0 |= GroupSet::bit(group);
    }

    /// The groups of this set that are not in the other.
    pub(crate) fn without(self, other: GroupSet) -> GroupSet {
        GroupSet(self.0 & !other.0)
    }

    fn bit(group: Group) -> u8 {
        1 << (group.id() - 1)
    }
}

/// One `T` for each group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PerGroup<T>([T; 4]);

impl<T> PerGroup<T> {
    pub(crate) fn from_fn(mut make: impl FnMut(Group) -> T) -> PerGroup<T> {
        PerGroup(Group::ALL.map(&mut make))
    }

    pub(crate) fn get(&self, group: Group) -> &T {
        let [device, communication, application, calibration] = &self.0;
        match group {
            Group::Device => device,
            Group::Communication => communication,
            Group::Application => application,
            Group::Calibration => calibration,
        }
    }

    pub(crate) fn get_mut(&mut self, group: Group) -> &mut T {
        let [device, communication, application, calibration] = &mut self.0;
        match group {
            Group::Device => device,
            Group::Communication => communication,
            Group::Application => application,
            Group::Calibration => calibration,
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (Group, &T)> {
        Group::ALL.into_iter().zip(&self.0)
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (Group, &mut T)> {
        Group::ALL.into_iter().zip(&mut self.0)
    }
}
