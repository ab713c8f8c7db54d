"""The page on a bus with 127 nodes: lists that fit a desk and a phone and read what is in view, and plots of several nodes."""

import struct
import threading

import pytest
from full_bus import FullBus, serve
from page import CUT, Page, size
from selenium.webdriver.common.keys import Keys

DESK, PHONE = (1440, 900), (390, 844)
#: The height of a page that is read without a search: four screens of a phone.
LONGEST = 4 * PHONE[1]

class Beating(FullBus):
    """A full bus whose nodes send heartbeats, with the requests that were sent to each."""

    def __init__(self):
        super().__init__()
        self.requests: list[str] = []
        self.turn = 0
        self.state = {node: 5 for node in self.objects}
        self.is_over = threading.Event()

    def answer(self, words: list[str]) -> None:
        if words[0] == "send" and words[1].startswith("6"):
            self.requests.append("".join(words[3:])[:8])
        super().answer(words)

    def beat(self) -> None:
        while not self.is_over.wait(0.2):
            self.frames([(0x700 + node, bytes([state])) for node, state in self.state.items()])
            # TPDO 1 of two nodes: a value that rises, and one that stays.
            self.turn += 1
            self.frames([(0x181, struct.pack("<ff", self.turn, 0)), (0x182, struct.pack("<ff", 20, 0))])


@pytest.fixture
def bus():
    return Beating()


@pytest.fixture
def page(bus, driver):
    process, url = serve(bus)
    size(driver, *DESK)
    page = Page(driver, url)
    bus.beating = threading.Thread(target=bus.beat, daemon=True)
    bus.beating.start()
    page.says("#view-overview [role=status]", "127 nodes: 127 operational")
    page.says("tr[data-node='127'] td[data-label=Personality]", "pressure")
    yield page
    page.leave()
    bus.is_over.set()
    bus.beating.join()
    process.kill()
    process.wait()


def test_127_nodes_fit_a_desk_and_a_phone_and_are_filtered(page: Page, bus: Beating):
    for screen in (DESK, PHONE):
        size(page.driver, *screen)
        assert page.script("return document.documentElement.scrollHeight") < LONGEST
        assert page.script(CUT) == []
    page.press("Commands of node 3")
    assert page.field("Search")
    page.press("Stop node 3")
    size(page.driver, *DESK)
    bus.state[5] = 4
    page.says("#view-overview [role=status]", "126 operational, 1 not operational")
    page.choose("Show", "idle")
    shown = "return [...document.querySelectorAll('.nodes tbody tr')].map(({ dataset }) => dataset.node)"
    page.until(lambda: page.script(shown) == ["5"], "list the stopped node alone")
    page.choose("Show", "all")
    page.fill("Search", "pressure 127")
    assert page.script(shown) == ["127"]


def rows(page: Page) -> list[str]:
    return page.script("return [...document.querySelectorAll('.objects tbody tr.object')].map(({ dataset }) => dataset.object)")


def test_the_dictionary_has_the_rows_in_view_and_reads_no_others(page: Page, bus: Beating):
    bus.requests.clear()
    page.view("dictionary")
    page.until(lambda: "1000h:0" in rows(page), "list the objects")
    page.until(lambda: page.text("tr[data-object='1000h:0'] td[data-label=Value]") == str(0x0002_0194), "read a value in view")
    assert len(rows(page)) < 60
    assert "Communication 1000h to 13FFh" in page.text("tr[data-area=communication]")
    page.until(lambda: page.script(WAITING) == [], "read all rows in view")
    asked, beats = len(bus.requests), bus.sent
    page.until(lambda: bus.sent > beats + 4 * 127, "stay open")
    assert len(bus.requests) == asked, "objects out of view are read"
    page.script("const box = document.querySelector('#view-dictionary .listing'); box.scrollTop = box.scrollHeight")
    page.until(lambda: "1000h:0" not in rows(page) and page.script(WAITING) == [], "read the last rows when they come into view")
    assert len(rows(page)) < 60
    bus.requests.clear()
    page.script("document.querySelector('#view-dictionary .listing').scrollTop = 0")
    page.until(lambda: "1000h:0" in rows(page), "list the first objects again")
    page.until(lambda: page.script(WAITING) == [], "keep the values")
    assert "40001000" not in bus.requests, "a value is read once"


