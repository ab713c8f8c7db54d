"""Nodes of all personalities with factory settings on the page, in a real browser: the values of their panels, and units that another client changes."""

import re

import pytest
from page import CUT, Page, Server, size
from simulator import Simulator, nodectl

PRESSURE, ENCODER, COMBINED, LIFT = 1, 16, 64, 127
NODES = {PRESSURE: "pressure", ENCODER: "encoder", COMBINED: "combined", LIFT: "lift"}
#: The values in the panels of a node: the process values and their unit.
PANELS = {PRESSURE: ["bar"], ENCODER: ["units"], COMBINED: ["bar", "units"], LIFT: ["mm"]}
PANEL = "#view-commissioning section.box:not([hidden])"
#: The rows of *Live* by their signals, with the value as shown.
ROWS = """return Object.fromEntries([...document.querySelectorAll("#view-live .signals tbody tr")].map((row) => [row.dataset.signal, row.cells[3].innerText]))"""
BUS_TIME = "return window.canopen.recorder.t"
#: The units of the plots.
PLOTS = """return [...document.querySelectorAll("#view-live .extremes caption")].map(({ innerText }) => innerText.replace("Values in the plot, ", ""))"""


@pytest.fixture(scope="module")
def simulator():
    flags = [word for node, personality in NODES.items() for word in ("--node", f"{node}:{personality}")]
    simulator = Simulator("--bitrate", "1000", "--pressure", "const:250000", "--control", "127.0.0.1:0", *flags, speed="real")
    yield simulator
    simulator.end()


@pytest.fixture
def page(driver, server: Server):
    size(driver, 1440, 900)
    page = Page(driver, server.url)
    page.knows(*NODES)
    yield page
    page.leave()


def command(page: Page, name: str, state: str) -> None:
    page.view("overview")
    page.request("nmt", node="all", command=name)
    for node in NODES:
        page.says(f"tr[data-node='{node}'] td[data-label=State]", state)


def choose(page: Page, view: str, node: int) -> None:
    page.view(view)
    page.choose("Node", str(node))


def shown(page: Page) -> list[str]:
    """The values in the panels of the chosen node."""
    return page.script("return [...document.querySelectorAll(arguments[0])].map(({ innerText }) => innerText)", f"{PANEL} output.big")


@pytest.mark.parametrize("node", NODES, ids=NODES.values())
def test_a_panel_has_the_value_and_unit_of_a_node_with_factory_settings(page: Page, node: int):
    """TPDOs of event type without an event timer bring no value at rest, and a node that is not Operational sends none."""
    for name, state in (("preop", "pre-operational"), ("start", "operational")):
        command(page, name, state)
        choose(page, "commissioning", node)
        forms = [rf"-?[\d.]+ {unit}" for unit in PANELS[node]]
        page.until(lambda: len(shown(page)) == len(forms) and all(map(re.fullmatch, forms, shown(page))), f"show values in {PANELS[node]}")


@pytest.mark.parametrize("node", NODES, ids=NODES.values())
def test_a_panel_names_the_reason_for_a_missing_value(page: Page, node: int):
    command(page, "stop", "stopped")
    choose(page, "commissioning", node)
    page.says("#view-commissioning", "No values: the node is stopped.")
    command(page, "start", "operational")
    choose(page, "commissioning", node)
    page.until(lambda: "No values" not in page.text("#view-commissioning"), "have values")


def values(page: Page) -> dict[str, str]:
    return page.script(ROWS)


def write(simulator: Simulator, node: int, place: str, value: str) -> None:
    done = nodectl(simulator, "write", place, value, "--node", str(node))
    assert done.returncode == 0, done.stderr


#: The node, its unit, and its process value.
UNITS = [(PRESSURE, "6131:1", "6130:1"), (COMBINED, "6931:1", "6930:1")]


@pytest.mark.parametrize(("node", "unit", "value"), UNITS)
def test_a_unit_that_another_client_changes_is_shown(page: Page, simulator: Simulator, node: int, unit: str, value: str):
    command(page, "start", "operational")
    page.write(node, 0x1800, 5, 20)
    choose(page, "live", node)
    key = f"{node}:{value}"
    page.until(lambda: re.fullmatch(r"2\.(5|49)\d* bar", values(page)[key]), "show the pressure in bar")
    for symbol, form in (("kPa", r"2(50|49)(\.\d*)?"), ("bar", r"2\.(5|49)\d*")):
        write(simulator, node, unit, symbol)
        page.until(lambda: re.fullmatch(rf"{form}\d* {symbol}", values(page)[key]), f"show the pressure in {symbol}")
        page.until(lambda: symbol in page.script(PLOTS), f"have a plot in {symbol}")
        name = page.script("return window.canopen.recorder.signals.get(arguments[0]).name", key)
        points = page.until(lambda: len(page.drawn(name)) > 10 and page.drawn(name), "plot")
        assert {re.fullmatch(form, f"{point['y']:.3f}") is not None for point in points} == {True}, "samples of another unit are in the plot"
        choose(page, "commissioning", node)
        page.until(lambda: any(re.fullmatch(rf"{form}\d* {symbol}", text) for text in shown(page)), f"show the pressure in {symbol} in its panel")
        choose(page, "live", node)


