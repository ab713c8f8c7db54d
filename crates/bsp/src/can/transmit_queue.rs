//! Queue of frames for the transmit mailboxes: in the order of their CAN-ID, first in first out among equal CAN-IDs.
//!
//! The bus itself prefers the lowest identifier. A plain queue in front of the mailboxes would undo this order: an
//! earlier heartbeat would hold up a SYNC (priority inversion).
//!
//! The sender declares which of two kinds a frame is:
//!
//! * An event ([`Transmit::send`]) is sent once and in its order, however long it waits. If the queue is full, the
//!   sender keeps the event and offers it again.
//! * A state ([`Transmit::send_state`]), such as a heartbeat or a measured value, is worthless once there is a newer
//!   one. The newer frame replaces the older one of its CAN-ID. A node that is kept silent by more urgent frames for
//!   minutes therefore sends the newest frame of each CAN-ID in the first gap, after the frames that the three mailboxes
//!   hold, and not a queue of old values.
//!
//! The boot-up message is an event before which no other frame may be on the bus, although most CAN-IDs are more
//! urgent. The queue holds all other frames back until the boot-up message has left its mailbox.

use canopen::{CanId, Frame, QueueFull, Transmit};
use heapless::Vec;

/// Capacity in frames.
pub const CAPACITY: usize = 32;

/// The outcome of offering a frame to the mailboxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offer {
    /// The frame is in a mailbox that was free.
    Taken,
    /// The frame is in the mailbox of this less urgent frame, which must be queued again.
    Replaced(Frame),
    /// The frame has to wait.
    Refused,
}

/// The transmit mailboxes of a controller.
pub trait Mailboxes {
    /// Puts a frame into a mailbox if this keeps the order on the bus.
    fn offer(&mut self, frame: &Frame) -> Offer;

    /// Whether all mailboxes are empty: every frame that was taken has been sent.
    fn is_idle(&self) -> bool;

    /// Handles a frame that is on its way out of a mailbox. If the queue was cleared, the frame is discarded.
    fn settle(&mut self, is_cleared: bool);
}

/// A waiting frame.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    frame: Frame,
    /// A newer frame of the same identifier may replace this one.
    is_state: bool,
}

/// State of the boot-up message, before which no other frame may be on the bus.
#[derive(Clone, Copy, Debug, Default)]
enum BootUp {
    /// The message was sent, or there was none yet.
    #[default]
    Sent,
    Waits(Frame),
    InMailbox,
}

/// The queue of frames that wait for a mailbox.
#[derive(Debug, Default)]
pub struct TransmitQueue {
    boot_up: BootUp,
    /// The waiting frames; the most urgent one is last.
    waiting: Vec<Waiting, CAPACITY>,
    /// The queue was cleared since the last look at the mailboxes.
    is_cleared: bool,
    /// A PDO was moved into a mailbox since all mailboxes were empty.
    has_moved_pdo: bool,
}

impl TransmitQueue {
    /// An empty queue.
    #[must_use]
    pub const fn new() -> TransmitQueue {
        TransmitQueue { boot_up: BootUp::Sent, waiting: Vec::new(), is_cleared: false, has_moved_pdo: false }
    }

    /// Moves frames into the mailboxes until they take no more.
    pub fn pump(&mut self, mailboxes: &mut impl Mailboxes) {
        while self.step(mailboxes) {}
    }

    /// Moves one frame into a mailbox. Returns whether the mailboxes may take another one now.
    pub fn step(&mut self, mailboxes: &mut impl Mailboxes) -> bool {
        mailboxes.settle(core::mem::take(&mut self.is_cleared));
        self.has_moved_pdo &= !mailboxes.is_idle();
        let Some(frame) = self.next(mailboxes) else { return false };
        let offer = mailboxes.offer(&frame);
        if offer == Offer::Refused {
            return false;
        }
        self.has_moved_pdo |= is_pdo(&frame);
        if matches!(self.boot_up, BootUp::Waits(_)) {
            self.boot_up = BootUp::InMailbox;
        } else {
            self.waiting.pop();
        }
        if let Offer::Replaced(other) = offer {
            // The frame just removed has left room for this one.
            let _ = self.push_first(other);
        }
        !self.waiting.is_empty()
    }

