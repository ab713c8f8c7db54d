"""An update runs from the page: what does not fit is refused before anything is erased, B replaces A, and A is put back."""

import os
from pathlib import Path

import pytest
from page import Page, Server
from selenium.common.exceptions import JavascriptException
from simulator import Simulator
from test_update import identification, image


def checked(page: Page, file: Path) -> str:
    """Makes the page check a file, and waits for the result."""
    page.field("Program").send_keys(str(file))
    return page.says("#view-update .outcome", "nothing is changed")


def may_start(page: Page) -> bool:
    return page.script("return [...document.querySelectorAll('#view-update button')].some((button) => !button.disabled)")


def is_refused(page: Page, node: int | str) -> bool:
    try:
        page.request("nmt", node=node, command="preop")
    except JavascriptException as refused:
        return "node 1 is being updated" in str(refused)
    return False


def runs(page: Page, program: Path) -> bool:
    return page.read(1, 0x1F56, 1) == identification(program)


def test_an_update_runs_from_the_page_and_is_put_back(tmp_path: Path, driver):
    a = Path(os.environ["NODE_IMAGES"]) / "firmware.img"
    b = image(tmp_path / "b.img", "0.2.0")
    cut = tmp_path / "cut.img"
    cut.write_bytes(b.read_bytes()[:-100])
    simulator = Simulator("--bitrate", "1000", "--control", "127.0.0.1:0", speed="real")
    server = Server(simulator)
    try:
        page = Page(driver, server.url)
        page.says("tr[data-node='1']", "STM32F4")
        page.view("update")
        assert f"{identification(a):08X}h" in page.says("#view-update .programs", "No update")
        assert "does not fit" in checked(page, cut)
        assert not may_start(page)
        assert runs(page, a)
        checked(page, a)
        page.script("document.querySelector('#view-update .outcome').textContent = ''")
        assert "the program fits" in checked(page, b)
        page.press("Update the node")
        page.until(lambda: is_refused(page, node=1) and is_refused(page, node="all"), "refuse NMT commands during the update")
        page.says("#view-update .outcome", f"is now version 0.1.0, identification {identification(b):08X}h")
        page.until(lambda: runs(page, b), "read the identification of B in the node")
        assert f"{identification(b):08X}h" in page.says("#view-update .programs", "on trial")
        page.press("Put back firmware.img")
        page.says("#view-update .outcome", f"is now version 0.1.0, identification {identification(a):08X}h")
        page.until(lambda: runs(page, a), "read the identification of A in the node")
        page.leave()
    finally:
        server.stop()
        simulator.end()


@pytest.fixture
def two(driver):
    """A page with two nodes."""
    simulator = Simulator("--bitrate", "1000", "--node", "1:pressure", "--node", "2:encoder", "--control", "127.0.0.1:0", speed="real")
    server = Server(simulator)
    page = Page(driver, server.url)
    page.knows(1, 2)
    yield page, server, simulator
    page.leave()
    server.stop()
    simulator.end()


STARTS = "return [...document.querySelectorAll('#view-update button')].some(({ innerText, disabled }) => innerText === 'Update the node' && !disabled)"


def test_one_file_updates_two_nodes(two, tmp_path: Path):
    page, _, _ = two
    b = image(tmp_path / "b.img", "0.2.0")
    page.view("update")
    assert "the program fits" in checked(page, b)
    for node in (1, 2):
        page.choose("Node", str(node))
        page.until(lambda: page.script(STARTS), f"check the same file for node {node}")
        page.press("Update the node")
        page.says("#view-update [role=status]", " of ")
        page.choose("Node", str(3 - node))
        assert page.text("#view-update [role=status]") == "", "the progress is that of another node"
        page.choose("Node", str(node))
        page.says("#view-update .outcome", "updated: ")
        page.until(lambda: page.read(node, 0x1F56, 1) == identification(b), f"read the identification in node {node}")


def test_the_same_file_is_chosen_again(two):
    page, _, _ = two
    page.view("update")
    for _ in range(2):
        page.script("document.querySelector('#view-update .outcome').textContent = ''")
        page.script("document.querySelector('#view-update input[type=file]').click = () => {}")
        # As the dialog of a browser does: it opens with a click, and an unchanged choice is no change.
        page.script("document.querySelector('#view-update input[type=file]').dispatchEvent(new MouseEvent('click', { cancelable: true }))")
        assert "the program fits" in checked(page, Path(os.environ["NODE_IMAGES"]) / "firmware.img")


def test_a_chosen_file_is_checked_again_after_a_lost_connection(two):
    page, server, simulator = two
    page.view("update")
    checked(page, Path(os.environ["NODE_IMAGES"]) / "firmware.img")
    page.view("overview")
    page.script("[...document.querySelectorAll('#view-overview button')].find(({ innerText }) => innerText === 'Scan').click()")
    server.stop()
    page.says("#connection", "no server: trying again")
    again = Server(simulator, server.url.split("/")[2].split("?")[0])
    try:
        page.says("#connection", "connected")
        assert page.text("#view-overview .outcome") == "", "the lost connection is told beside the new one"
        page.view("update")
        page.says("#view-update .outcome", "the program fits")
        page.press("Update the node")
        page.says("#view-update .outcome", "the node runs this program already")
    finally:
        server.process, again.process = again.process, server.process


#: Bytes of the largest message that a server takes.
LARGEST = 2 * 1024 * 1024


@pytest.mark.parametrize("size", [LARGEST * 3 // 4, LARGEST, 3 * LARGEST])
@pytest.mark.parametrize(("view", "label", "words"), [("update", "Program", "a signed image, as firmware.img"), ("dictionary", "Apply a file", "a configuration file")])
def test_a_file_that_is_too_large_is_refused_and_the_connection_stays(two, tmp_path: Path, view: str, label: str, words: str, size: int):
    page, _, _ = two
    page.script("window.lost = 0; window.canopen.bus.on('connected', () => window.lost += 1)")
    page.view(view)
    if view == "dictionary":
        page.script("document.querySelector('#view-dictionary details.box').open = true")
    file = tmp_path / "large.img"
    file.write_bytes(b"[FileInfo]\n" + b"x\n" * (size // 2))
    page.field(label).send_keys(str(file))
    text = page.says(f"#view-{view} .outcome", "is too large")
    assert text.startswith("large.img") and words in text, text
    assert page.read(1, 0x1000) == 0x0002_0194
    assert page.script("return window.lost") == 0
