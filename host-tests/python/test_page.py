"""The page of the bus in a real browser: what it shows of the emulated boards, and what they do when it is used.

What is measured is told by time stamps of the bus, which are virtual time: no test looks at a clock of the host.
"""

import re

import pytest
from page import CUT, Page, Server, size
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.select import Select
from simulator import Simulator

PRESSURE, ENCODER = 1, 2
#: 1029h:2: a fault of the device leaves the node in Operational.
STAY_OPERATIONAL = 1
VIEWS = ["overview", "live", "dictionary", "trace", "commissioning", "update", "stimuli"]
PROCESS_VALUE, SAME_AS_INTEGER = "Pressure process value", "Pressure process value INTEGER16"


#: The newest bus time that the page has received.
BUS_TIME = "return window.canopen.recorder.t"


def stimulate(page: Page, board: int, kind: str, spec: str) -> None:
    page.request("stimulate", board=board, kind=kind, spec=spec)


@pytest.fixture(scope="module")
def simulator():
    flags = ["--bitrate", "1000", "--node", "1:pressure", "--node", "2:encoder", "--pressure", "const:200000", "--control", "127.0.0.1:0"]
    simulator = Simulator(*flags, speed="real")
    yield simulator
    simulator.end()


@pytest.fixture
def page(driver, server: Server):
    """The page as opened by a user, with both nodes known and Operational."""
    size(driver, 1440, 900)
    page = Page(driver, server.url)
    start(page)
    yield page
    page.leave()


def start(page: Page) -> None:
    page.view("overview")
    page.knows(PRESSURE, ENCODER)
    page.press("Start all")
    for node in (PRESSURE, ENCODER):
        page.says(f"tr[data-node='{node}'] td[data-label=State]", "operational")


def choose_node(page: Page, view: str, node: int) -> None:
    page.view(view)
    page.choose("Node", str(node))


def sample_often(page: Page) -> None:
    """Sends TPDO 1 of the pressure node by its event timer, every 10 ms."""
    page.write(PRESSURE, 0x1800, 5, 10)


def test_the_overview_tells_who_is_there_and_commands_them(page: Page):
    row = f"tr[data-node='{PRESSURE}']"
    assert "pressure" in page.text(f"{row} td[data-label=Personality]")
    assert "encoder" in page.text(f"tr[data-node='{ENCODER}'] td[data-label=Personality]")
    page.says(f"{row} td[data-label=Heartbeat]", "1.00 s")
    page.press(f"Stop node {PRESSURE}")
    page.says(f"{row} td[data-label=State]", "stopped")
    assert "operational" in page.text(f"tr[data-node='{ENCODER}'] td[data-label=State]")
    page.press(f"Start node {PRESSURE}")
    page.says(f"{row} td[data-label=State]", "operational")


def test_a_plot_follows_a_step_of_the_stimulus(page: Page):
    sample_often(page)
    choose_node(page, "live", PRESSURE)
    page.until(lambda: len(page.drawn(PROCESS_VALUE)) > 20, "plot the pressure")
    stimulate(page, PRESSURE, "pressure", "const:200000")
    page.until(lambda: page.drawn(PROCESS_VALUE)[-1]["y"] < 2.1, "plot what is before the step")
    # The page's own clock may be ahead of a simulator that is late; a point that is plotted has happened.
    before = page.drawn(PROCESS_VALUE)[-1]["x"]
    stimulate(page, PRESSURE, "pressure", "step:200000,400000,0.5")
    after = page.script(BUS_TIME)
    page.until(lambda: page.drawn(PROCESS_VALUE)[-1]["y"] > 3.9, "plot the step")
    points = [point for point in page.drawn(PROCESS_VALUE) if point["x"] > before]
    risen = next(point["x"] for point in points if point["y"] > 3.9)
    # The plot may have been one message behind the bus when the stimulus was sent.
    assert before + 0.5 <= risen <= after + 0.5 + 1
    assert all(point["y"] < 2.1 for point in points if point["x"] < before + 0.5), "nothing is plotted before it happens"
    steps = [later["x"] - earlier["x"] for earlier, later in zip(points, points[1:])]
    assert max(steps) < 0.02, "each TPDO is a point"
    page.press("Pause")
    last = page.drawn(PROCESS_VALUE)[-1]["x"]
    page.until(lambda: float(page.script(BUS_TIME)) > last + 0.5, "go on recording")
    assert page.drawn(PROCESS_VALUE)[-1]["x"] <= last + 0.1, "a paused plot stands still"
    page.press("Follow")
    page.until(lambda: page.drawn(PROCESS_VALUE)[-1]["x"] > last + 0.5, "follow the bus again")


