//! Bugs that a test seeds into a program: a store of the program into a register, or a read of one, is changed. For the
//! rest of the program and for the chip, this has the same effect as a wrong constant or a missing line.

use chip::Peripherals;

use crate::machine::Machine;

/// A seeded bug: a wrong access to a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bug {
    /// The address of the register, a multiple of 4.
    pub register: u32,
    /// The change of the access.
    pub access: Access,
}

/// The change of an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The store is missing.
    Missing,
    /// These bits of a stored word have a wrong value.
    Wrong {
        /// The changed bits.
        bits: u32,
        /// The wrong value, in the positions of the bits.
        value: u32,
    },
    /// The program ignores these bits: they read as zero.
    Unseen {
        /// The ignored bits.
        bits: u32,
    },
    /// A read waits neither for a store on its way to the same bus nor for the bus, as if it were not there. The first shows
    /// after [`Machine::interleave`] only.
    Unordered,
}

impl Access {
    /// The value stored instead of `value`, which has `size` bytes from byte `lane` of the word on; `None` if the store
    /// is missing.
    fn instead_of(self, value: u32, lane: u32, size: usize) -> Option<u32> {
        let (bits, wrong) = match self {
            Access::Missing => return None,
            Access::Wrong { bits, value } => (bits, value),
            Access::Unseen { .. } | Access::Unordered => (0, 0),
        };
        let width = u32::MAX >> (32 - 8 * size);
        let (bits, wrong) = (bits >> (8 * lane) & width, wrong >> (8 * lane));
        Some(value & !bits | wrong & bits)
    }

    /// The value read instead of `value`, which begins at byte `lane` of the word.
    fn seen_of(self, value: u32, lane: u32) -> u32 {
        let Access::Unseen { bits } = self else { return value };
        value & !(bits >> (8 * lane))
    }
}

/// The seeded bugs of a program.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bugs(Vec<Bug>);

impl Bugs {
    /// The value that the program stores with its bugs; `None` if the store is missing.
    pub(crate) fn stored(&self, address: u32, size: usize, value: u32) -> Option<u32> {
        self.of(address).try_fold(value, |value, access| access.instead_of(value, address & 3, size))
    }

    /// The value that the program reads with its bugs.
    pub(crate) fn seen(&self, address: u32, value: u32) -> u32 {
        self.of(address).fold(value, |value, access| access.seen_of(value, address & 3))
    }

    /// Whether a read of the register does not wait for earlier stores.
    pub(crate) fn ignores_order(&self, address: u32) -> bool {
        self.of(address).any(|access| access == Access::Unordered)
    }

    fn of(&self, address: u32) -> impl Iterator<Item = Access> {
        self.0.iter().filter(move |bug| bug.register == address & !3).map(|bug| bug.access)
    }
}

impl<P: Peripherals + 'static> Machine<P> {
    /// Seeds a bug into the program, from now on.
    pub fn seed(&mut self, bug: Bug) {
        self.cpu.get_data_mut().bugs.0.push(bug);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REGISTER: u32 = 0x4000_0000;

    fn stored(access: Access, address: u32, size: usize, value: u32) -> Option<u32> {
        Bugs(vec![Bug { register: REGISTER, access }]).stored(address, size, value)
    }

    #[test]
    fn bits_are_wrong_in_words_and_in_bytes_of_them() {
        let wrong = Access::Wrong { bits: 0x0000_FF0F, value: 0x0000_8805 };
        assert_eq!(stored(wrong, REGISTER, 4, 0x1234_99A0), Some(0x1234_88A5));
        assert_eq!(stored(wrong, REGISTER + 1, 1, 0x99), Some(0x88));
        assert_eq!(stored(wrong, REGISTER + 2, 2, 0x1234), Some(0x1234));
        assert_eq!(stored(wrong, REGISTER + 4, 4, 0x1234_99A0), Some(0x1234_99A0));
    }

    #[test]
    fn a_line_is_missing() {
        assert_eq!(stored(Access::Missing, REGISTER, 4, 1), None);
        assert_eq!(stored(Access::Missing, REGISTER + 4, 4, 1), Some(1));
    }
    #[test]
    fn unseen_bits_read_as_zero() {
        let bugs = Bugs(vec![Bug { register: REGISTER, access: Access::Unseen { bits: 0x0120 } }]);
        assert_eq!(bugs.seen(REGISTER, 0x0FFF), 0x0EDF);
        assert_eq!(bugs.seen(REGISTER + 1, 0x0F), 0x0E);
        assert_eq!(bugs.seen(REGISTER + 4, 0x0FFF), 0x0FFF);
        assert_eq!(bugs.stored(REGISTER, 4, 0x0FFF), Some(0x0FFF));
    }
}
