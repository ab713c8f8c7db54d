"""An update runs from the page: what does not fit is refused before anything is erased, B replaces A, and A is put back."""

import os
from pathlib import Path

from page import Page, Server, browser
from simulator import Master, Simulator
from test_update import identification, image, until


def checked(page: Page, file: Path) -> str:
    """Has the page check a file, and waits for what it says."""
    page.field("Program").send_keys(str(file))
    return page.says("#view-update .outcome", "nothing is changed")


def may_start(page: Page) -> bool:
    return page.script("return [...document.querySelectorAll('#view-update button')].some((button) => !button.disabled)")


def test_an_update_runs_from_the_page_and_is_put_back(tmp_path: Path):
    a = Path(os.environ["NODE_IMAGES"]) / "firmware.img"
    b = image(tmp_path / "b.img", "0.2.0")
    cut = tmp_path / "cut.img"
    cut.write_bytes(b.read_bytes()[:-100])
    simulator = Simulator("--bitrate", "1000", "--control", "127.0.0.1:0", speed="real")
    server, driver = Server(simulator), browser()
    try:
        master = Master(simulator)
        # What a restarting node swallows must be noticed soon, and what a busy machine answers late is no loss.
        master.node.sdo.RESPONSE_TIMEOUT = 5.0
        page = Page(driver, server.url)
        page.says("tr[data-node='1']", "STM32F4")
        page.view("update")
        assert "does not fit" in checked(page, cut)
        assert not may_start(page)
        assert master.read(0x1F56, 1) == identification(a)
        checked(page, a)
        page.script("document.querySelector('#view-update .outcome').textContent = ''")
        assert "the program fits" in checked(page, b)
        page.press("Update the node")
        page.says("#view-update .outcome", f"is now version 0.1.0, identification {identification(b):08X}h")
        until(lambda: master.read(0x1F56, 1) == identification(b), "run B")
        page.press("Put back firmware.img")
        page.says("#view-update .outcome", f"is now version 0.1.0, identification {identification(a):08X}h")
        until(lambda: master.read(0x1F56, 1) == identification(a), "run A")
        assert page.console() == []
        master.close()
    finally:
        driver.quit()
        server.stop()
        simulator.process.kill()
