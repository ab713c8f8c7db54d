//! Recordings as CSV.

use std::io::Write;

use super::rows::{Row, Sink, title};
use super::target::Target;
use crate::acquisition::Signal;
use crate::cli::Failure;
use crate::text::visible;

/// A CSV table. Each complete row is written at once.
pub(super) struct Table<W: Write>(csv::Writer<W>);

impl<W: Write> Table<W> {
    /// A table with the titles of its columns.
    pub(super) fn new(to: W, signals: &[Signal]) -> Result<Table<W>, Failure> {
        let mut table = Table(csv::Writer::from_writer(to));
        table.record(std::iter::once("time s".to_owned()).chain(signals.iter().map(title)).collect())?;
        Ok(table)
    }

    fn record(&mut self, row: Vec<String>) -> Result<(), Failure> {
        self.0.write_record(row).map_err(|error| Failure::Output(error.into()))?;
        Ok(self.0.flush()?)
    }

    fn row(&mut self, row: &Row) -> Result<(), Failure> {
        let values =
            row.values.iter().map(|value| value.as_ref().map_or_else(String::new, ToString::to_string));
        let time = format!("{:.6}", row.seconds);
        self.record(std::iter::once(time).chain(values.map(|value| visible(&value))).collect())
    }
}

impl Sink for Table<Target> {
    fn write(&mut self, row: &Row) -> Result<(), Failure> {
        self.row(row)
    }

    fn complete(self: Box<Self>) -> Result<(), Failure> {
        self.0.into_inner().map_err(|error| Failure::Output(error.into_error()))?.complete()
    }
}

#[cfg(test)]
mod tests {
    use canopen::Instant;

    use super::super::rows::Rows;
    use super::*;
    use crate::acquisition::Sample;
    use crate::cli::Paper;
    use crate::object::at;
    use crate::value::Value;

    impl Sink for Table<Paper> {
        fn write(&mut self, row: &Row) -> Result<(), Failure> {
            self.row(row)
        }

        fn complete(self: Box<Self>) -> Result<(), Failure> {
            Ok(())
        }
    }

    #[test]
    fn values_of_one_time_share_a_row() {
        let paper = Paper::default();
        let signals = [Signal::polled(at(0x6130, 1), "a, b", "bar"), Signal::polled(at(0x1001, 0), "", "")];
        let table = Table::new(paper.clone(), &signals).unwrap();
        let mut rows = Rows::new(&signals, vec![Box::new(table)]);
        for (micros, signal, value) in [(500, 0, 1), (500, 1, 2), (2_000_500, 1, 3), (3_000_501, 0, 4)] {
            rows.take(&Sample { at: Instant(micros), signal, value: Value::Integer(value) }).unwrap();
        }
        assert_eq!(rows.complete().unwrap(), 3);
        let expected = "time s,\"6130h:1 a, b [bar]\",1001h:0\n0.000000,1,2\n2.000000,,3\n3.000001,4,\n";
        assert_eq!(paper.take(), expected);
    }
}