def test_digits_and_steps_that_another_client_changes_are_used(page: Page, simulator: Simulator):
    command(page, "start", "operational")
    done = nodectl(simulator, "map", "tpdo", "1", "7130:1", "6130:1", "--node", str(PRESSURE))
    assert done.returncode == 0, done.stderr
    page.write(PRESSURE, 0x1800, 5, 20)
    choose(page, "live", PRESSURE)
    key = f"{PRESSURE}:7130:1"
    for digits, form in ((2, r"2\.(49|50?) bar"), (1, r"2\.[45] bar"), (0, r"[23] bar")):
        write(simulator, PRESSURE, "6132:1", str(digits))
        page.until(lambda: re.fullmatch(form, values(page).get(key, "")), f"show {digits} digits")
    page.request("stimulate", board=LIFT, kind="shaft", spec="const:7")
    choose(page, "commissioning", LIFT)
    number = lambda: float(shown(page)[0].split(" ")[0])
    page.until(lambda: re.fullmatch(r"\d+(\.\d+)? mm", shown(page)[0]), "show the position of the car")
    page.until(lambda: number() > 0, "move the car")
    step, before = page.read(LIFT, 0x6384, 1), number()
    write(simulator, LIFT, "6384:1", str(step * 2))
    position = lambda: page.request("read", node=LIFT, objects=[[0x6383, 1]])["values"][0]["text"]
    time = page.script(BUS_TIME)
    page.until(lambda: page.script(BUS_TIME) > time + 2, "follow the bus")
    assert number() == float(position()), f"the steps are {step * 2}, not {step}, as for {before} mm"


def test_a_series_of_another_node_has_its_unit(page: Page):
    command(page, "start", "operational")
    choose(page, "live", PRESSURE)
    page.choose("Series of node", str(LIFT))
    page.choose("Object", f"{LIFT}:6383:1")
    page.press("Add")
    page.until(lambda: re.fullmatch(r"[\d.]+ mm", values(page).get(f"{LIFT}:6383:1", "")), "show the position of the car in mm")
    page.until(lambda: "mm" in page.script(PLOTS), "have a plot in mm")


@pytest.mark.parametrize("node", [ENCODER, COMBINED])
@pytest.mark.parametrize("width", [320, 390, 600, 800])
def test_the_cams_are_not_cut_off_on_a_phone(page: Page, node: int, width: int):
    size(page.driver, width, 844)
    choose(page, "commissioning", node)
    page.until(lambda: page.find("input[aria-label='Cam 8 low']").is_enabled(), "show the cams")
    assert page.script(CUT) == []
    tall = page.find(".cams tbody tr").rect["height"]
    assert tall < 170, f"a cam takes {tall} pixels"


def test_a_node_with_another_personality_has_its_panels_and_signals(page: Page, simulator: Simulator):
    command(page, "start", "operational")
    choose(page, "live", ENCODER)
    choose(page, "commissioning", ENCODER)
    page.until(lambda: len(shown(page)) == 1, "show the panel of an encoder")
    try:
        write(simulator, ENCODER, "2000", "2")
        assert nodectl(simulator, "nmt", "reset", "--node", str(ENCODER)).returncode == 0
        page.until(lambda: all(map(re.fullmatch, [r"[\d.]+ bar", r"-?\d+ units"], shown(page))) and len(shown(page)) == 2, "show both panels")
        page.view("live")
        page.until(lambda: f"{ENCODER}:6930:1" in values(page), "list the pressure")
        names = page.script("return [...document.querySelectorAll('#view-live .signals tbody th')].map(({ innerText }) => innerText)")
        assert all(names) and "Pressure process value" in str(names)
    finally:
        write(simulator, ENCODER, "2000", "1")
        assert nodectl(simulator, "nmt", "reset", "--node", str(ENCODER)).returncode == 0
    choose(page, "commissioning", ENCODER)
    page.until(lambda: len(shown(page)) == 1, "show the panel of an encoder again")


MAPPING = "#view-commissioning [aria-labelledby=mapping-title]"


@pytest.mark.parametrize(("node", "label", "wrong", "words"), [
    (PRESSURE, "Transmission type", "300", "a whole number from 0 to 255"),
    (ENCODER, "Transmission type", "-1", "a whole number from 0 to 255"),
    (COMBINED, "Transmission type", "1.5", "a whole number from 0 to 255"),
    (ENCODER, "Event timer, ms", "70000", "a whole number from 0 to 65535"),
    (PRESSURE, "Inhibit time, 100 us", "", "a whole number from 0 to 65535"),
])
def test_a_wrong_number_of_a_pdo_is_named(page: Page, node: int, label: str, wrong: str, words: str):
    choose(page, "commissioning", node)
    page.says(MAPPING, f"{0x180 + node:X}h")

    def outcome() -> str:
        """What the page says. It may read the mapping once more after the choice, and then shows the number of the node again."""
        field = page.field(label)
        field.clear()
        field.send_keys(wrong)
        page.press("Map", "[aria-labelledby=mapping-title]")
        text = page.text(f"{MAPPING} .outcome")
        return text if words in text else ""

    assert page.until(outcome, f"say {words!r}").startswith(label)


def test_a_pdo_without_an_object_is_not_mapped(page: Page):
    choose(page, "commissioning", PRESSURE)
    page.until(lambda: "6130h:1" in page.text(MAPPING), "show the mapping")
    page.choose("PDO", "2")
    page.press("Map", "[aria-labelledby=mapping-title]")
    page.says(f"{MAPPING} .outcome", "Choose an object.")


def test_a_fixed_mapping_is_not_offered_for_a_change(page: Page):
    choose(page, "commissioning", LIFT)
    page.says(MAPPING, "The mapping of this PDO is fixed")
    assert page.script(f"return [...document.querySelectorAll('{MAPPING} button')].every(({{ disabled }}) => disabled)")
