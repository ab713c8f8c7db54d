//! Bugs that a test seeds into a program: what the program stores into a register, or sees of one, is not what its source says. For the
//! rest of the program and for the chip that is the same as a wrong constant, or a line that is missing.

use chip::Peripherals;

use crate::machine::Machine;

/// A register that is used wrongly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bug {
    /// The address of the register, a multiple of 4.
    pub register: u32,
    /// What becomes of an access.
    pub access: Access,
}

/// What becomes of an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Nothing is stored: the line is missing.
    Missing,
    /// These bits of a word that is stored are others.
    Wrong {
        /// Which.
        bits: u32,
        /// What they are, in their places.
        value: u32,
    },
    /// The program does not look at these bits: they read as zero.
    Unseen {
        /// Which.
        bits: u32,
    },
}

impl Access {
    /// What is stored in place of a value of `size` bytes from byte `lane` of the word on.
    fn instead_of(self, value: u32, lane: u32, size: usize) -> Option<u32> {
        let (bits, wrong) = match self {
            Access::Missing => return None,
            Access::Wrong { bits, value } => (bits, value),
            Access::Unseen { .. } => (0, 0),
        };
        let width = u32::MAX >> (32 - 8 * size);
        let (bits, wrong) = (bits >> (8 * lane) & width, wrong >> (8 * lane));
        Some(value & !bits | wrong & bits)
    }

    /// What is seen in place of a value from byte `lane` of the word on.
    fn seen_of(self, value: u32, lane: u32) -> u32 {
        let Access::Unseen { bits } = self else { return value };
        value & !(bits >> (8 * lane))
    }
}

/// The bugs of a program.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bugs(Vec<Bug>);

impl Bugs {
    /// What a program stores that has these bugs; `None` where it stores nothing.
    pub(crate) fn stored(&self, address: u32, size: usize, value: u32) -> Option<u32> {
        self.of(address).try_fold(value, |value, access| access.instead_of(value, address & 3, size))
    }

    /// What a program sees that has these bugs.
    pub(crate) fn seen(&self, address: u32, value: u32) -> u32 {
        self.of(address).fold(value, |value, access| access.seen_of(value, address & 3))
    }

    fn of(&self, address: u32) -> impl Iterator<Item = Access> {
        self.0.iter().filter(move |bug| bug.register == address & !3).map(|bug| bug.access)
    }
}

impl<P: Peripherals + 'static> Machine<P> {
    /// Has the program do this from now on.
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
    fn bits_that_nobody_looks_at_read_as_zero() {
        let bugs = Bugs(vec![Bug { register: REGISTER, access: Access::Unseen { bits: 0x0120 } }]);
        assert_eq!(bugs.seen(REGISTER, 0x0FFF), 0x0EDF);
        assert_eq!(bugs.seen(REGISTER + 1, 0x0F), 0x0E);
        assert_eq!(bugs.seen(REGISTER + 4, 0x0FFF), 0x0FFF);
        assert_eq!(bugs.stored(REGISTER, 4, 0x0FFF), Some(0x0FFF));
    }
}
