"""The gateway of the examples, driven by python-canopen: the last of its 512 PDOs, its 127 nodes, its SDO channels."""

import canopen
import pytest
from example import Bench, data_sheet

NODE = 7
OFF = 1 << 31


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    return data_sheet("gateway", tmp_path_factory.mktemp("gateway"))


@pytest.fixture
def bench(sheet):
    bench = Bench("gateway", NODE, sheet)
    yield bench
    bench.close()


def test_the_last_pdos_carry_the_values_of_the_host(bench):
    bench.node.sdo[0x19FF][1].raw = 0x695
    bench.node.sdo[0x15FF][1].raw = 0x6AB
    bench.listen(0x695)
    bench.state("OPERATIONAL", 5)
    assert bench.next(0x695) == bytes(4), "on entering Operational"
    bench.program.command("set", 512, 123456)
    assert bench.next(0x695) == (123456).to_bytes(4, "little")
    bench.network.send_message(0x6AB, (654321).to_bytes(4, "little"))
    bench.program.wait_for("received 512 654321")
    assert bench.node.sdo[0x31FF].raw == 654321


def test_the_data_sheet_lists_all_pdos(bench):
    info = bench.node.object_dictionary.device_information
    assert (info.nr_of_RXPDO, info.nr_of_TXPDO) == (512, 512)
    for index in (0x1400, 0x15FF, 0x1800, 0x19FF, 0x1028, 0x1201, 0x1280):
        assert index in bench.node.object_dictionary, hex(index)


def test_the_host_learns_of_127_nodes(bench):
    for node in (2, 64, 127):
        bench.node.sdo[0x1016][node].raw = node << 16 | 1000
    for node in (2, 64, 127):
        bench.network.send_message(0x700 + node, b"\x00")
        bench.program.wait_for(f"node {node} Initialising")
        bench.network.send_message(0x700 + node, b"\x05")
        bench.program.wait_for(f"node {node} Operational")
        bench.network.send_message(0x080 + node, bytes([0x30, 0x81, 0x11, 0, 0, 0, 0, 0]))
        bench.program.wait_for(f"emcy {node} 8130")
    for node in (2, 64, 127):
        bench.program.wait_for(f"lost {node}")


def test_the_host_reads_another_node_through_the_gateway(bench):
    bench.listen(0x709)
    bench.start("io_module", 9)
    assert bench.next(0x709) == b"\x00"
    bench.program.command("read", 9, "1008", 0)
    assert bench.program.line() == "value " + b"I/O module".hex()
    bench.program.command("read", 9, "1000", 0)
    assert bench.program.line() == "value " + (0x00070191).to_bytes(4, "little").hex()
    bench.program.command("read", 9, "2FFF", 0)
    assert bench.program.line().startswith("failed: ")
    assert bench.node.sdo[0x1280][1].raw == 0x609
    bench.program.command("read", 0, "1000", 0)
    assert bench.program.line() == "failed: NoConnection"


def test_two_clients_read_at_the_same_time(bench):
    bench.node.sdo[0x1201][1].raw = 0x6A0
    bench.node.sdo[0x1201][2].raw = 0x6B0
    second = bench.node.add_sdo(0x6A0, 0x6B0)
    second.network = bench.network
    second.RESPONSE_TIMEOUT = bench.node.sdo.RESPONSE_TIMEOUT
    with bench.node.sdo[0x1008].open("rb", size=None) as first, second[0x1008].open("rb") as other:
        begun = [first.read(3), other.read(3)]
        texts = [start + stream.read() for start, stream in zip(begun, [first, other])]
    assert texts == [b"Gateway", b"Gateway"]
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        bench.node.sdo[0x1201][1].raw = 0x605
    assert refusal.value.code == 0x06090030
