//! The connection of a station: the firmware's transmit queue, mailboxes that behave like those of bxCAN, and a receive
//! queue.

use std::collections::VecDeque;

use bsp::can::transmit_queue::{Mailboxes, Offer, TransmitQueue};
use canbus::{Attachment, BitTiming, Confinement, Controller, ErrorReport, ErrorState, Id, StandardId, Time};
use canopen::{Frame, QueueFull, Transmit};

/// Number of transmit mailboxes of bxCAN.
const MAILBOXES: usize = 3;

/// A station's connection to the bus.
#[derive(Debug)]
pub struct Port {
    bit: Time,
    queue: TransmitQueue,
    mailboxes: Boxes,
    /// The instant since which a mailbox has been waiting.
    since: Time,
    inbox: VecDeque<Frame>,
    confinement: Confinement,
    /// Frames sent so far.
    pub sent: u64,
    /// Frames received so far.
    pub received: u64,
}

/// The transmit mailboxes with frames of different identifiers. The last frame is the most urgent one.
#[derive(Debug, Default)]
struct Boxes {
    frames: Vec<Frame>,
    on_wire: Option<u16>,
}

impl Mailboxes for Boxes {
    fn offer(&mut self, frame: &Frame) -> Offer {
        let is_full = self.frames.len() == MAILBOXES;
        // The driver aborts no frame while the controller transmits.
        let stays = |least: &Frame| least.id() < frame.id() || self.on_wire.is_some();
        if is_full && self.frames.first().is_some_and(stays)
            || self.frames.iter().any(|other| other.id() == frame.id())
        {
            return Offer::Refused;
        }
        self.frames.push(*frame);
        self.frames.sort_by_key(|frame| core::cmp::Reverse(frame.id()));
        if !is_full {
            return Offer::Taken;
        }
        Offer::Replaced(self.frames.remove(0))
    }

    fn is_idle(&self) -> bool {
        self.frames.is_empty()
    }

    /// An abort takes no time here, so no frame is on its way out.
    fn settle(&mut self, _is_cleared: bool) {}
}

impl Port {
    /// A port with bits of this length.
    #[must_use]
    pub fn new(bit: Time) -> Port {
        Port {
            bit,
            queue: TransmitQueue::new(),
            mailboxes: Boxes::default(),
            since: Time::ZERO,
            inbox: VecDeque::new(),
            confinement: Confinement::default(),
            sent: 0,
            received: 0,
        }
    }

    /// The oldest frame received and not taken yet.
    pub fn receive(&mut self) -> Option<Frame> {
        self.inbox.pop_front()
    }

    /// Whether a received frame is waiting.
    #[must_use]
    pub fn has_mail(&self) -> bool {
        !self.inbox.is_empty()
    }

    /// Whether a frame is waiting to be sent.
    #[must_use]
    pub fn is_sending(&self) -> bool {
        !self.mailboxes.frames.is_empty()
    }

    /// Drops the frames that wait to be sent, as the start of the communication does.
    pub fn clear(&mut self) {
        self.queue.clear();
        let on_wire = self.mailboxes.on_wire;
        self.mailboxes.frames.retain(|frame| on_wire == Some(frame.id()));
    }

    /// Moves frames from the queue into the mailboxes.
    pub fn pump(&mut self, now: Time) {
        if !self.is_sending() {
            self.since = now;
        }
        self.queue.pump(&mut self.mailboxes);
    }
}

impl Transmit for Port {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.queue.send(frame)
    }

    fn send_state(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.queue.send_state(frame)
    }

    fn send_boot_up(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.queue.send_boot_up(frame)
    }

    fn room(&self) -> usize {
        self.queue.room()
    }
}

impl Controller for Port {
    fn attachment(&mut self, _at: Time) -> Attachment {
        let timing = BitTiming::nominal(self.bit);
        match self.confinement.state() {
            ErrorState::Active => Attachment::Active { timing },
            ErrorState::Passive => Attachment::Passive { timing },
            ErrorState::BusOff => Attachment::Off,
        }
    }

    fn requested(&self) -> Option<Time> {
        self.is_sending().then_some(self.since)
    }

