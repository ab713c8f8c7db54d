"""What is done once with a node, on the page in a real browser: its zero, its preset, its cams, its node-ID, its lift, and the files it leaves."""

import csv
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import canopen
import pytest
from page import Page, Server
from selenium.webdriver.common.keys import Keys
from simulator import PATIENCE, Relay, Simulator, nodectl

PRESSURE, ENCODER, LIFT, NEW = 1, 2, 33, 5
#: A board with a number in the simulator and without a node-ID on the bus.
WITHOUT_ID = 201
PROCESS_VALUE = "Pressure process value"
EDS = Path(__file__).parents[2] / "eds"
STATE = "return window.canopen.bus.nodes.get(arguments[0]).state"
PANEL = "#view-commissioning section"


@pytest.fixture(scope="module")
def simulator():
    nodes = [f"{PRESSURE}:pressure", f"{ENCODER}:encoder", f"{LIFT}:lift", f"{WITHOUT_ID}:pressure"]
    flags = [word for node in nodes for word in ("--node", node)]
    simulator = Simulator("--bitrate", "500", "--pressure", "const:200000", "--control", "127.0.0.1:0", *flags, speed="real")
    yield simulator
    simulator.end()


@pytest.fixture(scope="module")
def page(driver, simulator: Simulator):
    server = Server(simulator)
    page = Page(driver, server.url)
    page.knows(PRESSURE, ENCODER, LIFT)
    page.press("Start all")
    for node in (PRESSURE, ENCODER, LIFT):
        page.says(f"tr[data-node='{node}'] td[data-label=State]", "operational")
    yield page
    page.leave()
    server.stop()


def commission(page: Page, node: int) -> None:
    page.view("commissioning")
    page.choose("Node", str(node))


def write(page: Page, label: str, text: str) -> None:
    page.fill(label, text).send_keys(Keys.ENTER)


def cams_are_read(page: Page) -> None:
    """Waits for the cams, which the page reads last of an encoder."""
    page.until(lambda: page.find("input[aria-label='Cam 8 low']").is_enabled(), "show the cams")


def shown(page: Page) -> float:
    """The number in the panel's large display."""
    text = page.text(f"{PANEL}:not([hidden]) output.big")
    return float(text.split()[0]) if text[:1] not in ("", "-") or text[1:2].isdigit() else float("nan")


def test_the_present_pressure_becomes_zero(page: Page):
    page.write(PRESSURE, 0x1800, 5, 10)
    commission(page, PRESSURE)
    page.until(lambda: abs(shown(page) - 2) < 0.02, "show two bar")
    page.press("Auto-zero")
    page.says(PANEL, "the present pressure is zero now")
    page.until(lambda: abs(shown(page)) < 0.02, "show zero")
    page.until(lambda: abs(float(page.field("Offset").get_attribute("value")) + 2) < 0.02, "show the offset that the node has found")
    write(page, "Offset", "0")
    page.until(lambda: abs(shown(page) - 2) < 0.02, "show two bar again")


def test_the_span_is_written_and_what_the_node_makes_of_it_is_shown(page: Page):
    commission(page, PRESSURE)
    page.until(lambda: page.field("Span end").get_attribute("value") == "10", "show the span")
    write(page, "Span end", "4")
    page.says(PANEL, "written, reads 4")
    write(page, "Span end", "10")
    page.says(PANEL, "written, reads 10")


def test_the_position_takes_its_preset(page: Page):
    page.write(ENCODER, 0x1800, 5, 10)
    commission(page, ENCODER)
    cams_are_read(page)
    write(page, "Preset", "1000")
    page.says(PANEL + ":not([hidden]) .object-field", "written, reads 1000")
    page.until(lambda: shown(page) == 1000, "show the preset")


def test_a_cam_is_on_where_it_was_put_on_the_dial(page: Page):
    commission(page, ENCODER)
    cams_are_read(page)
    page.until(lambda: shown(page) == 1000, "show the position")
    dial = lambda: page.script("return document.querySelector('.dial').ariaLabel")
    page.until(lambda: "cams on: none" in dial(), "have no cam on")
    for name, value in (("low", "900"), ("high", "1100")):
        box = page.find(f"input[aria-label='Cam 1 {name}']")
        box.send_keys(Keys.CONTROL, "a")
        box.send_keys(value)
    page.find("input[aria-label='Cam 1 on']").click()
    page.press("Write the cams")
    page.says(PANEL + ":not([hidden])", "cams written")
    assert [page.read(ENCODER, index, 1) for index in (0x6310, 0x6320, 0x6301)] == [900, 1100, 1]
    page.until(lambda: "cams on: 1" in dial() or page.read(ENCODER, 0x6300, 1) == 1, "have the cam on")


