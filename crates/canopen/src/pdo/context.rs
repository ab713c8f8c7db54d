//! One call of the device for its process data.

use super::Budget;
use crate::{Frame, Tick, Transmit};

/// One call of the device for its process data, which have a share of the bus.
pub(crate) struct ProcessContext<'a, T> {
    pub(crate) now: Tick,
    pub(crate) out: &'a mut T,
    pub(crate) is_open: bool,
    pub(crate) budget: &'a mut Budget,
}

impl<T: Transmit> ProcessContext<'_, T> {
    /// Queues a PDO with present values, which a newer one may replace. `false` when there is no room beside the services,
    /// or the process data have taken their share of the bus.
    #[inline]
    pub(crate) fn send_pdo(&mut self, frame: Frame) -> bool {
        let (id, len) = (frame.id(), frame.len());
        let replaces = self.out.replaces(id);
        let is_admitted =
            self.room() > ROOM_FOR_SERVICES && (replaces || self.budget.admits(id, len, self.now));
        is_admitted && self.out.send_state(frame).is_ok() && (replaces || self.spend(len))
    }

    /// Queues a PDO that no newer one may replace: a multiplexed PDO, or one with an event. `false` when there is no room
    /// beside all others, or the process data have taken their share of the bus.
    pub(crate) fn send_event(&mut self, frame: Frame) -> bool {
        let len = frame.len();
        self.takes_event(frame.id(), len) && self.out.send(frame).is_ok() && self.spend(len)
    }

    /// Queues a SYNC or a time stamp. `false` when there is no room.
    pub(crate) fn send(&mut self, frame: Frame) -> bool {
        self.is_open && self.out.send(frame).is_ok()
    }

    /// Whether `send_event` would take a frame with this CAN-ID and number of bytes now.
    pub(crate) fn takes_event(&mut self, id: u16, len: usize) -> bool {
        self.room() > ROOM_FOR_OTHERS && self.budget.admits(id, len, self.now)
    }

    fn spend(&mut self, len: usize) -> bool {
        self.budget.spend(len);
        true
    }

    fn room(&self) -> usize {
        if self.is_open { self.out.room() } else { 0 }
    }
}

/// Free places that PDOs leave in the queue: for a heartbeat, an EMCY, an SDO response and an LSS response.
const ROOM_FOR_SERVICES: usize = 4;

/// Free places that events leave in the queue. The bus may be busy for minutes, but events can wait in the application.
/// A block upload, which leaves fewer places, continues beside them.
const ROOM_FOR_OTHERS: usize = 12;
