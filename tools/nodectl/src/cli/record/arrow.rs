//! Recordings as a stream of Apache Arrow (IPC streaming format, version 1). For recordings of days, which are too
//! large for text.

use std::collections::HashMap;
use std::io::{self, Write};
use std::sync::Arc;

use arrow_array::builder::{Float64Builder, Int64Builder, StringBuilder, UInt64Builder};
use arrow_array::{ArrayRef, RecordBatch};
use arrow_ipc::writer::StreamWriter;
use arrow_schema::{ArrowError, DataType, Field, Schema};

use super::rows::{Row, Sink, title};
use super::target::Target;
use crate::acquisition::{Kind, Signal};
use crate::cli::Failure;
use crate::object::Place;
use crate::value::Value;

/// The number of rows in a batch: a few seconds of a TPDO.
const BATCH: usize = 1024;

/// A stream that is written batch by batch.
pub(super) struct Arrow {
    to: StreamWriter<Target>,
    schema: Arc<Schema>,
    seconds: Float64Builder,
    columns: Vec<Column>,
    rows: usize,
}

/// The values of one signal; null where a row has no value.
enum Column {
    Signed(Int64Builder),
    Unsigned(UInt64Builder),
    Number(Float64Builder),
    Text(StringBuilder),
}

impl Arrow {
    /// A stream with the names and types of its columns. The metadata of a column are `object` and `unit`.
    pub(super) fn new(to: Target, signals: &[Signal]) -> Result<Arrow, Failure> {
        let time = Field::new("time s", DataType::Float64, false);
        let fields: Vec<_> = std::iter::once(time).chain(signals.iter().map(field)).collect();
        let schema = Arc::new(Schema::new(fields));
        Ok(Arrow {
            to: StreamWriter::try_new(to, &schema).map_err(failure)?,
            schema,
            seconds: Float64Builder::new(),
            columns: signals.iter().map(Column::new).collect(),
            rows: 0,
        })
    }

    fn end_batch(&mut self) -> Result<(), Failure> {
        let time: ArrayRef = Arc::new(self.seconds.finish());
        let columns = std::iter::once(time).chain(self.columns.iter_mut().map(Column::finish)).collect();
        self.rows = 0;
        let batch = RecordBatch::try_new(Arc::clone(&self.schema), columns).map_err(failure)?;
        self.to.write(&batch).map_err(failure)?;
        Ok(self.to.get_mut().flush()?)
    }
}

impl Sink for Arrow {
    fn write(&mut self, row: &Row) -> Result<(), Failure> {
        self.seconds.append_value(row.seconds);
        for (column, value) in self.columns.iter_mut().zip(&row.values) {
            column.append(value.as_ref());
        }
        self.rows += 1;
        if self.rows == BATCH { self.end_batch() } else { Ok(()) }
    }

    fn complete(mut self: Box<Self>) -> Result<(), Failure> {
        if self.rows > 0 {
            self.end_batch()?;
        }
        self.to.into_inner().map_err(failure)?.complete()
    }
}

impl Column {
    fn new(signal: &Signal) -> Column {
        match signal.kind() {
            Kind::Signed => Column::Signed(Int64Builder::new()),
            Kind::Unsigned => Column::Unsigned(UInt64Builder::new()),
            Kind::Number => Column::Number(Float64Builder::new()),
            Kind::Text => Column::Text(StringBuilder::new()),
        }
    }

    /// Appends a value. A value that does not fit the column is null, for example one with fewer bytes than its type.
    fn append(&mut self, value: Option<&Value>) {
        let integer = |value: &Value| if let Value::Integer(number) = value { Some(*number) } else { None };
        match self {
            Column::Signed(to) => {
                to.append_option(value.and_then(integer).and_then(|value| value.try_into().ok()));
            }
            Column::Unsigned(to) => {
                to.append_option(value.and_then(integer).and_then(|value| value.try_into().ok()));
            }
            Column::Number(to) => to.append_option(value.and_then(Value::as_f64)),
            Column::Text(to) => to.append_option(value.map(ToString::to_string)),
        }
    }

    fn finish(&mut self) -> ArrayRef {
        match self {
            Column::Signed(values) => Arc::new(values.finish()),
            Column::Unsigned(values) => Arc::new(values.finish()),
            Column::Number(values) => Arc::new(values.finish()),
            Column::Text(values) => Arc::new(values.finish()),
        }
    }
}

fn field(signal: &Signal) -> Field {
    let data_type = match signal.kind() {
        Kind::Signed => DataType::Int64,
        Kind::Unsigned => DataType::UInt64,
        Kind::Number => DataType::Float64,
        Kind::Text => DataType::Utf8,
    };
    let metadata = [("object", Place(signal.at).to_string()), ("unit", signal.unit.clone())];
    let metadata =
        metadata.into_iter().map(|(key, value)| (key.to_owned(), value)).collect::<HashMap<_, _>>();
    Field::new(title(signal), data_type, true).with_metadata(metadata)
}

fn failure(error: ArrowError) -> Failure {
    Failure::Output(match error {
        ArrowError::IoError(_, error) => error,
        error => io::Error::other(error),
    })
}
