"""The data sheet of the lift node in a stock CANopen master: each pre-defined PDO has its COB-ID and its mapping."""

import csv
import os
import subprocess
from pathlib import Path

import canopen
import pytest
from canopen import objectdictionary as od
from simulator import PATIENCE, Master, Simulator

ROOT = Path(__file__).parents[2]
EDS = ROOT / "eds" / "lift.eds"
TABLE = ROOT / "host-tests" / "tables" / "lift417.csv"
NODE_ID = 33

#: The node's PDOs in the table: its units produce and consume these. PDOs with one CAN-ID for all nodes are off.
PRODUCED = {2, 130, 258, 263, 264, 385, 386}
OFF = {258, 263, 264, 385, 386}
CONSUMED = {2, 3, 4, 5, 6, 7, 8, 257}


def rows() -> list:
    found = []
    with TABLE.open() as table:
        for row in csv.DictReader(table):
            is_produced, number = row["direction"] == "TPDO", int(row["number"])
            if number in (PRODUCED if is_produced else CONSUMED):
                found.append(pytest.param(row, is_produced, number, id=f"{row['direction']}{number}"))
    return found


def can_id(row: dict) -> int:
    base, relative, _ = row["cob_id"].partition("+node-id")
    return int(base, 16) + (NODE_ID if relative else 0)


def entries(row: dict) -> list[int]:
    if row["objects"] == "multiplexed":
        return []
    parts = ([int(part, 16) for part in text.split(":")] for text in row["objects"].split(";"))
    return [index << 16 | sub << 8 | bits for index, sub, bits in parts]


@pytest.fixture(scope="module")
def dictionary() -> od.ObjectDictionary:
    return od.import_od(str(EDS), NODE_ID)


@pytest.mark.parametrize("row, is_produced, number", rows())
def test_the_data_sheet_has_the_pdo(dictionary, row, is_produced, number):
    communication, mapping = dictionary[int(row["communication"], 16)], dictionary[int(row["mapping"], 16)]
    flags = (0 if number == 2 else 1 << 30) | (number in OFF) << 31 if is_produced else 0
    assert communication[1].default == can_id(row) | flags
    assert (communication[2].default, communication[5].default) == (0xFF, 0)
    assert mapping[0].default == (len(entries(row)) or 0xFF)
    assert [mapping[sub + 1].default for sub in range(len(entries(row)))] == entries(row)
    assert mapping[0].access_type == "const"


def test_there_is_no_other_pdo(dictionary):
    known = {int(row.values[0][column], 16) for row in rows() for column in ("communication", "mapping")}
    assert {index for index in dictionary if 0x1400 <= index <= 0x1BFF} == known


def test_a_master_reads_what_the_node_sends():
    """The firmware on an emulated board: the master's own PDO objects decode its frames."""
    simulator = Simulator("--node", f"{NODE_ID}:lift", "--bitrate", "1000", speed="real")
    master = Master(simulator)
    try:
        node = master.node = master.network.add_node(NODE_ID, str(EDS))
        master.ready()
        assert node.sdo[0x1000].raw == 0x000001A1
        # The choice of virtual devices: car position unit and load measuring unit.
        node.sdo[0x2305].raw = 0x03
        assert node.sdo[0x1000].raw == 0x000001A1
        assert [node.sdo[0x6000][sub].raw for sub in range(3)] == [2, 0x0600, 0x0A00]
        for number in (258, 263):
            node.tpdo[number].read()
        assert (node.tpdo[258].cob_id, node.tpdo[263].cob_id) == (0x188, 0x18C)
        assert [variable.name for variable in node.tpdo[258].map] == ["Load signals.Load signal", "Load values.Load value"]
        node.nmt.send_command(1)
        position = node.tpdo[263]
        assert position.wait_for_reception(PATIENCE) is not None
        assert position.map[0].raw == 0
        # Half a revolution of a wheel of 200 mm.
        simulator.command(f"shaft {NODE_ID}=ramp:0,0.5,0.2")
        # The CAN-ID of the position is not that of TPDO 1 of a node 12.
        bus = f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0"
        scan = [os.environ["NODECTL_COMMAND"], "--bus", bus, "scan"]
        found = subprocess.run(scan, capture_output=True, text=True, check=True)
        assert "node 8" not in found.stderr and "node 12" not in found.stderr
        while position.map[0].raw != 100:
            assert position.wait_for_reception(PATIENCE) is not None
    finally:
        master.close()
        simulator.end()
