"""Start and end of the simulator as a script sees them."""

import os
import signal
import subprocess
import time

import can
import pytest
from simulator import PATIENCE, Master, Simulator


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


BUSES = ["socketcand", "slcan"]
ADAPTERS = [*BUSES, "serial port"]


def address(simulator: Simulator, bus: str) -> str:
    """The address of a bus for nodectl."""
    match bus:
        case "socketcand":
            return f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0"
        case "slcan":
            return f"slcan://127.0.0.1:{simulator.slcan}"
        case _:
            return f"slcan:{simulator.serial_adapter()}"


def nodectl(simulator: Simulator, bus: str, *arguments: str) -> str:
    command = [os.environ["NODECTL_COMMAND"], "--bus", address(simulator, bus), *arguments]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, timeout=PATIENCE).stdout


def settle(simulator: Simulator) -> None:
    """Lets the bus carry all frames: a heartbeat has the second lowest priority of what the tests send."""
    with simulator.bus() as bus:
        while bus.recv(PATIENCE).arbitration_id != 0x701:
            pass


def hear(bus: can.BusABC, can_id: int, count: int) -> None:
    """Waits for frames with this CAN-ID."""
    end = time.monotonic() + PATIENCE
    while count:
        assert time.monotonic() < end, f"{count} frames are missing"
        frame = bus.recv(1)
        count -= frame is not None and frame.arbitration_id == can_id


@pytest.mark.parametrize("bus", BUSES)
def test_frames_that_python_can_sends_before_it_leaves_are_on_the_bus(tmp_path, bus):
    log = tmp_path / "bus.log"
    simulator = Simulator("--candump", str(log), speed="real")
    for count in range(1, 11):
        with simulator.bus() if bus == "socketcand" else simulator.slcan_bus(bitrate=250_000) as client:
            for number in range(count):
                client.send(can.Message(arbitration_id=0x600, data=[count, number], is_extended_id=False))
    settle(simulator)
    simulator.quit()
    text = log.read_text()
    assert [text.count(f" 600#{count:02X}") for count in range(1, 11)] == list(range(1, 11))


@pytest.mark.parametrize("bitrate", [10, 250, 1000])
@pytest.mark.parametrize("bus", ADAPTERS)
def test_the_last_frame_of_nodectl_is_on_the_bus(tmp_path, bus, bitrate):
    log = tmp_path / "bus.log"
    simulator = Simulator("--candump", str(log), "--bitrate", str(bitrate), speed="real")
    with simulator.bus() as listener:
        for _ in range(6):
            nodectl(simulator, bus, "--bit-rate", str(bitrate), "nmt", "preop", "--node", "9", "--no-wait")
        # A serial adapter is a thread of this program, which may be late.
        hear(listener, 0x000, 6)
    settle(simulator)
    simulator.quit()
    assert log.read_text().count(" 000#8009") == 6


@pytest.mark.parametrize("bus", ADAPTERS)
def test_a_node_is_out_of_lss_configuration_after_nodectl_has_set_its_node_id(bus):
    simulator = Simulator(speed="real")
    Master(simulator).close()
    assert "node-ID 7" in nodectl(simulator, bus, "lss", "set-id", "7")
    with simulator.bus() as client:
        # Inquire node-ID (CiA 305): only a slave in the state Configuration answers.
        client.send(can.Message(arbitration_id=0x7E5, data=[0x5E, 0, 0, 0, 0, 0, 0, 0], is_extended_id=False))
        heartbeats = 0
        while heartbeats < 3:
            frame = client.recv(PATIENCE)
            assert frame.arbitration_id != 0x7E4, "the node is in the state Configuration"
            heartbeats += frame.arbitration_id == 0x701
    simulator.quit()


def test_every_adapter_reads_the_same_values():
    simulator = Simulator(speed="real")
    Master(simulator).close()
    values = {bus: nodectl(simulator, bus, "-n", "1", "read", "1018", "1008", "1017") for bus in ADAPTERS}
    assert "STM32F4 pressure transmitter" in values["serial port"]
    assert len(set(values.values())) == 1, values
    simulator.quit()
