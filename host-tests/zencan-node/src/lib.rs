//! zencan-node as a station of a simulated bus, called as its documentation describes.

use canopen::{Duration, Frame, Instant, Transmit};
use nodectl::bus::Station;
use zencan_node::Callbacks;
use zencan_node::common::messages::{CanId, CanMessage};

#[allow(missing_docs, unreachable_pub, clippy::all, clippy::pedantic)]
mod generated {
    zencan_node::include_modules!(NODE);
}

/// The node-ID.
pub const ID: u8 = 5;

/// Period of the calls of the node.
const PERIOD: Duration = Duration::from_millis(1);

/// The node. Its dictionary is global, so a process can have only one node.
pub struct Zencan(zencan_node::Node<'static>);

impl Zencan {
    /// A node that boots with its first call. It has no memory for saved parameters: storage is left to the
    /// application.
    #[must_use]
    #[allow(clippy::new_without_default)] // A process has only one node, so there is no default.
    pub fn new() -> Zencan {
        let id = zencan_node::common::NodeId::new(ID).expect("a node-ID");
        let (mailbox, state) = (&generated::NODE_MBOX, &generated::NODE_STATE);
        Zencan(zencan_node::Node::new(id, Callbacks::new(), mailbox, state, &generated::OD_TABLE))
    }

    fn run(&mut self, now: Instant, out: &mut impl Transmit) {
        self.0.process(now.0);
        while let Some(message) = generated::NODE_MBOX.next_transmit_message() {
            let id = u16::try_from(message.id().raw()).unwrap_or(0);
            if let Some(frame) = Frame::new(id, message.data()) {
                // The simulated bus accepts any number of frames.
                let _ = out.send(frame);
            }
        }
    }
}

impl Station for Zencan {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        let id = CanId::Std(frame.id());
        let message =
            if frame.is_remote() { CanMessage::new_rtr(id) } else { CanMessage::new(id, frame.data()) };
        // A message that the mailbox does not accept is addressed to another node.
        let _ = generated::NODE_MBOX.store_message(message);
        self.run(now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        self.run(now, out);
        now + PERIOD
    }
}