def test_a_slider_moves_the_plot(page: Page):
    sample_often(page)
    choose_node(page, "live", PRESSURE)
    slider = page.field("Pressure, bar")
    page.script("arguments[0].value = 6; arguments[0].dispatchEvent(new Event('input', { bubbles: true }))", slider)
    page.until(lambda: abs(page.drawn(PROCESS_VALUE)[-1]["y"] - 6) < 0.02, "plot what the slider says")


def test_a_waveform_moves_the_plot(page: Page):
    sample_often(page)
    page.view("stimuli")
    board = f"[data-board='{PRESSURE}']"
    choose_waveform(page, board, "Pressure", "ramp")
    for label, text in (("From", "1"), ("To", "5"), ("Seconds", "2")):
        page.fill(label, text, board)
    page.press("Apply", board)
    page.says(f"#view-stimuli {board}", "ramp:100000,500000,2")
    choose_node(page, "live", PRESSURE)
    page.until(lambda: page.drawn(PROCESS_VALUE)[-1]["y"] > 4.9, "plot the end of the ramp")
    values = [point["y"] for point in page.drawn(PROCESS_VALUE)]
    # Values from before the ramp may lie between its ends.
    begin = max((at for at, value in enumerate(values) if value <= 1.5), default=0)
    ramp = [value for value in values[begin:] if 1.5 < value < 4.5]
    # A sample comes every 10 ms, and the ramp rises by 2 bar a second.
    assert len(ramp) > 100 and ramp == sorted(ramp)


@pytest.mark.parametrize(
    ("board", "quantity", "forms"),
    [
        (PRESSURE, "Pressure", ["sine", "ramp", "step", "noise"]),
        (PRESSURE, "Temperature of the chip", ["sine", "ramp", "step", "noise"]),
        (PRESSURE, "Thermistor", ["sine", "ramp", "step", "noise"]),
        (ENCODER, "Shaft", ["sine", "ramp", "step", "noise", "rpm"]),
    ],
)
def test_the_simulator_takes_each_waveform_as_it_is_offered(page: Page, board: int, quantity: str, forms: list[str]):
    page.view("stimuli")
    selector = f"[data-board='{board}']"
    for form in forms:
        choose_waveform(page, selector, quantity, form)
        page.press("Apply", selector)
        page.until(lambda: f"{form}:" in shown_quantity(page, selector, quantity), f"say that {quantity} is a {form}")
    choose_waveform(page, selector, quantity, "const")
    page.until(lambda: "const:" in shown_quantity(page, selector, quantity), "go back to the slider")


PRESSURE_CONTROLS = {"Pressure, bar", "Temperature of the chip, °C", "Thermistor, °C", "open sensor", "open thermistor"}
POSITION_CONTROLS = {"Shaft, revolutions", "Absolute encoder", "missing index", "open ssi"}
CONTROLS_OF_EACH = {"Supply of the chip, V", "battery empty", "no crystal"}


def controls(page: Page, board: int) -> set[str]:
    """The labels of the controls of a board that are in view."""
    code = "return [...document.querySelectorAll(arguments[0])].filter((label) => label.offsetParent).map((label) => label.innerText.trim())"
    return set(page.script(code, f"#view-stimuli [data-board='{board}'] label"))


@pytest.mark.parametrize(
    ("board", "used", "unused"),
    [(PRESSURE, PRESSURE_CONTROLS, POSITION_CONTROLS), (ENCODER, POSITION_CONTROLS, PRESSURE_CONTROLS)],
)
def test_a_board_has_the_controls_of_what_its_personality_reads(page: Page, board: int, used: set[str], unused: set[str]):
    page.view("stimuli")
    page.says(f"#view-stimuli [data-board='{board}']", "Supply of the chip")
    shown = controls(page, board)
    assert used | CONTROLS_OF_EACH <= shown
    assert not unused & shown


def test_a_board_has_more_controls_after_its_personality_has_changed(page: Page):
    page.view("stimuli")
    try:
        change_personality(page, 2)
        page.until(lambda: PRESSURE_CONTROLS | POSITION_CONTROLS <= controls(page, ENCODER), "show the controls of both devices")
    finally:
        change_personality(page, 1)
    page.until(lambda: not PRESSURE_CONTROLS & controls(page, ENCODER), "show the controls of an encoder")


def change_personality(page: Page, personality: int) -> None:
    page.write(ENCODER, 0x2000, 0, personality)
    page.request("nmt", node=ENCODER, command="reset")


