//! Bugs that a test seeds into a program: what the program stores into a register is not what its source says. For the rest of the
//! program and for the chip that is the same as a wrong constant, or a line that is missing.

use chip::Peripherals;

use crate::machine::Machine;

/// A wrong store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bug {
    /// The address of the register, a multiple of 4.
    pub register: u32,
    /// What becomes of a store there.
    pub store: Store,
}

/// What becomes of a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Store {
    /// The line is missing.
    Missing,
    /// These bits of the word are others.
    Wrong {
        /// Which.
        bits: u32,
        /// What they are, in their places.
        value: u32,
    },
}

impl Store {
    /// What is stored in place of a value of `size` bytes from byte `lane` of the word on.
    fn instead_of(self, value: u32, lane: u32, size: usize) -> Option<u32> {
        let Store::Wrong { bits, value: wrong } = self else { return None };
        let width = u32::MAX >> (32 - 8 * size);
        let (bits, wrong) = (bits >> (8 * lane) & width, wrong >> (8 * lane));
        Some(value & !bits | wrong & bits)
    }
}

/// The bugs of a program.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bugs(Vec<Bug>);

impl Bugs {
    /// What a program stores that has these bugs; `None` where it stores nothing.
    pub(crate) fn stored(&self, address: u32, size: usize, value: u32) -> Option<u32> {
        let of_register = self.0.iter().filter(|bug| bug.register == address & !3);
        of_register
            .map(|bug| bug.store)
            .try_fold(value, |value, store| store.instead_of(value, address & 3, size))
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

    fn stored(store: Store, address: u32, size: usize, value: u32) -> Option<u32> {
        Bugs(vec![Bug { register: REGISTER, store }]).stored(address, size, value)
    }

    #[test]
    fn bits_are_wrong_in_words_and_in_bytes_of_them() {
        let wrong = Store::Wrong { bits: 0x0000_FF0F, value: 0x0000_8805 };
        assert_eq!(stored(wrong, REGISTER, 4, 0x1234_99A0), Some(0x1234_88A5));
        assert_eq!(stored(wrong, REGISTER + 1, 1, 0x99), Some(0x88));
        assert_eq!(stored(wrong, REGISTER + 2, 2, 0x1234), Some(0x1234));
        assert_eq!(stored(wrong, REGISTER + 4, 4, 0x1234_99A0), Some(0x1234_99A0));
    }

    #[test]
    fn a_line_is_missing() {
        assert_eq!(stored(Store::Missing, REGISTER, 4, 1), None);
        assert_eq!(stored(Store::Missing, REGISTER + 4, 4, 1), Some(1));
    }
}
