//! `nodectl record`

#[cfg(feature = "arrow")]
mod arrow;
mod plot;
mod rows;
mod table;
mod target;
mod units;

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use canopen::{Duration, Instant};
use clap::Args;

#[cfg(feature = "arrow")]
use self::arrow::Arrow;
use self::plot::Plot;
pub(super) use self::plot::range;
pub(super) use self::rows::seconds as seconds_between;
use self::rows::{Rows, Sink};
use self::table::Table;
use self::target::{Target, is_standard};
use self::units::Units;
use super::source::Source;
use super::{Failure, Session};
use crate::acquisition::{Acquisition, Sample, Signal};
use crate::text::{counted, note};

/// The longest wait for a value, after which the end of the recording is checked.
const WAKE: Duration = Duration::from_millis(50);

/// Records values over time, as CSV, as a stream of Apache Arrow and as a plot.
///
/// Times are those of the bus, where the adapter tells them. The values are kept however the recording ends: by its
/// duration, Ctrl-C, SIGTERM or the loss of the bus. Values in another unit than that of their column are left out. An existing file is replaced when the new one is complete.
#[derive(Debug, Args)]
pub(super) struct Record {
    #[command(flatten)]
    source: Source,

    /// How long; until Ctrl-C if it is left out.
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Duration>,

    /// Table of the values, one row for each time ("-" for the standard output); to the standard output if there is no
    /// other file.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// The same table as a stream of Apache Arrow ("-" for the standard output), for recordings of days. Needs a nodectl
    /// that is built with `--features arrow`.
    #[arg(long, value_name = "FILE")]
    arrow: Option<PathBuf>,

    /// Plot of the values.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

/// Parses a duration. The limit of ten years is as good as no end.
fn seconds(text: &str) -> Result<Duration, String> {
    const MOST: f64 = 315_360_000.0;
    let seconds = text.parse::<f64>().ok().filter(|seconds| (0.0..=MOST).contains(seconds));
    let seconds = seconds.ok_or_else(|| format!("{text:?} is not a number of seconds"))?;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    Ok(Duration((seconds * 1e6).round() as u64))
}

impl Record {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        if self.arrow.is_some() && !cfg!(feature = "arrow") {
            let advice =
                "this nodectl is built without Apache Arrow: cargo build -p nodectl --features arrow";
            return Err(Failure::Usage(advice.to_owned()));
        }
        // Open all files before the recording, so that a file that cannot be written is reported at once.
        let files = [&self.csv, &self.arrow, &self.svg];
        let [csv, arrow, svg] = files.map(|path| path.as_deref().map(Target::open).transpose());
        let (csv, arrow, svg) = (csv?, arrow?, svg?);
        if files.into_iter().flatten().filter(|path| is_standard(path)).count() > 1 {
            return Err(Failure::Usage("the standard output takes one of the files".to_owned()));
        }
        let (mut acquisition, _) = self.source.open(session)?;
        let signals = acquisition.signals().to_vec();
        let mut rows = Rows::new(&signals, sinks(&signals, csv, arrow, svg)?);
        let (mut count, mut units) = (0_usize, Units::new(&signals));
        let ended = acquire(&mut acquisition, self.duration, |signal, sample| {
            if !units.fit(sample.signal, signal) {
                return Ok(());
            }
            count += 1;
            rows.take(sample)
        });
        if count == 0 {
            ended?;
            let hint = acquisition.hint().unwrap_or_else(|| "no value has come".to_owned());
            return Err(Failure::Silence(format!("nothing is recorded: {hint}")));
        }
        // Keep the values even if the recording has ended with an error.
        self.tell(rows.complete()?);
        ended
    }

    /// Prints the files that were written.
    fn tell(&self, rows: usize) {
        let is_file = |path: &&PathBuf| !is_standard(path);
        let tables = self.csv.iter().chain(&self.arrow).filter(is_file);
        let counted = counted(rows, "row", "rows");
        let tables = tables.map(|path| format!("{counted} in {}", path.display()));
        let svg = self.svg.iter().filter(is_file).map(|path| format!("a plot in {}", path.display()));
        let written: Vec<String> = tables.chain(svg).collect();
        if !written.is_empty() {
            note(written.join(", "));
        }
    }
}

/// The destinations of the rows: all files, or the standard output when there are no files.
fn sinks(
    signals: &[Signal],
    csv: Option<Target>,
    arrow: Option<Target>,
    svg: Option<Target>,
) -> Result<Vec<Box<dyn Sink>>, Failure> {
    let has_other = arrow.is_some() || svg.is_some();
    let csv = csv.or_else(|| (!has_other).then(|| Target::Standard(io::stdout())));
    let mut sinks: Vec<Box<dyn Sink>> = Vec::new();
    if let Some(target) = csv {
        sinks.push(Box::new(Table::new(target, signals)?));
    }
    #[cfg(feature = "arrow")]
    if let Some(file) = arrow {
        sinks.push(Box::new(Arrow::new(file, signals)?));
    }
    if let Some(file) = svg {
        sinks.push(Box::new(Plot::new(file, signals)));
    }
    Ok(sinks)
}

/// Takes samples until the time is over, or until a signal (Ctrl-C, SIGTERM) comes.
fn acquire(
    acquisition: &mut Acquisition,
    duration: Option<Duration>,
    mut take: impl FnMut(&Signal, &Sample) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    // Only one handler is possible. If another one is set already, only the duration ends the recording.
    let _ = ctrlc::set_handler(move || stopped.store(true, Ordering::Relaxed));
    let start = time(acquisition);
    let end = duration.map_or(Instant::NEVER, |duration| start + duration);
    while !stop.load(Ordering::Relaxed) && time(acquisition) < end {
        let until = acquisition.now() + WAKE;
        match acquisition.next(until)? {
            Some(sample) if sample.at < end => take(&acquisition.signals()[sample.signal], &sample)?,
            _ => (),
        }
    }
    Ok(())
}

/// The time on the bus.
fn time(acquisition: &Acquisition) -> Instant {
    acquisition.bus_time().unwrap_or(acquisition.now())
}