def test_supply_and_power_of_a_board_are_set_on_the_page(page: Page):
    page.view("stimuli")
    board = f"[data-board='{PRESSURE}']"
    choose_waveform(page, board, "Supply of the chip", "step")
    page.fill("To", "3.1", board)
    page.press("Apply", board)
    page.until(lambda: "step:" in shown_quantity(page, board, "Supply of the chip"), "say that the supply is a step")
    choose_waveform(page, board, "Supply of the chip", "const")
    page.press("Power on", board)
    assert "no stimulus" not in page.text(f"#view-stimuli {board} .outcome")


def choose_waveform(page: Page, board: str, quantity: str, form: str) -> None:
    label = f"{board} select[aria-label='Waveform of {quantity}']"
    Select(page.until(lambda: page.find(label), f"offer waveforms of {quantity}")).select_by_value(form)


def shown_quantity(page: Page, board: str, quantity: str) -> str:
    """The settings of a quantity's knobs."""
    code = "return document.querySelector(arguments[0]).closest('.quantity').innerText"
    return page.script(code, f"#view-stimuli {board} select[aria-label='Waveform of {quantity}']")


def test_a_fault_is_marked_on_the_time_axis(page: Page):
    sample_often(page)
    choose_node(page, "live", PRESSURE)
    page.field("open sensor").click()
    page.says("#view-live .faults", "5006h")
    page.says("#view-live .signals", "not sent: pre-operational")
    page.field("open sensor").click()
    page.says("#view-live .faults", "0000h")
    start(page)


def test_a_value_that_is_not_valid_says_so(page: Page):
    sample_often(page)
    page.write(PRESSURE, 0x1029, 2, STAY_OPERATIONAL)
    choose_node(page, "live", PRESSURE)
    page.says("#view-live .signals tr[data-signal='1:6130:1']", "\tvalid")
    page.field("open sensor").click()
    page.says("#view-live .signals tr[data-signal='1:6130:1']", "not valid")
    # The simulator reports the fault by another way than the bus.
    page.until(lambda: page.field("open sensor").is_selected(), "show the fault as on")
    page.field("open sensor").click()
    page.says("#view-live .faults", "0000h")
    page.until(lambda: "not valid" not in page.text("#view-live .signals tr[data-signal='1:6130:1']"), "say that the value is valid again")


def test_an_edit_is_checked_refused_and_accepted(page: Page):
    choose_node(page, "dictionary", PRESSURE)
    outcome = ".outcome"

    details = page.open_object("6132h:1")
    field = page.fill("New value", "39", details)
    field.send_keys(Keys.ENTER)
    page.says(f"{details} {outcome}", "Too high: 0 to 38")
    assert field.get_attribute("aria-invalid") == "true"
    assert page.read(PRESSURE, 0x6132, 1) == 0, "what is wrong is not sent"

    details = page.open_object("1A00h:0")
    page.fill("New value", "3", details).send_keys(Keys.ENTER)
    page.says(f"{details} {outcome}", "060")
    assert page.read(PRESSURE, 0x1A00) == 2, "what the node refuses stays as it was"

    details = page.open_object("61A1h:1")
    page.fill("New value", "7", details).send_keys(Keys.ENTER)
    page.says(f"{details} {outcome}", "written, reads 7")
    assert page.read(PRESSURE, 0x61A1, 1) == 7


def test_what_differs_from_the_default_is_listed(page: Page):
    page.write(PRESSURE, 0x61A1, 1, 9)
    choose_node(page, "dictionary", PRESSURE)
    page.until(lambda: "objects" in page.text("#view-dictionary .hint"), "list the objects")
    page.choose("Show", "differs")
    page.until(lambda: page.find("tr[data-object='61A1h:1']").is_displayed(), "list what differs")
    page.until(lambda: page.script("return document.querySelector(\"tr[data-object='1000h:0']\")") is None, "hide what does not")
    page.write(PRESSURE, 0x61A1, 1, 1)


def test_a_configuration_is_shown_before_it_is_written(page: Page, tmp_path):
    page.write(PRESSURE, 0x61A1, 1, 9)
    file = tmp_path / "node.dcf"
    file.write_text(page.request("dcf", node=PRESSURE, all=False)["text"])
    page.write(PRESSURE, 0x61A1, 1, 1)
    choose_node(page, "dictionary", PRESSURE)
    page.find("summary").click()
    page.field("Apply a file").send_keys(str(file))
    row = page.says("#view-dictionary details.box tbody", "61A1h:1")
    assert row.split("\t")[0::2] == ["61A1h:1", "1"] and row.split("\t")[3] == "9", row
    assert page.read(PRESSURE, 0x61A1, 1) == 1, "nothing is written before the user has seen it"
    page.press("Write these")
    page.says("#view-dictionary details.box", "1 object changed")
    assert page.read(PRESSURE, 0x61A1, 1) == 9
    page.write(PRESSURE, 0x61A1, 1, 1)


