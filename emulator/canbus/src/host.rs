//! A controller in this process: for host-side nodes, network clients and traffic generators.

use std::collections::VecDeque;

use crate::confinement::{Confinement, ErrorState};
use crate::monitor::Monitor;
use crate::{Attachment, BitTiming, Controller, ErrorReport, Frame, Time};

/// The order in which waiting frames are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// The frame that would win an arbitration goes first; frames with equal identifiers in the order of their
    /// requests.
    #[default]
    Priority,
    /// The frame requested first goes first.
    Fifo,
}

/// A frame with the instant of its request or of its end on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamped {
    /// The instant.
    pub at: Time,
    /// The frame.
    pub frame: Frame,
}

/// A controller with a transmit and a receive queue of any length. It recovers from bus-off automatically and keeps its
/// queues.
#[derive(Clone, Debug)]
pub struct HostNode {
    timing: BitTiming,
    silent: bool,
    order: Order,
    transmit: Vec<Stamped>,
    /// Place in `transmit` of the frame on the wire.
    on_wire: Option<usize>,
    receive: VecDeque<Stamped>,
    sent: VecDeque<Stamped>,
    keeps_sent: bool,
    confinement: Confinement,
    monitor: Monitor,
}

impl HostNode {
    /// A node with bits of this length, sampled at 87.5 % of the bit; see [`Time::of_cycle`].
    pub fn new(bit: Time) -> HostNode {
        HostNode {
            timing: BitTiming::nominal(bit),
            silent: false,
            order: Order::default(),
            transmit: Vec::new(),
            on_wire: None,
            receive: VecDeque::new(),
            sent: VecDeque::new(),
            keeps_sent: false,
            confinement: Confinement::default(),
            monitor: Monitor::new(),
        }
    }

    /// Sets another bit timing.
    #[must_use]
    pub fn with_timing(mut self, timing: BitTiming) -> HostNode {
        self.timing = timing;
        self
    }

    /// Chooses the order of transmission.
    #[must_use]
    pub fn with_order(mut self, order: Order) -> HostNode {
        self.order = order;
        self
    }

    /// Switches to silent mode: the node neither sends nor acknowledges.
    #[must_use]
    pub fn silent(mut self) -> HostNode {
        self.silent = true;
        self
    }

    /// Keeps sent frames for [`HostNode::take_sent`].
    #[must_use]
    pub fn keep_sent(mut self) -> HostNode {
        self.keeps_sent = true;
        self
    }

    /// Changes the bit rate between two frames.
    pub fn set_bit(&mut self, bit: Time) {
        self.timing = BitTiming::nominal(bit);
    }

    /// Queues a frame that may go out from `at` on.
    pub fn send(&mut self, frame: Frame, at: Time) {
        self.transmit.push(Stamped { at, frame });
    }

    /// Discards the waiting frames and returns their number.
    pub fn forget(&mut self) -> u64 {
        self.on_wire = None;
        self.transmit.drain(..).len() as u64
    }

    /// Number of waiting frames, the one on the wire included.
    pub fn backlog(&self) -> usize {
        self.transmit.len()
    }

    /// The oldest frame received and not taken yet.
    pub fn receive(&mut self) -> Option<Stamped> {
        self.receive.pop_front()
    }

    /// The oldest frame sent and not taken yet, with the end of its transmission.
    pub fn take_sent(&mut self) -> Option<Stamped> {
        self.sent.pop_front()
    }

    /// The error counters.
    pub fn confinement(&self) -> &Confinement {
        &self.confinement
    }

    fn is_off(&self) -> bool {
        self.confinement.state() == ErrorState::BusOff
    }

    /// The place of the frame to send first, of the frames requested up to `at`.
    fn choose(&self, at: Time) -> Option<usize> {
        let ready = self.transmit.iter().enumerate().filter(|(_, queued)| queued.at <= at);
        let first = match self.order {
            Order::Fifo => ready.min_by_key(|(_, queued)| queued.at),
            Order::Priority => ready.min_by_key(|(_, queued)| queued.frame.arbitration()),
        };
        first.map(|(n, _)| n)
    }
}

impl Controller for HostNode {
    fn attachment(&mut self, at: Time) -> Attachment {
        if self.is_off() && self.monitor.poll(at, self.timing.bit()) {
            self.confinement = Confinement::default();
        }
        let timing = self.timing;
        match self.confinement.state() {
            ErrorState::BusOff => Attachment::Off,
            _ if self.silent => Attachment::Silent { timing },
            ErrorState::Passive => Attachment::Passive { timing },
            ErrorState::Active => Attachment::Active { timing },
        }
    }

    fn requested(&self) -> Option<Time> {
        let oldest = self.transmit.iter().map(|queued| queued.at).min().filter(|_| !self.silent)?;
        Some(oldest.max(self.monitor.ready(self.timing.bit())))
    }

    fn pending(&mut self, at: Time) -> Option<Frame> {
        self.choose(at).map(|n| self.transmit[n].frame)
    }

    fn start_of_frame(&mut self, transmitting: bool, at: Time) {
        self.on_wire = if transmitting { self.choose(at) } else { None };
        self.monitor.busy(at, self.timing.bit());
    }

    fn lost(&mut self, _at: Time) {
        self.on_wire = None;
    }

    fn sent(&mut self, at: Time) {
        self.confinement.sent();
        if let Some(n) = self.on_wire.take() {
            let frame = self.transmit.remove(n).frame;
            if self.keeps_sent {
                self.sent.push_back(Stamped { at, frame });
            }
        }
    }

    fn received(&mut self, frame: &Frame, at: Time) {
        self.confinement.received();
        self.receive.push_back(Stamped { at, frame: *frame });
    }

    fn error(&mut self, report: &ErrorReport, at: Time) {
        self.on_wire = None;
        self.confinement.error(report);
        if self.is_off() {
            self.monitor.wait(Monitor::BUS_OFF_SEQUENCES, at);
        }
    }

    fn idle(&mut self, since: Time) {
        self.monitor.idle(since);
    }
}
