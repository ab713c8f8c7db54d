"""A stock CANopen master with the EDS does all that the node offers: objects, transfers, PDOs, saving, LSS.

These simulators run at the speed of a real board: the node gives up a transfer whose client is silent for a second of
its time, which would be some hundredths of a second of this program's.
"""

import configparser
import os
import random
import shutil
import struct
import subprocess
from pathlib import Path

import canopen
import pytest
from canopen import objectdictionary as od
from simulator import PATIENCE, Master, Simulator

EDS = Path(__file__).parents[2] / "eds" / "pressure.eds"

#: Objects whose value is a command or changes with time.
COMMANDS = {0x1010, 0x1011, 0x1F51, 0x2203, 0x2204, 0x2213, 0x6125, 0x6139, 0x650E, 0x6610, 0x6611}
#: Objects that have a default in the EDS although the node measures or counts the value.
MEASURED = {0x2010, 0x1F56, 0x2211, 0x2212, 0x6100, 0x6130, 0x6150, 0x7130, 0x9130}


class NodeWithEds(Master):
    """A master that has read the EDS for node 1."""

    def __init__(self, simulator: Simulator, node_id: int = 1):
        super().__init__(simulator)
        self.node = self.network.add_node(node_id, str(EDS))
        self.node.sdo.RESPONSE_TIMEOUT = PATIENCE

    def variables(self):
        """Every entry of the EDS as the client's variable, except for the dummy data types of RPDOs."""
        for index, entry in self.node.object_dictionary.items():
            if index < 0x1000:
                continue
            if isinstance(entry, od.ODVariable):
                yield index, 0, entry, self.node.sdo[index]
            else:
                for sub, variable in entry.subindices.items():
                    yield index, sub, variable, self.node.sdo[index][sub]


@pytest.fixture(scope="module")
def simulator(tmp_path_factory):
    log = tmp_path_factory.mktemp("log") / "bus.log"
    simulator = Simulator("--bitrate", "1000", "--pressure", "const:250000", "--candump", str(log), speed="real")
    simulator.log = log
    # The node must have booted once before a reset, so that this boot-up is not taken for the one of the reset.
    Master(simulator).ready().close()
    yield simulator
    simulator.end()


@pytest.fixture
def master(simulator):
    master = NodeWithEds(simulator)
    boot_up = master.listen(0x701)
    master.node.nmt.send_command(0x81)
    boot_up.until(lambda data: data == b"\x00")
    yield master
    master.close()


def abort_code(action) -> int | None:
    try:
        action()
    except canopen.SdoAbortedError as aborted:
        return aborted.code
    return None


def real_defaults() -> dict[tuple[int, int], float]:
    """Defaults of REAL32 entries. The EDS has the bits of the value, which python-canopen does not convert."""
    sheet = configparser.RawConfigParser(inline_comment_prefixes=(";",), strict=False)
    sheet.read(EDS, encoding="utf-8")
    defaults = {}
    for name in sheet.sections():
        if sheet.get(name, "DataType", fallback="") == "0x0008" and sheet.has_option(name, "DefaultValue"):
            index, _, sub = name.partition("sub")
            bits = int(sheet.get(name, "DefaultValue"), 0)
            defaults[int(index, 16), int(sub or "0", 16)] = struct.unpack("<f", struct.pack("<I", bits))[0]
    return defaults


def test_every_object_of_the_eds_reads_its_default(master: NodeWithEds):
    count, reals = 0, real_defaults()
    assert len(reals) > 30
    for index, sub, variable, remote in master.variables():
        if variable.access_type == "wo":
            assert abort_code(lambda: remote.raw) == 0x0601_0001, variable.name
        elif index in (0x2F00,) or (index == 0x1003 and sub > 0):
            assert abort_code(lambda: remote.raw) == 0x0800_0024, variable.name
        elif (index, sub) in reals and index not in MEASURED:
            assert remote.raw == pytest.approx(reals[index, sub]), variable.name
        elif variable.default is not None and index not in MEASURED:
            assert remote.raw == pytest.approx(variable.default) if isinstance(variable.default, float) else (
                remote.raw == variable.default
            ), variable.name
        else:
            assert remote.data is not None
        count += 1
    assert count > 350


