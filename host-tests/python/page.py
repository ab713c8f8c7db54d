"""The page of the bus: its server, and a real browser that shows it."""

import contextlib
import json
import os
import shutil
import subprocess
import time

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.select import Select
from simulator import PATIENCE, Relay, Simulator

#: The selector of the view on display.
SHOWN = "main > section:not([hidden])"

#: Texts and tables that are cut off at the right, or can only be read by scrolling to the right.
CUT = """return [...document.querySelectorAll("main section:not([hidden]) *")].filter((element) => {
  const { right, width } = element.getBoundingClientRect();
  const isScrolled = ["auto", "scroll"].includes(getComputedStyle(element).overflowX) && element.scrollWidth > element.clientWidth + 1;
  return width > 0 && !element.closest(".unseen, .tile svg, option, thead") && (right > innerWidth + 1 || isScrolled);
}).map((element) => `${element.tagName}.${element.className}: ${element.innerText?.slice(0, 40)}`)"""

#: Seconds between two checks of the page.
POLL = 0.1


class Server:
    """`nodectl serve` on the bus of a simulator."""

    started: list["Server"] = []

    def __init__(self, simulator: Simulator, address: str = "127.0.0.1:0", bus: Relay | None = None):
        bus = f"socketcand://127.0.0.1:{(bus or simulator).socketcand}/vcan0"
        command = [os.environ["NODECTL_COMMAND"], "--json", "serve", bus, "--page", address, "--stimuli", simulator.greeting["control"]]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        Server.started.append(self)
        line = self.process.stdout.readline()
        assert line, "nodectl has ended without serving a page"
        self.url = json.loads(line)["page"]

    def stop(self) -> None:
        self.process.kill()
        self.process.wait()


def browser(width: int = 1440, height: int = 900) -> webdriver.Chrome:
    """A headless browser with an empty profile."""
    options = webdriver.ChromeOptions()
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--hide-scrollbars"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    driver.set_script_timeout(PATIENCE)
    size(driver, width, height)
    return driver


def size(driver: webdriver.Chrome, width: int, height: int) -> None:
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)


class Page:
    """A user's actions and observations on the page. Waits end when the page shows the expected state."""

    def __init__(self, driver: webdriver.Chrome, url: str):
        self.driver = driver
        self.url = url
        driver.get(url)
        self.until(lambda: "connected" in self.text("#connection"), "connect to the server")

    def script(self, code: str, *arguments):
        return self.driver.execute_script(code, *arguments)

    def until(self, condition, what: str):
        """The first result of the condition that is not false or empty."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            with contextlib.suppress(Exception):
                if result := condition():
                    return result
            time.sleep(POLL)
        raise AssertionError(f"the page does not {what}; it shows:\n{self.text('main')[:3000]}")

    def text(self, selector: str) -> str:
        return self.script("return document.querySelector(arguments[0])?.innerText ?? ''", selector)

    def says(self, selector: str, words: str) -> str:
        """Waits until an element contains this text."""
        return self.until(lambda: words in (text := self.text(selector)) and text, f"say {words!r} at {selector}")

    def view(self, name: str) -> None:
        self.script("location.hash = arguments[0]", name)
        self.until(lambda: self.script("return !document.getElementById(arguments[0]).hidden", f"view-{name}"), f"show {name}")

    def knows(self, *nodes: int) -> None:
        """Waits until the page has identified these nodes."""
        for node in nodes:
            self.says(f"tr[data-node='{node}']", "STM32F4")

    def find(self, selector: str):
        return self.driver.find_element(By.CSS_SELECTOR, f"{SHOWN} {selector}")

    def press(self, name: str, inside: str = "") -> None:
        """Presses the button of this view with this name, when the button is enabled."""
        code = """return [...document.querySelectorAll(arguments[0])].find((button) => button.offsetParent && !button.disabled
            && (button.ariaLabel ?? button.innerText).trim() === arguments[1])"""
        button = self.until(lambda: self.script(code, f"{SHOWN} {inside} button", name), f"offer {name!r}")
        self.script("arguments[0].scrollIntoView({ block: 'center' })", button)
        button.click()

    def field(self, label: str, inside: str = ""):
        """The control of this view with this label."""
        code = """return [...document.querySelectorAll(arguments[0])].find((label) => label.offsetParent
            && label.innerText.trim() === arguments[1])?.control"""
        return self.until(lambda: self.script(code, f"{SHOWN} {inside} label", label), f"have the field {label!r}")

    def choose(self, label: str, value: str) -> None:
        field = self.field(label)
        self.until(lambda: value in [option.get_attribute("value") for option in Select(field).options], f"offer {value} for {label}")
        Select(field).select_by_value(value)

    def fill(self, label: str, text: str, inside: str = ""):
        field = self.field(label, inside)
        self.script("arguments[0].scrollIntoView({ block: 'center' })", field)
        field.send_keys(Keys.CONTROL, "a")
        field.send_keys(text)
        return field

    def drawn(self, signal: str) -> list[dict]:
        """The points of a signal in its plot now; none without a plot."""
        code = """const [name, unit] = [arguments[0], arguments[1]];
            for (const canvas of document.querySelectorAll("#view-live canvas"))
              for (const { label, data } of Chart.getChart(canvas).data.datasets) if (label === name) return data;
            return [];"""
        return self.script(code, signal, None)

    def open_object(self, address: str) -> str:
        """Finds an object in the dictionary and opens its details. Returns the selector of the details."""
        self.view("dictionary")
        self.until(lambda: self.script("return document.querySelectorAll('.objects tbody tr.object').length > 0"), "list the objects")
        self.fill("Search", address)
        row = f"tr[data-object='{address}']"
        if self.find(f"{row} button.plain").get_attribute("aria-expanded") == "false":
            self.find(f"{row} button.plain").click()
        return f"{row} + tr.details"

    def request(self, what: str, **keys):
        """Sends a request to the server as the page does, and waits for the answer."""
        return self.script("return window.canopen.bus.request(arguments[0], arguments[1])", what, keys)

    def read(self, node: int, index: int, sub: int = 0):
        """The value of an object. All clients share the SDO channel of a node, so the tests read through the server."""
        (value,) = self.request("read", node=node, objects=[[index, sub]])["values"]
        return value["value"]

    def write(self, node: int, index: int, sub: int, value: int) -> None:
        self.request("write", node=node, index=index, sub=sub, value=value)

    def console(self) -> list[str]:
        """The errors of the page's scripts."""
        lost = "WebSocket connection to"
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE" and lost not in entry["message"]]

    def leave(self) -> None:
        """Closes the page before its server ends: the page would log an error for each try to reconnect."""
        errors = self.console()
        self.driver.get("about:blank")
        assert errors == [], "errors in the page's console"
