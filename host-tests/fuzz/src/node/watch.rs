//! The monitor beside the board: every frame is judged by the rules of the bus.

use canopen::{Frame, Instant};
use monitor::{Incident, Monitor, Sender, Sheet};
use node::Personality;

/// Listens to the frames of the board.
#[derive(Debug)]
pub(super) struct Watch(Monitor);

impl Watch {
    /// A monitor that knows neither the values nor the state of the node.
    pub(super) fn new(personality: Personality, node_id: Option<u16>) -> Watch {
        let mut monitor = Monitor::new().without_bus();
        monitor.set_sheet(0, Sheet::of_node(personality.rows()), false);
        if let Some([node_id, _]) = node_id.map(u16::to_le_bytes) {
            monitor.set_node_id(0, node_id);
        }
        Watch(monitor)
    }

    /// The node starts.
    pub(super) fn starts(&mut self, now: Instant) {
        self.0.incident(now, 0, Incident::PowerOn);
    }

    /// The communication of the node starts.
    pub(super) fn restarts(&mut self, now: Instant) {
        self.0.incident(now, 0, Incident::Restart);
    }

    /// A frame to the node.
    pub(super) fn received(&mut self, now: Instant, frame: &Frame) {
        self.feed(now, frame, Sender::Other);
    }

    /// A frame of the node.
    pub(super) fn sent(&mut self, now: Instant, frame: &Frame) {
        self.feed(now, frame, Sender::Node(0));
    }

    fn feed(&mut self, now: Instant, frame: &Frame, sender: Sender) {
        // Steps let time pass without the node: times are no rule here.
        self.0.resume(now);
        self.0.frame(now, frame, sender);
        if let Some(breach) = self.0.breaches().first() {
            panic!("{breach}");
        }
    }
}
