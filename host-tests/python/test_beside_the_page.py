"""Clients of the bus beside a plain `cargo sim`: its page is no second client of theirs."""

import json
import os
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from canopen.sdo.exceptions import SdoError
from full_bus import Client
from simulator import PATIENCE, Master, Simulator, nodectl

#: All personalities, with node-IDs at both ends.
NODES = {1: "pressure", 16: "lift", 64: "encoder", 127: "combined"}
BOARDS = [flag for node, personality in NODES.items() for flag in ("--node", f"{node}:{personality}")]


def requests(log: Path) -> list[str]:
    """The SDO requests in a log of candump."""
    frames = [line.split()[2].split("#") for line in log.read_text().splitlines()]
    return [f"{can_id}#{data}" for can_id, data in frames if can_id.startswith("6") and len(can_id) == 3]


def row(page: Client, node: int, is_it) -> dict:
    """The row of a node, when it is as wanted."""
    end = time.monotonic() + PATIENCE
    rows = [row for event in page.events for row in event.get("nodes", [])]
    while time.monotonic() < end:
        for found in rows:
            if found["node"] == node and is_it(found):
                return found
        rows = page.next().get("nodes", [])
    raise AssertionError(f"the page does not show node {node} as wanted: {rows}")


def test_without_an_open_page_nothing_is_sent_at_boot_ups_of_any_personality(tmp_path: Path):
    log = tmp_path / "bus.log"
    simulator = Simulator(*BOARDS, "--bitrate", "1000", "--candump", str(log), speed="real")
    with simulator.bus() as bus:
        for _ in range(2):
            nodectl(simulator, "nmt", "reset", "--node", "all")
            missing = set(NODES)
            while missing:
                frame = bus.recv(PATIENCE)
                if frame.data == b"\x00":
                    missing.discard(frame.arbitration_id - 0x700)
        heartbeats = 0
        while heartbeats < 4 * len(NODES):
            heartbeats += 0x700 < bus.recv(PATIENCE).arbitration_id < 0x780
    simulator.quit()
    assert requests(log) == []


@contextmanager
def reading(master: Master, objects: Iterable[tuple[int, int]]) -> Iterator[None]:
    """A client that reads these objects all the time. An answer that comes late on a busy machine is no failure."""
    done = threading.Event()

    def read() -> None:
        while not done.wait(0.02):
            with suppress(SdoError):
                for index, sub in objects:
                    master.node.sdo.upload(index, sub)

    thread = threading.Thread(target=read)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def test_an_open_page_learns_from_another_client_and_shows_it(tmp_path: Path):
    """The page asks no node that another client talks to, and knows the device by what that client reads."""
    log = tmp_path / "bus.log"
    simulator = Simulator("--candump", str(log), speed="real")
    master = Master(simulator)
    with reading(master, ((0x1018, 1), (0x1018, 2), (0x1008, 0))):
        page = Client(simulator.greeting["page"])
        seen = row(page, 1, lambda row: row["name"] and row["personality"] and row["other_client"])
        assert (seen["personality"], seen["serial"]) == ("pressure", None)
    master.close()
    # Once that client has left, the page asks what is missing.
    seen = row(page, 1, lambda row: row["serial"] is not None)
    assert not seen["other_client"]
    simulator.quit()
    assert any(request.startswith("601#40181004") for request in requests(log))


def test_the_update_command_works_every_time():
    simulator = Simulator("--bitrate", "1000", speed="real")
    image = Path(os.environ["NODE_IMAGES"]) / "firmware.img"
    for number in range(3):
        done = nodectl(simulator, "update", str(image), "--force", "--json")
        assert done.returncode == 0, f"update {number + 1}: {done.stdout} {done.stderr}"
        assert json.loads(done.stdout)["result"] == "updated"
    simulator.quit()
