//! `nodectl lss scan`

use std::collections::VecDeque;

use canopen::NodeId;
use canopen::client::lss::Fastscan;
use canopen::lss::Identity;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{booted, only, slave, step};
use crate::cli::{Failure, Session};
use crate::lss::Master;

/// The number of searches, each with longer steps, when nodes are there and none is found.
const ATTEMPTS: u32 = 3;

#[derive(Debug, Args)]
pub(super) struct Scan {
    /// How long each of the 133 steps may take, in milliseconds; a tenth of --timeout if it is left out.
    #[arg(long, value_name = "MS")]
    step: Option<u32>,
    /// Give the nodes node-IDs from this one on, without those in use; by default only the first node is found.
    #[arg(long, value_name = "NODE", value_parser = clap::value_parser!(u8).range(1..=127))]
    assign: Option<u8>,
    /// Make the nodes keep their node-IDs.
    #[arg(long, requires = "assign")]
    store: bool,
}

impl Scan {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let mut free = self.free(session)?;
        let mut found = 0;
        while let Some(identity) = self.find(session)? {
            found += 1;
            let id = self.assign.map(|first| free.pop_front().ok_or(first)).transpose();
            let id = id.map_err(|first| Failure::Usage(format!("no node-ID from {first} on is free")));
            let configured = id.and_then(|id| self.configure(session, id).map(|()| id));
            Master::new(&mut session.network, session.options.timeout()).release()?;
            let id = configured?;
            if let Some(id) = id {
                booted(session, id)?;
            }
            session.print(&slave(identity, id))?;
            if id.is_none() {
                return Ok(());
            }
        }
        match found {
            0 => Err(Failure::Silence("no node without a node-ID answers".to_owned())),
            _ => Ok(()),
        }
    }

    /// Free node-IDs.
    fn free(&self, session: &mut Session) -> Result<VecDeque<NodeId>, Failure> {
        let Some(first) = self.assign else { return Ok(VecDeque::new()) };
        let used = only::configured(session)?;
        Ok((first..=127).filter_map(NodeId::new).filter(|id| !used.contains_key(id)).collect())
    }

    fn configure(&self, session: &mut Session, id: Option<NodeId>) -> Result<(), Failure> {
        let mut master = Master::new(&mut session.network, session.options.timeout());
        if id.is_some() {
            master.set_node_id(id)?;
        }
        if self.store {
            master.store()?;
        }
        Ok(())
    }

    fn find(&self, session: &mut Session) -> Result<Option<Identity>, Failure> {
        let (step, bar) = (step(session, self.step), bar());
        let found = find(session, step, |asked| bar.set_position(asked.into()));
        bar.finish_and_clear();
        found
    }
}

/// Finds a node without a node-ID and leaves it selected. On a slow bus adapter an answer may come after its step. So a
/// question with the full time-out decides whether there is no such node. `progress` is called with the number of
/// questions asked.
pub(in crate::cli) fn find(
    session: &mut Session,
    step: canopen::Duration,
    mut progress: impl FnMut(u8),
) -> Result<Option<Identity>, Failure> {
    let timeout = session.options.timeout();
    for attempt in 0..ATTEMPTS {
        let step = canopen::Duration(step.0 << attempt);
        let found = Master::new(&mut session.network, step).fastscan(&mut progress);
        if let Ok(Some(identity)) = found {
            return Ok(Some(identity));
        }
        let mut master = Master::new(&mut session.network, timeout);
        master.release()?;
        if !master.is_anybody_unconfigured()? {
            return Ok(found?);
        }
    }
    let message = "nodes without a node-ID answer, but none can be found: give them more time with --step";
    Err(Failure::Silence(message.to_owned()))
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("searching [{bar:30}] {percent:>3} % {elapsed}");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(Fastscan::QUESTIONS.into()).with_style(style.progress_chars("=> "))
}
