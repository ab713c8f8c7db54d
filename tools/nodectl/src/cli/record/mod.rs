//! `nodectl record`

mod plot;
mod table;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use canopen::{Duration, Instant};
use clap::Args;

pub(super) use self::plot::range;
use self::table::Table;
pub(super) use self::table::seconds as seconds_between;
use super::monitor::Source;
use super::{Failure, Session};
use crate::acquisition::{Acquisition, Sample};

/// How often the end of the recording is looked for while nothing arrives.
const WAKE: Duration = Duration::from_millis(50);

/// Records values over time, as CSV and as a plot.
///
/// Times are those of the bus, where the adapter tells them.
#[derive(Debug, Args)]
pub(super) struct Record {
    #[command(flatten)]
    source: Source,

    /// How long; until Ctrl-C if it is left out.
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Duration>,

    /// Table of the values, one row for each time; to the standard output if there is neither this nor a plot.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Plot of the values.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

/// Ten years are as good as for ever.
fn seconds(text: &str) -> Result<Duration, String> {
    const MOST: f64 = 315_360_000.0;
    let seconds = text.parse::<f64>().ok().filter(|seconds| (0.0..=MOST).contains(seconds));
    let seconds = seconds.ok_or_else(|| format!("{text:?} is not a number of seconds"))?;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    Ok(Duration((seconds * 1e6).round() as u64))
}

impl Record {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let mut table = self.open_table()?;
        let (mut acquisition, _) = self.source.open(session)?;
        let signals = acquisition.signals().to_vec();
        if let Some(table) = &mut table {
            table.head(&signals)?;
        }
        let mut samples = Vec::new();
        acquire(&mut acquisition, self.duration, |sample| {
            if self.svg.is_some() {
                samples.push(sample.clone());
            }
            table.as_mut().map_or(Ok(()), |table| table.take(sample))
        })?;
        if let Some(table) = table {
            table.finish()?;
        }
        acquisition.hint().iter().for_each(|hint| eprintln!("{hint}"));
        match &self.svg {
            Some(path) => plot::draw(path, &signals, &samples).map_err(|error| Failure::file(path, error)),
            None => Ok(()),
        }
    }

    /// Before anything is recorded: a file that cannot be written is told at once.
    fn open_table(&self) -> Result<Option<Table>, Failure> {
        let to: Box<dyn Write> = match &self.csv {
            Some(path) => {
                let file = File::create(path).map_err(|error| Failure::file(path, error))?;
                Box::new(BufWriter::new(file))
            }
            None if self.svg.is_some() => return Ok(None),
            None => Box::new(io::stdout()),
        };
        Ok(Some(Table::new(to)))
    }
}

/// Takes samples until the time is over or somebody presses Ctrl-C.
fn acquire(
    acquisition: &mut Acquisition,
    duration: Option<Duration>,
    mut take: impl FnMut(&Sample) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    // There can be one handler only; where there is one already, the recording ends by its duration.
    let _ = ctrlc::set_handler(move || stopped.store(true, Ordering::Relaxed));
    let start = time(acquisition);
    let end = duration.map_or(Instant::NEVER, |duration| start + duration);
    while !stop.load(Ordering::Relaxed) && time(acquisition) < end {
        let until = acquisition.now() + WAKE;
        match acquisition.next(until)? {
            Some(sample) if sample.at < end => take(&sample)?,
            _ => (),
        }
    }
    Ok(())
}

/// The time of the bus.
fn time(acquisition: &Acquisition) -> Instant {
    acquisition.bus_time().unwrap_or(acquisition.now())
}
