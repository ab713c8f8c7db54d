//! `nodectl nmt`

use std::fmt;

use canopen::nmt::{self, State};
use canopen::{Duration, NodeId};
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use super::node_set::NodeSet;
use super::{Failure, Session};
use crate::heartbeat;
use crate::nmt::{self as master, send};
use crate::object::at;
use crate::sdo::{Cause, Error};

/// How long a node may take to boot.
const BOOT: Duration = Duration::from_millis(10_000);

/// Changes the state of nodes.
#[derive(Debug, Args)]
pub(super) struct Nmt {
    command: Command,

    /// Do not wait until a node that is reset has booted, or a heartbeat has the new state.
    #[arg(long)]
    no_wait: bool,
}

#[derive(Clone, Copy, Debug, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Command {
    /// To operational.
    Start,
    /// To stopped.
    Stop,
    /// To pre-operational.
    Preop,
    /// Restart the node.
    Reset,
    /// Restart its communication.
    #[serde(rename = "reset-communication")]
    ResetComm,
}

#[derive(Serialize)]
struct Done {
    node: u8,
    state: Option<&'static str>,
}

/// A node that has booted, and its node-ID from now on.
#[derive(Serialize)]
struct Booted {
    node: u8,
    state: &'static str,
    booted: u8,
}

impl fmt::Display for Booted {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "node {}: {}", self.node, self.state)?;
        if self.booted == self.node { Ok(()) } else { write!(f, " as node {}", self.booted) }
    }
}

impl Nmt {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let (command, wanted) = self.command.meaning();
        let nodes = match &session.options.node {
            NodeSet::All => return Ok(send(&mut session.network, command, None)?),
            NodeSet::These(_) => session.options.node.list()?,
        };
        for node in nodes {
            match wanted {
                _ if self.no_wait => send(&mut session.network, command, Some(node))?,
                None => restart(session, command, node)?,
                Some(_) => change(session, command, node)?,
            }
        }
        Ok(())
    }
}

/// Restarts a node. One that LSS has given a new node-ID boots with it, and answers no more at its old one.
fn restart(session: &mut Session, command: nmt::Command, node: NodeId) -> Result<(), Failure> {
    let silence = || Failure::Silence(format!("node {}: no boot-up message", node.get()));
    // Another node may boot at the same time, while there is no node of this node-ID at all.
    let was_there = session.network.heard(node).is_some() || is_there(session, node)?;
    let booted = master::restart(&mut session.network, command, node, BOOT)?.ok_or_else(silence)?;
    if booted != node && (!was_there || is_there(session, node)?) {
        return Err(silence());
    }
    session.print(&Booted { node: node.get(), state: "booted", booted: booted.get() })
}

/// Changes the state. A node without a heartbeat cannot tell its state; then an SDO answer shows that the node exists.
/// A stopped node has no SDO, so a node that is to stop is asked before.
fn change(session: &mut Session, command: nmt::Command, node: NodeId) -> Result<(), Failure> {
    let answers = matches!(command, nmt::Command::Stop) && is_there(session, node)?;
    let time = session.options.timeout().max(Duration::from_millis(1500));
    let state = master::change(&mut session.network, command, node, time)?;
    if state.is_none() && !answers && !is_there(session, node)? {
        let node = node.get();
        return Err(Failure::Silence(format!(
            "node {node}: sent, but no such node answers or sends a heartbeat"
        )));
    }
    session.print(&Done { node: node.get(), state: state.map(heartbeat::words) })
}

/// Whether the node answers by SDO. A stopped node does not.
fn is_there(session: &mut Session, node: NodeId) -> Result<bool, Failure> {
    match session.client(node).upload(at(0x1000, 0)) {
        Err(Error { cause: Cause::Bus(error), .. }) => Err(error.into()),
        Err(error) => Ok(error.abort().is_some()),
        Ok(_) => Ok(true),
    }
}

impl Command {
    /// The NMT command and the state that follows; `None` for a restart.
    pub(super) fn meaning(self) -> (nmt::Command, Option<State>) {
        match self {
            Command::Start => (nmt::Command::Start, Some(State::Operational)),
            Command::Stop => (nmt::Command::Stop, Some(State::Stopped)),
            Command::Preop => (nmt::Command::EnterPreOperational, Some(State::PreOperational)),
            Command::Reset => (nmt::Command::ResetNode, None),
            Command::ResetComm => (nmt::Command::ResetCommunication, None),
        }
    }
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let state = self.state.unwrap_or("sent; no heartbeat tells the state");
        write!(f, "node {}: {state}", self.node)
    }
}
