"""`nodectl simulate`: a drive out of a data sheet, driven by a stock python-canopen network and judged by `nodectl check`."""

import json
import os
import queue
import subprocess
from pathlib import Path

import canopen
import pytest
from simulator import PATIENCE, Simulator

SHEET = Path(__file__).parents[2] / "tools" / "eds" / "tests" / "corpus" / "plain-drive.eds"
NODE = 6
SCRIPT = """
0.5  Statusword = 0x0250
0.8  6064 = -2000   # mapped into TPDO 1, too
1.0  emcy 4200
1.3  emcy 0
2.0  repeat
"""


@pytest.fixture(params=[[]])
def bench(tmp_path, request):
    simulator = Simulator(speed="real")
    bus = f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0"
    (tmp_path / "values.txt").write_text(SCRIPT)
    nodectl = os.environ["NODECTL_COMMAND"]
    line = [nodectl, "--json", "--bus", bus, "--eds", SHEET, "-n", str(NODE), "simulate", *request.param]
    network = canopen.Network()
    network.connect(interface="socketcand", host="127.0.0.1", port=simulator.socketcand, channel="vcan0")
    process = subprocess.Popen(line, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert json.loads(process.stdout.readline())["node"] == NODE
    node = network.add_node(NODE, str(SHEET))
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    yield network, node, bus
    process.kill()
    process.wait()
    network.disconnect()


@pytest.mark.parametrize("bench", [["--values", "values.txt"]], indirect=True)
def test_python_canopen_drives_it(bench):
    network, node, _bus = bench
    node.nmt.wait_for_heartbeat(PATIENCE)
    assert node.sdo["Device type"].raw == 0x00020192
    assert node.sdo["Identity object"]["Product code"].raw == 0x202
    node.sdo["Profile velocity"].raw = 2500
    node.store()
    with pytest.raises(canopen.SdoAbortedError):
        node.sdo["Profile velocity"].raw = 60001
    emergencies = queue.Queue()
    node.emcy.add_callback(emergencies.put)
    node.tpdo.read()
    node.rpdo.read()
    received = queue.Queue()
    node.tpdo[1].add_callback(lambda pdo: received.put([variable.raw for variable in pdo]))
    node.nmt.state = "OPERATIONAL"
    node.nmt.wait_for_heartbeat(PATIENCE)
    node.rpdo[1]["Target position"].raw = 4711
    node.rpdo[1].transmit()
    while node.sdo["Target position"].raw != 4711:
        pass
    while received.get(timeout=PATIENCE) != [0x0250, -2000]:
        pass
    codes = []
    while codes[-2:] != [0x4200, 0]:
        codes.append(emergencies.get(timeout=PATIENCE).code)
    node.nmt.state = "RESET"
    node.nmt.wait_for_bootup(PATIENCE)
    assert node.sdo["Profile velocity"].raw == 2500, "it was stored"


def test_nodectl_check_judges_it(bench):
    _network, _node, bus = bench
    # ERR, SYN and PDO judge times. They run in virtual time (tools/nodectl/tests/client/simulate.rs).
    groups = "EDS,DIC,SDO,NMT,EMC,STO,LSS,ROB"
    line = [os.environ["NODECTL_COMMAND"], "--bus", bus, "--eds", SHEET, "-n", str(NODE), "check", "--only", groups]
    done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
