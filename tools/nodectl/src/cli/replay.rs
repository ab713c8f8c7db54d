//! `nodectl replay`: sends the frames of a log again.

use std::fmt;
use std::path::PathBuf;

use canopen::{Duration, Instant, NodeId};
use clap::Args;
use serde::Serialize;

use super::can_id::can_id;
use super::node_set::NodeSet;
use super::traffic::Records;
use super::{Failure, Session};
use crate::text::counted;
use crate::trace::Record;

/// Sends the frames of a log (candump, Vector .asc, PEAK .trc) with their distances in time. The nodes that are on the
/// bus answer them.
#[derive(Debug, Args)]
pub(super) struct Replay {
    /// The log; "-" for the standard input.
    file: PathBuf,

    /// Only frames whose CAN-ID is of these nodes (1,2,5-8).
    #[arg(long, value_name = "NODES", default_value = "all")]
    of: NodeSet,

    /// Only these CAN-IDs, in hexadecimal digits (181, 0x181, 181h).
    #[arg(long, value_name = "ID", value_delimiter = ',', value_parser = can_id)]
    id: Vec<u16>,

    /// How many times faster than the log; 0 without pauses.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    speed: f64,
}

#[derive(Serialize)]
struct Done {
    frames: usize,
    left_out: usize,
}

impl Replay {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        if !self.speed.is_finite() || self.speed < 0.0 {
            return Err(Failure::Usage("the speed is a number from 0 on".to_owned()));
        }
        let begin = session.network.now();
        let mut first: Option<Instant> = None;
        let mut done = Done { frames: 0, left_out: 0 };
        for record in Records::open(&self.file)? {
            let (at, record) = record?;
            let Record::Frame(frame) = record else {
                done.left_out += 1;
                continue;
            };
            if !self.is_wanted(frame.id()) {
                done.left_out += 1;
                continue;
            }
            let first = *first.get_or_insert(at);
            self.wait(session, begin, at.0.saturating_sub(first.0))?;
            session.network.send(&frame)?;
            done.frames += 1;
        }
        session.print(&done)
    }

    fn is_wanted(&self, id: u16) -> bool {
        let is_node = match &self.of {
            NodeSet::All => true,
            NodeSet::These(nodes) => {
                let node = u8::try_from(id & 0x7F).ok().and_then(NodeId::new);
                id > 0x080 && node.is_some_and(|node| nodes.contains(&node))
            }
        };
        is_node && (self.id.is_empty() || self.id.contains(&id))
    }

    /// Waits until the time of a frame. Frames of the bus are passed over.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn wait(&self, session: &mut Session, begin: Instant, after: u64) -> Result<(), Failure> {
        if self.speed == 0.0 {
            return Ok(());
        }
        let until = begin + Duration((after as f64 / self.speed) as u64);
        session.network.forget();
        while session.network.now() < until && session.network.receive(until)?.is_some() {}
        Ok(())
    }
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&counted(self.frames, "frame sent", "frames sent"))?;
        if self.left_out > 0 { write!(f, ", {} left out", self.left_out) } else { Ok(()) }
    }
}
