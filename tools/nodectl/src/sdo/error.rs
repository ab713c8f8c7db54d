//! Errors of transfers, with node and object.

use std::fmt;

use canopen::NodeId;
use canopen::client::sdo;
use canopen::sdo::Multiplexer;
use thiserror::Error;

use super::AbortCode;
use crate::bus::BusError;
use crate::object::Place;

/// The abort code for the present state of the device (CiA 301, table 22).
const DEVICE_STATE: u32 = 0x0800_0022;

/// A transfer that failed.
#[derive(Debug, Error)]
pub struct Error {
    /// The node.
    pub node: NodeId,
    /// The object.
    pub at: Multiplexer,
    /// The name of the object, where it is known.
    pub name: Option<String>,
    /// A hint for the user, where there is one.
    pub hint: Option<String>,
    /// The cause.
    #[source]
    pub cause: Cause,
}

/// Why a transfer failed.
#[derive(Debug, Error)]
pub enum Cause {
    /// The transfer itself failed.
    #[error(transparent)]
    Transfer(#[from] sdo::Error),
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Another client used the SDO server of the node all the time.
    #[error("another client uses the SDO server of the node")]
    Busy,
}

impl Error {
    /// The abort code, where the transfer was aborted.
    #[must_use]
    pub fn abort(&self) -> Option<AbortCode> {
        match self.cause {
            Cause::Transfer(sdo::Error::Abort(code)) => Some(code),
            _ => None,
        }
    }

    /// Whether the node has no such object.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        self.abort().is_some_and(AbortCode::is_absent)
    }

    /// Whether the node or the bus was silent, so that a later try may succeed.
    #[must_use]
    pub fn is_silence(&self) -> bool {
        matches!(self.cause, Cause::Transfer(sdo::Error::NoAnswer) | Cause::Bus(BusError::Lost(_)))
    }

    /// Whether the server may have dropped the transfer for that of another client.
    pub(super) fn may_be_dropped(&self) -> bool {
        self.is_disturbed() || self.abort() == Some(AbortCode(DEVICE_STATE))
    }

    /// Whether a later try may succeed: the node or the bus was silent, or another client was in the way.
    #[must_use]
    pub fn may_pass(&self) -> bool {
        self.is_silence() || self.is_disturbed() || matches!(self.cause, Cause::Busy)
    }

    /// Whether another client used the SDO server of the node all the time.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        matches!(self.cause, Cause::Busy)
    }

    /// Whether the bus is lost.
    #[must_use]
    pub fn is_bus_lost(&self) -> bool {
        matches!(self.cause, Cause::Bus(BusError::Lost(_)))
    }

    /// Whether the answer fits another transfer, as when the frames of an earlier one are still on their way.
    #[must_use]
    pub fn is_disturbed(&self) -> bool {
        let is_unexpected = matches!(self.cause, Cause::Transfer(sdo::Error::Unexpected));
        is_unexpected || self.abort().is_some_and(|code| code.is_protocol() || code.is_time_out())
    }
}

/// `node 5, 1017h:0 "Producer heartbeat time": 0609 0030h, invalid value for the parameter`
impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "node {}, {}", self.node.get(), Place(self.at))?;
        if let Some(name) = &self.name {
            write!(f, " \"{name}\"")?;
        }
        write!(f, ": {}", self.cause)?;
        self.hint.iter().try_for_each(|hint| write!(f, "; {hint}"))
    }
}
