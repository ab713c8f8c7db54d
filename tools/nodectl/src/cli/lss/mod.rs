//! `nodectl lss`

mod only;
pub(super) mod scan;

use std::fmt;

use canopen::lss::{BitRate, Identity};
use canopen::{Duration, NodeId};
use clap::{Args, Subcommand};
use serde::Serialize;

use self::scan::Scan;
use super::output::hex;
use super::{Failure, Session};
use crate::heartbeat;
use crate::lss::{Master, Selection};
use crate::text::note;
use crate::value::unsigned;

/// The minimum time to wait for a node that boots with a new node-ID.
const BOOT: Duration = Duration::from_millis(2000);

/// Node-IDs and bit rates of nodes that are known by their identity (CiA 305).
#[derive(Debug, Args)]
pub(super) struct Lss {
    #[command(subcommand)]
    command: Command,

    /// The node, as VENDOR:PRODUCT:REVISION:SERIAL, decimal or after 0x hexadecimal. Without it, the only node on the
    /// bus: it is looked for first, and nothing is done where there are several.
    #[arg(long, global = true, value_name = "IDENTITY", value_parser = identity)]
    select: Option<Identity>,

    /// All nodes on the bus, for set-rate, store and activate.
    #[arg(long, global = true, conflicts_with = "select")]
    all: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Find the nodes that have no node-ID.
    Scan(Scan),
    /// Ask for identity and node-ID.
    Inquire,
    /// Give a node-ID, or none.
    SetId {
        /// 1 to 127, or 255 for none. In force after a reset of communication.
        id: u8,
        /// Make the node keep the node-ID.
        #[arg(long)]
        store: bool,
    },
    /// Give a bit rate.
    SetRate {
        /// In kbit/s; 0 to detect it. In force after `activate` or the next start.
        kbit: u16,
        /// Make the node keep the bit rate.
        #[arg(long)]
        store: bool,
    },
    /// Make the node keep its configuration.
    Store,
    /// Change to the new bit rate now.
    Activate {
        /// How long all nodes are silent before and after the change, in milliseconds.
        #[arg(default_value_t = 500)]
        delay: u16,
    },
}

#[derive(Serialize)]
struct Slave {
    vendor: u32,
    product: u32,
    revision: u32,
    serial: u32,
    node: Option<u8>,
}

#[derive(Serialize)]
struct Done {
    done: String,
}

impl Lss {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        if let Command::Scan(scan) = &self.command {
            return scan.run(session);
        }
        let selection = self.selection(session)?;
        let timeout = session.options.timeout();
        let mut master = Master::new(&mut session.network, timeout);
        master.select(selection)?;
        let done = self.serve(&mut master);
        // Release all slaves in any case, also after an error.
        let released = master.release();
        let done = done?;
        released?;
        if let Answer::NodeId { id, boots, .. } = done {
            match id {
                _ if !boots => note("in force after `nodectl nmt reset-comm --node all`"),
                Some(id) => booted(session, id)?,
                None => (),
            }
        }
        done.print(session)
    }

    /// The slaves that the command is for. Wrong arguments are refused before any slave is selected.
    fn selection(&self, session: &mut Session) -> Result<Selection, Failure> {
        if let Command::SetRate { kbit, .. } = self.command {
            bit_rate(kbit)?;
        }
        let id = match self.command {
            Command::SetId { id, .. } => node_id(id)?,
            _ => None,
        };
        match self.command {
            Command::SetId { .. } | Command::Inquire if self.all => {
                return Err(Failure::Usage("this command is for one node".to_owned()));
            }
            _ if self.all => return Ok(Selection::All),
            _ => (),
        }
        let identity = self.select.map_or_else(|| only::only(session), Ok)?;
        if let Some(id) = id {
            free(session, id, &identity)?;
        }
        Ok(Selection::One(identity))
    }

    fn serve(&self, master: &mut Master) -> Result<Answer, Failure> {
        let done = match self.command {
            Command::Inquire => return Ok(Answer::Slave(slave(master.identity()?, master.node_id()?))),
            Command::SetId { id, store } => {
                let had_one = master.node_id()?.is_some();
                master.set_node_id(node_id(id)?)?;
                if store {
                    master.store()?;
                }
                let done = Done { done: format!("node-ID {id}{}", kept(store)) };
                return Ok(Answer::NodeId { done, id: node_id(id)?, boots: !had_one });
            }
            Command::SetRate { kbit, store } => {
                master.set_bit_rate(bit_rate(kbit)?)?;
                if store {
                    master.store()?;
                }
                let rate =
                    if kbit == 0 { "automatic detection".to_owned() } else { format!("{kbit} kbit/s") };
                format!("bit rate: {rate}{}", kept(store))
            }
            Command::Store => {
                master.store()?;
                "stored".to_owned()
            }
            Command::Activate { delay } => {
                master.activate(delay)?;
                format!("the bit rate changes in {delay} ms; the bus of this host has to change too")
            }
            Command::Scan(_) => String::new(),
        };
        Ok(Answer::Done(Done { done }))
    }
}

