//! Events that were lost, counted by an interrupt and collected by a task of a lower priority.

use core::sync::atomic::{AtomicU32, Ordering};

/// A number of losses since it was last collected.
#[derive(Debug, Default)]
pub struct Losses(AtomicU32);

impl Losses {
    /// None.
    #[must_use]
    pub const fn new() -> Losses {
        Losses(AtomicU32::new(0))
    }

    /// One more.
    pub fn count(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// How many, and starts again from zero.
    pub fn take(&self) -> u32 {
        self.0.swap(0, Ordering::Relaxed)
    }
}
