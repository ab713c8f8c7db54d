//! Errors of an update.

use canopen::NodeId;
use thiserror::Error;

use super::Status;
use crate::bus::BusError;
use crate::sdo::{self, AbortCode};

/// Why a node was not updated. If not stated otherwise, the node can be reached and the update can be tried again.
#[derive(Debug, Error)]
pub enum Error {
    /// A transfer failed.
    #[error(transparent)]
    Sdo(#[from] sdo::Error),
    /// The download has failed after a part of it had arrived, and the node has nothing against the program: frames of two
    /// transfers were mixed up.
    #[error(transparent)]
    Mixed(sdo::Error),
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The image is for another board. Nothing was changed.
    #[error("node {}: the image is for board {image:08X}h, the node has board {device:08X}h", .node.get())]
    Board {
        /// The node.
        node: NodeId,
        /// Board code of the image.
        image: u32,
        /// Board code of the node, 2004h:1.
        device: u32,
    },
    /// The node runs a newer version. Nothing was changed.
    #[error("node {}: the node runs version {device}, which is newer than {image}", .node.get())]
    Older {
        /// The node.
        node: NodeId,
        /// Version of the image.
        image: String,
        /// Version of the node, 100Ah.
        device: String,
    },
    /// The node has rejected the program: 1F57h.
    #[error("node {}, 1F57h:1 \"Flash status identification\": {status}", .node.get())]
    Flash {
        /// The node.
        node: NodeId,
        /// The status that the node tells.
        status: Status,
    },
    /// The node has another program than the one that was downloaded: 1F56h.
    #[error(
        "node {}, 1F56h:1 \"Program software identification\": {found:08X}h after the download, not {expected:08X}h",
        .node.get()
    )]
    Identification {
        /// The node.
        node: NodeId,
        /// The identification of the image.
        expected: u32,
        /// The identification of the node.
        found: u32,
    },
    /// The node demands an authorisation, and there is no key. Nothing was changed.
    #[error("node {}: it changes its program only for the holder of its key: --authorisation-key", .node.get())]
    Closed {
        /// The node.
        node: NodeId,
    },
    /// The program of the node is on trial, so the node accepts no other program. Nothing was changed.
    #[error("node {}: its program is on trial; confirm it or roll it back first (nodectl confirm, nodectl rollback)", .node.get())]
    OnTrial {
        /// The node.
        node: NodeId,
    },
    /// The loader had a complete program of another download, which has been started and is on trial now.
    #[error(
        "node {}: its bootloader had a complete program of another download, which runs now; its program is on trial; confirm it or roll it back first (nodectl confirm, nodectl rollback)",
        .node.get()
    )]
    OtherDownload {
        /// The node.
        node: NodeId,
    },
    /// The program of the node is on no trial, so there is nothing to confirm or to roll back.
    #[error("node {}: its program is not on trial", .node.get())]
    NoTrial {
        /// The node.
        node: NodeId,
    },
    /// The loader has started its program before the program was cleared. The update continues: it stops the program
    /// again.
    #[error("node {}: its loader starts the program by itself", .node.get())]
    Left {
        /// The node.
        node: NodeId,
    },
    /// The node has not stopped, started or finished in time.
    #[error("node {}: it does not {what}", .node.get())]
    Stuck {
        /// The node.
        node: NodeId,
        /// The action that the node has not done.
        what: &'static str,
    },
    /// The node was lost and has not come back.
    #[error("node {}: lost, and not back within {patience} s", .node.get())]
    Lost {
        /// The node.
        node: NodeId,
        /// The time waited, in seconds.
        patience: u64,
    },
}

impl Error {
    /// Whether the node or the bus was lost, or the loader has left, so that continuing may succeed.
    pub(super) fn can_continue(&self) -> bool {
        match self {
            Error::Left { .. } => true,
            // A node that has not heard this program for a while is lost, too.
            Error::Sdo(error) => error.is_silence() || error.abort().is_some_and(AbortCode::is_time_out),
            _ => self.is_bus_lost(),
        }
    }

    /// Whether frames of another client, or late ones, were in the way, so that another try may succeed.
    pub(super) fn is_disturbance(&self) -> bool {
        match self {
            Error::Mixed(_) => true,
            Error::Sdo(error) => error.may_pass() && !self.can_continue(),
            _ => false,
        }
    }

    /// Whether the bus is lost.
    pub(super) fn is_bus_lost(&self) -> bool {
        match self {
            Error::Sdo(error) => error.is_bus_lost(),
            Error::Bus(error) => matches!(error, BusError::Lost(_)),
            _ => false,
        }
    }
}
