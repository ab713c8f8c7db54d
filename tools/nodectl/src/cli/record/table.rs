//! The recording as CSV: a row for each time, a column for each signal.

use std::io::Write;

use canopen::Instant;

use crate::acquisition::{Sample, Signal};
use crate::cli::Failure;
use crate::object::Place;

/// A table that grows.
pub(super) struct Table {
    to: csv::Writer<Box<dyn Write>>,
    start: Option<Instant>,
    row: Option<Row>,
    columns: usize,
}

/// Values of the same time: usually those of one PDO.
struct Row {
    at: Instant,
    values: Vec<String>,
}

impl Table {
    pub(super) fn new(to: Box<dyn Write>) -> Table {
        Table { to: csv::Writer::from_writer(to), start: None, row: None, columns: 0 }
    }

    /// The titles of the columns.
    pub(super) fn head(&mut self, signals: &[Signal]) -> Result<(), Failure> {
        self.columns = signals.len();
        let titles = signals.iter().map(title);
        self.write(std::iter::once("time s".to_owned()).chain(titles).collect())
    }

    pub(super) fn take(&mut self, sample: &Sample) -> Result<(), Failure> {
        if self.row.as_ref().is_none_or(|row| row.at != sample.at) {
            self.end_row()?;
            self.start.get_or_insert(sample.at);
            self.row = Some(Row { at: sample.at, values: vec![String::new(); self.columns] });
        }
        let place = self.row.as_mut().and_then(|row| row.values.get_mut(sample.signal));
        if let Some(place) = place {
            *place = sample.value.to_string();
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<(), Failure> {
        self.end_row()?;
        Ok(self.to.flush()?)
    }

    fn end_row(&mut self) -> Result<(), Failure> {
        let (Some(row), Some(start)) = (self.row.take(), self.start) else { return Ok(()) };
        let time = seconds(start, row.at);
        self.write(std::iter::once(format!("{time:.6}")).chain(row.values).collect())
    }

    fn write(&mut self, row: Vec<String>) -> Result<(), Failure> {
        self.to.write_record(row).map_err(|error| Failure::Output(error.into()))
    }
}

/// `6130h:1 Pressure process value [bar]`
pub(super) fn title(signal: &Signal) -> String {
    let unit = if signal.unit.is_empty() { String::new() } else { format!(" [{}]", signal.unit) };
    format!("{} {}{unit}", Place(signal.at), signal.name).trim().to_owned()
}

/// From one instant to another.
#[allow(clippy::cast_precision_loss)] // Microseconds of years fit.
pub(in crate::cli) fn seconds(start: Instant, at: Instant) -> f64 {
    at.0.saturating_sub(start.0) as f64 / 1e6
}