def test_what_is_being_edited_stays_when_the_nodes_are_heard_again(page: Page):
    commission(page, PRESSURE)
    page.until(lambda: page.field("Offset").get_attribute("value"), "show the offset")
    commission(page, ENCODER)
    cams_are_read(page)
    page.fill("Preset", "4321")
    low = page.find("input[aria-label='Cam 2 low']")
    low.send_keys(Keys.CONTROL, "a")
    low.send_keys("77")
    for command, state in (("stop", "stopped"), ("start", "operational")):
        page.request("nmt", node=PRESSURE, command=command)
        page.until(lambda: page.script(STATE, PRESSURE) == state, f"hear that a node is {state}")
    # As after an interruption of the server.
    page.script("window.canopen.bus.dispatchEvent(new CustomEvent('connected'))")
    for _ in range(3):
        assert page.read(ENCODER, 0x6310, 2) != 77
    assert page.field("Preset").get_attribute("value") == "4321"
    assert page.find("input[aria-label='Cam 2 low']").get_attribute("value") == "77"


def test_the_car_of_a_lift_is_shown_and_its_virtual_devices_are_chosen(page: Page):
    commission(page, LIFT)
    page.until(lambda: page.script("return document.querySelector('.shaft').ariaLabel"), "draw the car")
    before = page.read(LIFT, 0x2305)
    for wanted in (before ^ 8, before):
        page.field("Output panel").click()
        page.until(lambda: page.read(LIFT, 0x2305) == wanted, "choose the output panel")


#: The indexes of a data sheet for which the page has no help text.
WITHOUT_HELP = """const [indices, personality, done] = arguments;
    import("./js/dictionary/help.js").then(({ help }) => done(indices.filter((index) => !help({ index }, personality))));"""


@pytest.mark.parametrize("personality", ["pressure", "encoder", "combined", "lift"])
def test_every_object_has_a_sentence_that_says_what_it_is_for(page: Page, personality: str):
    sheet = canopen.import_od(str(EDS / f"{personality}.eds"))
    assert len(sheet) > 80
    without = page.driver.execute_async_script(WITHOUT_HELP, [index for index in sheet if index >= 0x1000], personality)
    assert [f"{index:04X}h {sheet[index].name}" for index in without] == []


def test_a_node_without_a_node_id_is_found_and_gets_one(page: Page):
    page.view("commissioning")
    page.press("Find a node without a node-ID")
    page.says(PANEL + "[aria-labelledby=lss-title]", "found vendor")
    page.fill("Node-ID", str(NEW))
    page.press("Give the node-ID")
    page.says(PANEL + "[aria-labelledby=lss-title]", f"node {NEW} is there")
    page.view("overview")
    page.knows(NEW)


def test_what_is_plotted_is_saved_as_a_table_and_as_a_drawing(page: Page, driver, tmp_path: Path):
    driver.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})
    page.view("live")
    page.choose("Node", str(PRESSURE))
    page.until(lambda: len(page.drawn(PROCESS_VALUE)) > 20, "plot the pressure")
    page.press("Pause")
    page.press("CSV")
    page.press("SVG")
    names = {f"node{PRESSURE}.csv", f"node{PRESSURE}.svg"}
    page.until(lambda: names == {file.name for file in tmp_path.iterdir()}, "save both files")
    head, *rows = csv.reader((tmp_path / f"node{PRESSURE}.csv").open())
    column = next(at for at, name in enumerate(head) if PROCESS_VALUE in name)
    assert head[column].endswith("[bar]")
    times = [float(row[0]) for row in rows]
    assert times == sorted(times) and len(times) > 20
    assert all(abs(float(row[column]) - 2) < 0.02 for row in rows[-5:])
    drawing = ElementTree.parse(tmp_path / f"node{PRESSURE}.svg").getroot()
    assert drawing.tag.endswith("svg") and any(path.get("d", "").startswith("M") for path in drawing.iter("{http://www.w3.org/2000/svg}path"))


