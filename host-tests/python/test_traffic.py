"""`nodectl trace --by-id`, `replay`, `send` and `map --dbc`, judged by python-can's reader of logs and by cantools."""

import json
import os
import subprocess
from collections import Counter

import can
import cantools
import pytest
from simulator import Master, Simulator, nodectl


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A second of a bus with SDO transfers, TPDOs and heartbeats."""
    log = tmp_path_factory.mktemp("traffic") / "bus.log"
    simulator = Simulator("--bitrate", "250", "--candump", str(log))
    master = Master(simulator)
    master.write(0x1017, 0, 100, 2)
    master.write(0x1800, 5, 20, 2)
    pdos = master.listen(0x181)
    master.node.nmt.send_command(0x01)
    for _ in range(50):
        pdos.next()
    assert master.read(0x1018, 2) == 1
    master.close()
    simulator.quit()
    return log


def test_one_line_for_each_can_id(log):
    frames = list(can.CanutilsLogReader(log))
    command = [os.environ["NODECTL_COMMAND"], "--json", "--bit-rate", "250", "trace", "--by-id", "--file", log]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    lines = [json.loads(line) for line in output.splitlines()]
    *rows, bus = lines
    assert {row["can_id"]: row["count"] for row in rows} == Counter(frame.arbitration_id for frame in frames)
    assert bus["frames"] == len(frames)
    for row in rows:
        own = [frame for frame in frames if frame.arbitration_id == row["can_id"]]
        assert row["data"] == own[-1].data.hex(" ").upper() and row["length"] == own[-1].dlc
        gaps = [after.timestamp - before.timestamp for before, after in zip(own, own[1:])]
        if gaps:
            wanted = [1000 * time for time in (sum(gaps) / len(gaps), min(gaps), max(gaps))]
            assert [row["period"], row["shortest"], row["longest"]] == pytest.approx(wanted, abs=0.002)
    # Without stuff bits, a frame has 47 bits and its data.
    bits = sum(47 + 8 * frame.dlc for frame in frames)
    seconds = frames[-1].timestamp - frames[0].timestamp
    least = 100 * bits / (seconds * 250_000)
    assert least <= bus["load_percent"] <= 1.2 * least
    assert bus["load_percent"] <= bus["peak_percent"] <= 100


def test_a_log_is_sent_again(log):
    frames = list(can.CanutilsLogReader(log))
    requests = [frame for frame in frames if frame.arbitration_id == 0x601]
    # A client aborts a transfer whose request came before the node's boot-up; nothing answers an abort.
    wanted = sum(frame.data[0] != 0x80 for frame in requests)
    simulator = Simulator("--bitrate", "250")
    Master(simulator).close()
    bus = simulator.bus()
    replay = nodectl(simulator, "--json", "replay", log, "--id", "601", "--speed", "2")
    assert replay.returncode == 0, replay.stderr
    assert json.loads(replay.stdout) == {"frames": len(requests), "left_out": len(frames) - len(requests)}
    # A client that listens gets the frames in their order, and the answers.
    sent, answers = [], 0
    while (len(sent), answers) != (len(requests), wanted):
        message = bus.recv(10)
        assert message is not None and answers <= len(sent), (sent, answers)
        sent += [message.data] if message.arbitration_id == 0x601 else []
        answers += message.arbitration_id == 0x581
    assert sent == [frame.data for frame in requests]
    bus.shutdown()
    # A client on the bus before would take the answers of the log for its own.
    master = Master(simulator)
    assert (master.read(0x1017, 0), master.read(0x1800, 5)) == (100, 20)
    master.close()
    simulator.quit()


@pytest.mark.parametrize("rate", ["125", "1000"])
def test_each_sync_that_is_sent_brings_a_tpdo(rate):
    simulator = Simulator("--bitrate", rate, "--node", "1:encoder")
    master = Master(simulator)
    master.node.nmt.send_command(0x01)
    master.close()
    bus = simulator.bus()
    sent = nodectl(simulator, "send", "080#", "--count", "3", "--every", "50")
    assert (sent.returncode, sent.stdout) == (0, "3 frames sent\n"), sent.stderr
    seen = []
    while seen.count(0x281) < 3:
        message = bus.recv(10)
        assert message is not None, seen
        seen += [message.arbitration_id] if message.arbitration_id in (0x080, 0x281) else []
    assert seen == [0x080, 0x281] * 3
    refused = nodectl(simulator, "send", "800#")
    assert refused.returncode == 2 and "such as 201#0102" in refused.stderr
    bus.shutdown()
    simulator.quit()


@pytest.mark.parametrize("personality", ["pressure", "encoder", "combined", "lift"])
def test_a_dbc_file_decodes_the_pdos(personality, tmp_path):
    simulator = Simulator("--bitrate", "250", "--node", f"1:{personality}", "--pressure", "const:250000")
    Master(simulator).close()
    file = tmp_path / "bus.dbc"
    done = nodectl(simulator, "map", "--dbc", file)
    assert done.returncode == 0, done.stderr
    database = cantools.database.load_file(file)
    master = Master(simulator)
    assert [node.name for node in database.nodes] == ["Node1"]
    for message in database.messages:
        number = int(message.name.removeprefix("Node1_TPDO"))
        communication, mapping = 0x1800 + number - 1, 0x1A00 + number - 1
        assert message.frame_id == master.read(communication, 1) & 0x7FF
        mapped = [master.read(mapping, sub) for sub in range(1, master.read(mapping, 0) + 1)]
        assert message.length == (sum(entry & 0xFF for entry in mapped) + 7) // 8
        starts = [sum(entry & 0xFF for entry in mapped[:place]) for place in range(len(mapped))]
        signals = [(signal.start, signal.length) for signal in message.signals]
        numbers = [(start, entry & 0xFF) for start, entry in zip(starts, mapped)]
        assert set(signals) <= set(numbers) and signals
        values = message.decode(bytes(message.length))
        assert set(values) == {signal.name for signal in message.signals}
    assert database.messages
    if personality == "pressure":
        pdos = master.listen(0x181)
        master.write(0x1800, 5, 100, 2)
        master.node.nmt.send_command(0x01)
        values = list(database.get_message_by_frame_id(0x181).decode(pdos.next()[1]).values())
        # bar and degrees Celsius; the simulator is at room temperature.
        assert values[0] == pytest.approx(2.5, abs=0.02) and 15 < values[1] < 30
    master.close()
    simulator.quit()
