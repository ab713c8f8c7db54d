//! `nodectl monitor`

mod lift;
mod plot;
mod screen;
mod status;
mod table;
mod view;

use std::fmt;

use canopen::sdo::Multiplexer;
use canopen::{Duration, Instant, NodeId};
use clap::Args;
use serde::Serialize;

use self::view::View;
use super::read::place;
use super::source::Source;
use super::{Failure, Session};
use crate::acquisition::{Sample, Signal};
use crate::object::Place;
use crate::text::{note, visible};
use crate::value::Value;
use crate::{Catalogue, meaning};

/// A hint is printed after this time without a value.
const SILENCE: Duration = Duration::from_millis(2000);

/// Shows live values, with a plot where the output is a terminal; else one line for each value.
#[derive(Debug, Args)]
pub(super) struct Monitor {
    #[command(flatten)]
    source: Source,

    /// A line for each value in the pre-defined PDOs of a lift (CiA 417), of any sender; no requests are sent.
    #[arg(long, conflicts_with_all = ["objects", "start", "window"])]
    lift: bool,

    /// Print a line only for a value that has changed.
    #[arg(long, conflicts_with = "lift")]
    changes: bool,

    /// End after this number of values.
    #[arg(long, value_name = "N")]
    count: Option<usize>,

    /// The time span of the plot, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 30)]
    window: u32,
}

/// A value as a line of the output.
#[derive(Serialize)]
struct Line<'a> {
    time: f64,
    node: u8,
    #[serde(rename = "object", serialize_with = "place")]
    at: Multiplexer,
    name: Option<&'a str>,
    #[serde(rename = "type")]
    data_type: String,
    value: &'a Value,
    unit: &'a str,
    /// The meaning of the number.
    #[serde(skip_serializing_if = "Option::is_none")]
    meaning: Option<String>,
    #[serde(skip)]
    short: &'a str,
}

impl Monitor {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        if self.lift {
            return lift::print_lines(session, self.count.unwrap_or(usize::MAX));
        }
        if session.output.is_interactive() && !self.changes {
            let catalogue = session.catalogue(session.options.node.one()?)?;
            let (mut acquisition, _) = self.source.open(session)?;
            let view = View::new(acquisition.signals(), catalogue, self.window.max(1).into());
            return screen::run(&mut acquisition, view, self.count);
        }
        self.print_lines(session)
    }

    fn print_lines(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?;
        let catalogue = session.catalogue(node)?;
        let (mut acquisition, output) = self.source.open(session)?;
        let (mut start, mut left) = (None, self.count.unwrap_or(usize::MAX));
        let mut hinted: Vec<String> = Vec::new();
        let mut told: Vec<Option<(Value, String)>> = vec![None; acquisition.signals().len()];
        while left > 0 {
            let until = acquisition.now() + SILENCE;
            let Some(sample) = acquisition.next(until)? else {
                if let Some(hint) = acquisition.hint().or_else(|| acquisition.awaited())
                    && !hinted.contains(&hint)
                {
                    note(&hint);
                    hinted.push(hint);
                }
                continue;
            };
            let start = *start.get_or_insert(sample.at);
            let signal = &acquisition.signals()[sample.signal];
            let now = Some((sample.value.clone(), signal.unit.clone()));
            let before = std::mem::replace(&mut told[sample.signal], now);
            if self.changes && before == told[sample.signal] {
                continue;
            }
            output.print(&line(node, &catalogue, signal, &sample, start))?;
            left -= 1;
        }
        Ok(())
    }
}

fn line<'a>(
    node: NodeId,
    catalogue: &Catalogue,
    signal: &'a Signal,
    sample: &'a Sample,
    start: Instant,
) -> Line<'a> {
    Line {
        time: super::record::seconds_between(start, sample.at),
        node: node.get(),
        at: signal.at,
        name: signal.path.as_deref(),
        data_type: signal.data_type(&sample.value),
        value: &sample.value,
        unit: &signal.unit,
        meaning: meaning::of(catalogue, signal.at, &sample.value),
        short: &signal.name,
    }
}

impl fmt::Display for Line<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Line { time, at, short, value, unit, meaning, .. } = self;
        write!(f, "{time:10.6} {} {short} = {} {unit}", Place(*at), visible(&value.to_string()))?;
        meaning.iter().try_for_each(|meaning| write!(f, " [{meaning}]"))
    }
}
