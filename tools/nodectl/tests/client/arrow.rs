//! `nodectl record --arrow`, read by the library of Apache Arrow.

use std::fs::File;

use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use arrow_ipc::reader::StreamReader;

use crate::commands::printed;
use crate::pressure::Pressure;
use crate::wire::Wire;

#[test]
fn a_recording_as_a_stream_of_arrow_has_the_rows_of_the_table_with_types() {
    let wire = Wire::new(Pressure::new(1));
    let file = |name: &str| format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"));
    let (csv, arrow) = (file("typed.csv"), file("typed.arrows"));
    printed(&wire, &["write", "6132:1", "2"]);
    // A number of a TPDO, and three objects that are read by SDO: an unsigned integer, an integer with decimal digits,
    // and a text.
    let objects = ["6130:1", "1001", "7130:1", "1008"];
    let mut command = vec!["record", "--start", "--for", "3.5", "--csv", &csv, "--arrow", &arrow];
    command.extend(objects);
    printed(&wire, &command);
    let mut stream = StreamReader::try_new(File::open(arrow).unwrap(), None).unwrap();
    let schema = stream.schema();
    let types: Vec<_> = schema.fields().iter().map(|field| field.data_type().to_string()).collect();
    assert_eq!(types, ["Float64", "Float64", "UInt64", "Float64", "Utf8"]);
    let unit = &schema.field(1).metadata()["unit"];
    assert_eq!((schema.field(1).metadata()["object"].as_str(), unit.as_str()), ("6130h:1", "bar"));
    let batch = stream.next().unwrap().unwrap();
    assert!(stream.next().is_none(), "all fits one batch");
    let mut table = csv::Reader::from_path(csv).unwrap();
    let rows: Vec<_> = table.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), batch.num_rows());
    for (number, row) in rows.iter().enumerate() {
        for (column, text) in batch.columns().iter().zip(row) {
            assert_eq!(column.is_null(number), text.is_empty(), "{row:?}");
        }
        let times = batch.column(0).as_primitive::<Float64Type>();
        assert_eq!(format!("{:.6}", times.value(number)), row[0], "{row:?}");
    }
    let names: Vec<_> = batch.column(4).as_string::<i32>().iter().flatten().collect();
    assert!(
        !names.is_empty() && names.iter().all(|name| *name == "STM32F4 pressure transmitter"),
        "{names:?}"
    );
}
