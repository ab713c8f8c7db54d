//! The parameter groups, and types for their state and changes.

/// A set of parameters that is saved, restored and loaded as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterGroup {
    /// Node-ID, bit rate and personality, set by LSS (CiA 305) and by the factory. See [`crate::DeviceRecord`].
    Device,
    /// Communication parameters, 1000h to 1FFFh (1010h sub-index 2).
    Communication,
    /// Application parameters, 6000h to 9FFFh and the user storage 4000h (1010h sub-index 3).
    Application,
    /// Calibration of the measuring channels: set in production, not affected by 1011h.
    Calibration,
}

impl ParameterGroup {
    /// Every group, in the order of the records in a transaction.
    pub const ALL: [ParameterGroup; 4] = [
        ParameterGroup::Device,
        ParameterGroup::Communication,
        ParameterGroup::Application,
        ParameterGroup::Calibration,
    ];

    /// The number of the group in flash. A number is never reused for another purpose.
    pub(crate) const fn id(self) -> u8 {
        match self {
            ParameterGroup::Device => 1,
            ParameterGroup::Communication => 2,
            ParameterGroup::Application => 3,
            ParameterGroup::Calibration => 4,
        }
    }

    pub(crate) fn from_id(id: u8) -> Option<ParameterGroup> {
        ParameterGroup::ALL.into_iter().find(|group| group.id() == id)
    }
}

/// Whether the newest values of a group could be read when the store was opened. Any state but `Good` should cause an
/// EMCY: 6301h for the device, 6302h for the communication and 6303h for the application group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Health {
    /// The newest saved value was read. A save that was stopped by a power cut counts as not made.
    #[default]
    Good,
    /// The newest saved value of this group is damaged, so the value before it was read.
    FellBack,
    /// The saved value of this group is damaged, and there is no older one, so the defaults are in use.
    Lost,
}

/// A change of one group in a save.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change<'a> {
    /// Gives the group this value.
    Set {
        /// The group.
        group: ParameterGroup,
        /// Version of the value's layout; `load` returns it so that the caller can migrate or refuse old data.
        version: u16,
        /// The value, at most [`crate::MAX_VALUE`] bytes. It may be empty.
        value: &'a [u8],
    },
    /// Removes the stored value of the group, so that the caller's defaults are in use (1011h).
    Restore(ParameterGroup),
}

impl Change<'_> {
    /// The changed group.
    #[must_use]
    pub fn group(&self) -> ParameterGroup {
        match *self {
            Change::Set { group, .. } | Change::Restore(group) => group,
        }
    }
}

/// Description of the value that `load` has put into the caller's buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loaded {
    /// Version of the layout, as given when the value was saved.
    pub version: u16,
    /// Length of the value in bytes.
    pub len: usize,
}

/// A set of groups: bit 0 for the group with the number 1, and so on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct GroupSet(pub(crate) u8);

impl GroupSet {
    pub(crate) const NONE: GroupSet = GroupSet(0);
    pub(crate) const ALL: GroupSet = GroupSet(0xF);

    pub(crate) fn contains(self, group: ParameterGroup) -> bool {
        self.0 & GroupSet::bit(group) != 0
    }

    pub(crate) fn insert(&mut self, group: ParameterGroup) {
        self.0 |= GroupSet::bit(group);
    }

    /// The groups of this set that are not in the other set.
    pub(crate) fn without(self, other: GroupSet) -> GroupSet {
        GroupSet(self.0 & !other.0)
    }

    fn bit(group: ParameterGroup) -> u8 {
        1 << (group.id() - 1)
    }
}

/// One `T` for each group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PerGroup<T>([T; 4]);

impl<T> PerGroup<T> {
    pub(crate) fn from_fn(mut make: impl FnMut(ParameterGroup) -> T) -> PerGroup<T> {
        PerGroup(ParameterGroup::ALL.map(&mut make))
    }

    pub(crate) fn get(&self, group: ParameterGroup) -> &T {
        let [device, communication, application, calibration] = &self.0;
        match group {
            ParameterGroup::Device => device,
            ParameterGroup::Communication => communication,
            ParameterGroup::Application => application,
            ParameterGroup::Calibration => calibration,
        }
    }

    pub(crate) fn get_mut(&mut self, group: ParameterGroup) -> &mut T {
        let [device, communication, application, calibration] = &mut self.0;
        match group {
            ParameterGroup::Device => device,
            ParameterGroup::Communication => communication,
            ParameterGroup::Application => application,
            ParameterGroup::Calibration => calibration,
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (ParameterGroup, &T)> {
        ParameterGroup::ALL.into_iter().zip(&self.0)
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (ParameterGroup, &mut T)> {
        ParameterGroup::ALL.into_iter().zip(&mut self.0)
    }
}
