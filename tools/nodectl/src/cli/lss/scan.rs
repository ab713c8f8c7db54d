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
    /// Give the nodes node-IDs from this one on, without those in use; without it, all nodes are listed and keep their node-IDs.
    #[arg(long, value_name = "NODE", value_parser = clap::value_parser!(u8).range(1..=127))]
    assign: Option<u8>,
    /// Make the nodes keep their node-IDs.
    #[arg(long, requires = "assign")]
    store: bool,
}

impl Scan {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let found = match self.assign {
            Some(first) => self.assign_all(session, first)?,
            None => self.list(session)?,
        };
        match found {
            0 => Err(Failure::Silence("no node without a node-ID answers".to_owned())),
            _ => Ok(()),
        }
    }

    /// Gives all nodes node-IDs. Returns their number.
    fn assign_all(&self, session: &mut Session, first: u8) -> Result<usize, Failure> {
        let mut free = Scan::free(session, first)?;
        let mut found = 0;
        while let Some(identity) = self.find(session)? {
            found += 1;
            let id = free.pop_front();
            let id = id.ok_or_else(|| Failure::Usage(format!("no node-ID from {first} on is free")));
            let configured = id.and_then(|id| self.configure(session, id).map(|()| id));
            Master::new(&mut session.network, session.options.timeout()).release()?;
            let id = configured?;
            booted(session, id)?;
            session.print(&slave(identity, Some(id)))?;
        }
        Ok(found)
    }

    /// Lists all nodes. A found node stays selected until the end, and takes no part in the search for the next one.
    fn list(&self, session: &mut Session) -> Result<usize, Failure> {
        let mut found = Vec::new();
        let mut next = self.find(session);
        while let Ok(Some(identity)) = next {
            // The search itself may have released the nodes.
            if found.contains(&identity) {
                break;
            }
            found.push(identity);
            session.print(&slave(identity, None))?;
            next = self.following(session);
        }
        Master::new(&mut session.network, session.options.timeout()).release()?;
        next.map(|_| found.len())
    }

    /// The next node while the former ones stay selected. Silence is asked once more, with longer steps.
    fn following(&self, session: &mut Session) -> Result<Option<Identity>, Failure> {
        let (step, bar) = (step(session, self.step), bar());
        let mut search =
            |step| Master::new(&mut session.network, step).fastscan(|asked| bar.set_position(asked.into()));
        let found = match search(step)? {
            Some(identity) => Some(identity),
            None => search(canopen::Duration(2 * step.0))?,
        };
        bar.finish_and_clear();
        Ok(found)
    }

    /// Free node-IDs from one on.
    fn free(session: &mut Session, first: u8) -> Result<VecDeque<NodeId>, Failure> {
        let used = only::configured(session)?;
        Ok((first..=127).filter_map(NodeId::new).filter(|id| !used.contains_key(id)).collect())
    }

    fn configure(&self, session: &mut Session, id: NodeId) -> Result<(), Failure> {
        let mut master = Master::new(&mut session.network, session.options.timeout());
        master.set_node_id(Some(id))?;
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
