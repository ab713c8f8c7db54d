"""Start and end of the simulator as a script sees them."""

import signal

import can
import pytest
from simulator import Master, Simulator


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=["SIGTERM", "Ctrl-C"])
def test_a_signal_ends_it_and_what_was_saved_is_kept(tmp_path, number):
    flags = ("--flash", str(tmp_path))
    simulator = Simulator(*flags, speed="real")
    assert simulator.greeting["boards"] == [{"id": 1, "programs": "written"}]
    master = Master(simulator)
    master.write(0x1017, 0, 750, 2)
    master.node.store()
    master.close()
    simulator.process.send_signal(number)
    assert simulator.summary()["nodes"][0]["boot_ups"] == 1

    simulator = Simulator(*flags, speed="real")
    assert simulator.greeting["boards"] == [{"id": 1, "programs": "kept"}]
    master = Master(simulator)
    assert master.read(0x1017) == 750
    master.close()
    simulator.quit()


def test_what_a_client_sends_before_it_leaves_is_on_the_bus(tmp_path):
    log = tmp_path / "bus.log"
    simulator = Simulator("--candump", str(log), speed="real")
    bus = simulator.bus()
    for _ in range(5):
        bus.send(can.Message(arbitration_id=0x000, data=[1, 1], is_extended_id=False))
    bus.shutdown()
    with simulator.bus():
        pass
    simulator.quit()
    assert log.read_text().count(" 000#0101") >= 5
