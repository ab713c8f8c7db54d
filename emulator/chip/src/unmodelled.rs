//! The record of accesses that the models answer differently from silicon.

use std::collections::BTreeMap;
use std::fmt;

/// The direction of an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Direction {
    /// A load.
    Read,
    /// A store.
    Write,
}

/// The reason why an access is recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Reason {
    /// The chip has this register or setting, but the model does not.
    NotModelled,
    /// The clock of the peripheral is off or its reset is held: silicon reads 0 and ignores writes.
    ClockOff,
    /// The backup domain cannot be written (PWR_CR, DBP): silicon ignores writes.
    Protected,
}

/// Accesses of one kind to one register.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unmodelled {
    /// Peripheral and offset, for example `TIM3+0x44`.
    pub name: String,
    /// Absolute address of the register.
    pub address: u32,
    /// Loads or stores.
    pub direction: Direction,
    /// Why the access is recorded.
    pub reason: Reason,
    /// Number of accesses.
    pub count: u64,
}

impl fmt::Display for Unmodelled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let direction = match self.direction {
            Direction::Read => "read",
            Direction::Write => "write",
        };
        let reason = match self.reason {
            Reason::NotModelled => "not modelled",
            Reason::ClockOff => "clock is off",
            Reason::Protected => "backup domain is protected",
        };
        write!(f, "{} ({:#010x}) {direction}: {reason}, {} times", self.name, self.address, self.count)
    }
}

/// The record, one entry for each register, direction and reason.
#[derive(Clone, Default)]
pub(crate) struct Record {
    entries: BTreeMap<(u32, Direction, Reason), Unmodelled>,
}

impl Record {
    pub(crate) fn add(&mut self, name: &str, base: u32, offset: u32, direction: Direction, reason: Reason) {
        let address = base + offset;
        let fresh =
            || Unmodelled { name: format!("{name}+{offset:#04x}"), address, direction, reason, count: 0 };
        self.entries.entry((address, direction, reason)).or_insert_with(fresh).count += 1;
    }

    pub(crate) fn list(&self) -> Vec<Unmodelled> {
        self.entries.values().cloned().collect()
    }
}
