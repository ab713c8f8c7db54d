//! Orders to the thread that owns the bus.

use canopen::{Frame, NodeId};
use serde_json::Value as Json;

use super::jobs::Learned;
use super::port::Outlet;
use crate::page::FromPage;

/// An order to the pump.
pub(super) enum Order {
    /// From a page.
    Page(FromPage),
    /// From a job: a port to pass frames to.
    Open(Outlet),
    /// From a job: a frame to send.
    Send(Frame),
    /// From a job: its progress.
    Progress(u64, Json),
    /// From a job: an event for all pages.
    Tell(Json),
    /// From a job: a fact about a node.
    Learned(NodeId, Learned),
    /// From a job: it has stopped between two transfers.
    Parked(u64),
    /// From a job: the result.
    Done(u64, Result<Json, Refusal>),
    /// From the simulator: a change of the stimuli.
    Stimuli(Json),
}

/// Why a request is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) text: String,
    /// The abort code of a node that has refused.
    pub(super) abort: Option<u32>,
}

impl Refusal {
    pub(super) fn new(text: impl Into<String>) -> Refusal {
        Refusal { text: text.into(), abort: None }
    }
}
