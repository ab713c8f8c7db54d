"""An update runs from the page: what does not fit is refused before anything is erased, B replaces A, and A is put back."""

import os
from pathlib import Path

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
