//! `nodectl save` and `nodectl restore`: objects 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14).

use std::fmt;

use clap::{Args, ValueEnum};
use serde::Serialize;

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
#[derive(Clone, Copy, Debug, ValueEnum)]
#[repr(u8)]
enum Group {
    All = 1,
    Communication = 2,
    Application = 3,
    Manufacturer = 4,
}

#[derive(Serialize)]
struct Done {
    node: u8,
    group: String,
    what: &'static str,
}

impl Save {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        sign(session, 0x1010, self.group, *b"save", "saved")
    }
}

impl Restore {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        sign(session, 0x1011, self.group, *b"load", "restored, in force after the next reset")
    }
}

/// Writes the signature that shows that it is meant.
fn sign(
    session: &mut Session,
    index: u16,
    group: Group,
    signature: [u8; 4],
    what: &'static str,
) -> Result<(), Failure> {
    for node in session.options.node.list()? {
        session.catalogue(node)?;
        let written = session.client(node).download(at(index, group as u8), &signature, |_| ());
        written.map_err(|error| session.named(error))?;
        session.print(&Done { node: node.get(), group: format!("{group:?}").to_lowercase(), what })?;
    }
    Ok(())
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "node {}: {} parameters {}", self.node, self.group, self.what)
    }
}
