//! A signal from a CSV file: `time,value` in each line, times in seconds and rising.

use std::path::Path;
use std::sync::Arc;

use thiserror::Error;

use super::spec::number;

/// The greatest size of a file in bytes: more than a million points.
const LARGEST: u64 = 16 << 20;

/// The reason why a CSV file cannot be used.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum TableError {
    /// The file cannot be read.
    #[error("cannot read {path}: {reason}")]
    Read {
        /// The file.
        path: String,
        /// The error message of the system.
        reason: String,
    },
    /// A line that is not `time,value`.
    #[error("{path}, line {line}: expected `time,value`")]
    Line {
        /// The file.
        path: String,
        /// Counted from 1.
        line: usize,
    },
    /// A time that is not later than the one before.
    #[error("{path}, line {line}: times must rise")]
    Order {
        /// The file.
        path: String,
        /// Counted from 1.
        line: usize,
    },
    /// The file has no points.
    #[error("{path} holds no points")]
    Empty {
        /// The file.
        path: String,
    },
}

/// Points of a signal, joined by straight lines; the signal is constant before the first and after the last point.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    points: Arc<[(f64, f64)]>,
}

impl Table {
    /// Reads a file. Empty lines, lines that start with `#` and a heading are skipped.
    ///
    /// # Errors
    /// When the file cannot be read or has another form.
    pub fn open(path: &Path) -> Result<Self, TableError> {
        let name = path.display().to_string();
        let text = wire::input::read_to_string(path, LARGEST)
            .map_err(|error| TableError::Read { path: name.clone(), reason: error.to_string() })?;
        Self::parse(&name, &text)
    }

    /// The lowest and the highest of the points.
    pub(super) fn ends(&self) -> (f64, f64) {
        let values = self.points.iter().map(|&(_, value)| value);
        values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    }

    fn parse(path: &str, text: &str) -> Result<Self, TableError> {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let (path, line_number) = (path.to_owned(), index + 1);
            let content = line.trim();
            let heading = points.is_empty() && content.starts_with(char::is_alphabetic);
            if content.is_empty() || content.starts_with('#') || heading {
                continue;
            }
            match point(content) {
                None => return Err(TableError::Line { path, line: line_number }),
                Some((time, _)) if points.last().is_some_and(|last| time <= last.0) => {
                    return Err(TableError::Order { path, line: line_number });
                }
                Some(point) => points.push(point),
            }
        }
        if points.is_empty() {
            return Err(TableError::Empty { path: path.to_owned() });
        }
        Ok(Self { points: points.into() })
    }

    /// The value at a time in seconds.
    pub(super) fn at(&self, seconds: f64) -> f64 {
        let after = self.points.partition_point(|point| point.0 <= seconds);
        let right = self.points[after.min(self.points.len() - 1)];
        let left = self.points[after.saturating_sub(1)];
        if left.0 == right.0 {
            return left.1;
        }
        let share = ((seconds - left.0) / (right.0 - left.0)).clamp(0.0, 1.0);
        left.1 + (right.1 - left.1) * share
    }
}

fn point(line: &str) -> Option<(f64, f64)> {
    let (time, value) = line.split_once(',')?;
    Some((number(time).ok()?, number(value).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_device_is_refused_at_once() {
        let message = Table::open(Path::new("/dev/zero")).unwrap_err().to_string();
        assert_eq!(message, "cannot read /dev/zero: it is not a regular file");
    }

    #[test]
    fn points_are_joined_by_lines() {
        let table = Table::parse("a.csv", "time,value\n# from a pump\n1,10\n\n2, 20\n4,0\n").unwrap();
        let values = [0.0, 1.0, 1.25, 2.0, 3.0, 4.0, 9.0].map(|seconds| table.at(seconds));
        assert_eq!(values, [10.0, 10.0, 12.5, 20.0, 10.0, 0.0, 0.0]);
    }

    #[test]
    fn mistakes_name_file_and_line() {
        let message = |text| Table::parse("a.csv", text).unwrap_err().to_string();
        assert_eq!(message("0,1\n1;2\n"), "a.csv, line 2: expected `time,value`");
        assert_eq!(message("0,1\n0,2\n"), "a.csv, line 2: times must rise");
        assert_eq!(message("time,value\n"), "a.csv holds no points");
    }
}
