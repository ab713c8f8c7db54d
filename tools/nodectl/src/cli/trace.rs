//! `nodectl trace`

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use canopen::sdo::Multiplexer;
use canopen::{Duration, Frame, Instant, NodeId};
use clap::Args;
use serde::Serialize;

use super::by_id::{ByCanId, HEAD, service};
use super::node_set::NodeSet;
use super::read::place;
use super::record::seconds_between;
use super::traffic::{Listening, Records};
use super::{Failure, Session};
use crate::Catalogue;
use crate::scan::scan;
use crate::text::{hex_digits, note, visible};
use crate::trace::{Decoder, Foreign, Kind, Knowledge, Line, Record, Shown};
use crate::value::Value;

/// The longest wait for a frame, after which the end of the trace is checked.
const PATIENCE: Duration = Duration::from_millis(200);
/// How long to listen for nodes before their objects are read.
const LISTEN: Duration = Duration::from_millis(300);

/// How often a node is asked for its PDOs while another client uses its SDO server.
const TRIES: usize = 3;

/// Shows the traffic on the bus: every frame decoded, with names, values and units; a transfer of several frames is one
/// line.
///
/// Nodes are asked first for the mapping of their PDOs and the units. Later changes are taken from the trace itself.
#[derive(Debug, Args)]
pub(super) struct Trace {
    /// Decode a log of candump, Vector (.asc) or PEAK (.trc) instead of the bus ("-" for the standard input). `--eds` is for the nodes of `--of`, or all.
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,

    /// Only frames from and to these nodes (1,2,5-8).
    #[arg(long, value_name = "NODES", default_value = "all")]
    of: NodeSet,

    /// Only these services.
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    kind: Vec<Kind>,

    /// All services but these.
    #[arg(long, value_name = "KIND", value_delimiter = ',', conflicts_with = "kind")]
    without: Vec<Kind>,

    /// Send nothing: PDOs are decoded by the data sheet of `--eds` only.
    #[arg(long)]
    silent: bool,

    /// One line for each CAN-ID at the end: count, period, newest data; and the load of the bus at `--bit-rate`.
    #[arg(long)]
    by_id: bool,

    /// End after this number of lines.
    #[arg(long, value_name = "N")]
    count: Option<usize>,

    /// End after this number of seconds.
    #[arg(long = "for", value_name = "SECONDS")]
    seconds: Option<u32>,
}

/// A line in the form for scripts.
#[derive(Serialize)]
struct Row {
    time: f64,
    can_id: u32,
    kind: Kind,
    node: Option<u8>,
    text: String,
    values: Vec<Cell>,
    #[serde(skip_serializing_if = "Option::is_none")]
    abort: Option<u32>,
    data: String,
}

#[derive(Serialize)]
struct Cell {
    #[serde(rename = "object", serialize_with = "place")]
    at: Multiplexer,
    name: String,
    value: Option<Value>,
    unit: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    meaning: Option<String>,
}

/// The decoder, and the number of lines that may still be printed.
struct Printer<'t> {
    trace: &'t Trace,
    decoder: Decoder,
    start: Option<Instant>,
    left: usize,
    /// The frames by CAN-ID, where these are asked for instead of lines.
    by_id: Option<ByCanId>,
}

impl Trace {
    /// Whether the command needs a bus: a file is decoded without one.
    pub(super) fn needs_a_bus(&self) -> bool {
        self.file.is_none()
    }

    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let decoder = self.decoder(session)?;
        let (left, by_id) = (self.count.unwrap_or(usize::MAX), self.by_id.then(ByCanId::default));
        let mut printer = Printer { trace: self, decoder, start: None, left, by_id };
        match &self.file {
            Some(path) => printer.file(session, path)?,
            None => printer.bus(session)?,
        }
        printer.by_id.map_or(Ok(()), |counted| print_by_id(session, &counted))
    }

    /// A decoder with the knowledge about the nodes.
    fn decoder(&self, session: &mut Session) -> Result<Decoder, Failure> {
        let mut decoder = Decoder::default();
        if let Some(sheet) = session.sheets()?.file().cloned() {
            let catalogue = Arc::new(Catalogue::new(sheet));
            self.named()
                .into_iter()
                .for_each(|node| decoder.know(node, Knowledge::new(Arc::clone(&catalogue))));
        }
        if self.file.is_none() && !self.silent {
            for node in self.present(session)? {
                match Trace::survey(session, node) {
                    Ok(knowledge) => decoder.know(node, knowledge),
                    Err(failure) if failure.is_silence() => return Err(failure),
                    Err(failure) => {
                        // Until the trace shows other values, the defaults of the data sheet apply.
                        if session.knows(node) {
                            decoder.know(node, Knowledge::new(session.catalogue(node)?));
                        }
                        note(format_args!(
                            "node {}: the mapping of its PDOs and their units could not be read",
                            node.get()
                        ));
                        session.tell(&failure)?;
                    }
                }
            }
            // The trace and its time begin now.
            session.network.forget();
        }
        Ok(decoder)
    }

    /// Reads the PDOs of a node and the units of their objects. Other clients may use the node at the same time.
    fn survey(session: &mut Session, node: NodeId) -> Result<Knowledge, Failure> {
        let mut tries = 0;
        loop {
            // Beside another client, each transfer waits for its turn.
            if session.has_other_client(node) {
                session.begin_all();
            } else {
                session.begin();
            }
            let catalogue = session.catalogue(node);
            let asked = catalogue.and_then(|catalogue| {
                let asked = Knowledge::ask(&mut session.client(node), catalogue);
                asked.map_err(|error| session.named(error))
            });
            tries += 1;
            match asked {
                Err(Failure::Sdo(error)) if error.is_busy() && tries < TRIES => (),
                asked => return asked,
            }
        }
    }

    /// The nodes that the filter names.
    fn named(&self) -> BTreeSet<NodeId> {
        match &self.of {
            NodeSet::All => (1..=127).filter_map(NodeId::new).collect(),
            NodeSet::These(nodes) => nodes.clone(),
        }
    }

    /// The nodes of the filter that answer.
    fn present(&self, session: &mut Session) -> Result<Vec<NodeId>, Failure> {
        let mut found = scan(&mut session.network, LISTEN)?;
        session.network.forget();
        let named = self.named();
        found.retain(|node, _| named.contains(node));
        for (node, _) in found.iter().filter(|(_, presence)| presence.device_type.is_none()) {
            if session.has_other_client(*node) {
                note(format_args!("node {}: {}", node.get(), session.silence(*node)));
            }
        }
        found.retain(|_, presence| presence.device_type.is_some());
        Ok(found.into_keys().collect())
    }

    /// Whether the filter has a service and a node.
    fn is_named(&self, kind: Kind, node: Option<NodeId>) -> bool {
        let is_kind = (self.kind.is_empty() || self.kind.contains(&kind)) && !self.without.contains(&kind);
        let is_node = match &self.of {
            NodeSet::All => true,
            NodeSet::These(nodes) => node.is_some_and(|node| nodes.contains(&node)),
        };
        is_kind && is_node
    }
}

