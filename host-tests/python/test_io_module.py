"""The example of the library, a CiA 401 device, driven by python-canopen with the data sheet that the example writes."""

import os
import queue
import subprocess
import threading

import canopen
import pytest
from simulator import PATIENCE, Simulator

NODE = 5


class Module:
    """The running example: its process on standard input and output."""

    def __init__(self, port: int):
        command = [os.environ["IO_MODULE_COMMAND"], f"127.0.0.1:{port}", "vcan0", str(NODE)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=lambda: [self.lines.put(line) for line in self.process.stdout], daemon=True).start()

    def connect(self, what: str, value: int) -> None:
        print(what, value, file=self.process.stdin, flush=True)

    def outputs(self) -> int:
        """The next change of the outputs."""
        name, value = self.lines.get(timeout=PATIENCE).split()
        assert name == "outputs"
        return int(value)

    def end(self) -> None:
        self.process.kill()
        self.process.wait()


class Bench:
    """The bus, the example on it, and a stock python-canopen network."""

    def __init__(self, sheet):
        self.simulator = Simulator(speed="real")
        self.network = canopen.Network()
        self.network.connect(interface="socketcand", host="127.0.0.1", port=self.simulator.socketcand, channel="vcan0")
        self.frames: dict[int, queue.Queue] = {}
        self.listen(0x700 + NODE)
        self.module = Module(self.simulator.socketcand)
        self.node = self.network.add_node(NODE, str(sheet))
        self.node.sdo.RESPONSE_TIMEOUT = PATIENCE
        assert self.next(0x700 + NODE) == b"\x00"

    def listen(self, cob_id: int) -> None:
        frames = self.frames[cob_id] = queue.Queue()
        self.network.subscribe(cob_id, lambda _id, data, _time: frames.put(bytes(data)))

    def next(self, cob_id: int) -> bytes:
        return self.frames[cob_id].get(timeout=PATIENCE)

    def state(self, command: str, code: int) -> None:
        """Commands a state and waits for the heartbeat with this state."""
        self.node.nmt.state = command
        while self.next(0x700 + NODE) != bytes([code]):
            pass

    def close(self) -> None:
        self.module.end()
        self.network.disconnect()


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    path = tmp_path_factory.mktemp("io_module") / "io_module.eds"
    subprocess.run([os.environ["IO_MODULE_COMMAND"], "--eds", path], check=True)
    return path


@pytest.fixture
def bench(sheet):
    bench = Bench(sheet)
    yield bench
    bench.close()


def test_the_data_sheet_says_what_the_device_says(bench):
    for index in (0x1000, 0x1014, 0x1017, 0x6423):
        variable = bench.node.sdo[index]
        assert variable.raw == bench.node.object_dictionary[index].default, hex(index)
    for index in (0x1018, 0x6002, 0x6206, 0x6207, 0x6426, 0x1A00, 0x1600):
        for sub in range(1, bench.node.sdo[index][0].raw + 1):
            wanted = bench.node.object_dictionary[index][sub].default
            assert bench.node.sdo[index][sub].raw == wanted, f"{index:X}h:{sub}"


def test_inputs_come_by_tpdo_through_filter_and_polarity(bench):
    bench.listen(0x180 + NODE)
    bench.state("OPERATIONAL", 5)
    assert bench.next(0x180 + NODE) == b"\x00", "on entering Operational"
    bench.module.connect("inputs", 0b0101)
    assert bench.next(0x180 + NODE) == bytes([0b0101])
    bench.node.sdo[0x6002][1].raw = 0b0001
    assert bench.next(0x180 + NODE) == bytes([0b0100])
    bench.node.sdo[0x6003][1].raw = 0b1000
    bench.module.connect("inputs", 0b1101)
    assert bench.next(0x180 + NODE) == bytes([0b1100])


def test_outputs_go_by_rpdo_and_sdo_through_polarity(bench):
    bench.state("OPERATIONAL", 5)
    bench.network.send_message(0x200 + NODE, b"\x03")
    assert bench.module.outputs() == 3
    bench.node.sdo[0x6202][1].raw = 1
    assert bench.module.outputs() == 2
    bench.node.sdo[0x6200][1].raw = 0x80
    assert bench.module.outputs() == 0x81


def test_the_analogue_input_is_sent_when_it_has_changed_by_the_delta(bench):
    bench.listen(0x280 + NODE)
    bench.node.sdo[0x6426][1].raw = 100
    bench.node.sdo[0x6423].raw = True
    bench.state("OPERATIONAL", 5)
    assert bench.next(0x280 + NODE) == (0).to_bytes(2, "little"), "on entering Operational"
    for value in (60, 99, -100, -180, -201):
        bench.module.connect("analogue", value)
        while bench.node.sdo[0x6401][1].raw != value:
            pass
    sent = [int.from_bytes(bench.next(0x280 + NODE), "little", signed=True) for _ in range(2)]
    assert sent == [-100, -201]


def test_a_master_that_falls_silent_and_a_stop_lead_to_the_error_values(bench):
    bench.node.sdo[0x6206][1].raw = 0x0F
    bench.node.sdo[0x6207][1].raw = 0x05
    bench.node.sdo[0x1029][1].raw = 1
    bench.node.sdo[0x1016][1].raw = 0x7F << 16 | 200
    bench.listen(0x080 + NODE)
    bench.state("OPERATIONAL", 5)
    bench.network.send_message(0x77F, b"\x05")
    bench.network.send_message(0x200 + NODE, b"\xF0")
    assert bench.module.outputs() == 0xF0
    assert bench.module.outputs() == 0xF5, "the heartbeat of the master is missing"
    assert bench.next(0x080 + NODE)[:2] == (0x8130).to_bytes(2, "little")
    bench.network.send_message(0x77F, b"\x05")
    bench.network.send_message(0x200 + NODE, b"\x08")
    assert bench.module.outputs() == 0x08
    bench.state("STOPPED", 4)
    assert bench.module.outputs() == 0x05


def test_a_cable_that_is_pulled_leads_to_the_error_values(bench):
    bench.node.sdo[0x6207][1].raw = 0x42
    bench.state("OPERATIONAL", 5)
    bench.network.send_message(0x200 + NODE, b"\x01")
    assert bench.module.outputs() == 1
    bench.simulator.quit()
    assert bench.module.outputs() == 0x42
