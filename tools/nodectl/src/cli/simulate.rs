//! `nodectl simulate`: a device of a data sheet on the bus.

use std::collections::VecDeque;
use std::fmt;
use std::path::PathBuf;

use canopen::{Duration, Frame, NodeId, QueueFull, Transmit};
use clap::Args;
use serde::Serialize;

use super::{Failure, Session};
use crate::bus::Station;
use crate::object::at;
use crate::simulate::{Node, Script, Table};
use crate::text::{note, visible};
use crate::value::unsigned;
use crate::{Catalogue, scan};

/// The largest script.
const LARGEST: u64 = 1 << 20;
/// How long to listen for a node that has the node-ID already. A heartbeat comes once a second as a rule.
const LISTEN: Duration = Duration::from_millis(1100);
/// The longest wait for a frame, so that the end of the command is noticed.
const WAKE: Duration = Duration::from_millis(100);

/// Answers as the device of a data sheet (--eds FILE): SDO, PDO, heartbeat, EMCY, LSS, storing of parameters.
#[derive(Debug, Args)]
pub(super) struct Simulate {
    /// A script that sets values over time: lines such as `0.5 6130:1 = 2.5`, `1 emcy 4200`, `5 repeat`.
    #[arg(long, value_name = "FILE")]
    values: Option<PathBuf>,

    /// The serial number (1018h:4).
    #[arg(long, value_parser = number)]
    serial: Option<u32>,

    /// Start without a node-ID and wait for LSS.
    #[arg(long)]
    unconfigured: bool,

    /// End after this number of seconds.
    #[arg(long = "for", value_name = "SECONDS")]
    duration: Option<u32>,
}

fn number(text: &str) -> Result<u32, String> {
    unsigned(text).ok_or_else(|| format!("\"{text}\" is no number of 32 bits"))
}

#[derive(Serialize)]
struct Running {
    node: Option<u8>,
    device: String,
    left_out: Vec<String>,
}

/// Frames to send.
#[derive(Default)]
struct Queue(VecDeque<Frame>);

impl Transmit for Queue {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push_back(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}

impl Simulate {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?;
        let Some(sheet) = session.sheets()?.file().cloned() else {
            return Err(Failure::Usage("a simulated device needs its data sheet: --eds FILE".to_owned()));
        };
        let table = Table::new(&sheet, Some(node)).map_err(|error| Failure::Usage(error.to_string()))?;
        let running = Running {
            node: (!self.unconfigured).then(|| node.get()),
            device: sheet.device.product_name.clone(),
            left_out: table.notes.clone(),
        };
        let mut device = Node::new(table, Some(node).filter(|_| !self.unconfigured));
        if let Some(serial) = self.serial {
            device.set(at(0x1018, 4), &serial.to_le_bytes());
        }
        device = device.with_script(self.script(Catalogue::new(sheet))?);
        if !self.unconfigured && is_in_use(session, node)? {
            let words =
                "is in use by another node on this bus: simulate a free one (`nodectl scan` lists the nodes)";
            return Err(Failure::Usage(format!("node-ID {} {words}", node.get())));
        }
        session.print(&running)?;
        self.serve(session, &mut device)
    }

    fn script(&self, catalogue: Catalogue) -> Result<Script, Failure> {
        let Some(path) = &self.values else { return Ok(Script::default()) };
        let text = wire::input::read_to_string(path, LARGEST).map_err(|error| Failure::file(path, error))?;
        Script::parse(&text, &catalogue).map_err(|error| Failure::file(path, error))
    }

    fn serve(&self, session: &mut Session, device: &mut Node) -> Result<(), Failure> {
        let network = &mut session.network;
        let end =
            self.duration.map(|seconds| network.now() + Duration::from_millis(u64::from(seconds) * 1000));
        let mut queue = Queue::default();
        let mut state: Option<(Option<NodeId>, canopen::nmt::State)> = None;
        loop {
            let now = network.now();
            let due = device.poll(now, &mut queue);
            while let Some(frame) = queue.0.pop_front() {
                network.send(&frame)?;
            }
            if end.is_some_and(|end| now >= end) {
                return Ok(());
            }
            let present = (device.node_id(), device.state());
            if state.replace(present) != Some(present) {
                let node =
                    present.0.map_or("without a node-ID".to_owned(), |node| format!("node {}", node.get()));
                note(format_args!("{node}: {}", crate::heartbeat::words(present.1)));
            }
            if let Some(received) = network.receive(due.min(now + WAKE))? {
                device.receive(&received.frame, network.now(), &mut queue);
            }
        }
    }
}

/// Whether a node answers with this node-ID, or sends its heartbeat. A stopped node answers no request.
fn is_in_use(session: &mut Session, node: NodeId) -> Result<bool, Failure> {
    let network = &mut session.network;
    if network.heard(node).is_some() {
        return Ok(true);
    }
    scan::ask(network, node)?;
    let id = u16::from(node.get());
    let until = network.now() + LISTEN;
    let is_of_node = |frame: &Frame| [0x580 + id, 0x700 + id].contains(&frame.id()) && !frame.is_remote();
    Ok(network.wait(until, |frame| is_of_node(frame).then_some(()))?.is_some())
}

impl fmt::Display for Running {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let node = self.node.map_or("a device without a node-ID".to_owned(), |node| format!("node {node}"));
        write!(f, "{node}: {}, simulated", visible(&self.device))?;
        self.left_out.iter().try_for_each(|one| write!(f, "\n  {}", visible(one)))
    }
}