def test_warnings_of_a_file_are_lines_and_its_changes_are_those_of_one_node(page: Page, driver, tmp_path):
    whole = page.request("dcf", node=PRESSURE, all=True)["text"]
    changed = re.sub(r"(\[1A00sub1\][^\[]*?ParameterValue=)\w+", r"\g<1>0x71300110", whole)
    changed = re.sub(r"(\[100[89]\][^\[]*?PDOMapping=)0", r"\g<1>FALSE", changed)
    file = tmp_path / "node.dcf"
    choose_node(page, "dictionary", PRESSURE)
    page.find("summary").click()
    box = "#view-dictionary details.box"
    file.write_text(whole[: whole.rindex("PDOMapping=")])
    page.field("Apply a file").send_keys(str(file))
    page.says(box, "the file is cut off in its last section, before PDOMapping")
    assert page.text(f"{box} table") == ""
    file.write_text(changed)
    # The same file again.
    page.script("arguments[0].click()", page.field("Apply a file"))
    page.field("Apply a file").send_keys(str(file))
    row = page.says(f"{box} tbody", "1A00h:1")
    assert "1630535968 (61300120h)\t1898971408 (71300110h)" in row and len(row.splitlines()) == 1, row
    warnings = page.text(f"{box} ul").splitlines()
    assert [warning.split(":")[0] for warning in warnings] == ["warning", "warning"], warnings
    size(driver, 360, 800)
    assert page.script(CUT) == []
    choose_node(page, "dictionary", ENCODER)
    page.until(lambda: page.text(f"{box} table") == "", "forget the changes of the other node")


def test_a_mapping_is_changed_and_plotted(page: Page):
    sample_often(page)
    choose_node(page, "commissioning", PRESSURE)
    page.choose("PDO", "0")
    page.until(lambda: page.field("Object 1").get_attribute("value") == f"{0x6130}:1", "show the mapping of TPDO 1")
    page.choose("Object 1", f"{0x7130}:1")
    page.choose("Object 2", "")
    page.fill("Event timer, ms", "20")
    page.press("Map")
    page.says("#view-commissioning [data-pdo='TPDO 1']", "7130h:1")
    assert page.script("return document.querySelectorAll('.steps [data-done=yes]').length") == 5
    assert (page.read(PRESSURE, 0x1A00), page.read(PRESSURE, 0x1A00, 1)) == (1, 0x7130_0110)
    choose_node(page, "live", PRESSURE)
    page.until(lambda: len(page.drawn(SAME_AS_INTEGER)) > 20, "plot the object that is mapped now")
    assert "6130h:1" not in page.text("#view-live .signals")
    page.request("nmt", node=PRESSURE, command="reset")


def test_the_trace_is_filtered_and_paused_and_shows_bits(page: Page):
    page.view("trace")
    page.says("#view-trace .frames", "pdo")
    assert "0 dropped" in page.text("#view-trace .hint")
    for kind in ("nmt", "sync", "time", "emcy", "pdo", "sdo", "lss", "other"):
        page.field(kind).click()
    page.view("overview")
    page.press(f"Pre-operational node {ENCODER}")
    page.press(f"Start node {ENCODER}")
    page.view("trace")
    rows = "return [...document.querySelectorAll('.frames tbody tr')].map((row) => row.dataset.kind)"
    page.until(lambda: page.script(rows), "show a heartbeat")
    assert set(page.script(rows)) == {"heartbeat"}
    page.press("Pause")
    before = page.text("#view-trace .frames")
    page.find(".scroll").send_keys(Keys.ARROW_DOWN)
    page.says("#view-trace .frame-details", "Data, bit 7 first")
    assert page.text("#view-trace .frames") == before


