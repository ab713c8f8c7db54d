//! `nodectl record`

mod plot;
mod table;

use std::error::Error;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use canopen::{Duration, Instant};
use clap::Args;

pub(super) use self::plot::range;
use self::table::Table;
pub(super) use self::table::seconds as seconds_between;
use super::monitor::Source;
use super::replacement::Replacement;
use super::{Failure, Session};
use crate::acquisition::{Acquisition, Sample, Signal};

/// How often the end of the recording is looked for while nothing arrives.
const WAKE: Duration = Duration::from_millis(50);

/// Records values over time, as CSV and as a plot.
///
/// Times are those of the bus, where the adapter tells them. What has come is kept however the recording ends: by its
/// duration, Ctrl-C, SIGTERM or the loss of the bus. A file that is there already is replaced when the new one is complete.
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
        // All files are opened before anything is recorded: what cannot be written is told at once.
        let csv = self.csv.as_deref().map(Replacement::open).transpose()?;
        let svg = self.svg.as_deref().map(Replacement::open).transpose()?;
        let (mut acquisition, _) = self.source.open(session)?;
        let signals = acquisition.signals().to_vec();
        let mut table = Table::new(Target::new(csv, svg.is_some()));
        table.head(&signals)?;
        let (mut samples, mut count) = (Vec::new(), 0_usize);
        let ended = acquire(&mut acquisition, self.duration, |sample| {
            count += 1;
            if svg.is_some() {
                samples.push(sample.clone());
            }
            table.take(sample)
        });
        if count == 0 {
            ended?;
            let hint = acquisition.hint().unwrap_or_else(|| "no value has come".to_owned());
            return Err(Failure::Silence(format!("nothing is recorded: {hint}")));
        }
        // Whatever has ended the recording: what has come is kept.
        table.end_row()?;
        let rows = table.rows();
        table.into_inner()?.complete()?;
        if let (Some(path), Some(file)) = (&self.svg, svg) {
            write_plot(file, &signals, &samples).map_err(|error| Failure::file(path, error))?;
        }
        self.tell(rows);
        ended
    }

    /// What has been written.
    fn tell(&self, rows: usize) {
        let csv = self.csv.iter().map(|path| format!("{rows} rows in {}", path.display()));
        let svg = self.svg.iter().map(|path| format!("a plot in {}", path.display()));
        let written: Vec<String> = csv.chain(svg).collect();
        if !written.is_empty() {
            eprintln!("{}", written.join(", "));
        }
    }
}

fn write_plot(mut file: Replacement, signals: &[Signal], samples: &[Sample]) -> Result<(), Box<dyn Error>> {
    file.write_all(plot::draw(signals, samples)?.as_bytes())?;
    Ok(file.complete()?)
}

/// Where the table goes.
enum Target {
    File(Replacement),
    Standard(io::Stdout),
    /// Only a plot is wanted.
    Nowhere,
}

impl Target {
    fn new(csv: Option<Replacement>, has_plot: bool) -> Target {
        match csv {
            Some(file) => Target::File(file),
            None if has_plot => Target::Nowhere,
            None => Target::Standard(io::stdout()),
        }
    }

    fn complete(self) -> Result<(), Failure> {
        match self {
            Target::File(file) => file.complete(),
            Target::Standard(_) | Target::Nowhere => Ok(()),
        }
    }
}

impl Write for Target {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Target::File(file) => file.write(bytes),
            Target::Standard(out) => out.write(bytes),
            Target::Nowhere => Ok(bytes.len()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Target::File(file) => file.flush(),
            Target::Standard(out) => out.flush(),
            Target::Nowhere => Ok(()),
        }
    }
}

/// Takes samples until the time is over or a signal (Ctrl-C, SIGTERM) comes.
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
