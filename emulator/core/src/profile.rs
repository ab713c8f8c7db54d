//! Counts of how often each block of code ran, to show where the instructions are spent.

use std::collections::BTreeMap;

/// The counts of each block, while profiling is on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Profile {
    pub(crate) is_on: bool,
    visits: BTreeMap<(u32, u32), u64>,
}

/// A block of code and its count. A block may begin in the middle of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visits {
    /// The address of the block.
    pub address: u32,
    /// The length of the block in bytes.
    pub size: u32,
    /// The number of runs.
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
