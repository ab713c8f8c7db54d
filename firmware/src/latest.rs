//! The latest snapshot, on its way from the sampling task to that of the process data.

use node::Snapshot;

/// Written in its place: a thousand times a second, a copy of some hundred bytes counts.
#[derive(Default)]
pub struct Latest {
    snapshot: Snapshot,
    is_new: bool,
}

impl Latest {
    /// The place of the next one.
    pub(crate) fn renew(&mut self) -> &mut Snapshot {
        self.is_new = true;
        &mut self.snapshot
    }

    /// The one that nobody has taken yet.
    pub(crate) fn take(&mut self) -> Option<Snapshot> {
        core::mem::take(&mut self.is_new).then_some(self.snapshot)
    }
}
