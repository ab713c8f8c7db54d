//! Frames that wait for a mailbox, in the order of sending. The bootloader sends no process data that would have to go
//! first.

use bsp::Transmitter;
use canopen::{Frame, QueueFull, Transmit};

/// A response, a heartbeat, LSS, and as much again: a client waits for the answer before it sends the next request.
const CAPACITY: usize = 8;

/// The queue, a ring buffer.
pub(crate) struct Outbox {
    frames: [Option<Frame>; CAPACITY],
    first: usize,
}

impl Outbox {
    pub(crate) const fn new() -> Outbox {
        Outbox { frames: [None; CAPACITY], first: 0 }
    }

    /// Drops all waiting frames.
    pub(crate) fn clear(&mut self) {
        self.frames.iter_mut().for_each(|place| *place = None);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.frames.iter().all(Option::is_none)
    }

    /// Moves frames into free mailboxes.
    pub(crate) fn pump(&mut self, transmitter: &mut Transmitter) {
        while let Some(place) = self.frames.get_mut(self.first)
            && place.as_ref().is_some_and(|frame| transmitter.put(frame))
        {
            *place = None;
            self.first = (self.first + 1) % CAPACITY;
        }
    }
}

impl Transmit for Outbox {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        let used = CAPACITY - self.room();
        match self.frames.get_mut((self.first + used) % CAPACITY) {
            Some(place @ None) => *place = Some(frame),
            _ => return Err(QueueFull),
        }
        Ok(())
    }

    fn room(&self) -> usize {
        self.frames.iter().filter(|place| place.is_none()).count()
    }
}