impl Printer<'_> {
    fn bus(&mut self, session: &mut Session) -> Result<(), Failure> {
        let mut listening = Listening::begin(session, self.trace.seconds, PATIENCE);
        while self.left > 0 {
            if let Some(received) = listening.receive(session)? {
                self.frame(session, &received.frame, received.at)?;
            }
            if listening.is_over(session) {
                break;
            }
        }
        Ok(())
    }

    fn file(&mut self, session: &mut Session, path: &Path) -> Result<(), Failure> {
        let mut records = Records::open(path)?;
        while self.left > 0
            && let Some(record) = records.next()
        {
            match record? {
                (at, Record::Frame(frame)) => self.frame(session, &frame, at)?,
                (at, Record::Foreign(frame)) if self.by_id.is_some() => {
                    let Foreign { id, data, .. } = frame;
                    self.by_id.iter_mut().for_each(|all| all.add(id, Kind::Other, None, &data, at));
                }
                (at, Record::Foreign(frame)) => {
                    self.lines(session, vec![Decoder::on_foreign(frame, at)], at)?;
                }
            }
        }
        Ok(())
    }

    fn frame(&mut self, session: &mut Session, frame: &Frame, at: Instant) -> Result<(), Failure> {
        let lines = self.decoder.on_frame(frame, at);
        if let Some(counted) = &mut self.by_id {
            let (kind, node) = service(frame.id(), &lines);
            if self.trace.is_named(kind, node.and_then(NodeId::new)) {
                counted.add(frame.id().into(), kind, node, frame.data(), at);
            }
            return Ok(());
        }
        self.lines(session, lines, at)
    }

    fn lines(&mut self, session: &mut Session, lines: Vec<Line>, at: Instant) -> Result<(), Failure> {
        let start = *self.start.get_or_insert(at);
        for line in lines {
            if self.left > 0 && self.trace.is_named(line.kind, line.node) {
                self.left -= 1;
                session.print(&row(line, start))?;
            }
        }
        Ok(())
    }
}

/// Prints a line for each CAN-ID, and one for the bus.
fn print_by_id(session: &mut Session, counted: &ByCanId) -> Result<(), Failure> {
    if !session.options.json {
        session.output.write(format!("{HEAD}\n").as_bytes())?;
    }
    counted.rows().try_for_each(|row| session.print(&row))?;
    let bus = counted.bus(session.options.bit_rate());
    session.print(&bus)
}

fn row(line: Line, start: Instant) -> Row {
    let Line { at, id, kind, node, text, values, abort, data } = line;
    let cell = |Shown { at, name, value, unit, meaning }| Cell { at, name, value, unit, meaning };
    Row {
        time: seconds_between(start, at),
        can_id: id,
        kind,
        node: node.map(NodeId::get),
        text,
        values: values.into_iter().map(cell).collect(),
        abort,
        data: hex_digits(&data, ""),
    }
}

/// `  0.020012  181h  pdo          1  TPDO 1: Pressure process value = 3.25 bar`
impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Row { time, can_id, kind, node, text, .. } = self;
        let node = node.map_or_else(|| "-".to_owned(), |node| node.to_string());
        write!(f, "{time:10.6} {can_id:03X}h {:<9} {node:>3}  {}", kind.name(), visible(text))
    }
}
