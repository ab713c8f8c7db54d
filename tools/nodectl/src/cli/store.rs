//! `nodectl save` and `nodectl restore`: objects 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14).

use std::fmt;

use canopen::NodeId;
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};

use super::{Failure, Session};
use crate::object::at;

/// Makes the node keep its parameters.
#[derive(Debug, Args)]
pub(super) struct Save {
    /// Which parameters.
    #[arg(default_value = "all")]
    group: Group,
}

/// Gives the node its factory parameters back, from its next reset on.
#[derive(Debug, Args)]
pub(super) struct Restore {
    /// Which parameters.
    #[arg(default_value = "all")]
    group: Group,
}

/// A group of parameters. The discriminant is its sub-index.
#[derive(Clone, Copy, Debug, Default, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub(super) enum Group {
    #[default]
    All = 1,
    Communication = 2,
    Application = 3,
    Manufacturer = 4,
}

/// An order to a node about its parameters.
#[derive(Clone, Copy, Debug)]
pub(super) enum Order {
    /// Save the parameters (1010h).
    Save,
    /// Restore the defaults at the next reset (1011h).
    Restore,
}

#[derive(Serialize)]
struct Done {
    node: u8,
    group: String,
    what: &'static str,
}

impl Save {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        for_each(session, Order::Save, self.group, "saved")
    }
}

impl Restore {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        for_each(session, Order::Restore, self.group, "restored, in force after the next reset")
    }
}

fn for_each(session: &mut Session, order: Order, group: Group, what: &'static str) -> Result<(), Failure> {
    for node in session.options.node.list()? {
        sign(session, node, order, group)?;
        session.print(&Done { node: node.get(), group: format!("{group:?}").to_lowercase(), what })?;
    }
    Ok(())
}

/// Writes the signature that protects 1010h and 1011h against accidental writes.
pub(super) fn sign(session: &mut Session, node: NodeId, order: Order, group: Group) -> Result<(), Failure> {
    session.catalogue(node)?;
    let (index, signature) = match order {
        Order::Save => (0x1010, b"save"),
        Order::Restore => (0x1011, b"load"),
    };
    let written = session.client(node).download(at(index, group as u8), signature, |_| ());
    written.map_err(|error| session.named(error))
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "node {}: {} parameters {}", self.node, self.group, self.what)
    }
}