def test_the_keyboard_is_enough(page: Page):
    page.script("document.activeElement.blur()")
    page.driver.find_element("tag name", "body").send_keys("2")
    page.until(lambda: page.script("return location.hash") == "#live", "change the view by a digit")
    assert page.script("return document.activeElement.innerText") == "Live", "the focus goes to the heading of the view"
    seen = []
    for _ in range(8):
        page.driver.switch_to.active_element.send_keys(Keys.TAB)
        seen.append(page.script("const e = document.activeElement; return e.ariaLabel ?? e.labels?.[0]?.innerText ?? e.innerText"))
    assert seen[:3] == ["Node", "Time", "Pause"]
    canvas = page.until(lambda: page.find("canvas"), "have a plot")
    page.script("arguments[0].focus()", canvas)
    canvas.send_keys(" ")
    page.until(lambda: page.script("return window.canopen.time.follows") is False, "pause by the space bar")
    canvas.send_keys(Keys.HOME)
    page.until(lambda: page.script("return window.canopen.time.follows"), "follow by Home")
    page.script("document.activeElement.blur()")
    page.driver.find_element("tag name", "body").send_keys("3")
    page.driver.switch_to.active_element.send_keys("/")
    assert page.script("return document.activeElement.type") == "search"


#: The roles of elements that a screen reader announces by their names.
NAMED = {"button", "checkbox", "combobox", "image", "img", "link", "progressbar", "searchbox", "slider", "spinbutton", "switch", "textbox"}


def nameless(page: Page) -> list[str]:
    """The controls and drawings for which the browser has no accessible name."""
    nodes = page.driver.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    told = [node for node in nodes if not node["ignored"] and node["role"]["value"] in NAMED]
    assert len(told) > 8, "the tree has the controls"
    return [str(node) for node in told if not node.get("name", {}).get("value")]


def test_every_control_has_a_name_and_no_view_is_wider_than_a_phone(page: Page):
    for view in VIEWS:
        page.view(view)
        page.until(lambda: page.script("return document.querySelector('main section:not([hidden])').innerText.length > 60"), f"fill {view}")
        assert nameless(page) == [], view
    size(page.driver, 390, 844)
    for view in VIEWS:
        page.view(view)
        assert page.script("return document.documentElement.scrollWidth") <= 390, view


def test_two_pages_at_once(page: Page, driver, server: Server):
    sample_often(page)
    first = driver.current_window_handle
    driver.switch_to.new_window("window")
    second = driver.current_window_handle
    try:
        other = Page(driver, server.url)
        choose_node(other, "live", PRESSURE)
        other.until(lambda: len(other.drawn(PROCESS_VALUE)) > 20, "plot in the second page")
        other.says("#bus-status", "Pages\n2")
        driver.switch_to.window(first)
        page.view("overview")
        page.press(f"Stop node {ENCODER}")
        page.says(f"tr[data-node='{ENCODER}'] td[data-label=State]", "stopped")
        driver.switch_to.window(second)
        other.view("overview")
        other.says(f"tr[data-node='{ENCODER}'] td[data-label=State]", "stopped")
    finally:
        driver.switch_to.window(second)
        driver.close()
        driver.switch_to.window(first)


def test_the_server_goes_away_and_comes_back(page: Page, simulator: Simulator, server: Server):
    sample_often(page)
    choose_node(page, "live", PRESSURE)
    page.until(lambda: len(page.drawn(PROCESS_VALUE)) > 20, "plot")
    address = server.url.split("/")[2].split("?")[0]
    server.stop()
    page.says("#connection", "no server: trying again")
    again = Server(simulator, address)
    assert again.url.split("/")[2] == address, "the port is free again"
    try:
        page.says("#connection", "connected")
        newest = page.script(BUS_TIME)
        page.until(lambda: page.drawn(PROCESS_VALUE)[-1]["x"] != newest and len(page.drawn(PROCESS_VALUE)) > 20, "plot again, without being loaded anew")
        page.view("overview")
        page.press(f"Stop node {ENCODER}")
        page.says(f"tr[data-node='{ENCODER}'] td[data-label=State]", "stopped")
    finally:
        server.process, again.process = again.process, server.process


def test_nothing_is_cut_off_on_a_phone(page: Page):
    sample_often(page)
    size(page.driver, 390, 844)
    for view in VIEWS:
        choose_node(page, view, PRESSURE) if view in ("live", "dictionary", "commissioning") else page.view(view)
        page.until(lambda: page.script("return document.querySelector('main section:not([hidden])').innerText.length > 60"), f"fill {view}")
        if view == "trace":
            page.says("#view-trace .frames", "pdo")
            assert page.script(CUT) == [], view
            page.field("by CAN-ID").click()
        if view == "commissioning":
            page.says("#view-commissioning [data-pdo='TPDO 1']", "6130h:1")
        assert page.script(CUT) == [], view
