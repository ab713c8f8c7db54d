"""Hostile content in a real browser: a page of another site that talks to the ports of the simulator, and devices whose names are
markup.
"""

import functools
import http.server
import struct
import threading
import time
from pathlib import Path

from full_bus import ABSENT, FullBus, serve
from page import Page
from simulator import PATIENCE, Master, Simulator

#: Names that devices may have (1008h).
NAMES = {
    1: "<img src=x onerror=\"window.attacked='img'\">",
    2: "<script>window.attacked='script'</script>",
    3: "\"><svg onload=window.attacked='svg'>&amp;{{token}}",
    4: "long" * 300,
    5: "\u202egnp.exe",
    6: "\u05e9\u05dc\u05d5\u05dd \u0645\u0631\u062d\u0628\u0627",
}


class OtherSite:
    """A web server of another origin on this machine."""

    def __init__(self, folder: Path):
        handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=folder)
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
        (folder / "index.html").write_text("<!doctype html><title>another site</title>")
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}/"


#: Sends a text to a port in each way that a page has, and waits until all have ended.
SEND = """
const [port, text, done] = arguments;
const url = `http://127.0.0.1:${port}/`;
const post = fetch(url, { method: "POST", mode: "no-cors", body: text });
const blob = fetch(url, { method: "POST", mode: "no-cors", body: new Blob([text]) });
const beacon = navigator.sendBeacon(url, text);
const form = document.createElement("form");
Object.assign(form, { action: url, method: "post", enctype: "text/plain", target: "frame" });
const field = document.createElement("textarea");
Object.assign(field, { name: "a", value: text });
const frame = Object.assign(document.createElement("iframe"), { name: "frame" });
form.append(field);
document.body.append(frame, form);
form.submit();
const socket = new Promise((ended) => { new WebSocket(url.replace("http", "ws")).onclose = ended; });
Promise.allSettled([post, blob, socket]).then((all) => done(all.length));
"""


def test_a_page_of_another_site_sends_no_frames_and_gives_no_commands(tmp_path: Path, driver):
    log = tmp_path / "bus.log"
    simulator = Simulator("--control", "127.0.0.1:0", "--candump", str(log), speed="real")
    master = Master(simulator)
    heartbeats = master.listen(0x701)
    master.node.nmt.send_command(1)
    heartbeats.until(lambda data: data == b"\x05")
    driver.get(OtherSite(tmp_path).url)
    text = "< open vcan0 >< rawmode >< send 000 2 2 0 >\r\rC\rS8\rO\rt00020200\rquit\npressure const:1\n"
    ports = [simulator.socketcand, simulator.slcan, int(simulator.greeting["control"].split(":")[1])]
    for port in ports:
        assert driver.execute_async_script(SEND, port, text) == 3
    assert heartbeats.next()[1] == b"\x05"
    # From another origin there is no WebSocket of the page, either.
    page = int(simulator.greeting["page"].rstrip("/").rsplit(":", 1)[1])
    opens = "const [url, done] = arguments; const s = new WebSocket(url); s.onopen = () => done(true); s.onclose = () => done(false);"
    assert driver.execute_async_script(opens, f"ws://127.0.0.1:{page}/ws") is False
    heartbeats.until(lambda data: data == b"\x05")
    master.close()
    simulator.quit()
    assert not [line for line in log.read_text().splitlines() if " 000#02" in line]


class NamedBus(FullBus):
    """A bus of nodes with these names, read in segments."""

    def __init__(self, names: dict[int, str]):
        self.names = {node: name.encode() for node, name in names.items()}
        self.rest: dict[int, tuple[bytes, int]] = {}
        super().__init__()

    def answer(self, words: list[str]) -> None:
        match words:
            case ["send", identifier, _, *data] if 0x600 < int(identifier, 16) < 0x680:
                node, request = int(identifier, 16) - 0x600, bytes.fromhex("".join(f"{int(byte, 16):02x}" for byte in data))
                if node not in self.names:
                    return
                index, sub = struct.unpack_from("<HB", request, 1)
                if request[0] == 0x40 and (index, sub) == (0x1008, 0):
                    self.rest[node] = (self.names[node], 0)
                    answer = struct.pack("<BHBI", 0x41, index, sub, len(self.names[node]))
                elif request[0] & 0xE0 == 0x60 and node in self.rest:
                    rest, toggle = self.rest[node]
                    part, rest = rest[:7], rest[7:]
                    answer = bytes([toggle | (7 - len(part)) << 1 | (not rest)]) + part.ljust(7, b"\0")
                    self.rest[node] = (rest, toggle ^ 0x10)
                elif request[0] == 0x40:
                    value = self.objects[node].get((index, sub))
                    answer = struct.pack("<BHBI", *((0x80, index, sub, ABSENT) if value is None else (0x43, index, sub, value)))
                else:
                    return
                self.frames([(0x580 + node, answer)])
            case _:
                super().answer(words)

    def beat(self) -> None:
        """Heartbeats of all nodes."""
        self.frames([(0x700 + node, b"\x05") for node in self.names])


VIEWS = ("overview", "live", "dictionary", "trace", "commissioning", "update")
#: What the overview shows of each name.
PARTS = ("<img src=x", "<script>", "<svg", "longlong", "gnp.exe", "\u05e9\u05dc\u05d5\u05dd")


def test_hostile_names_are_text_in_every_view(driver):
    bus = NamedBus(NAMES)
    process, url = serve(bus)
    try:
        page = Page(driver, url)
        end = time.monotonic() + PATIENCE
        while not all(part in page.text("main") for part in PARTS):
            assert time.monotonic() < end, page.text("main")[:2000]
            bus.beat()
            time.sleep(0.3)
        for view in VIEWS:
            page.view(view)
            assert page.script("return window.attacked ?? null") is None, view
            injected = "return document.querySelectorAll('main img, main script, svg[onload], [onerror], [onload]').length"
            assert page.script(injected) == 0, view
            wide = page.script("return document.documentElement.scrollWidth - document.documentElement.clientWidth")
            assert wide <= 0, f"{view}: the names make the page {wide} pixels wider than its window"
    finally:
        process.kill()
