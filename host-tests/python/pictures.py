"""Takes the pictures of docs/page.md and README: the page in a browser, and the screen of the simulator.

`cargo xtask pictures` runs this with the programs that it has built.
"""

import fcntl
import html
import os
import pty
import struct
import subprocess
import termios
import time
from io import BytesIO
from pathlib import Path

import picture_sources
import pyte
from page import Page, Server, browser, size
from PIL import Image
from simulator import Simulator

FOLDER = Path(__file__).parents[2] / "docs/pictures"
DESK, PHONE = (1440, 900), (390, 844)

#: Number of colours in the palette of a picture: a page has few colours, and the file stays small.
COLOURS = 64

#: Seconds of the bus that the plots of a picture show.
SECONDS = 10


def save(png: bytes, name: str) -> None:
    FOLDER.mkdir(exist_ok=True)
    picture = Image.open(BytesIO(png)).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    path = FOLDER / f"{name}.png"
    picture.save(path, optimize=True)
    print(f"{path.name}: {picture.width} x {picture.height}, {path.stat().st_size} bytes")


def shoot(page: Page, name: str) -> None:
    for suffix, (width, height) in (("", DESK), ("-phone", PHONE)):
        size(page.driver, width, height)
        page.script("scrollTo(0, 0); document.activeElement.blur()")
        time.sleep(0.5)
        save(page.driver.get_screenshot_as_png(), name + suffix)
    size(page.driver, *DESK)


def shoot_dark(page: Page, name: str) -> None:
    """The picture for readers whose system is dark."""
    dark = [{"name": "prefers-color-scheme", "value": "dark"}]
    page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": dark})
    time.sleep(1)
    save(page.driver.get_screenshot_as_png(), name)
    page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def bus_time(page: Page) -> float:
    return page.script("return window.canopen.recorder.t")


CURSOR = "window.canopen.time.point(2 / 3)"


def take_page(page: Page) -> None:
    page.view("overview")
    for node in (1, 2, 3, 16):
        page.says(f"tr[data-node='{node}'] td[data-label=Personality]", "")
    page.press("Start all")
    page.says("tr[data-node='1'] td[data-label=State]", "operational")
    for node in (1, 3):
        page.write(node, 0x1800, 5, 10)
    # A fault of the device leaves the node in Operational.
    page.write(1, 0x1029, 2, 1)
    begin = bus_time(page)
    page.view("live")
    page.choose("Series of node", "3")
    page.choose("Object", "3:6130:1")
    page.press("Add")
    page.until(lambda: bus_time(page) > begin + SECONDS * 0.6, "measure")
    fault = page.field("open sensor")
    fault.click()
    page.says("#view-live .faults", "5006h")
    page.until(lambda: bus_time(page) > begin + SECONDS * 0.7, "measure")
    fault.click()
    page.until(lambda: bus_time(page) > begin + SECONDS * 1.1, "measure")
    # The cursor, at two thirds of the time.
    page.script(CURSOR)
    shoot(page, "live")
    shoot_dark(page, "live-dark")
    page.view("overview")
    shoot(page, "overview")
    page.view("trace")
    page.says("#view-trace .frames", "heartbeat")
    page.press("Pause")
    page.find(".scroll").send_keys("\ue013")
    shoot(page, "trace")
    page.open_object("6132h:1")
    page.fill("Search", "pressure 61")
    page.press("Read all values")
    page.says("#view-dictionary .counts", "objects read")
    shoot(page, "dictionary")
    page.view("commissioning")
    page.says("#view-commissioning [data-pdo='TPDO 1']", "6130h:1")
    shoot(page, "commissioning")
    page.view("update")
    page.field("Program").send_keys(str(Path(os.environ["NODE_IMAGES"]) / "firmware.img"))
    page.says("#view-update", "In the file")
    shoot(page, "update")
    page.view("stimuli")
    shoot(page, "stimuli")


CELL = "<span style='color:{};background:{};font-weight:{}'>{}</span>"
NAMES = {"default": "#d8dee9", "black": "#2e3440", "red": "#ff8a8a", "green": "#6fd08c", "brown": "#e0cc66", "yellow": "#e0cc66", "blue": "#7ab8ff", "magenta": "#e39be0", "cyan": "#5fd3d6", "white": "#ffffff"}


def terminal_of(command: list[str], seconds: float, rows: int = 30, columns: int = 110) -> pyte.Screen:
    """The output of a program on a terminal of this size after some time."""
    screen = pyte.Screen(columns, rows)
    stream = pyte.ByteStream(screen)
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    program = subprocess.Popen(command, stdin=follower, stdout=follower, stderr=subprocess.DEVNULL, env={**os.environ, "TERM": "xterm-256color"})
    os.close(follower)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        stream.feed(os.read(leader, 65536))
    program.kill()
    program.wait()
    return screen


def colour(name: str) -> str:
    return NAMES.get(name, f"#{name}" if len(name) == 6 else NAMES["default"])


def as_html(screen: pyte.Screen) -> str:
    lines = []
    for row in range(screen.lines):
        cells = [screen.buffer[row][column] for column in range(screen.columns)]
        parts = []
        for cell in cells:
            front, back = colour(cell.fg), "transparent" if cell.bg == "default" else colour(cell.bg)
            if cell.reverse:
                front, back = "#12171d", front
            parts.append(CELL.format(front, back, 700 if cell.bold else 400, html.escape(cell.data)))
        lines.append("".join(parts))
    style = "margin:0;padding:16px;background:#12171d;font:15px/1.25 'DejaVu Sans Mono',monospace;display:inline-block"
    return f"<body style='margin:0;background:#12171d'><pre style=\"{style}\">" + "\n".join(lines) + "</pre>"


def take_terminal(driver) -> None:
    images = Path(os.environ["NODE_IMAGES"])
    command = [os.environ["SIM_COMMAND"], "--bootloader", str(images / "bootloader"), "--firmware", str(images / "firmware"), "--socketcand", "127.0.0.1:0", "--node", "1:pressure", "--pressure", "sine:250000,100000,0.5"]
    screen = terminal_of(command, 15)
    driver.get("about:blank")
    driver.execute_script("document.documentElement.innerHTML = arguments[0]", as_html(screen))
    save(driver.find_element("tag name", "pre").screenshot_as_png, "terminal")


def main() -> None:
    flags = ["--bitrate", "250", "--control", "127.0.0.1:0", "--pressure", "sine:250000,100000,0.5", "--pressure", "3=sine:300000,50000,0.2", "--shaft", "2=rpm:30", "--shaft", "16=sine:10,5,0.05"]
    for node in ("1:pressure", "2:encoder", "3:pressure", "16:lift"):
        flags += ["--node", node]
    simulator = Simulator(*flags, speed="real")
    server = Server(simulator)
    driver = browser(*DESK)
    try:
        take_page(Page(driver, server.url))
        server.stop()
        simulator.process.kill()
        take_terminal(driver)
        picture_sources.write()
    finally:
        driver.quit()
        server.stop()
        simulator.process.kill()


if __name__ == "__main__":
    main()
