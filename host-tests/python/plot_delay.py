"""How long a frame of a full bus takes to the screen: from the socket of the adapter to the plot that a browser has painted.

A program: its figures depend on the machine. It prints the delay of the oldest sample that each painted picture shows for the first time.
"""

import sys
import threading
import time

from full_bus import FullBus, cpu, memory, serve
from page import Page, browser

NODE = 1
#: Seconds of the bus before the measurement begins, so that the page has warmed up.
WARM_UP = 3.0

#: After each painted picture: the age of the first sample that the previous picture did not show.
DELAYS = """const [name, first, seconds, done] = arguments;
    const chart = [...document.querySelectorAll("#view-live canvas")].map((canvas) => Chart.getChart(canvas))
      .find(({ data }) => data.datasets.some(({ label }) => label === name));
    const clock = () => (performance.timeOrigin + performance.now()) / 1000 - first;
    const delays = [], end = clock() + seconds;
    let drawn = null;
    const painted = () => {
      const newest = chart.data.datasets.find(({ label }) => label === name).data.at(-1)?.x;
      if (drawn != null && newest > drawn) delays.push(clock() - drawn);
      drawn = newest;
      clock() < end ? look() : done(delays);
    };
    const look = () => requestAnimationFrame(() => setTimeout(painted));
    look();"""


def measure(seconds: float) -> None:
    bus = FullBus()
    process, url = serve(bus)
    driver = browser()
    try:
        page = Page(driver, url)
        sender = threading.Thread(target=bus.run, args=(WARM_UP + seconds + 30,), daemon=True)
        sender.start()
        page.view("live")
        page.choose("Node", str(NODE))
        name = page.until(lambda: next(iter(names(page)), None), "plot a signal")
        page.until(lambda: len(page.drawn(name)) > 100, "plot the bus")
        time.sleep(WARM_UP)
        wall_clock = time.time() - time.monotonic()
        before, start = cpu(process), time.monotonic()
        delays = sorted(driver.execute_async_script(DELAYS, name, wall_clock + bus.first, seconds))
        share = (cpu(process) - before) / (time.monotonic() - start)
        print(
            f"{len(delays) / seconds:4.1f} pictures/s at {bus.sent / (time.monotonic() - bus.first):.0f} frames/s: from frame to painted plot "
            f"{delays[len(delays) // 2] * 1000:.0f} ms (median), {delays[-len(delays) // 100] * 1000:.0f} ms (99 %), {delays[-1] * 1000:.0f} ms (worst); "
            f"the server takes {share:.1%} of a core and {memory(process) / 1e6:.0f} MB"
        )
    finally:
        driver.quit()
        process.kill()
        process.wait()


def names(page: Page) -> list[str]:
    """The signals in the plots."""
    code = """return [...document.querySelectorAll("#view-live canvas")].flatMap((canvas) => Chart.getChart(canvas).data.datasets.map(({ label }) => label))"""
    return page.script(code)


if __name__ == "__main__":
    measure(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
