//! The parameter groups and what is said of each.

/// The number of a group in flash. What a group holds is the business of the caller, but for [`DeviceRecord::NUMBER`]. A
/// number is never used again for another purpose.
///
/// [`DeviceRecord::NUMBER`]: crate::DeviceRecord::NUMBER
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs)] // A number says nothing but itself.
pub enum Number {
    One = 1,
    Two,
    Three,
    Four,
}

impl Number {
    /// All of them, in the order in which a transaction holds their groups.
    pub const ALL: [Number; 4] = [Number::One, Number::Two, Number::Three, Number::Four];

    /// As it stands in flash.
    pub(crate) const fn id(self) -> u8 {
        self as u8
    }

    pub(crate) fn from_id(id: u8) -> Option<Number> {
        Number::ALL.into_iter().find(|number| number.id() == id)
    }
}

/// Whether the newest values of a group could be read, as found when the store was opened.
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
        group: Number,
        /// Version of the value's layout; `load` hands it back so that the caller can migrate or refuse old data.
        version: u16,
        /// The value, at most [`crate::MAX_VALUE`] bytes. Empty is a value too.
        value: &'a [u8],
    },
    /// The group has no stored value any more: the caller's defaults hold.
    Restore(Number),
}

impl Change<'_> {
    /// The group that changes.
    #[must_use]
    pub fn group(&self) -> Number {
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

    pub(crate) fn contains(self, group: Number) -> bool {
        self.0 & GroupSet::bit(group) != 0
    }

    pub(crate) fn insert(&mut self, group: Number) {
        self.0 |= GroupSet::bit(group);
    }

    /// The groups of this set that are not in the other.
    pub(crate) fn without(self, other: GroupSet) -> GroupSet {
        GroupSet(self.0 & !other.0)
    }

    fn bit(group: Number) -> u8 {
        1 << (group.id() - 1)
    }
}

/// One `T` for each group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PerGroup<T>([T; 4]);

impl<T> PerGroup<T> {
    pub(crate) fn from_fn(mut make: impl FnMut(Number) -> T) -> PerGroup<T> {
        PerGroup(Number::ALL.map(&mut make))
    }

    pub(crate) fn get(&self, group: Number) -> &T {
        let [one, two, three, four] = &self.0;
        match group {
            Number::One => one,
            Number::Two => two,
            Number::Three => three,
            Number::Four => four,
        }
    }

    pub(crate) fn get_mut(&mut self, group: Number) -> &mut T {
        let [one, two, three, four] = &mut self.0;
        match group {
            Number::One => one,
            Number::Two => two,
            Number::Three => three,
            Number::Four => four,
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (Number, &T)> {
        Number::ALL.into_iter().zip(&self.0)
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (Number, &mut T)> {
        Number::ALL.into_iter().zip(&mut self.0)
    }
}
