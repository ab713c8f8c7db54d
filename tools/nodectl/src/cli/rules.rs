//! `nodectl rules`

use std::fmt;
use std::path::{Path, PathBuf};

use canopen::{Duration, Frame, Instant, NodeId};
use clap::Args;
use monitor::{Breach, Monitor, Rule, Sender};
use serde::Serialize;

use super::node_set::NodeSet;
use super::options::parse_bit_rate;
use super::traffic::{Listening, Records};
use super::{Failure, Session};
use crate::rules::{self, Device};
use crate::text::hex_digits;
use crate::trace::Record;

/// The longest wait for a frame, after which the end of the run is checked.
const PATIENCE: Duration = Duration::from_millis(100);

/// Judges the traffic on the bus by the rules of CiA 301 and by the settings of the nodes; sends nothing.
///
/// Settings are learned from SDO transfers on the bus and from data sheets (--device, --eds). A breach is printed with the
/// frames that show it. Ends with exit code 10 after a breach.
#[derive(Debug, Args)]
pub(super) struct Rules {
    /// Judge a file of candump instead of the bus ("-" for the standard input).
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,

    /// Judge only these nodes (1,2,5-8).
    #[arg(long, value_name = "NODES", default_value = "all")]
    of: NodeSet,

    /// A node and its device: a personality of this project or a data sheet (1=pressure, 5=drive.eds).
    #[arg(long, value_name = "NODE=DEVICE")]
    device: Vec<Device>,

    /// The nodes have the default values of their data sheets: nothing is saved in them.
    #[arg(long)]
    factory: bool,

    /// Bit rate of the bus in kbit/s; without it, the traffic shows the bit rate.
    #[arg(long, value_name = "KBIT/S", value_parser = parse_bit_rate)]
    rate: Option<u16>,

    /// Rules that are not applied, by name (heartbeat-late,emcy).
    #[arg(long, value_name = "RULE", value_delimiter = ',', value_parser = rule)]
    without: Vec<Rule>,

    /// End after this number of seconds.
    #[arg(long = "for", value_name = "SECONDS")]
    seconds: Option<u32>,

    /// Print the rules with their clauses, and end.
    #[arg(long)]
    list: bool,
}

/// A breach in the form for scripts.
#[derive(Serialize)]
struct Row {
    time: f64,
    node: Option<u8>,
    rule: &'static str,
    clause: &'static str,
    text: String,
    frames: Vec<Cell>,
    #[serde(skip)]
    shown: String,
}

#[derive(Serialize)]
struct Cell {
    time: f64,
    can_id: u16,
    data: String,
}

/// A rule of the list.
#[derive(Serialize)]
struct Line {
    rule: &'static str,
    clause: &'static str,
}

/// The monitor, and the number of breaches that were printed.
struct Judge<'r> {
    rules: &'r Rules,
    monitor: Monitor,
    breaches: usize,
}

fn rule(name: &str) -> Result<Rule, String> {
    let names = || Rule::ALL.map(Rule::name).join(", ");
    Rule::named(name).ok_or_else(|| format!("no rule has this name; there are {}", names()))
}

