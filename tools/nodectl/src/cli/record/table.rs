//! The recording as CSV: a row for each time, a column for each signal.

use std::io::Write;

use canopen::Instant;

use crate::acquisition::{Sample, Signal};
use crate::cli::Failure;
use crate::object::Place;
use crate::text::visible;

/// A table that grows, row by row: a row that is complete is written at once.
pub(super) struct Table<W: Write> {
    to: csv::Writer<W>,
    start: Option<Instant>,
    row: Option<Row>,
    columns: usize,
    rows: usize,
}

/// Values of the same time: usually those of one PDO.
struct Row {
    at: Instant,
    values: Vec<String>,
}

impl<W: Write> Table<W> {
    pub(super) fn new(to: W) -> Table<W> {
        Table { to: csv::Writer::from_writer(to), start: None, row: None, columns: 0, rows: 0 }
    }

    /// Rows below the titles so far.
    pub(super) fn rows(&self) -> usize {
        self.rows
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
            *place = visible(&sample.value.to_string());
        }
        Ok(())
    }

    /// Writes what is left.
    pub(super) fn end_row(&mut self) -> Result<(), Failure> {
        let (Some(row), Some(start)) = (self.row.take(), self.start) else { return Ok(()) };
        let time = seconds(start, row.at);
        self.rows += 1;
        self.write(std::iter::once(format!("{time:.6}")).chain(row.values).collect())
    }

    /// Where it was written to.
    pub(super) fn into_inner(self) -> Result<W, Failure> {
        self.to.into_inner().map_err(|error| Failure::Output(error.into_error()))
    }

    fn write(&mut self, row: Vec<String>) -> Result<(), Failure> {
        self.to.write_record(row).map_err(|error| Failure::Output(error.into()))?;
        Ok(self.to.flush()?)
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

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::io;
    use std::rc::Rc;

    use super::*;
    use crate::object::at;
    use crate::value::Value;

    struct Paper(Rc<RefCell<Vec<u8>>>);

    impl Write for Paper {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.borrow_mut().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn values_of_one_time_share_a_row() {
        let paper = Rc::default();
        let mut table = Table::new(Paper(Rc::clone(&paper)));
        table
            .head(&[Signal::polled(at(0x6130, 1), "a, b", "bar"), Signal::polled(at(0x1001, 0), "", "")])
            .unwrap();
        for (micros, signal, value) in [(500, 0, 1), (500, 1, 2), (2_000_500, 1, 3), (3_000_501, 0, 4)] {
            table.take(&Sample { at: Instant(micros), signal, value: Value::Integer(value) }).unwrap();
        }
        table.end_row().unwrap();
        assert_eq!(table.rows(), 3);
        let expected = "time s,\"6130h:1 a, b [bar]\",1001h:0\n0.000000,1,2\n2.000000,,3\n3.000001,4,\n";
        assert_eq!(String::from_utf8(paper.take()).unwrap(), expected);
    }
}
