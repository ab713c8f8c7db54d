//! The data that the sampling task shares with other tasks: one resource, so that a sample takes one lock.

use node::{Parameters, Snapshot};
use profiles::board::RETAINED_WORDS;

/// The words retained by the last sample; `None` if the profile retains nothing.
pub(crate) type Retained = Option<[u32; RETAINED_WORDS]>;

/// New parameters for the sampling task, and the results of the last sample.
pub struct Exchange {
    /// New parameters, until the sampling task has taken them.
    pub(crate) parameters: Option<Parameters>,
    /// The words retained by the last sample.
    pub(crate) retained: Retained,
    snapshot: Snapshot,
    is_new: bool,
}

impl Exchange {
    /// With the parameters for the first sample.
    pub(crate) fn new(parameters: Parameters) -> Exchange {
        Exchange {
            parameters: Some(parameters),
            retained: None,
            snapshot: Snapshot::default(),
            is_new: false,
        }
    }

    /// The place for the next snapshot. The snapshot is written in its place and copied once: a thousand times a second,
    /// each copy of some hundred bytes matters.
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
