//! Frames that wait for a transmit mailbox: in the order of their CAN-ID, first in first out among equals.
//!
//! The bus itself prefers the lowest identifier. A plain queue in front of the mailboxes would undo that: a heartbeat
//! that came first would hold up a SYNC (priority inversion).

use canopen::{Frame, QueueFull, Transmit};
use heapless::Vec;

/// Most frames that wait.
pub const CAPACITY: usize = 32;

/// What became of a frame that was offered to the mailboxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offer {
    /// It is in a mailbox that was free.
    Taken,
    /// It is in the mailbox of this less urgent frame, which must be queued again.
    Replaced(Frame),
    /// It has to wait.
    Refused,
}

/// The transmit mailboxes of a controller.
pub trait Mailboxes {
    /// Puts a frame into a mailbox when that keeps the order on the bus.
    fn offer(&mut self, frame: &Frame) -> Offer;
}

/// The queue.
#[derive(Debug, Default)]
pub struct TransmitQueue {
    /// The most urgent frame is the last one.
    frames: Vec<Frame, CAPACITY>,
}

impl TransmitQueue {
    /// An empty queue.
    #[must_use]
    pub const fn new() -> TransmitQueue {
        TransmitQueue { frames: Vec::new() }
    }

    /// Moves frames into the mailboxes until they take no more.
    pub fn pump(&mut self, mailboxes: &mut impl Mailboxes) {
        while let Some(frame) = self.frames.last() {
            match mailboxes.offer(frame) {
                Offer::Refused => return,
                Offer::Taken => drop(self.frames.pop()),
                Offer::Replaced(other) => {
                    self.frames.pop();
                    // The frame that left made room for this one.
                    let _ = self.push_first(other);
                }
            }
        }
    }

    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Drops everything that waits.
    pub fn clear(&mut self) {
        self.frames.clear();
    }

    /// Adds a frame before those of its identifier: it was taken before them.
    fn push_first(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.insert(self.frames.partition_point(|other| other.id() >= frame.id()), frame)
    }

    /// Moves what is behind the place one further. `Vec::insert` panics at a place behind the end.
    fn insert(&mut self, index: usize, frame: Frame) -> Result<(), QueueFull> {
        if self.frames.is_full() {
            return Err(QueueFull);
        }
        let mut moved = frame;
        for place in self.frames.iter_mut().skip(index) {
            core::mem::swap(place, &mut moved);
        }
        self.frames.push(moved).map_err(|_| QueueFull)
    }
}

impl Transmit for TransmitQueue {
    /// Adds a frame behind those of its identifier.
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.insert(self.frames.partition_point(|other| other.id() > frame.id()), frame)
    }

    fn room(&self) -> usize {
        CAPACITY - self.frames.len()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// Mailboxes that behave as bxCAN under its driver: strictly more urgent frames only, the least urgent one gives way.
    #[derive(Default)]
    struct Fake {
        pending: Vec<Frame>,
    }

    impl Mailboxes for Fake {
        fn offer(&mut self, frame: &Frame) -> Offer {
            if self.pending.iter().any(|other| other.id() <= frame.id()) {
                return Offer::Refused;
            }
            self.pending.push(*frame);
            if self.pending.len() <= 3 { Offer::Taken } else { Offer::Replaced(self.pending.remove(0)) }
        }
    }

    impl Fake {
        fn send(&mut self) -> Option<Frame> {
            self.pending.pop()
        }
    }

    fn frame(id: u16, tag: u8) -> Frame {
        Frame::new(id, &[tag]).unwrap()
    }

    fn sent(queue: &mut TransmitQueue, bus: &mut Fake) -> Vec<(u16, u8)> {
        let mut order = Vec::new();
        loop {
            queue.pump(bus);
            let Some(frame) = bus.send() else { return order };
            order.push((frame.id(), frame.data()[0]));
        }
    }

    #[test]
    fn the_lowest_identifier_leaves_first_and_equals_in_their_order() {
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        for (tag, id) in [0x701, 0x181, 0x581, 0x181, 0x080, 0x581].into_iter().enumerate() {
            queue.send(frame(id, u8::try_from(tag).unwrap())).unwrap();
        }
        let order = sent(&mut queue, &mut bus);
        assert_eq!(order, [(0x080, 4), (0x181, 1), (0x181, 3), (0x581, 2), (0x581, 5), (0x701, 0)]);
    }

    #[test]
    fn a_replaced_frame_keeps_its_place_before_its_equals() {
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        for (id, tag) in [(0x701, 0), (0x701, 1)] {
            queue.send(frame(id, tag)).unwrap();
            queue.pump(&mut bus);
        }
        for id in [0x581, 0x281, 0x181] {
            queue.send(frame(id, 2)).unwrap();
            queue.pump(&mut bus);
        }
        assert_eq!(bus.pending.len(), 3, "the heartbeat gave way");
        let order = sent(&mut queue, &mut bus);
        assert_eq!(order, [(0x181, 2), (0x281, 2), (0x581, 2), (0x701, 0), (0x701, 1)]);
    }

    #[test]
    fn a_replaced_frame_finds_room_in_a_full_queue() {
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        for id in [0x703, 0x702, 0x701] {
            queue.send(frame(id, 0)).unwrap();
            queue.pump(&mut bus);
        }
        for tag in 0..u8::try_from(CAPACITY).unwrap() {
            queue.send(frame(0x181, tag)).unwrap();
        }
        assert_eq!(queue.send(frame(0x080, 0)), Err(QueueFull));
        let order = sent(&mut queue, &mut bus);
        assert_eq!(order.len(), CAPACITY + 3);
        assert!(order.is_sorted());
    }

    #[test]
    fn room_tells_what_can_be_sent() {
        let mut queue = TransmitQueue::new();
        while queue.room() > 0 {
            queue.send(frame(1, 0)).unwrap();
        }
        assert_eq!(queue.send(frame(1, 0)), Err(QueueFull));
        queue.clear();
        assert_eq!(queue.room(), CAPACITY);
    }
}
