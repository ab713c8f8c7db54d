"""`nodectl serve` on a full bus: nothing is lost on the way to a page that reads, and the memory is bounded.

How much of a core it takes depends on the machine, and is measured by running full_bus.py as a program.
"""

import threading
import time

import pytest
from full_bus import SIGNALS, Client, FullBus, memory, serve
from simulator import PATIENCE

SECONDS = 5.0


@pytest.fixture
def served():
    bus = FullBus()
    process, url = serve(bus)
    yield bus, process, url
    process.kill()
    process.wait()


def test_every_sample_of_a_full_bus_reaches_the_page_once_and_in_order(served):
    bus, process, url = served
    client = Client(url)
    for node in (1, 40, 80, 127):
        client.ask("signals", node=node)
    client.ask("follow", signals=SIGNALS)
    sender = threading.Thread(target=bus.run, args=(SECONDS,))
    sender.start()
    values = {signal: [] for signal in SIGNALS}
    expected = [float(turn) for turn in range(int(SECONDS * 8500) // 127) if turn % 67 != 66]
    end = time.monotonic() + SECONDS + PATIENCE
    while not all(len(got) >= len(expected) for got in values.values()):
        assert time.monotonic() < end, {signal: f"{len(got)} of {len(expected)}" for signal, got in values.items()}
        message = client.next()
        if message.get("event") == "live":
            assert message["lost"] == 0
            for signal in message["signals"]:
                values[signal["signal"]] += signal["v"]
                assert signal["t"] == sorted(signal["t"])
    sender.join()
    for node in (1, 40, 80, 127):
        assert values[f"{node}:6130:1"][: len(expected)] == expected
        assert set(values[f"{node}:6130:2"]) == {float(node - 1)}
    assert memory(process) < 100e6


def test_a_trace_shows_every_frame_or_says_how_many_are_missing(served):
    bus, process, url = served
    client, idle = Client(url), Client(url)
    idle.ask("trace", on=True)
    client.ask("trace", on=True, kinds=["pdo"])
    bus.run(SECONDS)
    pdos = sum(bus.frame(number)[0] < 0x700 for number in range(int(SECONDS * 8500)))
    rows = lost = 0
    events = client.events
    end = time.monotonic() + PATIENCE
    while rows + lost < pdos:
        assert time.monotonic() < end, f"{rows} rows and {lost} lost of {pdos}"
        message = events.pop(0) if events else client.next()
        if message.get("event") == "trace":
            assert all(row["kind"] == "pdo" for row in message["rows"])
            rows += len(message["rows"])
            lost += message["lost"]
    assert rows > 0
    # The other page has read nothing so far: its queue is bounded.
    assert memory(process) < 100e6
