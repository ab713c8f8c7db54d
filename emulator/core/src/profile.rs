//! How often each block of code ran, for whoever asks where the instructions go.

use std::collections::BTreeMap;

/// Instructions by block, while it is switched on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Profile {
    pub(crate) is_on: bool,
    visits: BTreeMap<(u32, u32), u64>,
}

/// A block of code that ran: a block may begin in the middle of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visits {
    /// Where it begins.
    pub address: u32,
    /// Its length in bytes.
    pub size: u32,
    /// How often it ran.
    pub count: u64,
}

impl Profile {
    #[inline]
    pub(crate) fn visit(&mut self, address: u32, size: u32) {
        if self.is_on {
            self.count(address, size);
        }
    }

    #[cold]
    fn count(&mut self, address: u32, size: u32) {
        *self.visits.entry((address, size)).or_default() += 1;
    }

    pub(crate) fn take(&mut self) -> Vec<Visits> {
        let visits = std::mem::take(&mut self.visits);
        visits.into_iter().map(|((address, size), count)| Visits { address, size, count }).collect()
    }
}
