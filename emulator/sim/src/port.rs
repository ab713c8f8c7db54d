//! A client's place on the bus.

use canbus::{Attachment, Controller, ErrorReport, Frame, HostNode, Order, Stamped, Time};

/// The settings of a client's adapter on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Adapter {
    /// The bit rate in bit/s. A rate that differs from the bus destroys frames, as with a real adapter.
    pub bit_rate: u32,
    /// Listen-only: neither sends nor acknowledges.
    pub silent: bool,
}

/// Time limit for a waiting frame. After this time the bus will not take the frame: no other node is on the bus, or the
/// bit rate is wrong.
const PATIENCE: Time = Time::from_millis(1000);

/// A place on the bus: empty, or with an adapter that sends in the order of the requests.
#[derive(Debug, Default)]
pub struct Port {
    node: Option<HostNode>,
    /// The settings of the adapter.
    settings: Option<Adapter>,
    /// The adapter leaves the bus when its waiting frames are sent.
    is_leaving: bool,
    /// The instant at which a frame last went out, or at which the first one began to wait.
    moved: Time,
}

impl Port {
    /// Attaches an adapter to the bus; `None` detaches it. Waiting frames are dropped, except those of an adapter that
    /// is leaving and returns with the same settings.
    pub fn attach(&mut self, adapter: Option<Adapter>) {
        if self.node.is_none() || !self.is_leaving || self.settings != adapter {
            self.node = adapter.map(|adapter| {
                let node = HostNode::new(Time::of_cycle(adapter.bit_rate.into())).with_order(Order::Fifo);
                if adapter.silent { node.silent() } else { node }
            });
        }
        (self.settings, self.is_leaving) = (adapter, false);
    }

    /// Detaches the adapter once its waiting frames are sent, as with a channel that is closed.
    pub fn detach_when_sent(&mut self) {
        self.is_leaving = true;
    }

    /// Changes the bit rate of the attached adapter.
    pub(crate) fn set_bit(&mut self, bit: Time) {
        self.tell(|node| node.set_bit(bit));
    }

    /// Queues a frame. Without an adapter the frame is lost, as with an interface that is down.
    pub fn send(&mut self, frame: Frame, now: Time) {
        if let Some(node) = &mut self.node {
            if node.backlog() == 0 {
                self.moved = now;
            }
            node.send(frame, now);
        }
    }

    /// Drops the waiting frames when none has gone out for a second. Returns their number. To be called between two steps
    /// of the bus, in which an adapter that is leaving goes off the bus.
    pub fn give_up(&mut self, now: Time) -> u64 {
        let stuck = self.node.as_mut().filter(|node| node.backlog() > 0 && now.since(self.moved) > PATIENCE);
        let dropped = stuck.map_or(0, HostNode::forget);
        if self.is_leaving && self.backlog() == 0 {
            self.node = None;
        }
        dropped
    }

    /// The oldest frame received and not taken yet, with its instant.
    pub fn receive(&mut self) -> Option<Stamped> {
        self.node.as_mut()?.receive()
    }

    /// Number of frames that wait to be sent.
    pub fn backlog(&self) -> usize {
        self.node.as_ref().map_or(0, HostNode::backlog)
    }
}

impl Controller for Port {
    fn attachment(&mut self, at: Time) -> Attachment {
        self.node.as_mut().map_or(Attachment::Off, |node| node.attachment(at))
    }

    fn requested(&self) -> Option<Time> {
        self.node.as_ref()?.requested()
    }

    fn pending(&mut self, at: Time) -> Option<Frame> {
        self.node.as_mut()?.pending(at)
    }

    fn start_of_frame(&mut self, transmitting: bool, at: Time) {
        self.tell(|node| node.start_of_frame(transmitting, at));
    }

    fn lost(&mut self, at: Time) {
        self.tell(|node| node.lost(at));
    }

    fn sent(&mut self, at: Time) {
        self.moved = at;
        self.tell(|node| node.sent(at));
    }

    fn received(&mut self, frame: &Frame, at: Time) {
        self.tell(|node| node.received(frame, at));
    }

    fn error(&mut self, report: &ErrorReport, at: Time) {
        self.tell(|node| node.error(report, at));
    }

    fn idle(&mut self, since: Time) {
        self.tell(|node| node.idle(since));
    }
}

impl Port {
    fn tell(&mut self, notice: impl FnOnce(&mut HostNode)) {
        if let Some(node) = &mut self.node {
            notice(node);
        }
    }
}
