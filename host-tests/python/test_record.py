"""`nodectl record --arrow`: an independent reader of Apache Arrow reads the stream with the right values."""

import csv
import os
import subprocess

import nanoarrow
from nanoarrow.ipc import InputStream


def test_a_stream_of_arrow_is_the_table(simulator, tmp_path):
    table, stream = tmp_path / "record.csv", tmp_path / "record.arrows"
    command = [os.environ["NODECTL_COMMAND"], "--bus", f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0", "record"]
    command += ["--start", "--for", "3", "--csv", table, "--arrow", stream, "6130:1", "6150:1"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    with InputStream.from_path(stream) as source:
        array = nanoarrow.Array(source)
    with open(table, newline="") as text:
        titles, *rows = csv.reader(text)
    schema = array.schema
    assert [field.name for field in schema.fields] == titles
    assert [field.type.name for field in schema.fields] == ["DOUBLE", "DOUBLE", "UINT64"]
    assert dict(schema.field(1).metadata.items()) == {b"object": b"6130h:1", b"unit": b"bar"}
    columns = [list(column.iter_py()) for column in array.iter_children()]
    assert len(rows) == len(columns[0]) >= 3
    for row, values in zip(rows, zip(*columns)):
        assert [float(text) if text else None for text in row][0] == round(values[0], 6)
        for text, value in zip(row[1:], values[1:]):
            assert (value is None) == (text == "") and (value is None or abs(float(text) - value) < 1e-6)