/// The result to print.
enum Answer {
    Slave(Slave),
    Done(Done),
    /// A new node-ID or none, and whether the node had none, so that it boots with a new one at once.
    NodeId {
        done: Done,
        id: Option<NodeId>,
        boots: bool,
    },
}

impl Answer {
    fn print(&self, session: &mut Session) -> Result<(), Failure> {
        match self {
            Answer::Slave(slave) => session.print(slave),
            Answer::Done(done) | Answer::NodeId { done, .. } => session.print(done),
        }
    }
}

/// The duration of a step of a search.
fn step(session: &Session, given: Option<u32>) -> Duration {
    given.map_or(Duration(session.options.timeout().0 / 10), |step| Duration::from_millis(step.into()))
}

/// Refuses a node-ID that another node has.
pub(super) fn free(session: &mut Session, id: NodeId, identity: &Identity) -> Result<(), Failure> {
    let is_used = only::configured(session)?.contains_key(&id);
    if is_used && only::identity(session, id).ok().as_ref() != Some(identity) {
        return Err(Failure::Usage(format!("node-ID {} is in use by another node", id.get())));
    }
    Ok(())
}

/// Waits for the boot-up message of a node that has got a node-ID.
pub(super) fn booted(session: &mut Session, id: NodeId) -> Result<(), Failure> {
    let time = session.options.timeout().max(BOOT);
    let heard = heartbeat::wait(&mut session.network, id, time)?;
    heard.map(drop).ok_or_else(|| {
        Failure::Silence(format!(
            "node {0}: it has taken the node-ID {0}, and no boot-up message has come",
            id.get()
        ))
    })
}

/// An identity as --select takes it.
fn describe(identity: &Identity) -> String {
    let Identity { vendor, product, revision, serial } = identity;
    format!("0x{vendor:X}:0x{product:X}:0x{revision:X}:0x{serial:X}")
}

fn slave(identity: Identity, node: Option<NodeId>) -> Slave {
    let Identity { vendor, product, revision, serial } = identity;
    Slave { vendor, product, revision, serial, node: node.map(NodeId::get) }
}

fn kept(store: bool) -> &'static str {
    if store { ", stored" } else { "" }
}

fn node_id(id: u8) -> Result<Option<NodeId>, Failure> {
    let node = NodeId::new(id);
    let is_valid = node.is_some() || id == u8::MAX;
    is_valid.then_some(node).ok_or_else(|| Failure::Usage(format!("{id} is no node-ID")))
}

pub(super) fn bit_rate(kbit: u16) -> Result<BitRate, Failure> {
    BitRate::from_kbit(kbit).ok_or_else(|| {
        let rates = "CANopen has 10, 20, 50, 125, 250, 500, 800 and 1000 kbit/s, and 0 to detect it";
        Failure::Usage(rates.to_owned())
    })
}

fn identity(text: &str) -> Result<Identity, String> {
    let numbers: Option<Vec<u32>> = text.split(':').map(unsigned).collect();
    match numbers.as_deref() {
        Some(&[vendor, product, revision, serial]) => Ok(Identity { vendor, product, revision, serial }),
        _ => Err("an identity is VENDOR:PRODUCT:REVISION:SERIAL".to_owned()),
    }
}

impl fmt::Display for Slave {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let word = |value| hex(Some(value));
        write!(f, "vendor {}, product {}, ", word(self.vendor), word(self.product))?;
        write!(f, "revision {}, serial number {}, ", word(self.revision), word(self.serial))?;
        match self.node {
            Some(node) => write!(f, "node-ID {node}"),
            None => write!(f, "no node-ID"),
        }
    }
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identities() {
        let expected = Identity { vendor: 0, product: 1, revision: 0x1_0000, serial: 0x1234_5678 };
        assert_eq!(identity("0:1:0x10000:0x12345678"), Ok(expected));
        for text in ["", "1:2:3", "1:2:3:4:5", "a:b:c:d", "1:2:3:-4"] {
            assert!(identity(text).is_err(), "{text}");
        }
    }
}
