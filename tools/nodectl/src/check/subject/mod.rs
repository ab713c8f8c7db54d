//! The device under test, as the checks use it.

mod bus;
mod control;
mod pdo;
mod restore;
mod sdo;
mod segments;
mod sheet;
mod verdict;

use canopen::sdo::Multiplexer;
use canopen::{Duration, NodeId};
use eds::Eds;

use crate::Network;

pub(in crate::check) use bus::Mark;
pub(in crate::check) use pdo::mapped;
pub(in crate::check) use pdo::{OFF, Pdo, RPDO, TPDO};
pub(in crate::check) use restore::Values;
pub(in crate::check) use sdo::{Refusal, abort};
pub(in crate::check) use sheet::size;
pub use verdict::{Deviation, Outcome, Stop, Verdict};
pub(in crate::check) use verdict::{ensure, fail, skip};

/// The settings for a device under test.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The node-ID.
    pub node: NodeId,
    /// The data sheet, where there is one.
    pub sheet: Option<Eds>,
    /// The time-out for an answer.
    pub timeout: Duration,
    /// The time-out for booting.
    pub boot: Duration,
}

/// The device on the bus, and the changes that a check has made.
pub struct Subject<'n> {
    pub(super) network: &'n mut Network,
    setup: Setup,
    /// The objects that were written, with their former bytes; the newest is the last.
    pub(super) written: Vec<(Multiplexer, Vec<u8>)>,
    /// Whether a check may make the device store values.
    pub(super) may_store: bool,
    /// Whether other nodes were heard on the bus. Then no frames for all nodes are sent.
    has_company: bool,
    /// Whether the user has interrupted the run.
    is_interrupted: Box<dyn Fn() -> bool + 'n>,
    /// Whether the run cannot be interrupted now, because the device gets its values back.
    is_sheltered: bool,
    /// Whether the check under way has ended because of an interruption.
    is_ending: bool,
    /// The values that a check has not restored in an interrupted run.
    pub(super) not_restored: Vec<String>,
}

impl<'n> Subject<'n> {
    /// The device with this node-ID.
    pub fn new(network: &'n mut Network, setup: Setup) -> Subject<'n> {
        Subject {
            network,
            setup,
            written: Vec::new(),
            may_store: false,
            has_company: false,
            is_interrupted: Box::new(|| false),
            is_sheltered: false,
            is_ending: false,
            not_restored: Vec::new(),
        }
    }

    /// Sets the function that tells whether the user has interrupted the run. An interrupted check ends at once, and the
    /// device gets its values back.
    #[must_use]
    pub fn with_interruption(self, is_interrupted: impl Fn() -> bool + 'n) -> Subject<'n> {
        Subject { is_interrupted: Box::new(is_interrupted), ..self }
    }

    /// Whether the user has interrupted the run.
    pub(in crate::check) fn is_interrupted(&self) -> bool {
        (self.is_interrupted)()
    }

    /// Ends the check if the user has interrupted the run.
    pub(in crate::check) fn go_on(&mut self) -> Outcome {
        if !self.is_interrupted() || self.is_sheltered {
            return Ok(());
        }
        if !std::mem::replace(&mut self.is_ending, true) {
            // A device that waits for the segments of a block does not take a request that restores a value.
            self.sheltered(|subject| subject.give_up(0, 0))?;
        }
        Err(Stop::Interrupted)
    }

    /// Runs a function that restores values. Its failure in an interrupted run, whose check has no verdict, is kept.
    pub(in crate::check) fn restoring(&mut self, does: impl FnOnce(&mut Self) -> Outcome) -> Outcome {
        let done = self.sheltered(does);
        if let Err(Stop::Failed(deviation)) = &done
            && self.is_interrupted()
        {
            self.not_restored.push(deviation.seen.clone());
        }
        done
    }

    /// Runs a function that an interruption does not end.
    pub(in crate::check) fn sheltered<T>(&mut self, does: impl FnOnce(&mut Self) -> T) -> T {
        let before = std::mem::replace(&mut self.is_sheltered, true);
        let done = does(self);
        self.is_sheltered = before;
        done
    }

    /// The node-ID.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.setup.node
    }

    /// The node-ID as a number.
    pub(in crate::check) fn id(&self) -> u16 {
        self.setup.node.get().into()
    }
}
