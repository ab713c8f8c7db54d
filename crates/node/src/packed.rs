//! The packed values of the storage groups, in the form that the parameter store holds.

use canopen::dictionary::Group;
use heapless::{Vec, VecView};
use storage::{DeviceRecord, GroupNumber};

const COMMUNICATION: usize = profiles::packed_size(Group::Communication);
const APPLICATION: usize = profiles::packed_size(Group::Application);
const CALIBRATION: usize = profiles::packed_size(Group::Calibration);
const _: () = assert!(COMMUNICATION <= storage::MAX_VALUE && APPLICATION <= storage::MAX_VALUE);
const _: () = assert!(CALIBRATION <= storage::MAX_VALUE);

/// The longest values of the parameter store in bytes, by group number.
pub(crate) const LONGEST: [usize; 4] = [DeviceRecord::ROOM, COMMUNICATION, APPLICATION, CALIBRATION];

/// The packed values of every group, with room for the largest dictionary. Empty values are all zeros, so the initial
/// value needs no copy in flash.
#[derive(Debug)]
pub(crate) struct PackedGroups {
    communication: Vec<u8, COMMUNICATION>,
    application: Vec<u8, APPLICATION>,
    calibration: Vec<u8, CALIBRATION>,
}

impl PackedGroups {
    pub(crate) const EMPTY: PackedGroups =
        PackedGroups { communication: Vec::new(), application: Vec::new(), calibration: Vec::new() };

    pub(crate) fn get(&self, group: Group) -> &[u8] {
        match group {
            Group::Communication => &self.communication,
            Group::Application => &self.application,
            _ => &self.calibration,
        }
    }

    fn get_mut(&mut self, group: Group) -> &mut VecView<u8> {
        match group {
            Group::Communication => self.communication.as_mut_view(),
            Group::Application => self.application.as_mut_view(),
            _ => self.calibration.as_mut_view(),
        }
    }

    /// Gives `fill` all the room of a group; `fill` returns the number of bytes in use.
    pub(crate) fn fill(&mut self, group: Group, fill: impl FnOnce(&mut [u8]) -> usize) {
        let values = self.get_mut(group);
        values.clear();
        let _ = values.resize(values.capacity(), 0);
        let len = fill(values);
        values.truncate(len);
    }

    /// Takes these values; returns whether there is room for them.
    pub(crate) fn replace(&mut self, group: Group, packed: &[u8]) -> bool {
        let values = self.get_mut(group);
        values.clear();
        values.extend_from_slice(packed).is_ok()
    }
}

/// Under which number the parameter store holds a group. One is the device record.
pub(crate) const fn number_of(group: Group) -> GroupNumber {
    match group {
        Group::Communication => GroupNumber::Two,
        Group::Application => GroupNumber::Three,
        _ => GroupNumber::Four,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_group_has_a_number_of_its_own() {
        let [first, second, third] = Group::COMMON.map(number_of);
        assert!(first != second && second != third && first != third);
        assert!(Group::COMMON.iter().all(|group| number_of(*group) != storage::DeviceRecord::NUMBER));
    }
}
