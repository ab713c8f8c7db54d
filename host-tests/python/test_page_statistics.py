"""The statistics of the bus on the page: load with its peak, frames, error frames, and the state of the CAN controller."""

import socket
import threading

import pytest
from full_bus import FullBus, serve_address
from page import Page, size

TILE = "#view-overview [data-tile='{}']"


class Slcan:
    """An slcan adapter at 250 kbit/s with traffic, whose status flags a test sets."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.flags = b"F00\r"
        self.burst = threading.Event()
        self.is_over = threading.Event()
        self.sender = threading.Thread(target=self.serve, daemon=True)
        self.sender.start()

    def serve(self) -> None:
        client, _ = self.listener.accept()
        threading.Thread(target=self.answer, args=(client,), daemon=True).start()
        while not self.is_over.wait(0.1):
            # 40 frames of 117 bits in 0.1 s are 18.7 % of 250 kbit/s for this time.
            client.sendall(b"t701105\r" + (b"t18181122334455667788\r" * 40 if self.burst.is_set() else b""))
            self.burst.clear()

    def answer(self, client: socket.socket) -> None:
        while data := client.recv(4096):
            if b"F\r" in data:
                client.sendall(self.flags)


def shown(page: Page, name: str) -> str:
    return page.text(TILE.format(name))


@pytest.fixture
def serving():
    """Serves buses by their addresses for the time of a test."""
    started = []

    def serve(address: str) -> str:
        process, url = serve_address(address)
        started.append(process)
        return url

    yield serve
    for process in started:
        process.kill()
        process.wait()


@pytest.fixture
def adapter():
    return Slcan()


@pytest.fixture
def page(adapter, driver, serving):
    size(driver, 1440, 900)
    page = Page(driver, serving(f"slcan://127.0.0.1:{adapter.listener.getsockname()[1]}"))
    yield page
    page.leave()
    adapter.is_over.set()
    adapter.sender.join()


def test_the_peak_stays_after_a_burst_until_it_is_reset(page: Page, adapter: Slcan):
    page.until(lambda: "%" in shown(page, "Load"), "show the load")
    assert "at 250 kbit/s" in shown(page, "Load")
    adapter.burst.set()
    peak = "Peak (0.1 s)"
    percent = lambda name: float(shown(page, name).split("\n")[1].split(" ")[0])
    page.until(lambda: percent(peak) > 18, "show the peak of the burst")
    page.until(lambda: percent("Load") < 2, "show the load after the burst")
    # The tenth of a second of the burst may belong to two reports of the bus.
    frames = lambda: int(shown(page, "Frames").split("\n")[2].split(" ")[0])
    before = frames()
    page.until(lambda: frames() > before + 20, "count the frames of two more reports")
    assert percent(peak) > 18
    page.press("Reset the peak load")
    page.until(lambda: percent(peak) < 18, "forget the burst")


def test_the_controller_and_its_error_frames_are_those_of_the_adapter(page: Page, adapter: Slcan):
    page.until(lambda: "error-active" in shown(page, "Controller"), "show the state of the controller")
    assert shown(page, "Error frames").split("\n")[1] == "0"
    adapter.flags = b"FA0\r"
    page.until(lambda: "error-passive" in shown(page, "Controller"), "show the new state")
    page.until(lambda: int(shown(page, "Error frames").split("\n")[1]) > 0, "count the bus errors")


def test_error_frames_of_socketcand_are_counted_and_do_not_end_the_bus(driver, serving):
    bus = FullBus()
    page = Page(driver, serving(f"socketcand://127.0.0.1:{bus.port}/vcan0"))
    assert "not reported" in page.until(lambda: "not" in (text := shown(page, "Error frames")) and text, "show what is unknown")
    bus.client.sendall(b"< error 088 12.000001 >< error 040 12.000002 >< frame 701 12.100000 05 >")
    page.until(lambda: "bus-off" in shown(page, "Controller"), "show bus-off")
    assert shown(page, "Error frames").split("\n")[1] == "1"
    page.says("tr[data-node='1'] td[data-label=State]", "operational")
    page.leave()
