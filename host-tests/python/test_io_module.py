"""The example of the library, a CiA 401 device, driven by python-canopen with the data sheet that the example writes."""

import canopen
import pytest
from example import Bench, data_sheet

NODE = 5


class Module(Bench):
    """The module, with a file for its parameters."""

    def __init__(self, sheet, file):
        super().__init__("io_module", NODE, sheet, file)

    def connect(self, what: str, value: int) -> None:
        self.program.command(what, value)

    def outputs(self) -> int:
        """The next change of the outputs."""
        name, value = self.program.line().split()
        assert name == "outputs"
        return int(value)


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    return data_sheet("io_module", tmp_path_factory.mktemp("io_module"))


@pytest.fixture
def bench(sheet, tmp_path):
    bench = Module(sheet, tmp_path / "parameters")
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
    bench.connect("inputs", 0b0101)
    assert bench.next(0x180 + NODE) == bytes([0b0101])
    bench.node.sdo[0x6002][1].raw = 0b0001
    assert bench.next(0x180 + NODE) == bytes([0b0100])
    bench.node.sdo[0x6003][1].raw = 0b1000
    bench.connect("inputs", 0b1101)
    assert bench.next(0x180 + NODE) == bytes([0b1100])


def test_outputs_go_by_rpdo_and_sdo_through_polarity(bench):
    bench.state("OPERATIONAL", 5)
    bench.network.send_message(0x200 + NODE, b"\x03")
    assert bench.outputs() == 3
    bench.node.sdo[0x6202][1].raw = 1
    assert bench.outputs() == 2
    bench.node.sdo[0x6200][1].raw = 0x80
    assert bench.outputs() == 0x81


def test_the_analogue_input_is_sent_when_it_has_changed_by_the_delta(bench):
    bench.listen(0x280 + NODE)
    bench.node.sdo[0x6426][1].raw = 100
    bench.node.sdo[0x6423].raw = True
    bench.state("OPERATIONAL", 5)
    assert bench.next(0x280 + NODE) == (0).to_bytes(2, "little"), "on entering Operational"
    for value in (60, 99, -100, -180, -201):
        bench.connect("analogue", value)
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
    assert bench.outputs() == 0xF0
    assert bench.outputs() == 0xF5, "the heartbeat of the master is missing"
    assert bench.next(0x080 + NODE)[:2] == (0x8130).to_bytes(2, "little")
    bench.network.send_message(0x77F, b"\x05")
    bench.network.send_message(0x200 + NODE, b"\x08")
    assert bench.outputs() == 0x08
    bench.state("STOPPED", 4)
    assert bench.outputs() == 0x05


def test_a_cable_that_is_pulled_leads_to_the_error_values(bench):
    bench.node.sdo[0x6207][1].raw = 0x42
    bench.state("OPERATIONAL", 5)
    bench.network.send_message(0x200 + NODE, b"\x01")
    assert bench.outputs() == 1
    bench.simulator.quit()
    assert bench.outputs() == 0x42


def test_parameters_that_are_saved_outlive_the_supply(bench):
    bench.node.sdo[0x6206][1].raw = 0x0F
    bench.node.sdo[0x1017].raw = 150
    bench.node.sdo[0x6207][1].raw = 0x05
    bench.node.store(2)
    bench.restart()
    assert bench.node.sdo[0x1017].raw == 150
    assert bench.node.sdo[0x6206][1].raw == 0xFF, "application parameters were not saved"
    bench.node.sdo[0x6206][1].raw = 0x0F
    bench.node.store()
    bench.restart()
    assert bench.node.sdo[0x6206][1].raw == 0x0F
    bench.node.restore(3)
    assert bench.node.sdo[0x6206][1].raw == 0x0F, "the defaults come with the next reset"
    bench.node.nmt.state = "RESET"
    while bench.next(0x700 + NODE) != b"\x00":
        pass
    assert bench.node.sdo[0x6206][1].raw == 0xFF
    assert bench.node.sdo[0x1017].raw == 150, "the other group is stored"


def test_a_damaged_file_is_reported_and_its_group_has_its_defaults(bench, tmp_path):
    bench.node.sdo[0x6207][1].raw = 0x05
    bench.node.store(3)
    stored = tmp_path / "parameters.3"
    stored.write_bytes(stored.read_bytes()[:-1])
    bench.listen(0x080 + NODE)
    bench.restart()
    assert bench.next(0x080 + NODE)[:4] == bytes([0x03, 0x63, 0x01, 2])
    assert bench.node.sdo[0x6207][1].raw == 0


def test_what_the_module_cannot_store_is_refused(bench):
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        bench.node.sdo[0x1010][1].raw = 0x12345678
    assert refusal.value.code == 0x08000020
