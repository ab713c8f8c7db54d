//! The transmit queue of the driver as the protocols use it.

use crate::{Frame, Span, Tick};

/// The queue has no room. The sender keeps the frame and tries again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct QueueFull;

impl core::fmt::Display for QueueFull {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the transmit queue is full")
    }
}

impl core::error::Error for QueueFull {}

/// A transmit queue. It never blocks. It should hold about twenty frames: PDOs leave room for four other frames, events
/// among them for twelve, a block upload for ten, on a [`ServiceDevice`](crate::ServiceDevice) for two.
pub trait Transmit {
    /// Queues one frame.
    ///
    /// # Errors
    /// `QueueFull` when there is no room; the frame is then not queued.
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull>;

    /// Queues a frame with a present state: a heartbeat or a PDO. While the frame waits, a newer frame with the same
    /// identifier may replace it. A queue without this feature sends both.
    ///
    /// # Errors
    /// `QueueFull` when there is no room; the frame is then not queued.
    fn send_state(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.send(frame)
    }

    /// Queues the boot-up message. No frame that is queued later may overtake it, whatever the identifiers: a node must
    /// not send anything before its boot-up message (CiA 301, 7.3.2.2). A queue that keeps the order of its frames does
    /// so anyway.
    ///
    /// # Errors
    /// `QueueFull` when there is no room; the frame is then not queued.
    fn send_boot_up(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.send(frame)
    }

    /// How many frames `send` would take now.
    fn room(&self) -> usize;

    /// Whether [`send_state`](Transmit::send_state) would replace a waiting frame with this CAN-ID. Such a frame costs no
    /// share of the bus.
    fn replaces(&self, _id: u16) -> bool {
        false
    }

    /// Whether a queued PDO waits for the bus: a frame with a CAN-ID up to [`CanId::LAST_PDO`](crate::CanId::LAST_PDO). While
    /// other nodes hold the bus, a device earns no share of the time for its PDOs, so that less urgent frames get through. A
    /// queue that cannot tell returns `false`.
    fn has_waiting_pdo(&self) -> bool {
        false
    }
}

/// One call of the device: its time and the transmit queue. While the bit rate changes, the queue is closed: it accepts
/// no frame, and the senders try again later.
pub(crate) struct Context<'a, T> {
    pub(crate) now: Tick,
    pub(crate) out: &'a mut T,
    pub(crate) is_open: bool,
}

impl<T: Transmit> Context<'_, T> {
    /// Queues a frame. `false` when there is no room.
    pub(crate) fn send(&mut self, frame: Frame) -> bool {
        self.is_open && self.out.send(frame).is_ok()
    }

    /// Queues the boot-up message. `false` when there is no room.
    pub(crate) fn send_boot_up(&mut self, frame: Frame) -> bool {
        self.is_open && self.out.send_boot_up(frame).is_ok()
    }

    /// Queues a frame that a newer frame may replace. `false` when there is no room.
    pub(crate) fn send_state(&mut self, frame: Frame) -> bool {
        self.is_open && self.out.send_state(frame).is_ok()
    }

    /// How many frames `send` would take now.
    pub(crate) fn room(&self) -> usize {
        if self.is_open { self.out.room() } else { 0 }
    }
}

/// When to try again after `QueueFull`.
pub(crate) const RETRY: Span = Span::from_millis(1);