    /// The next frame for a mailbox. The boot-up message has all mailboxes for itself.
    fn next(&mut self, mailboxes: &impl Mailboxes) -> Option<Frame> {
        if !matches!(self.boot_up, BootUp::Sent) && !mailboxes.is_idle() {
            return None;
        }
        if let BootUp::Waits(frame) = self.boot_up {
            return Some(frame);
        }
        self.boot_up = BootUp::Sent;
        self.waiting.last().map(|waiting| waiting.frame)
    }

    /// Whether no frame waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && !matches!(self.boot_up, BootUp::Waits(_))
    }

    /// Drops all waiting frames, and the frame that is on its way out of a mailbox.
    pub fn clear(&mut self) {
        (self.is_cleared, self.has_moved_pdo) = (true, false);
        self.waiting.clear();
        self.boot_up = BootUp::Sent;
    }

    /// Adds a frame returned from a mailbox. The frame was queued before all others of its identifier, so it
    /// goes in front of them. The mailboxes hold at most one frame of an identifier, so at most one such frame waits;
    /// it counts as an event.
    fn push_first(&mut self, frame: Frame) -> Result<(), QueueFull> {
        let index = self.waiting.partition_point(|other| other.frame.id() >= frame.id());
        self.insert(index, Waiting { frame, is_state: false })
    }

    /// The place after all frames of this identifier.
    fn place(&self, frame: &Frame) -> usize {
        self.waiting.partition_point(|other| other.frame.id() > frame.id())
    }

    /// Inserts a frame at a place and moves all frames from there on by one place. `Vec::insert` would panic at a place
    /// beyond the end.
    fn insert(&mut self, index: usize, new: Waiting) -> Result<(), QueueFull> {
        if self.waiting.is_full() {
            return Err(QueueFull);
        }
        let mut moved = new;
        for place in self.waiting.iter_mut().skip(index) {
            core::mem::swap(place, &mut moved);
        }
        self.waiting.push(moved).map_err(|_| QueueFull)
    }
}

impl Transmit for TransmitQueue {
    /// Adds an event after the frames of its identifier.
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.insert(self.place(&frame), Waiting { frame, is_state: false })
    }

    /// Adds a state after the frames of its identifier. If the last of these frames is a state too, the new one
    /// replaces it. An event between two states keeps both.
    fn send_state(&mut self, frame: Frame) -> Result<(), QueueFull> {
        let index = self.place(&frame);
        match self.waiting.get_mut(index).filter(|last| last.is_state && last.frame.id() == frame.id()) {
            Some(last) => last.frame = frame,
            None => self.insert(index, Waiting { frame, is_state: true })?,
        }
        Ok(())
    }

    /// Takes the boot-up message, which has its own place.
    fn send_boot_up(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.boot_up = BootUp::Waits(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        CAPACITY - self.waiting.len()
    }

    fn replaces(&self, id: u16) -> bool {
        self.waiting.iter().any(|waiting| waiting.is_state && waiting.frame.id() == id)
    }

    fn has_waiting_pdo(&self) -> bool {
        self.has_moved_pdo || self.waiting.last().is_some_and(|waiting| is_pdo(&waiting.frame))
    }
}