def test_the_bit_rate_of_all_nodes_is_changed(driver):
    """The page's interface keeps its bit rate and no longer hears the nodes; one with the new rate does."""
    simulator = Simulator("--bitrate", "500", "--node", "1:pressure", "--node", "2:encoder", "--control", "127.0.0.1:0", speed="real")
    server = Server(simulator)
    page = Page(driver, server.url)
    page.knows(1, 2)
    page.view("commissioning")
    page.choose("Bit rate of all nodes", "250")
    page.press("Change the bit rate")
    alert = driver.switch_to.alert
    assert "250 kbit/s" in alert.text
    alert.accept()
    page.says(PANEL + "[aria-labelledby=lss-title]", "250 kbit/s: stored")
    page.leave()
    server.stop()
    with simulator.slcan_bus(bitrate=250_000) as bus:
        silent = {0x701, 0x702}
        while silent:
            message = bus.recv(PATIENCE)
            assert message is not None, f"{silent} are not heard at the new bit rate"
            silent.discard(message.arbitration_id)
    simulator.quit()


def since_activation(relay: Relay) -> list[tuple[float, str, int, str]]:
    """The frames from *activate bit timing* on. Their times count from the LSS request before it: the page has neither sent nor
    received the activation when that request passes the relay."""
    frames = list(relay.frames)
    (place,) = [place for place, (_, _, can_id, data) in enumerate(frames) if can_id == 0x7E5 and data.startswith("15")]
    begin = max(at for at, _, can_id, _ in frames[:place] if can_id == 0x7E5)
    return [(at - begin, *frame) for at, *frame in frames[place:]]


#: The begin of the page's own requests: an upload of 1000h.
ASKED = "40001000"


def requests(relay: Relay, node: int) -> list[float]:
    """The times at which the page asks a node for an upload, since the activation. One request of the server's survey, which may
    run on a busy machine, may cross the activation; the server waits for its answer and sends no other."""
    asked = [(at, data) for at, sent, can_id, data in since_activation(relay) if (sent, can_id, data[:2]) == ("send", 0x600 + node, "40")]
    return [at for place, (at, data) in enumerate(asked) if place > 0 or data.startswith(ASKED)]


#: The LSS master, two nodes, their bit rate, the next one, and the switch delay in milliseconds.
CHANGES = [
    ("page", {1: "pressure", 2: "encoder"}, 500, 250, 1000),
    ("nodectl", {3: "combined", 4: "lift"}, 125, 1000, 600),
    ("page", {127: "lift", 64: "combined"}, 1000, 50, 1500),
    ("nodectl", {20: "encoder", 99: "pressure"}, 50, 125, 3000),
]


@pytest.mark.parametrize(("master", "nodes", "rate", "new", "delay"), CHANGES)
def test_no_node_is_asked_while_its_bit_rate_changes(driver, master: str, nodes: dict, rate: int, new: int, delay: int):
    """Nodes are silent for twice the switch delay (CiA 305). The page waits by the clock of the host, which a simulator on a
    busy machine is behind, so the times are those of a relay on this host. A node that is heard may be asked."""
    flags = [word for node, personality in nodes.items() for word in ("--node", f"{node}:{personality}")]
    simulator = Simulator("--bitrate", str(rate), *flags, "--control", "127.0.0.1:0", speed="real")
    relay = Relay(simulator)
    server = Server(simulator, bus=relay)
    page = Page(driver, server.url)
    page.knows(*nodes)
    ask = """const ask = (node) => window.canopen.bus.request("read", { node, objects: [[0x1000, 0]] });
        setInterval(() => %s.forEach((node) => ask(node).catch(() => null)), 50);""" % list(nodes)
    if master == "page":
        page.script(ask)
        page.request("lss.bit_rate", kbit=new, identity=None, store=True, activate=delay)
    else:
        page.view("trace")
        page.find("input[type=search]").send_keys("activate")
        assert nodectl(simulator, "lss", "--all", "set-rate", str(new), "--store").returncode == 0
        assert nodectl(simulator, "lss", "--all", "activate", str(delay)).returncode == 0
        # A request of the page may not cross the command, which a page on a busy machine knows some time after the simulator.
        page.says("#view-trace .frames", "activate")
        page.script(ask)
    page.until(lambda: all(len(requests(relay, node)) > 2 for node in nodes), "ask again after the change")
    page.leave()
    server.stop()
    simulator.quit()
    for node in nodes:
        heard = [at for at, sent, can_id, _ in since_activation(relay) if sent == "frame" and can_id in (0x580 + node, 0x700 + node)]
        assert requests(relay, node)[0] >= min(heard + [2 * delay / 1000]), f"node {node} is asked while its bit rate changes"
