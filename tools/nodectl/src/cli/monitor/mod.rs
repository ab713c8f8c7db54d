//! `nodectl monitor`

mod lift;
mod plot;
mod screen;
mod status;
mod table;
mod view;

use std::fmt;

use canopen::sdo::Multiplexer;
use canopen::{Duration, Instant};
use clap::Args;
use serde::Serialize;

use self::view::View;
use super::read::place;
use super::{Failure, Output, Session};
use crate::acquisition::{Acquisition, Sample, Setup, Signal};
use crate::object::Place;
use crate::text::{note, visible};
use crate::value::Value;

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

/// The values to acquire, and the way to acquire them.
#[derive(Debug, Args)]
pub(super) struct Source {
    /// Objects by index or name; without any, all objects in TPDOs. Objects in a TPDO are taken from the TPDO.
    #[arg(value_name = "OBJECT")]
    objects: Vec<String>,

    /// The period of reading the objects that no TPDO carries, in milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 100)]
    period: u32,

    /// Start the node first: TPDOs come in the state operational only.
    #[arg(long)]
    start: bool,
}

impl Source {
    /// Opens the acquisition of the session's node; results go to the session's output.
    pub(super) fn open<'s>(
        &self,
        session: &'s mut Session,
    ) -> Result<(Acquisition<'s>, &'s mut Output), Failure> {
        let node = session.options.node.one()?;
        let catalogue = session.catalogue(node)?;
        let objects: Result<Vec<_>, Failure> =
            self.objects.iter().map(|query| session.find(node, query)).collect();
        let period = Duration::from_millis(self.period.max(1).into());
        let setup = Setup { node, options: session.options.sdo(), period, start: self.start };
        let acquisition = Acquisition::open(&mut session.network, setup, &catalogue, &objects?)?;
        if acquisition.signals().is_empty() {
            let message = "the node has no TPDO that is switched on: name the objects";
            return Err(Failure::Usage(message.to_owned()));
        }
        Ok((acquisition, &mut session.output))
    }
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
    #[serde(skip)]
    short: &'a str,
}

impl Monitor {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        if self.lift {
            return lift::print_lines(session, self.count.unwrap_or(usize::MAX));
        }
        if session.output.is_interactive() && !self.changes {
            let (mut acquisition, _) = self.source.open(session)?;
            let view = View::new(acquisition.signals(), self.window.max(1).into());
            return screen::run(&mut acquisition, view, self.count);
        }
        self.print_lines(session)
    }

    fn print_lines(&self, session: &mut Session) -> Result<(), Failure> {
        let node = session.options.node.one()?.get();
        let (mut acquisition, output) = self.source.open(session)?;
        let signals = acquisition.signals().to_vec();
        let (mut start, mut left, mut hinted) = (None, self.count.unwrap_or(usize::MAX), false);
        let mut told: Vec<Option<Value>> = vec![None; signals.len()];
        while left > 0 {
            let until = acquisition.now() + SILENCE;
            let Some(sample) = acquisition.next(until)? else {
                let hint = acquisition.hint().filter(|_| !std::mem::replace(&mut hinted, true));
                hint.iter().for_each(note);
                continue;
            };
            let start = *start.get_or_insert(sample.at);
            let before = told[sample.signal].replace(sample.value.clone());
            if self.changes && before.as_ref() == Some(&sample.value) {
                continue;
            }
            output.print(&line(node, &signals[sample.signal], &sample, start))?;
            left -= 1;
        }
        Ok(())
    }
}

fn line<'a>(node: u8, signal: &'a Signal, sample: &'a Sample, start: Instant) -> Line<'a> {
    Line {
        time: super::record::seconds_between(start, sample.at),
        node,
        at: signal.at,
        name: signal.path.as_deref(),
        data_type: signal.data_type(&sample.value),
        value: &sample.value,
        unit: &signal.unit,
        short: &signal.name,
    }
}

impl fmt::Display for Line<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Line { time, at, short, value, unit, .. } = self;
        write!(f, "{time:10.6} {} {short} = {} {unit}", Place(*at), visible(&value.to_string()))
    }
}
