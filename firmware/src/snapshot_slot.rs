//! The slot snapshot, on its way from the sampling task to that of the process data.

use node::Snapshot;

/// Written in its place and copied once: a thousand times a second, a copy of some hundred bytes counts.
#[derive(Default)]
pub struct SnapshotSlot {
    snapshot: Snapshot,
    is_new: bool,
}

impl SnapshotSlot {
    /// The place of the next one.
    pub(crate) fn renew(&mut self) -> &mut Snapshot {
        self.is_new = true;
        &mut self.snapshot
    }

    /// Copies the one that nobody has taken yet; false when there is none.
    pub(crate) fn take(&mut self, to: &mut Snapshot) -> bool {
        if self.is_new {
            *to = self.snapshot;
        }
        core::mem::take(&mut self.is_new)
    }
}
