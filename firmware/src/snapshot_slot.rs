//! The slot for the snapshot, from the sampling task to the process data task.

use node::Snapshot;

/// The snapshot is written in its place and copied once: a thousand times a second, each copy of some hundred bytes
/// matters.
#[derive(Default)]
pub struct SnapshotSlot {
    snapshot: Snapshot,
    is_new: bool,
}

impl SnapshotSlot {
    /// The place for the next snapshot.
    pub(crate) fn renew(&mut self) -> &mut Snapshot {
        self.is_new = true;
        &mut self.snapshot
    }

    /// Copies a snapshot that has not been taken yet; false without a new one.
    pub(crate) fn take(&mut self, to: &mut Snapshot) -> bool {
        if self.is_new {
            *to = self.snapshot;
        }
        core::mem::take(&mut self.is_new)
    }
}
