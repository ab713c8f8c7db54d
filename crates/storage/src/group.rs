//! The parameter groups, and types for their state and changes.

/// The number of a parameter group: a set of parameters that is saved, restored and loaded as a whole. What a group holds is
/// the caller's decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs)] // The variants are the numbers.
pub enum GroupNumber {
    One = 1,
    Two,
    Three,
    Four,
}

impl GroupNumber {
    /// All of them, in the order in which a transaction holds their groups.
    pub const ALL: [GroupNumber; 4] =
        [GroupNumber::One, GroupNumber::Two, GroupNumber::Three, GroupNumber::Four];

    /// The number of the group in flash. A number is never reused for another purpose.
    pub(crate) const fn id(self) -> u8 {
        self as u8
    }

    pub(crate) fn from_id(id: u8) -> Option<GroupNumber> {
        GroupNumber::ALL.into_iter().find(|number| number.id() == id)
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
        group: GroupNumber,
        /// Version of the value's layout; `load` returns it so that the caller can migrate or refuse old data.
        version: u16,
        /// The value, at most [`crate::MAX_VALUE`] bytes. It may be empty.
        value: &'a [u8],
    },
    /// The group has no stored value any more: the caller's defaults hold.
    Restore(GroupNumber),
}

impl Change<'_> {
    /// The changed group.
    #[must_use]
    pub fn group(&self) -> GroupNumber {
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

    pub(crate) fn contains(self, group: GroupNumber) -> bool {
        self.0 & GroupSet::bit(group) != 0
    }

    pub(crate) fn insert(&mut self, group: GroupNumber) {
        self.0 |= GroupSet::bit(group);
    }

    /// The groups of this set that are not in the other set.
    pub(crate) fn without(self, other: GroupSet) -> GroupSet {
        GroupSet(self.0 & !other.0)
    }

    fn bit(group: GroupNumber) -> u8 {
        1 << (group.id() - 1)
    }
}

/// One `T` for each group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PerGroup<T>([T; 4]);

impl<T> PerGroup<T> {
    pub(crate) fn from_fn(mut make: impl FnMut(GroupNumber) -> T) -> PerGroup<T> {
        PerGroup(GroupNumber::ALL.map(&mut make))
    }

    pub(crate) fn get(&self, group: GroupNumber) -> &T {
        let [one, two, three, four] = &self.0;
        match group {
            GroupNumber::One => one,
            GroupNumber::Two => two,
            GroupNumber::Three => three,
            GroupNumber::Four => four,
        }
    }

    pub(crate) fn get_mut(&mut self, group: GroupNumber) -> &mut T {
        let [one, two, three, four] = &mut self.0;
        match group {
            GroupNumber::One => one,
            GroupNumber::Two => two,
            GroupNumber::Three => three,
            GroupNumber::Four => four,
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (GroupNumber, &T)> {
        GroupNumber::ALL.into_iter().zip(&self.0)
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (GroupNumber, &mut T)> {
        GroupNumber::ALL.into_iter().zip(&mut self.0)
    }
}