    fn pending(&mut self, _at: Time) -> Option<canbus::Frame> {
        self.mailboxes.frames.last().map(to_bus)
    }

    fn start_of_frame(&mut self, transmitting: bool, _at: Time) {
        self.mailboxes.on_wire = self.mailboxes.frames.last().map(Frame::id).filter(|_| transmitting);
    }

    fn lost(&mut self, _at: Time) {
        self.mailboxes.on_wire = None;
    }

    fn sent(&mut self, at: Time) {
        self.confinement.sent();
        self.sent += 1;
        let sent = self.mailboxes.on_wire.take();
        self.mailboxes.frames.retain(|frame| sent != Some(frame.id()));
        self.pump(at);
    }

    fn received(&mut self, frame: &canbus::Frame, _at: Time) {
        self.confinement.received();
        self.received += 1;
        self.inbox.extend(from_bus(frame));
    }

    fn error(&mut self, report: &ErrorReport, _at: Time) {
        self.mailboxes.on_wire = None;
        self.confinement.error(report);
    }

    fn idle(&mut self, _since: Time) {}
}

/// Converts a frame for the bus.
///
/// # Panics
/// Never: a CANopen frame is a valid one.
#[must_use]
pub fn to_bus(frame: &Frame) -> canbus::Frame {
    let id = StandardId::new(frame.id()).expect("11 bits");
    if frame.is_remote() {
        canbus::Frame::remote(id, u8::try_from(frame.len()).expect("a DLC"))
    } else {
        canbus::Frame::data(id, frame.data())
    }
    .expect("at most eight bytes")
}

/// Converts a frame for a node; `None` for an extended identifier, which no acceptance filter of a node passes.
#[must_use]
pub fn from_bus(frame: &canbus::Frame) -> Option<Frame> {
    let Id::Standard(id) = frame.id() else { return None };
    if frame.is_remote() {
        Frame::remote(id.as_raw(), frame.dlc())
    } else {
        Frame::new(id.as_raw(), frame.bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use canbus::{Bus, HostNode};

    const BIT: Time = Time::from_micros(1);

    /// Runs the bus until `end` and returns the identifiers that have arrived.
    fn run(bus: &mut Bus, port: &mut Port, other: &mut HostNode, end: Time) -> Vec<u16> {
        bus.step(&mut [port, other], end, &mut |_| {});
        std::iter::from_fn(|| other.receive())
            .filter_map(|got| from_bus(&got.frame))
            .map(|f| f.id())
            .collect()
    }

    #[test]
    fn an_urgent_frame_overtakes_all_but_the_one_on_the_wire() {
        let (mut bus, mut port, mut other) = (Bus::new(), Port::new(BIT), HostNode::new(BIT));
        for id in [0x709, 0x589, 0x489, 0x389] {
            port.send(Frame::new(id, &[0; 8]).unwrap()).unwrap();
            port.pump(Time::ZERO);
        }
        // The mailboxes hold 389h, 489h and 589h; 389h is on the wire.
        assert_eq!(run(&mut bus, &mut port, &mut other, BIT * 50), Vec::<u16>::new());
        for id in [0x289, 0x189] {
            port.send(Frame::new(id, &[0; 8]).unwrap()).unwrap();
            port.pump(BIT * 50);
        }
        let order = run(&mut bus, &mut port, &mut other, Time::from_millis(2));
        assert_eq!(order, [0x389, 0x189, 0x289, 0x489, 0x589, 0x709]);
        assert_eq!((port.sent, port.is_sending()), (6, false));
    }

    #[test]
    fn a_cleared_port_ends_the_frame_on_the_wire_and_sends_no_other() {
        let (mut bus, mut port, mut other) = (Bus::new(), Port::new(BIT), HostNode::new(BIT));
        for id in [0x709, 0x589] {
            port.send(Frame::new(id, &[0; 8]).unwrap()).unwrap();
            port.pump(Time::ZERO);
        }
        run(&mut bus, &mut port, &mut other, BIT * 50);
        port.clear();
        assert_eq!(run(&mut bus, &mut port, &mut other, Time::from_millis(2)), [0x589]);
    }
}
