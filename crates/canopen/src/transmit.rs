//! Where frames go: the driver's transmit queue as the protocol sees it.

use crate::{Duration, Frame};

/// The queue has no room; the sender keeps what it wanted to send and tries again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueueFull;

/// A transmit queue. It never blocks. It should hold some twenty frames: a block upload leaves room for ten others.
pub trait Transmit {
    /// Queues one frame.
    ///
    /// # Errors
    /// `QueueFull` when there is no room; the frame is then not queued.
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull>;

    /// How many frames `send` would take now.
    fn room(&self) -> usize;
}

/// A queue that can be shut: it then takes nothing, and the senders try again later.
pub(crate) struct Gate<'a, T> {
    pub(crate) out: &'a mut T,
    pub(crate) is_open: bool,
}

impl<T: Transmit> Transmit for Gate<'_, T> {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        if self.is_open { self.out.send(frame) } else { Err(QueueFull) }
    }

    fn room(&self) -> usize {
        if self.is_open { self.out.room() } else { 0 }
    }
}

/// When to try again after `QueueFull`.
pub(crate) const RETRY: Duration = Duration::from_millis(1);
