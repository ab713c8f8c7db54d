"""The functions of CiA 404 and CiA 406 beyond the mandatory objects, by the data sheets in a stock CANopen master."""

import time
from pathlib import Path

import canopen
import pytest
from simulator import PATIENCE, Master, Simulator

EDS = Path(__file__).parents[2] / "eds"


@pytest.fixture
def node(request):
    personality, *flags = request.param
    simulator = Simulator("--node", f"1:{personality}", *flags, speed="real")
    master = Master(simulator)
    node = master.network.add_node(1, str(EDS / f"{personality}.eds"))
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    yield node
    master.close()
    simulator.end()


def becomes(read, is_right) -> None:
    """Waits until a value is right: the node shows the next sample."""
    end = time.monotonic() + PATIENCE
    while not is_right(read()):
        assert time.monotonic() < end, read()


def refused(code: int, write) -> None:
    with pytest.raises(canopen.SdoAbortedError) as aborted:
        write()
    assert aborted.value.code == code


@pytest.mark.parametrize("node", [("pressure", "--pressure", "const:300000")], indirect=True)
def test_tare_extremes_and_alarms_of_cia_404(node):
    sdo = node.sdo
    becomes(lambda: sdo[0x6130][1].raw, lambda bar: abs(bar - 3) < 0.01)
    assert (sdo[0x6112][1].raw, sdo[0x6114][1].raw) == (1, 1000)
    refused(0x06090032, lambda: sdo.download(0x6112, 1, b"\x00"))
    becomes(lambda: (sdo[0x2211][1].raw, sdo[0x2212][1].raw), lambda pair: 2.9 < pair[0] <= pair[1] < 3.1)
    refused(0x06090030, lambda: sdo.download(0x6503, 1, (0x61500108).to_bytes(4, "little")))
    sdo[0x6503][1].raw = 0x61300120
    sdo[0x650A][1].raw = 2.5
    sdo[0x650B][1].raw = 0.25
    sdo[0x6508][1].raw = 1
    becomes(lambda: (sdo[0x650D][1].raw, sdo[0x6600][1].raw, sdo[0x6602].raw), lambda states: states == (1, 1, 1))
    refused(0x08000020, lambda: sdo.download(0x6139, 1, b"zero"))
    sdo.download(0x6139, 1, b"tare")
    becomes(lambda: sdo[0x6130][1].raw, lambda bar: abs(bar) < 0.01)
    assert abs(sdo[0x2210][1].raw - 3) < 0.01
    becomes(lambda: sdo[0x6600][1].raw, lambda states: states == 0)


@pytest.mark.parametrize("node", [("encoder", "--shaft", "rpm:60")], indirect=True)
def test_speed_gear_and_threshold_of_cia_406(node):
    sdo = node.sdo
    sdo[0x2111][2].raw = 100
    becomes(lambda: sdo[0x2110][1].raw, lambda speed: abs(speed - 4096) < 80)
    sdo[0x2111][1].raw = 1
    becomes(lambda: sdo[0x2110][1].raw, lambda speed: abs(speed - 6000) < 120)
    sdo[0x6001].raw, sdo[0x6002].raw, sdo[0x2114].raw = 10800, 3600, 10
    sdo[0x6000].raw = 4
    assert sdo[0x6500].raw & 4 == 4
    becomes(lambda: sdo[0x6030][1].raw, lambda speed: abs(speed - 1080) < 25)
    assert all(sdo[0x6004].raw < 3600 for _ in range(20))
    refused(0x06090032, lambda: sdo.download(0x2114, 0, b"\x00\x00"))
    refused(0x06090031, lambda: sdo.download(0x2115, 1, b"\x03"))
    sdo[0x2112][1].raw = 100
    assert (sdo[0x2112][1].raw, sdo[0x2113][1].raw) == (100, 0)


@pytest.mark.parametrize("node", [("encoder", "--shaft", "const:0.1")], indirect=True)
def test_cams_across_zero_of_cia_406(node):
    sdo = node.sdo
    sdo[0x6003].raw = 0
    sdo[0x6301][1].raw, sdo[0x6310][1].raw, sdo[0x6320][1].raw = 1, -100, 100
    becomes(lambda: sdo[0x6300][1].raw & 1, lambda cam: cam == 1)
    sdo[0x6003].raw = 500
    becomes(lambda: sdo[0x6300][1].raw & 1, lambda cam: cam == 0)
