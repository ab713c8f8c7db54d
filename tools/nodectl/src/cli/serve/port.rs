//! The bus of a job: frames that interest the job come through a queue, and frames that the job sends go to the pump.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TryRecvError, sync_channel};

use canopen::{Frame, Instant, NodeId};

use super::order::Order;
use crate::bus::{Bus, BusError, NoBus, Received, clock};
use crate::sdo::Channel;

/// The number of frames that may wait for a job. A slower job loses the newest frames, as with any adapter.
const WAITING: usize = 4096;

/// The frames that a job receives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interest {
    /// Frames of and for this node: SDO on its channel, also of other clients, and heartbeats. Requests of LSS masters.
    Node(NodeId, Channel),
    /// SDO and heartbeats of all nodes, and LSS.
    Services,
}

impl Interest {
    /// Whether a frame belongs to this interest.
    pub(super) fn has(self, frame: &Frame) -> bool {
        let id = frame.id();
        let is_service = matches!(id, 0x581..=0x5FF | 0x601..=0x67F | 0x701..=0x77F);
        match self {
            _ if id == 0x7E5 => true,
            Interest::Node(node, channel) => {
                (is_service && id & 0x7F == u16::from(node.get())) || channel.has(frame)
            }
            Interest::Services => is_service || id == 0x7E4,
        }
    }
}

/// The pump's end of a port.
pub(super) struct Outlet {
    interest: Interest,
    frames: SyncSender<Received>,
}

impl Outlet {
    /// Takes the channel that a job has chosen for a node.
    pub(super) fn choose(&mut self, node: NodeId, channel: Channel) {
        if matches!(self.interest, Interest::Node(of, _) if of == node) {
            self.interest = Interest::Node(node, channel);
        }
    }

    /// Passes a frame to the job, if the frame interests it. Returns `false` when the job has ended.
    pub(super) fn hand_over(&self, received: &Received) -> bool {
        use std::sync::mpsc::TrySendError;
        let sent = if self.interest.has(&received.frame) { self.frames.try_send(*received) } else { Ok(()) };
        !matches!(sent, Err(TrySendError::Disconnected(_)))
    }
}

/// The job's end of a port.
struct Port {
    orders: Sender<Order>,
    frames: Receiver<Received>,
}

/// Opens a port. If there is no bus, the first use of the port fails.
pub(super) fn open(orders: &Sender<Order>, interest: Interest) -> Box<dyn Bus> {
    let (frames, receiver) = sync_channel(WAITING);
    let _ = orders.send(Order::Open(Outlet { interest, frames }));
    Box::new(Port { orders: orders.clone(), frames: receiver })
}

impl Bus for Port {
    fn now(&self) -> Instant {
        clock::now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        match self.orders.send(Order::Send(*frame)) {
            Ok(()) => Ok(()),
            Err(_) => NoBus.send(frame),
        }
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        // First look for a waiting frame, because a deadline in the past leaves no time to wait for one.
        match self.frames.try_recv() {
            Ok(received) => return Ok(Some(received)),
            Err(TryRecvError::Disconnected) => return NoBus.receive(until),
            Err(TryRecvError::Empty) => {}
        }
        match self.frames.recv_timeout(clock::left(until)) {
            Ok(received) => Ok(Some(received)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => NoBus.receive(until),
        }
    }
}
