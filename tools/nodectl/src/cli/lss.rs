//! `nodectl lss`

use std::fmt;

use canopen::lss::{BitRate, Identity};
use canopen::{Duration, NodeId};
use clap::{Args, Subcommand};
use serde::Serialize;

use super::output::hex;
use super::{Failure, Session};
use crate::lss::{Master, Selection};

/// Node-IDs and bit rates of nodes that are known by their identity (CiA 305).
#[derive(Debug, Args)]
pub(super) struct Lss {
    #[command(subcommand)]
    command: Command,

    /// The node, as VENDOR:PRODUCT:REVISION:SERIAL, decimal or after 0x hexadecimal. Without it, the only node on the
    /// bus.
    #[arg(long, global = true, value_name = "IDENTITY", value_parser = identity)]
    select: Option<Identity>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Find the nodes that have no node-ID.
    Scan {
        /// How long each of the 133 steps takes, in milliseconds.
        #[arg(long, value_name = "MS", default_value_t = 50)]
        step: u32,
        /// Give them node-IDs from this one on; else only the first is found.
        #[arg(long, value_name = "NODE")]
        assign: Option<u8>,
    },
    /// Ask for identity and node-ID.
    Inquire,
    /// Give a node-ID, or none.
    SetId {
        /// 1 to 127, or 255 for none. In force after a reset of communication.
        id: u8,
        /// Make the node keep it.
        #[arg(long)]
        store: bool,
    },
    /// Give a bit rate.
    SetRate {
        /// In kbit/s; 0 to detect it. In force after `activate` or the next start.
        kbit: u16,
        /// Make the node keep it.
        #[arg(long)]
        store: bool,
    },
    /// Make the node keep its configuration.
    Store,
    /// Change to the new bit rate now.
    Activate {
        /// How long before and after the change nobody sends, in milliseconds.
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
        if let Command::Scan { step, assign } = self.command {
            return scan(session, step, assign);
        }
        let timeout = session.options.timeout();
        let mut master = Master::new(&mut session.network, timeout);
        master.select(self.select.map_or(Selection::All, Selection::One))?;
        let done = self.serve(&mut master);
        // Whatever came of it, no slave is left waiting for more.
        let released = master.release();
        let done = done?;
        released?;
        done.print(session)
    }

    fn serve(&self, master: &mut Master) -> Result<Answer, Failure> {
        let done = match self.command {
            Command::Inquire => return Ok(Answer::Slave(slave(master.identity()?, master.node_id()?))),
            Command::SetId { id, store } => {
                master.set_node_id(node_id(id)?)?;
                if store {
                    master.store()?;
                }
                format!("node-ID {id}{}", kept(store))
            }
            Command::SetRate { kbit, store } => {
                master.set_bit_rate(bit_rate(kbit)?)?;
                if store {
                    master.store()?;
                }
                format!("bit rate {kbit} kbit/s{}", kept(store))
            }
            Command::Store => {
                master.store()?;
                "stored".to_owned()
            }
            Command::Activate { delay } => {
                master.activate(delay)?;
                format!("the bit rate changes in {delay} ms; the bus of this host has to change too")
            }
            Command::Scan { .. } => String::new(),
        };
        Ok(Answer::Done(Done { done }))
    }
}

/// What there is to print.
enum Answer {
    Slave(Slave),
    Done(Done),
}

impl Answer {
    fn print(&self, session: &mut Session) -> Result<(), Failure> {
        match self {
            Answer::Slave(slave) => session.print(slave),
            Answer::Done(done) => session.print(done),
        }
    }
}

/// A node that has got a node-ID no longer takes part, so the next one is found.
fn scan(session: &mut Session, step: u32, assign: Option<u8>) -> Result<(), Failure> {
    let timeout = Duration::from_millis(step.into());
    let mut ids = assign.map(|first| (first..=127).filter_map(NodeId::new)).into_iter().flatten();
    loop {
        let mut master = Master::new(&mut session.network, timeout);
        let Some(identity) = master.fastscan()? else {
            eprintln!("no node without a node-ID (any more)");
            return Ok(());
        };
        let id = ids.next();
        if id.is_some() {
            master.set_node_id(id)?;
        }
        master.release()?;
        session.print(&slave(identity, id))?;
        if id.is_none() {
            return Ok(());
        }
    }
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

fn bit_rate(kbit: u16) -> Result<BitRate, Failure> {
    BitRate::from_kbit(kbit).ok_or_else(|| {
        let rates = "CANopen has 10, 20, 50, 125, 250, 500, 800 and 1000 kbit/s, and 0 to detect it";
        Failure::Usage(rates.to_owned())
    })
}

fn identity(text: &str) -> Result<Identity, String> {
    let number = |text: &str| match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    };
    let numbers: Option<Vec<u32>> = text.split(':').map(number).collect();
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
