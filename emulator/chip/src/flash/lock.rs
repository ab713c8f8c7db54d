//! The locks of FLASH_CR and FLASH_OPTCR: two keys in the right order open a lock.

use crate::peripherals::BusFault;

/// The keys of FLASH_CR (RM0390 section 3.5.1).
pub(super) const CONTROL_KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// The keys of FLASH_OPTCR (RM0390 section 3.6.2).
pub(super) const OPTION_KEYS: [u32; 2] = [0x0819_2A3B, 0x4C5D_6E7F];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Locked,
    FirstKey,
    Open,
    /// A wrong key was written: the lock stays closed until the next reset.
    Dead,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Lock {
    keys: [u32; 2],
    state: State,
}

impl Lock {
    pub(super) fn new(keys: [u32; 2]) -> Self {
        Self { keys, state: State::Locked }
    }

    pub(super) fn is_open(self) -> bool {
        self.state == State::Open
    }

    /// Takes a key; a wrong key is a bus error.
    pub(super) fn take(&mut self, key: u32) -> Result<(), BusFault> {
        self.state = match self.state {
            State::Locked if key == self.keys[0] => State::FirstKey,
            State::FirstKey if key == self.keys[1] => State::Open,
            State::Open => State::Open,
            _ => State::Dead,
        };
        if self.state == State::Dead { Err(BusFault) } else { Ok(()) }
    }

    /// Closes an open lock.
    pub(super) fn close(&mut self) {
        if self.is_open() {
            self.state = State::Locked;
        }
    }
}