#: Readable rows in view without a value.
WAITING = """const box = document.querySelector("#view-dictionary .listing").getBoundingClientRect();
    return [...document.querySelectorAll(".objects tr.object")].filter((row) => {
      const { top, bottom } = row.getBoundingClientRect();
      return bottom > box.top && top < box.bottom && row.querySelector(".waiting")?.innerText === "…";
    }).map(({ dataset }) => dataset.object)"""


def test_a_stopped_node_is_not_asked_for_values(page: Page, bus: Beating):
    bus.state[1] = 4
    page.says("tr[data-node='1'] td[data-label=State]", "stopped")
    page.view("dictionary")
    page.says("#view-dictionary .counts", "Values are not read: the node is stopped.")
    bus.requests.clear()
    beats = bus.sent
    page.until(lambda: bus.sent > beats + 4 * 127, "stay open")
    assert bus.requests == []
    bus.state[1] = 5
    page.until(lambda: page.text("tr[data-object='1000h:0'] td[data-label=Value]") == str(0x0002_0194), "read once the node answers")


def test_an_area_is_closed_and_a_search_opens_it(page: Page):
    page.view("dictionary")
    page.until(lambda: "1000h:0" in rows(page), "list the objects")
    page.find("tr[data-area=communication] button").click()
    page.until(lambda: rows(page)[0].startswith("1400h"), "close the area")
    page.fill("Search", "device type")
    page.until(lambda: rows(page) == ["1000h:0"], "find an object in a closed area")


#: For each plot: the names of its series, and the rows of values below it.
PLOTS = """return [...document.querySelectorAll("#view-live .plots > div")].map((plot) => ({
  names: Chart.getChart(plot.querySelector("canvas")).data.datasets.map(({ label }) => label),
  limits: (({ min, max }) => [min, max])(Chart.getChart(plot.querySelector("canvas")).scales.y),
  values: [...plot.querySelectorAll(".extremes tbody tr")].map((row) => [...row.querySelectorAll("td")].map(({ innerText }) => innerText)),
}))"""


#: The number of samples of node 2.
SAMPLES = "return window.canopen.recorder.of('2:6130:1').t.length"


def test_a_plot_has_series_of_several_nodes_with_their_values(page: Page):
    page.view("live")
    page.choose("Node", "1")
    page.until(lambda: len(page.script(PLOTS)) == 1, "plot the node")
    page.choose("Series of node", "2")
    page.choose("Object", "2:6130:1")
    page.press("Add")
    page.until(lambda: [name[:2] for name in page.script(PLOTS)[0]["names"]] == ["1:", "1:", "2:"], "plot both nodes in one plot")
    page.until(lambda: page.script(PLOTS)[0]["values"][2][1:] == ["20", "20", "0"], "show minimum, maximum and difference of the other node")
    rising = page.script(PLOTS)[0]["values"][0]
    assert float(rising[3]) == float(rising[2]) - float(rising[1]) > 0
    # The cursor is 0.4 s before the end of the time.
    page.until(lambda: page.script(SAMPLES) > 10, "plot samples of the other node before the cursor")
    page.press("Pause")
    point = """const canvas = document.querySelector("#view-live canvas"), { left, width, top } = canvas.getBoundingClientRect();
        canvas.dispatchEvent(new PointerEvent("pointermove", { clientX: left + width - 20, clientY: top + 20, bubbles: true }))"""
    page.script(point)
    page.until(lambda: page.script(PLOTS)[0]["values"][2][0] == "20", "show the value of the other node at the cursor")
    assert float(page.script(PLOTS)[0]["values"][0][0]) > 0
    page.fill("y from", "-5").send_keys(Keys.TAB)
    page.fill("y to", "300").send_keys(Keys.TAB)
    page.until(lambda: page.script(PLOTS)[0]["limits"] == [-5, 300], "use the limits for all series")
    page.press("Follow")
    page.choose("Node", "3")
    page.until(lambda: any(name.startswith("2:") for name in page.script(PLOTS)[0]["names"]), "keep the added series")
    page.until(lambda: page.find("button[aria-label^='Remove 2:']").click() is None, "remove the added series")
    page.until(lambda: not any(":" in name for name in page.script(PLOTS)[0]["names"]), "plot the node alone")
