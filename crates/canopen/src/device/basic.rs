//! The inner device: values, NMT state, heartbeat, and the actions that wait for the caller.

use super::body::Body;
use super::state::Pending;
use super::{Action, Application};
use crate::dictionary::{Dictionary, Entry, Field, little_endian};
use crate::lss::Identity;
use crate::nmt::State;
use crate::{CanId, Instant, NodeId, heartbeat};

/// Identity object.
const IDENTITY: u16 = 0x1018;

/// The part of a device that NMT, SDO, heartbeat and LSS need; `Services` adds the SDO server and the LSS slave.
/// `I` is the memory of all values.
#[derive(Debug)]
pub struct Basic<A, I: ?Sized> {
    pub(super) dictionary: &'static Dictionary,
    /// `None` for a device that waits for a node-ID from LSS.
    pub(super) node_id: Option<NodeId>,
    pub(super) state: State,
    /// Cached next deadlines. `STALE` after a change that may have moved a deadline.
    pub(super) process_due: Instant,
    pub(super) services_due: Instant,
    pub(super) heartbeat: heartbeat::Producer,
    pub(super) pending: Pending,
    pub(super) application: A,
    pub(super) image: I,
}

impl<A: Application, const N: usize> Body for Basic<A, [u8; N]> {
    type Application = A;
    type Image = [u8; N];

    fn new(dictionary: &'static Dictionary, node_id: Option<NodeId>, application: A) -> Self {
        Basic {
            dictionary,
            node_id,
            state: State::Initialising,
            process_due: Instant::NEVER,
            services_due: Instant::NEVER,
            heartbeat: heartbeat::Producer::new(),
            pending: Pending::new(),
            application,
            image: [0; N],
        }
    }

    fn basic(&self) -> &Basic<A, [u8]> {
        self
    }

    fn image(&self) -> &[u8; N] {
        &self.image
    }

    fn basic_mut(&mut self) -> &mut Basic<A, [u8]> {
        self
    }
}

impl<A: Application> Basic<A, [u8]> {
    pub(super) fn is_initialising(&self) -> bool {
        self.state == State::Initialising
    }

    /// The CAN-ID of a service of this device. Without a node-ID, the CAN-ID for node-ID 0, which no device uses.
    pub(super) fn service(&self, function: u16) -> CanId {
        CanId::of_service(function, self.node_id.map_or(0, NodeId::get))
    }

    /// Makes the services due at this instant, or earlier.
    pub(super) fn serve_until(&mut self, due: Instant) {
        self.services_due = self.services_due.min(due);
    }

    /// Asks the caller for an action.
    pub(super) fn ask(&mut self, action: Action) {
        self.pending.ask(action);
    }

    /// An integer of at most 32 bits; 0 where the dictionary has no such entry.
    #[inline(never)]
    pub(super) fn number(&self, index: u16, sub: u8) -> u32 {
        self.number_or(index, sub, 0)
    }

    pub(super) fn number_or(&self, index: u16, sub: u8, absent: u32) -> u32 {
        self.dictionary.find(index, sub).map_or(absent, |entry| self.word(entry.field))
    }

    /// The default value of an integer of at most 32 bits, including the node-ID where the default is relative to it.
    pub(super) fn default_number(&self, entry: &Entry) -> u32 {
        self.dictionary.default_number(entry, self.node_id)
    }

    pub(super) fn word(&self, field: Field) -> u32 {
        little_endian(field.get(&self.image))
    }

    pub(super) fn identity(&self) -> Identity {
        Identity {
            vendor: self.number(IDENTITY, 1),
            product: self.number(IDENTITY, 2),
            revision: self.number(IDENTITY, 3),
            serial: self.number(IDENTITY, 4),
        }
    }
}
