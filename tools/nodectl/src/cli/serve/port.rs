//! The bus as a job sees it: the frames that it asked for come through a queue, and what it sends goes to the pump.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TryRecvError, sync_channel};

use canopen::{Frame, Instant, NodeId};

use super::pump::Order;
use crate::bus::{Bus, BusError, NoBus, Received, clock};

/// Frames that may wait for a job. One that is slower loses the newest, as at any adapter.
const WAITING: usize = 4096;

/// The frames that a job has a use for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interest {
    /// What this node says: answers of its SDO server, heartbeats, and what LSS slaves answer.
    Node(NodeId),
    /// What all nodes say by SDO, heartbeat and LSS.
    Services,
}

impl Interest {
    /// Whether a frame is one of them.
    pub(super) fn has(self, frame: &Frame) -> bool {
        let id = frame.id();
        let is_service = matches!(id, 0x581..=0x5FF | 0x701..=0x77F);
        match self {
            Interest::Node(node) => is_service && id & 0x7F == u16::from(node.get()),
            Interest::Services => is_service || id == 0x7E4,
        }
    }
}

/// The pump's end.
pub(super) struct Outlet {
    interest: Interest,
    frames: SyncSender<Received>,
}

impl Outlet {
    /// Hands a frame over; `false` when the job is over.
    pub(super) fn hand_over(&self, received: &Received) -> bool {
        use std::sync::mpsc::TrySendError;
        let sent = if self.interest.has(&received.frame) { self.frames.try_send(*received) } else { Ok(()) };
        !matches!(sent, Err(TrySendError::Disconnected(_)))
    }
}

/// The job's end.
struct Port {
    orders: Sender<Order>,
    frames: Receiver<Received>,
}

/// Goes on the bus. Where there is none, the first use of the port tells.
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
        // What has arrived needs no waiting, and a deadline that has passed leaves no time for it.
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