impl Rules {
    /// Whether the command needs a bus.
    pub(super) fn needs_a_bus(&self) -> bool {
        self.file.is_none() && !self.list
    }

    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        if self.list {
            return self.print_list(session);
        }
        let mut judge = Judge { rules: self, monitor: self.monitor(session)?, breaches: 0 };
        match &self.file {
            Some(path) => judge.file(session, path)?,
            None => judge.bus(session)?,
        }
        judge.monitor.end();
        judge.print(session)?;
        if judge.breaches > 0 {
            return Err(Failure::RulesBroken(judge.breaches));
        }
        if !session.options.json {
            let nodes: Vec<String> = judge.monitor.nodes().map(|node| node.to_string()).collect();
            let nodes = if nodes.is_empty() { "no nodes".to_owned() } else { nodes.join(", ") };
            eprintln!("nodectl: no breach in {} frames; nodes: {nodes}", judge.monitor.frames());
        }
        Ok(())
    }

    fn print_list(&self, session: &mut Session) -> Result<(), Failure> {
        for rule in Rule::ALL.into_iter().filter(|rule| !self.without.contains(rule)) {
            session.print(&Line { rule: rule.name(), clause: rule.clause() })?;
        }
        Ok(())
    }

    fn monitor(&self, session: &mut Session) -> Result<Monitor, Failure> {
        let mut monitor = Monitor::new();
        if let Some(kbit) = self.rate {
            monitor.set_bit_rate(u32::from(kbit) * 1000);
        }
        let nodes: Vec<NodeId> = match &self.of {
            NodeSet::All => (1..=127).filter_map(NodeId::new).collect(),
            NodeSet::These(nodes) => nodes.iter().copied().collect(),
        };
        monitor.judge(nodes.iter().map(|node| node.get()));
        if session.options.eds.is_some() {
            for node in nodes {
                let sheet = rules::of_data_sheet(session.catalogue(node)?.sheet(), node);
                monitor.set_sheet_of_node(node.get(), sheet, self.factory);
            }
        }
        for device in &self.device {
            let sheet = device.sheet().map_err(|reason| Failure::file(Path::new(&device.name), reason))?;
            monitor.set_sheet_of_node(device.node.get(), sheet, self.factory);
        }
        Ok(monitor)
    }
}

impl Judge<'_> {
    fn bus(&mut self, session: &mut Session) -> Result<(), Failure> {
        let mut listening = Listening::begin(session, self.rules.seconds, PATIENCE);
        loop {
            if let Some(received) = listening.receive(session)? {
                self.frame(session, &received.frame, received.at)?;
            }
            if let Some(now) = listening.bus_time(session) {
                self.monitor.advance(now);
                self.print(session)?;
            }
            if listening.is_over(session) {
                return Ok(());
            }
        }
    }

    fn file(&mut self, session: &mut Session, path: &Path) -> Result<(), Failure> {
        let mut begin = None;
        for record in Records::open(path)? {
            let (at, Record::Frame(frame)) = record? else { continue };
            let begin = *begin.get_or_insert(at);
            let is_over = |seconds: u32| at.0.saturating_sub(begin.0) > u64::from(seconds) * 1_000_000;
            if self.rules.seconds.is_some_and(is_over) {
                break;
            }
            self.frame(session, &frame, at)?;
        }
        Ok(())
    }

    fn frame(&mut self, session: &mut Session, frame: &Frame, at: Instant) -> Result<(), Failure> {
        self.monitor.frame(at, frame, Sender::Unknown);
        self.print(session)
    }

    fn print(&mut self, session: &mut Session) -> Result<(), Failure> {
        if self.monitor.breaches().is_empty() {
            return Ok(());
        }
        for breach in self.monitor.take_breaches() {
            if !self.rules.without.contains(&breach.rule) {
                self.breaches += 1;
                session.print(&Row::from(&breach))?;
            }
        }
        Ok(())
    }
}

impl From<&Breach> for Row {
    fn from(breach: &Breach) -> Row {
        let cell = |(at, frame): &(Instant, Frame)| Cell {
            time: seconds(*at),
            can_id: frame.id(),
            data: hex_digits(frame.data(), ""),
        };
        Row {
            time: seconds(breach.at),
            node: breach.node,
            rule: breach.rule.name(),
            clause: breach.rule.clause(),
            text: breach.text.clone(),
            frames: breach.frames.iter().map(cell).collect(),
            shown: breach.to_string(),
        }
    }
}

#[allow(clippy::cast_precision_loss)] // Exact for three hundred years.
fn seconds(at: Instant) -> f64 {
    at.0 as f64 / 1e6
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.shown)
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:<17} {}", self.rule, self.clause)
    }
}
