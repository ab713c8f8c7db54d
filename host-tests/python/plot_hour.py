"""An hour of plotting at 1 kHz on a bus with 127 nodes: the memory that the page takes in the browser.

A program: `python host-tests/python/plot_hour.py` prints the figures after an hour of virtual time, `... 360` after 360 s. The bus has
time stamps that advance faster than the clock of this computer, as fast as the page takes the samples.
"""

import math
import re
import struct
import subprocess
import sys
import time
from dataclasses import dataclass

from full_bus import NODES, FullBus, serve
from page import POLL, Page, browser

#: The node whose TPDO 1, with two values, comes a thousand times a second.
NODE = 1
RATE = 1000
#: The values of the sine that the node sends: its period in seconds.
PERIOD = 7.0
#: Seconds of the bus in a parcel, and how far the bus may be ahead of the page: a queue of the server has 4096 samples.
PARCEL, AHEAD = 0.25, 3.0
#: The time stamp of the first frame, at which the time of the page begins.
FIRST = 1.0

#: The signal that is plotted, and one sample that is greater than all others, early in the run.
SIGNAL, PEAK = f"{NODE}:6130:1", 10.0
PEAK_AT = 20.0


class FastBus(FullBus):
    """A full bus with a clock of its own."""

    now = FIRST

    def frames(self, frames: list[tuple[int, bytes]]) -> None:
        self.stamped([(self.now, *frame) for frame in frames])

    def stamped(self, frames: list[tuple[float, int, bytes]]) -> None:
        with self.lock:
            self.client.sendall("".join(f"< frame {id:03X} {at:.6f} {data.hex().upper()} >" for at, id, data in frames).encode())

    def parcel(self) -> None:
        """Sends the samples of a parcel, and the heartbeats of all nodes once a second."""
        begin, count = self.now, round(PARCEL * RATE)
        frames = [(at := begin + number / RATE, 0x180 + NODE, sample(at)) for number in range(count)]
        if math.floor(begin) != math.floor(begin - PARCEL):
            frames += [(at, 0x700 + node, b"\x05") for node in NODES]
        self.now = begin + PARCEL
        self.stamped(frames)


def sample(at: float) -> bytes:
    is_peak = abs(at - PEAK_AT) < 0.5 / RATE
    return struct.pack("<ff", PEAK if is_peak else math.sin(2 * math.pi * at / PERIOD), at)


@dataclass
class Figures:
    """What the run has taken."""

    seconds: float
    wall: float
    heap: float
    heap_at_end: float
    renderer: float
    nodes: int
    listeners: int
    samples: int
    first: float
    newest: float
    greatest: float
    lost: int
    listed: int


def heap(page: Page) -> float:
    """The used heap of the scripts in MB."""
    metrics = page.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    return next(metric["value"] for metric in metrics if metric["name"] == "JSHeapUsedSize") / 1e6


def renderer(page: Page) -> float:
    """The greatest private memory of a renderer of the browser in MB."""
    processes = subprocess.run(["ps", "-eo", "pid,ppid,args"], capture_output=True, text=True).stdout.splitlines()
    parents = {int(pid): int(parent) for pid, parent, *_ in (line.split() for line in processes[1:])}
    driver = page.driver.service.process.pid
    own = [int(line.split()[0]) for line in processes[1:] if "--type=renderer" in line and is_child(int(line.split()[0]), driver, parents)]
    return max(private(pid) for pid in own)


def is_child(pid: int, of: int, parents: dict[int, int]) -> bool:
    while pid in parents:
        if pid == of:
            return True
        pid = parents[pid]
    return False


def private(pid: int) -> float:
    with open(f"/proc/{pid}/smaps_rollup") as rollup:
        return sum(int(size) for size in re.findall(r"Private_\w+:\s+(\d+) kB", rollup.read())) / 1e3


#: What the page has recorded of the signal, and the greatest value that its plot shows.
RECORDED = """const series = window.canopen.recorder.of(arguments[0]), { from } = window.canopen.time;
    const drawn = [...document.querySelectorAll("#view-live canvas")].flatMap((canvas) => Chart.getChart(canvas).data.datasets[0].data);
    return { samples: series.t.length, first: series.t[0], newest: series.t.at(-1), greatest: Math.max(...drawn.map(({ y }) => y)),
      lost: Math.max(window.canopen.recorder.lost, window.canopen.bus.status.lost.live), listed: window.canopen.bus.nodes.size }"""


def measure(page: Page, bus: FastBus, seconds: float) -> Figures:
    page.driver.execute_cdp_cmd("Performance.enable", {})
    begin, heaps, until = time.monotonic(), [0.0], bus.now + seconds
    page.view("live")
    page.choose("Node", str(NODE))
    page.choose("Time", "3600")
    page.until(lambda: page.script("return document.querySelectorAll('#view-live canvas').length"), "plot the node")
    while bus.now < until:
        bus.parcel()
        while bus.now - FIRST - page.script("return window.canopen.recorder.t") > AHEAD:
            time.sleep(POLL / 10)
        if round(bus.now / PARCEL) % 40 == 0:
            heaps.append(heap(page))
    page.until(lambda: page.script(RECORDED, SIGNAL)["newest"] >= until - FIRST - 2 / RATE, "plot the last sample")
    wall, largest = time.monotonic() - begin, renderer(page)
    time.sleep(4 * POLL)
    recorded = page.script(RECORDED, SIGNAL)
    page.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    counters = page.driver.execute_cdp_cmd("Memory.getDOMCounters", {})
    return Figures(seconds, wall, max(heaps), heap(page), largest, counters["nodes"], counters["jsEventListeners"], **recorded)


def run(driver, seconds: float) -> Figures:
    bus = FastBus()
    process, url = serve(bus)
    try:
        page = Page(driver, url)
        for _ in range(8):
            bus.parcel()
        page.says("#view-overview [role=status]", f"{len(NODES)} nodes")
        figures = measure(page, bus, seconds)
        page.leave()
        return figures
    finally:
        process.kill()
        process.wait()


if __name__ == "__main__":
    driver = browser()
    try:
        print(run(driver, float(sys.argv[1]) if len(sys.argv) > 1 else 3600.0))
    finally:
        driver.quit()
