"""A full bus: 127 nodes at 1 Mbit/s, without a simulator that would need more time than the bus has.

A socketcand that answers for all nodes: each has the dictionary of a pressure transmitter as far as a host asks for it, and sends
TPDO 1 and heartbeats at a pace. Run as a program it measures `nodectl serve`:

    NODECTL_COMMAND=target/sim/nodectl python host-tests/python/full_bus.py 20
"""

import contextlib
import json
import os
import re
import socket
import struct
import subprocess
import sys
import threading
import time
import urllib.request

import websocket

NODES = range(1, 128)
#: Frames per second. A frame with 8 bytes has 111 bits, interframe space included, and some stuff bits.
RATE = 8500
#: Seconds between two parcels of frames.
PARCEL = 0.005

ABSENT = 0x0602_0000


def objects(node: int) -> dict[tuple[int, int], int]:
    """The objects of a node."""
    return {
        (0x1000, 0): 0x0002_0194,
        (0x1018, 1): 0,
        (0x1018, 2): 1,
        (0x1018, 3): 0x0001_0000,
        (0x1018, 4): node,
        (0x1800, 1): 0x180 + node,
        (0x1A00, 0): 2,
        (0x1A00, 1): 0x6130_0120,
        (0x1A00, 2): 0x6130_0220,
    }


class FullBus:
    """The bus and its socketcand server, for one client."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.objects = {node: objects(node) for node in NODES}
        self.running = threading.Event()
        self.lock = threading.Lock()
        self.sent = 0
        #: The time of the first frame, by this program's clock.
        self.first: float | None = None
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self) -> None:
        self.client, _ = self.listener.accept()
        self.client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.client.sendall(b"< hi >")
        text = ""
        # A server that is killed may reset the connection.
        with contextlib.suppress(ConnectionError):
            while data := self.client.recv(4096):
                text += data.decode()
                *messages, text = text.split(">")
                for message in messages:
                    self.answer(message.split()[1:])

    def answer(self, words: list[str]) -> None:
        match words:
            case ["open" | "rawmode", *_]:
                self.client.sendall(b"< ok >")
            case ["send", identifier, _, *data] if 0x600 < int(identifier, 16) < 0x680:
                node, request = int(identifier, 16) - 0x600, bytes.fromhex("".join(data))
                index, sub = struct.unpack_from("<HB", request, 1)
                if request[0] == 0x40:
                    value = self.objects[node].get((index, sub))
                    code, value = (0x80, ABSENT) if value is None else (0x43, value)
                    self.frames([(0x580 + node, struct.pack("<BHBI", code, index, sub, value))])

    def frames(self, frames: list[tuple[int, bytes]]) -> None:
        with self.lock:
            now = time.monotonic()
            self.first = self.first or now
            self.sent += len(frames)
            self.client.sendall("".join(f"< frame {id:03X} {now:.6f} {data.hex().upper()} >" for id, data in frames).encode())

    def run(self, seconds: float) -> None:
        """Sends from all nodes for a time. A late host sends frames later, but the same number of frames."""
        parcels = int(seconds / PARCEL)
        start, done = time.monotonic(), 0
        for parcel in range(1, parcels + 1):
            count = round(parcel * PARCEL * RATE) - done
            self.frames([self.frame(number) for number in range(done, done + count)])
            done += count
            time.sleep(max(0.0, start + parcel * PARCEL - time.monotonic()))

    @staticmethod
    def frame(number: int) -> tuple[int, bytes]:
        """TPDO 1 of the nodes in turn, with the number of the turn as its value; heartbeats in between."""
        turn, node = divmod(number, len(NODES))
        if turn % 67 == 66:
            return 0x701 + node, b"\x05"
        return 0x181 + node, struct.pack("<ff", turn, node)


class Client:
    """A client of the page's interface, without a browser."""

    def __init__(self, url: str):
        html = urllib.request.urlopen(url).read().decode()
        token = re.search(r'name="token" content="([0-9a-f]+)"', html)[1]
        self.socket = websocket.create_connection(url.replace("http", "ws") + f"ws?token={token}", timeout=60)
        self.events: list[dict] = []
        self.number = 0

    def ask(self, do: str, **keys) -> dict:
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "do": do, **keys}))
        while True:
            message = self.next()
            if message.get("id") == self.number and "progress" not in message:
                assert "ok" in message, message
                return message["ok"]
            self.events.append(message)

    def next(self) -> dict:
        return json.loads(self.socket.recv())


def serve(bus: FullBus) -> tuple[subprocess.Popen, str]:
    """The server on the bus, with its address. On a busy machine the nodes may answer late."""
    return serve_address(f"socketcand://127.0.0.1:{bus.port}/vcan0", "--timeout", "20000")


def serve_address(address: str, *flags: str) -> tuple[subprocess.Popen, str]:
    """The server on the bus with this address, with the address of its page."""
    command = [os.environ["NODECTL_COMMAND"], "--json", *flags, "serve", address, "--page", "127.0.0.1:0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    return process, json.loads(process.stdout.readline())["page"]


def memory(process: subprocess.Popen) -> int:
    """The largest resident memory so far, in bytes."""
    with open(f"/proc/{process.pid}/status") as status:
        return int(re.search(r"VmHWM:\s+(\d+) kB", status.read())[1]) * 1024


def cpu(process: subprocess.Popen) -> float:
    """The CPU time so far, in seconds."""
    with open(f"/proc/{process.pid}/stat") as stat:
        user, system = stat.read().rsplit(")", 1)[1].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


#: The signals of a page: eight signals of four nodes.
SIGNALS = [f"{node}:6130:{sub}" for node in (1, 40, 80, 127) for sub in (1, 2)]


def measure(seconds: float, trace: bool) -> None:
    bus = FullBus()
    process, url = serve(bus)
    try:
        client = Client(url)
        for node in (1, 40, 80, 127):
            client.ask("signals", node=node)
        client.ask("follow", signals=SIGNALS)
        client.ask("trace", on=trace)
        before, start = cpu(process), time.monotonic()
        sender = threading.Thread(target=bus.run, args=(seconds,))
        sender.start()
        delays, samples, rows, lost = [], 0, 0, 0
        while sender.is_alive():
            message = client.next()
            now = time.monotonic()
            match message.get("event"):
                case "live":
                    for signal in message["signals"]:
                        samples += len(signal["t"])
                        delays += [now - bus.first - t for t in signal["t"]]
                    lost = message["lost"]
                case "trace":
                    rows += len(message["rows"])
                    lost += message["lost"]
        took = time.monotonic() - start
        share = (cpu(process) - before) / took
        delays.sort()
        print(
            f"{bus.sent / took:6.0f} frames/s of {len(NODES)} nodes, trace {'on' if trace else 'off'}: {share:5.1%} of a core, "
            f"{memory(process) / 1e6:.0f} MB; {samples} samples, {rows} rows, {lost} lost; from frame to page "
            f"{delays[len(delays) // 2] * 1000:.0f} ms (median), {delays[-len(delays) // 100] * 1000:.0f} ms (99 %), {delays[-1] * 1000:.0f} ms (worst)"
        )
    finally:
        process.kill()
        process.wait()


if __name__ == "__main__":
    for trace in (False, True):
        measure(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0, trace)