def test_every_object_of_the_eds_is_written_or_refused(master: NodeWithEds):
    for number in (1, 2):
        master.write(0x1800 + number - 1, 1, 0x8000_0081 + 0x100 * number, 4)
        master.write(0x1A00 + number - 1, 0, 0, 1)
    # The key to the calibration: "cali".
    master.write(0x2203, 0, 0x696C_6163, 4)
    for index, sub, variable, remote in master.variables():
        if index in COMMANDS or index == 0x2F00 or (index, sub) in ((0x2002, 2), (0x2003, 3)):
            continue
        if variable.writable:
            value = remote.data
            remote.data = value
            assert remote.data == value, variable.name
        else:
            code = abort_code(lambda: remote.write(b"\x00" * max(1, len(variable) // 8), "raw"))
            code = code or abort_code(lambda: master.node.sdo.download(index, sub, b"\x00"))
            assert code == 0x0601_0002, f"{index:04X}:{sub} {variable.name}"


@pytest.mark.parametrize("block", [False, True], ids=["segments", "blocks"])
def test_four_kib_go_both_ways(master: NodeWithEds, block: bool):
    content = random.Random(1).randbytes(4096)
    with master.node.sdo.open(
        0x2F00, 0, "wb", size=len(content), block_transfer=block, request_crc_support=True
    ) as stream:
        stream.write(content)
    with master.node.sdo.open(0x2F00, 0, "rb", block_transfer=block, request_crc_support=True) as stream:
        assert stream.read() == content
    too_long = content + b"\x00"
    assert abort_code(lambda: master.node.sdo.download(0x2F00, 0, too_long)) == 0x0607_0012


def test_a_pdo_is_remapped_saved_and_found_after_a_power_cycle(tmp_path):
    flash = ("--bitrate", "500", "--flash", str(tmp_path), "--pressure", "const:250000")
    simulator = Simulator(*flash, speed="real")
    master = NodeWithEds(simulator).ready()
    tpdo = master.node.tpdo[3]
    tpdo.read()
    tpdo.clear()
    tpdo.add_variable(0x6130, 1)
    tpdo.add_variable(0x6150, 1)
    tpdo.cob_id = 0x1A5
    tpdo.trans_type = 1
    tpdo.enabled = True
    tpdo.save()
    master.node.sdo["Producer heartbeat time"].raw = 750
    master.node.store()
    master.close()
    simulator.quit()

    simulator = Simulator(*flash, speed="real")
    master = NodeWithEds(simulator).ready()
    assert master.node.sdo[0x1017].raw == 750
    tpdo = master.node.tpdo[3]
    tpdo.read()
    assert (tpdo.cob_id, tpdo.trans_type, tpdo.enabled) == (0x1A5, 1, True)
    assert [variable.index for variable in tpdo.map] == [0x6130, 0x6150]
    frames = master.listen(0x1A5)
    master.node.nmt.send_command(0x01)
    master.network.send_message(0x80, b"")
    _, data = frames.next()
    tpdo.data = bytearray(data)
    assert tpdo.map[0].raw == pytest.approx(2.5, abs=0.004)

    master.node.restore()
    master.close()
    simulator.quit()
    simulator = Simulator(*flash, speed="real")
    master = NodeWithEds(simulator).ready()
    assert master.node.sdo[0x1017].raw == 1000
    master.close()
    simulator.quit()


def scan(lss) -> list[int]:
    """One more identity. The client tells a bit by an answer that does not come for a while of the host's time, so on a busy
    machine a scan may have to be repeated, with twice the time; a wrong identity cannot come of it, for its end is answered
    or is none."""
    while lss.RESPONSE_TIMEOUT < PATIENCE / 10:
        is_found, identity = lss.fast_scan()
        if is_found:
            return identity
        lss.RESPONSE_TIMEOUT *= 2
    raise AssertionError("no node is found")


def test_three_nodes_without_a_node_id_are_found_and_moved_to_another_bit_rate():
    nodes = [flag for number in (201, 202, 203) for flag in ("--node", f"{number}:pressure")]
    simulator = Simulator("--bitrate", "250", *nodes, speed="real")
    master = Master(simulator)
    lss = master.network.lss
    lss.RESPONSE_TIMEOUT = 0.4
    found = {}
    for node_id in (11, 12, 13):
        boot_up = master.listen(0x700 + node_id)
        identity = scan(lss)
        lss.configure_node_id(node_id)
        assert lss.inquire_node_id() == 255, "the new one counts from the next start of the communication"
        lss.configure_bit_timing(2)
        lss.store_configuration()
        lss.send_switch_state_global(lss.WAITING_STATE)
        boot_up.until(lambda data: data == b"\x00")
        found[node_id] = identity
    assert lss.fast_scan() == (False, None)
    assert len({tuple(identity) for identity in found.values()}) == 3

    lss.send_switch_state_global(lss.CONFIGURATION_STATE)
    heartbeats = [master.listen(0x700 + node_id) for node_id in found]
    lss.activate_bit_timing(100)
    lss.send_switch_state_global(lss.WAITING_STATE)
    for heartbeat in heartbeats:
        heartbeat.next()
        heartbeat.next()
    for node_id, identity in found.items():
        node = master.network.add_node(node_id, str(EDS))
        node.sdo.RESPONSE_TIMEOUT = PATIENCE
        assert [node.sdo[0x1018][sub].raw for sub in (1, 2, 3, 4)] == identity
        assert lss.send_switch_state_selective(*identity) is not False
        assert lss.inquire_node_id() == node_id
        lss.send_switch_state_global(lss.WAITING_STATE)
    master.close()
    summary = simulator.quit()
    assert summary["bus"]["bit_rate"] == 500
    assert summary["bus"]["errors"] == 0


def test_tshark_finds_nothing_malformed_in_what_was_said(master: NodeWithEds, simulator):
    """Runs last: the log then holds all messages of the tests above on the first simulator's bus."""
    if shutil.which("tshark") is None:
        pytest.fail("tshark is missing; `cargo xtask test` installs it")
    master.node.nmt.send_command(0x01)
    master.network.send_message(0x80, b"")
    master.listen(0x701).next()
    # The log is complete when the simulator has ended.
    simulator.quit()
    fields = ["_ws.col.Protocol", "canopen.function_code", "_ws.malformed", "_ws.expert.message"]
    command = ["tshark", "-r", str(simulator.log), "-d", "can.subdissector,canopen", "-T", "fields"]
    for field in fields:
        command += ["-e", field]
    lines = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, "LC_ALL": "C"})
    rows = [line.split("\t") for line in lines.stdout.splitlines()]
    assert len(rows) > 2000
    for protocol, function, malformed, expert in rows:
        assert protocol == "CANopen" and not malformed and not expert, (protocol, function, malformed, expert)
    assert {int(function, 0) for _, function, _, _ in rows} >= {0x0, 0x1, 0x3, 0xB, 0xC, 0xE}
