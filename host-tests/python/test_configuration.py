"""A configuration is copied from one board to others: by nodectl, by python-canopen, and in ascending order, as any tool does."""

import os
import subprocess
from pathlib import Path

import canopen
import pytest
from simulator import PATIENCE, Master, Simulator

#: The node that is configured, the copy by nodectl, the copy by python-canopen, and the one in ascending order.
SOURCE, OURS, THEIRS, ASCENDING = 1, 16, 127, 64
NODES = (SOURCE, OURS, THEIRS, ASCENDING)

COMMON = [("1017", "700"), ("1016:1", "0x00050BB8"), ("1029:1", "1"), ("1015", "100"), ("2002:3", "300")]
PRESSURE = [("6131:1", "0xFD4E0000"), ("6132:1", "2"), ("6124:1", "1.5"), ("61A0:1", "1"), ("61A1:1", "9"), ("4000:16", "7")]
ALARM = [("6503:1", "0x61300120"), ("6508:1", "1"), ("650A:1", "5.5"), ("650B:1", "0.25"), ("6133:1", "0.5"), ("2210:1", "0.5")]
SENSORS = [("2100:2", "5"), ("2101:1", "8192"), ("2106:1", "4600")]
SETTINGS = {
    "pressure": [*PRESSURE, *ALARM, ("1801:5", "250")],
    "encoder": [*SENSORS, ("6301:1", "3"), ("6302:1", "1"), ("6310:1", "100"), ("6320:1", "200"), ("6401:1", "5"), ("2111:2", "50"), ("2112:1", "9"), ("2113:1", "-5"), ("2115:1", "2")],
    "combined": [*SENSORS, ("6301:1", "3"), ("6931:1", "0xFD4E0000"), ("6924:1", "1.5")],
    "lift": [
        *SENSORS,
        *[(f"6483:{sub}", str(100 * sub)) for sub in (1, 2, 3, 4)],
        ("2301:2", "2"),
        ("6384:1", "200"),
        ("6380:1", "8"),
        ("63B4:1", "-6"),
        ("63B8:1", "90000"),
        ("63B5:1", "-8"),
        ("2305", "15"),
        ("2310:1", "1"),
        ("6120:2", "0"),
        ("1881:5", "250"),
    ],
}


def nodectl(simulator: Simulator, node: int, *arguments: str) -> subprocess.CompletedProcess:
    bus = f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0"
    command = [os.environ["NODECTL_COMMAND"], "--bus", bus, "--node", str(node), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)


def done(process: subprocess.CompletedProcess) -> str:
    assert process.returncode == 0, process.args[5:] and (process.stdout + process.stderr)
    return process.stdout


def add(master: Master, node: int, sheet: str) -> canopen.RemoteNode:
    """A node of python-canopen's network, with a data sheet or a configuration file."""
    added = master.network.add_node(node, sheet)
    added.sdo.RESPONSE_TIMEOUT = PATIENCE
    return added


def ascending(node: canopen.RemoteNode) -> None:
    """Writes every value of a configuration file in ascending order, as the simplest tool does."""
    for index in sorted(node.object_dictionary):
        item = node.object_dictionary[index]
        entries = [item] if isinstance(item, canopen.objectdictionary.ODVariable) else [item[sub] for sub in sorted(item)]
        for entry in entries:
            if entry.value is not None and entry.writable:
                # PDOs have steps of their own (CiA 301, 7.5.2.36), except for their event timers.
                if 0x1400 <= index < 0x1C00 and (index >= 0x1A00 or entry.subindex != 5):
                    continue
                node.sdo.download(entry.index, entry.subindex, entry.encode_raw(entry.value))


@pytest.mark.parametrize("personality", SETTINGS)
def test_a_configuration_survives_its_copy_by_any_tool(tmp_path: Path, personality: str):
    boards = [flag for node in NODES for flag in ("--node", f"{node}:{personality}")]
    simulator = Simulator(*boards, "--bitrate", "1000", "--pressure", "const:250000", speed="real")
    master = Master(simulator)
    for address, value in COMMON + SETTINGS[personality]:
        done(nodectl(simulator, SOURCE, "write", address, value))
    file = tmp_path / "node.dcf"
    done(nodectl(simulator, SOURCE, "save"))
    done(nodectl(simulator, SOURCE, "nmt", "reset"))
    done(nodectl(simulator, SOURCE, "dump", str(file)))
    settings = len(COMMON + SETTINGS[personality])
    assert file.read_text().count("ParameterValue=") >= settings - 1

    assert nodectl(simulator, OURS, "diff", str(file)).returncode == 8
    assert "saved" in done(nodectl(simulator, OURS, "apply", str(file), "--save"))
    if personality != "lift":
        # python-canopen does not know multiplexed PDOs: it takes their number of mapped objects, 255, for 255 objects.
        add(master, THEIRS, str(file)).load_configuration()
    ascending(add(master, ASCENDING, str(file)))
    for node in (OURS, THEIRS, ASCENDING) if personality != "lift" else (OURS, ASCENDING):
        done(nodectl(simulator, node, "save"))
        done(nodectl(simulator, node, "nmt", "reset"))
        assert done(nodectl(simulator, node, "diff", str(file))) == "", f"node {node}"
    simulator.quit()
