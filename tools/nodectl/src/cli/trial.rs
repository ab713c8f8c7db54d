//! `nodectl confirm` and `nodectl rollback`

use std::fmt;

use clap::Args;
use serde::Serialize;

use super::output::hex;
use super::{Failure, Session};
use crate::update::{Decision, Program, decide};

/// Confirms the program on trial (2002h): the node keeps it.
#[derive(Debug, Args)]
pub(super) struct Confirm {}

/// Rolls the program on trial back (2002h): the node restores the previous one.
#[derive(Debug, Args)]
pub(super) struct Rollback {}

#[derive(Serialize)]
struct Report {
    node: u8,
    result: &'static str,
    identification: Option<u32>,
}

impl Confirm {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        run(session, Decision::Confirm, "confirmed")
    }
}

impl Rollback {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        run(session, Decision::RollBack, "rolled back")
    }
}

fn run(session: &mut Session, decision: Decision, result: &'static str) -> Result<(), Failure> {
    let (sdo, key) = (session.options.sdo(), session.options.authorisation_key()?);
    for node in session.options.node.list()? {
        session.begin();
        let decided = decide(&mut session.network, node, decision, sdo, key.as_ref());
        decided.map_err(|error| session.explained_update(error))?;
        let identification = Program::new(&mut session.network, node, sdo).identification();
        let identification = identification.map_err(|error| session.named(error))?;
        session.print(&Report { node: node.get(), result, identification })?;
    }
    Ok(())
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Report { node, result, identification } = self;
        write!(f, "node {node}: {result}, program {} runs", hex(*identification))
    }
}