fn is_pdo(frame: &Frame) -> bool {
    frame.id() <= CanId::LAST_PDO.get()
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// Mailboxes that behave like bxCAN under its driver: of equal identifiers one is accepted. If all mailboxes are
    /// full, the least urgent frame gives way to a more urgent one. The most urgent frame is last.
    #[derive(Default)]
    struct Fake {
        pending: Vec<Frame>,
        aborted: Option<Frame>,
    }

    impl Mailboxes for Fake {
        fn offer(&mut self, frame: &Frame) -> Offer {
            let is_full = self.pending.len() == 3;
            if self.pending.iter().any(|other| other.id() == frame.id())
                || is_full && self.pending[0].id() < frame.id()
            {
                return Offer::Refused;
            }
            self.pending.push(*frame);
            self.pending.sort_by_key(|frame| core::cmp::Reverse(frame.id()));
            if is_full { Offer::Replaced(self.pending.remove(0)) } else { Offer::Taken }
        }

        fn is_idle(&self) -> bool {
            self.pending.is_empty()
        }

        fn settle(&mut self, is_cleared: bool) {
            let aborted = self.aborted.take().filter(|_| !is_cleared);
            self.pending.extend(aborted);
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
    fn of_a_state_the_newest_waits() {
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        for tag in 0..100 {
            queue.send_state(frame(0x701, tag)).unwrap();
            queue.send_state(frame(0x181, tag)).unwrap();
            queue.pump(&mut bus);
        }
        let order = sent(&mut queue, &mut bus);
        let expected = [(0x181, 0), (0x181, 99), (0x701, 0), (0x701, 99)];
        assert_eq!(order, expected, "the newest of each, after those that were in a mailbox");
    }

    #[test]
    fn a_state_takes_the_place_of_no_other_frame_and_passes_none() {
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        queue.send_state(frame(0x701, 1)).unwrap();
        queue.send(frame(0x701, 2)).unwrap();
        queue.send_state(frame(0x701, 3)).unwrap();
        queue.send_state(frame(0x702, 4)).unwrap();
        queue.send(frame(0x701, 5)).unwrap();
        let order = sent(&mut queue, &mut bus);
        assert_eq!(order, [(0x701, 1), (0x701, 2), (0x701, 3), (0x701, 5), (0x702, 4)]);
    }

    #[test]
    fn a_frame_returned_from_a_mailbox_is_not_replaced_by_a_newer_one() {
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        queue.send_state(frame(0x701, 1)).unwrap();
        queue.pump(&mut bus);
        for id in [0x581, 0x281, 0x181] {
            queue.send(frame(id, 0)).unwrap();
            queue.pump(&mut bus);
        }
        for tag in 2..5 {
            queue.send_state(frame(0x701, tag)).unwrap();
        }
        let order = sent(&mut queue, &mut bus);
        assert_eq!(order, [(0x181, 0), (0x281, 0), (0x581, 0), (0x701, 1), (0x701, 4)]);
    }

    /// Events and states of the same and of other identifiers, on a bus that comes and goes: every event arrives once
    /// and in the order of its identifier, and of the states the newest arrives.
    #[test]
    fn no_event_is_lost_or_passed_whatever_waits_beside_it() {
        const IDS: [u16; 4] = [0x181, 0x183, 0x281, 0x701];
        const EVENTS: usize = 10_000;
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        let (mut seed, mut sent, mut state) = (1_u32, [0_u16; 4], 0_u16);
        let mut arrived: Vec<(u16, bool, u16)> = Vec::new();
        let message = |id: u16, is_event: bool, number: u16| {
            let [low, high] = number.to_le_bytes();
            Frame::new(id, &[is_event.into(), low, high]).unwrap()
        };
        let mut take = |bus: &mut Fake| {
            let Some(frame) = bus.send() else { return false };
            let [is_event, low, high] = *frame.data() else { panic!("{frame:?}") };
            arrived.push((frame.id(), is_event != 0, u16::from_le_bytes([low, high])));
            true
        };
        while sent.iter().map(|count| usize::from(*count)).sum::<usize>() < EVENTS {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let (place, choice) = ((seed >> 30) as usize, seed >> 20 & 0xF);
            // For a quarter of the time there is no bus.
            let is_off = (sent.iter().map(|count| u32::from(*count)).sum::<u32>() / 64).is_multiple_of(4);
            match choice {
                // A sender that finds no room offers the same event again.
                0..6 if queue.send(message(IDS[place], true, sent[place])).is_ok() => sent[place] += 1,
                6..10 => {
                    state = state.wrapping_add(1);
                    let _ = queue.send_state(message(IDS[place], false, state));
                }
                _ if !is_off || queue.room() == 0 => drop(take(&mut bus)),
                _ => (),
            }
            queue.pump(&mut bus);
        }
        for id in IDS {
            let _ = queue.send_state(message(id, false, u16::MAX));
        }
        while take(&mut bus) {
            queue.pump(&mut bus);
        }
        for (id, sent) in IDS.into_iter().zip(sent) {
            let own = arrived.iter().filter(|(other, ..)| *other == id);
            let events: Vec<u16> = own.filter(|(_, is_event, _)| *is_event).map(|event| event.2).collect();
            assert!(events.iter().copied().eq(0..sent), "{id:03X}h");
        }
        let states = arrived.iter().filter(|(_, is_event, _)| !is_event).count();
        assert!(states > 100 && states < usize::from(state), "{states} of {state} states: some gave way");
    }

    #[test]
    fn a_full_queue_takes_a_state_that_waits_in_it() {
        let mut queue = TransmitQueue::new();
        queue.send_state(frame(0x181, 0)).unwrap();
        while queue.send(frame(1, 0)).is_ok() {}
        assert_eq!(queue.send_state(frame(0x181, 1)), Ok(()));
        assert_eq!(queue.send_state(frame(0x182, 0)), Err(QueueFull));
    }

    #[test]
    fn nothing_passes_the_boot_up_message() {
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        queue.send_boot_up(frame(0x701, 0)).unwrap();
        assert!(!queue.is_empty());
        queue.pump(&mut bus);
        for id in [0x581, 0x181, 0x081] {
            queue.send(frame(id, 1)).unwrap();
            queue.pump(&mut bus);
        }
        assert_eq!(bus.pending.len(), 1, "the boot-up message is alone in the mailboxes");
        let order = sent(&mut queue, &mut bus);
        assert_eq!(order, [(0x701, 0), (0x081, 1), (0x181, 1), (0x581, 1)]);
    }

    #[test]
    fn a_frame_on_its_way_out_of_a_mailbox_does_not_outlive_a_cleared_queue() {
        for (clears, expected) in [(false, [(0x181, 7), (0x701, 0)].as_slice()), (true, &[(0x701, 0)])] {
            let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
            bus.aborted = Some(frame(0x181, 7));
            if clears {
                queue.clear();
            }
            queue.send_boot_up(frame(0x701, 0)).unwrap();
            assert_eq!(sent(&mut queue, &mut bus), expected);
        }
    }

    #[test]
    fn frames_with_different_identifiers_share_the_mailboxes() {
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        for id in [0x181, 0x281, 0x381, 0x481] {
            queue.send(frame(id, 0)).unwrap();
        }
        queue.pump(&mut bus);
        assert_eq!(
            bus.pending.len(),
            3,
            "the TPDOs of a SYNC follow each other without an interrupt between"
        );
        assert_eq!(sent(&mut queue, &mut bus), [(0x181, 0), (0x281, 0), (0x381, 0), (0x481, 0)]);
    }

    #[test]
    fn a_cleared_queue_waits_for_no_boot_up_message() {
        let (mut queue, mut bus) = (TransmitQueue::new(), Fake::default());
        queue.send_boot_up(frame(0x701, 0)).unwrap();
        queue.clear();
        queue.send(frame(0x081, 1)).unwrap();
        assert_eq!(sent(&mut queue, &mut bus), [(0x081, 1)]);
    }

    #[test]
    fn room_is_the_number_of_frames_that_can_be_sent() {
        let mut queue = TransmitQueue::new();
        while queue.room() > 0 {
            queue.send(frame(1, 0)).unwrap();
        }
        assert_eq!(queue.send(frame(1, 0)), Err(QueueFull));
        queue.clear();
        assert_eq!(queue.room(), CAPACITY);
    }
}
