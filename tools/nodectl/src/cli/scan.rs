//! `nodectl scan`

use std::fmt;

use canopen::NodeId;
use clap::Args;
use serde::Serialize;

use super::output::hex;
use super::{Failure, Session};
use crate::lift::is_lift;
use crate::network::Heard;
use crate::object::at;
use crate::scan::{Presence, scan};
use crate::text::{note, visible};
use crate::{heartbeat, value};

/// The hint when no node answers.
const NOBODY: &str = "nobody answers: is the bus the right one, with the right bit rate, and are the nodes on? \
                      Nodes without a node-ID are found by `nodectl lss scan`";

/// Lists the nodes that answer, or that send a heartbeat.
#[derive(Debug, Args)]
pub(super) struct Scan {
    /// How long to listen after the last question, in milliseconds; heartbeats usually come once a second.
    #[arg(long, value_name = "MS", default_value_t = 1200)]
    listen: u32,
}

#[derive(Serialize)]
struct Found {
    nodes: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    node: u8,
    state: Option<&'static str>,
    device_type: Option<u32>,
    vendor: Option<u32>,
    product: Option<u32>,
    name: Option<String>,
}

impl Scan {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let time = canopen::Duration::from_millis(self.listen.into());
        let found = scan(&mut session.network, time)?;
        let (mut nodes, mut incomplete) = (Vec::new(), None);
        for (node, presence) in found {
            session.begin();
            let mut row = row(node, presence);
            if let Err(failure) = identify(session, node, &mut row) {
                let before = incomplete.replace(failure);
                before.map_or(Ok(()), |failure| session.tell(&failure))?;
            }
            nodes.push(row);
        }
        let is_empty = nodes.is_empty();
        let answering: Vec<u8> =
            nodes.iter().filter(|row| row.device_type.is_some()).map(|row| row.node).collect();
        let has_lift = nodes.iter().filter_map(|row| row.device_type).any(is_lift);
        session.print(&Found { nodes })?;
        let is_there = |(node, heard): &(NodeId, Heard)| {
            !answering.contains(&node.get()) && (heard.is_sure || !has_lift)
        };
        for (node, _) in session.network.all_heard().filter(is_there) {
            note(format_args!("node {}: {}", node.get(), session.silence(node)));
        }
        if is_empty {
            return Err(Failure::Silence(NOBODY.to_owned()));
        }
        incomplete.map_or(Ok(()), Err)
    }
}

/// The row of a node. A node that does not answer SDO, for example a stopped one, gets a row, too.
fn row(node: NodeId, presence: Presence) -> Row {
    Row {
        node: node.get(),
        state: presence.state.map(heartbeat::words),
        device_type: presence.device_type,
        vendor: None,
        product: None,
        name: None,
    }
}

/// Reads the identity of a node that answers SDO.
fn identify(session: &mut Session, node: NodeId, row: &mut Row) -> Result<(), Failure> {
    if row.device_type.is_some() {
        row.vendor = session.word(node, at(0x1018, 1))?;
        row.product = session.word(node, at(0x1018, 2))?;
        row.name = session.optional(node, at(0x1008, 0))?.map(|bytes| value::text(&bytes));
    }
    Ok(())
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "node  state            device type  vendor     product    name")?;
        for row in &self.nodes {
            let Row { node, state, device_type, vendor, product, name } = row;
            write!(f, "\n{node:>4}  {:<15}  ", state.unwrap_or("-"))?;
            write!(f, "{:<11}  {:<9}  {:<9}  ", hex(*device_type), hex(*vendor), hex(*product))?;
            write!(f, "{}", visible(name.as_deref().unwrap_or("-")))?;
        }
        Ok(())
    }
}
