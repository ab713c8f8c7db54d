//! Recordings as rows: a row for each time, with a place for each signal.

use canopen::Instant;

use crate::acquisition::{Sample, Signal};
use crate::cli::Failure;
use crate::object::Place;
use crate::value::Value;

/// The values of one time, usually of one PDO.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) at: Instant,
    /// Seconds since the first row.
    pub(super) seconds: f64,
    /// One value for each signal; `None` where the signal has no value at this time.
    pub(super) values: Vec<Option<Value>>,
}

/// A destination of rows.
pub(super) trait Sink {
    /// Writes a row.
    fn write(&mut self, row: &Row) -> Result<(), Failure>;

    /// Finishes the file after the last row, and moves it to its final path.
    fn complete(self: Box<Self>) -> Result<(), Failure>;
}

/// Makes rows of samples. A row is written when a sample of another time follows.
pub(super) struct Rows {
    columns: usize,
    start: Option<Instant>,
    row: Option<Row>,
    count: usize,
    sinks: Vec<Box<dyn Sink>>,
}

impl Rows {
    pub(super) fn new(signals: &[Signal], sinks: Vec<Box<dyn Sink>>) -> Rows {
        Rows { columns: signals.len(), start: None, row: None, count: 0, sinks }
    }

    pub(super) fn take(&mut self, sample: &Sample) -> Result<(), Failure> {
        if self.row.as_ref().is_none_or(|row| row.at != sample.at) {
            self.end_row()?;
            let start = *self.start.get_or_insert(sample.at);
            let values = vec![None; self.columns];
            self.row = Some(Row { at: sample.at, seconds: seconds(start, sample.at), values });
        }
        let place = self.row.as_mut().and_then(|row| row.values.get_mut(sample.signal));
        if let Some(place) = place {
            *place = Some(sample.value.clone());
        }
        Ok(())
    }

    fn end_row(&mut self) -> Result<(), Failure> {
        let Some(row) = self.row.take() else { return Ok(()) };
        self.count += 1;
        self.sinks.iter_mut().try_for_each(|sink| sink.write(&row))
    }

    /// Completes every file, also when another file fails. Returns the number of rows.
    pub(super) fn complete(mut self) -> Result<usize, Failure> {
        let mut result = self.end_row();
        for sink in self.sinks {
            result = result.and(sink.complete());
        }
        result.map(|()| self.count)
    }
}

/// `6130h:1 Pressure process value [bar]`
pub(super) fn title(signal: &Signal) -> String {
    let unit = if signal.unit.is_empty() { String::new() } else { format!(" [{}]", signal.unit) };
    format!("{} {}{unit}", Place(signal.at), signal.name).trim().to_owned()
}

/// The seconds from one instant to another.
#[allow(clippy::cast_precision_loss)] // Microseconds of years fit.
pub(in crate::cli) fn seconds(start: Instant, at: Instant) -> f64 {
    at.0.saturating_sub(start.0) as f64 / 1e6
}
