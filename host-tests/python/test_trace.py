"""`nodectl trace` beside tshark: of one recorded bus both tell the same transfers with the same values, the same commands,
emergencies and process data.
"""

import json
import os
import shutil
import struct
import subprocess
from pathlib import Path

import canopen
import pytest
from simulator import Master, Simulator

FIELDS = [
    "canopen.cob_id",
    "canopen.sdo.ccs",
    "canopen.sdo.scs",
    "canopen.sdo.e",
    "canopen.sdo.main_idx",
    "canopen.sdo.sub_idx",
    "canopen.sdo.data.bytes",
    "canopen.sdo.abort_code",
    "canopen.em.err_code",
    "canopen.nmt_ctrl.cd",
    "canopen.pdo.data.bytes",
]


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """The record of a bus with all kinds of events: transfers, refusals, PDOs, an emergency, a reset."""
    log = tmp_path_factory.mktemp("trace") / "bus.log"
    simulator = Simulator("--bitrate", "1000", "--pressure", "const:250000", "--candump", str(log))
    master = Master(simulator)
    emergencies = master.listen(0x081)
    assert master.node.sdo.upload(0x1008, 0) == b"STM32F4 pressure transmitter"
    assert master.read(0x1018, 2) == 1
    with master.node.sdo.open(0x1008, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == b"STM32F4 pressure transmitter"
    with pytest.raises(canopen.SdoAbortedError):
        master.write(0x1000, 0, 1, 4)
    with pytest.raises(canopen.SdoAbortedError):
        master.read(0x2FFF, 0)
    master.write(0x1800, 5, 20, 2)
    pdos = master.listen(0x181)
    master.node.nmt.send_command(0x01)
    master.network.send_message(0x80, b"")
    for _ in range(3):
        pdos.next()
    simulator.command("fault open-sensor@0")
    emergencies.until(lambda data: data[:2] != b"\x00\x00")
    master.node.nmt.send_command(0x81)
    master.listen(0x701).until(lambda data: data == b"\x00")
    master.close()
    simulator.quit()
    return log


def of_tshark(log) -> list[dict]:
    if shutil.which("tshark") is None:
        pytest.fail("tshark is missing; `cargo xtask test` installs it")
    command = ["tshark", "-r", str(log), "-d", "can.subdissector,canopen", "-T", "fields"]
    for field in FIELDS:
        command += ["-e", field]
    output = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, "LC_ALL": "C"})
    return [dict(zip(FIELDS, line.split("\t"))) for line in output.stdout.splitlines()]


def of_nodectl(log) -> list[dict]:
    eds = Path(__file__).parents[2] / "eds" / "pressure.eds"
    command = [os.environ["NODECTL_COMMAND"], "--json", "--eds", eds, "trace", "--file", log]
    output = subprocess.run(command, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in output.stdout.splitlines()]


def number(text: str) -> int:
    return int(text, 0)


def test_the_same_transfers_with_the_same_values(log):
    frames = [row for row in of_tshark(log) if row["canopen.sdo.ccs"] or row["canopen.sdo.scs"]]
    # Index and sub-index of the first frame of each transfer, and abort codes of the refused transfers.
    begins = [row for row in frames if row["canopen.sdo.ccs"] and row["canopen.sdo.main_idx"] and not row["canopen.sdo.abort_code"]]
    wanted = [(number(row["canopen.sdo.main_idx"]), number(row["canopen.sdo.sub_idx"])) for row in begins]
    lines = [line for line in of_nodectl(log) if line["kind"] == "sdo"]
    # tshark does not decode the first frame of a block transfer.
    objects = [line["values"][0]["object"] for line in lines if "(blocks, " not in line["text"]]
    assert objects == [f"{index:04X}h:{sub}" for index, sub in wanted]
    # To tshark, text in the segments of a block looks like aborts of objects that were never requested.
    refused = [row for row in frames if row["canopen.sdo.abort_code"] and row["canopen.sdo.scs"]]
    refused = [row for row in refused if number(row["canopen.sdo.main_idx"] or "0") in {index for index, _ in wanted}]
    aborts = [number(row["canopen.sdo.abort_code"]) for row in refused]
    assert [line["abort"] for line in lines if "refused" in line["text"]] == aborts and len(aborts) >= 2
    # Values that were read in one frame.
    is_read = [row for row in frames if row["canopen.sdo.scs"].endswith("2") and row["canopen.sdo.main_idx"]]
    read = [row for row in is_read if row["canopen.sdo.e"] in ("1", "True")]
    told = {(row["canopen.sdo.main_idx"], row["canopen.sdo.sub_idx"]): row["canopen.sdo.data.bytes"] for row in read}
    assert len(told) >= 2
    for (index, sub), data in told.items():
        name = f"{number(index):04X}h:{number(sub)}"
        values = [line["values"][0]["value"] for line in lines if line["values"][0]["object"] == name]
        # A request from before the node's boot-up has no answer.
        (value, *_) = [value for value in values if value is not None]
        assert value == int.from_bytes(bytes.fromhex(data.replace(":", "")), "little"), name
    texts = [line["text"] for line in lines if line["values"][0]["object"] == "1008h:0"]
    assert len(texts) == 2 and "segments" in texts[0] and "blocks" in texts[1]
    assert all(" = STM32F4 pressure transmitter (" in text for text in texts)


def test_the_same_commands_emergencies_and_process_data(log):
    frames, lines = of_tshark(log), of_nodectl(log)
    commands = [number(row["canopen.nmt_ctrl.cd"]) for row in frames if row["canopen.nmt_ctrl.cd"]]
    ours = [line for line in lines if line["kind"] == "nmt"]
    assert [int(line["data"][:2], 16) for line in ours] == commands and {0x01, 0x81} <= set(commands)
    codes = [number(row["canopen.em.err_code"]) for row in frames if row["canopen.em.err_code"]]
    emergencies = [line["text"] for line in lines if line["kind"] == "emcy"]
    assert [int(text[:4], 16) for text in emergencies] == codes and codes
    process = [bytes.fromhex(row["canopen.pdo.data.bytes"].replace(":", "")) for row in frames if row["canopen.pdo.data.bytes"]]
    pdos = [line for line in lines if line["kind"] == "pdo"]
    assert [bytes.fromhex(line["data"]) for line in pdos] == process and len(process) >= 2
    for line in pdos:
        if line["can_id"] != 0x181:
            continue
        pressure, temperature = struct.unpack("<ff", bytes.fromhex(line["data"]))
        values = [value["value"] for value in line["values"]]
        assert values == pytest.approx([pressure, temperature], nan_ok=True) or values[0] is None
        assert [value["unit"] for value in line["values"]] == ["bar", "°C"]
