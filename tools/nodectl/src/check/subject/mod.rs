//! The device that is checked, as the checks use it.

mod bus;
mod control;
mod pdo;
mod sdo;
mod segments;
mod sheet;

use canopen::sdo::Multiplexer;
use canopen::{Duration, NodeId};
use eds::Eds;

use crate::Network;

pub(in crate::check) use bus::Mark;
pub(in crate::check) use pdo::mapped;
pub(in crate::check) use pdo::{OFF, Pdo, RPDO, TPDO};
pub(in crate::check) use sdo::{Refusal, abort};
pub(in crate::check) use sheet::size;

/// What a check needs, in one line.
pub(in crate::check) mod prelude {
    pub(in crate::check) use canopen::nmt::{Command, State};

    pub(in crate::check) use super::super::verdict::{ensure, fail, skip};
    pub(in crate::check) use super::super::{Check, Outcome, Stop, Subject};
    pub(in crate::check) use super::{OFF, RPDO, Refusal, TPDO, abort};
}

/// What is known of the device before its checks.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Its node-ID.
    pub node: NodeId,
    /// Its data sheet, where there is one.
    pub sheet: Option<Eds>,
    /// How long it may take to answer.
    pub timeout: Duration,
    /// How long it may take to boot.
    pub boot: Duration,
}

/// The device on the bus, and what a check has done to it.
pub struct Subject<'n> {
    pub(super) network: &'n mut Network,
    setup: Setup,
    /// What was written, and the bytes that were there before; the newest last.
    pub(super) written: Vec<(Multiplexer, Vec<u8>)>,
    /// Whether other nodes were heard on the bus: nothing is sent then that is for all nodes.
    has_company: bool,
}

impl<'n> Subject<'n> {
    /// The device with this node-ID.
    pub fn new(network: &'n mut Network, setup: Setup) -> Subject<'n> {
        Subject { network, setup, written: Vec::new(), has_company: false }
    }

    /// Its node-ID.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.setup.node
    }

    /// Its node-ID as a number.
    pub(in crate::check) fn id(&self) -> u16 {
        self.setup.node.get().into()
    }
}
