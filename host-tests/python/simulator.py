"""A running `cargo sim`, and what the tests hear of it.

Virtual time runs as fast as the host can unless a test asks for the speed of a real board, so no test may look at a
clock of the host: what is asserted are the virtual time stamps that come with every frame.
"""

import contextlib
import json
import os
import queue
import re
import socket
import subprocess
import tempfile
import threading
import time
import tty
from pathlib import Path

import can
import canopen

#: Host seconds after which a missing frame is a failure. No passing test waits this long, however busy the machine is.
PATIENCE = 120.0

#: Host seconds after which a request is repeated that the node may have missed.
ONCE_MORE = 2.0

BOOT_UP = b"\x00"


class Simulator:
    """The `sim` program with one pressure node, served on free ports.

    The page runs beside it, as with a plain `cargo sim`: a client must not notice the page. `page` is its address; None
    is for tests of a bus without it.
    """

    #: The simulators that were started; the end of the session stops those that a failed test has left running.
    started: list["Simulator"] = []

    def __init__(self, *flags: str, speed: str = "max", bootloader: str = "bootloader", page: str | None = "127.0.0.1:0"):
        images = Path(os.environ["NODE_IMAGES"])
        for name in (bootloader, "firmware"):
            assert (images / name).exists(), f"no {name} in {images}; `cargo xtask images --development` builds it"
        command = [os.environ["SIM_COMMAND"], "--bootloader", images / bootloader, "--firmware", images / "firmware"]
        command += ["--socketcand", "127.0.0.1:0", "--slcan", "127.0.0.1:0", "--speed", speed, "--json", *flags]
        self.log = Path(flags[flags.index("--candump") + 1]) if "--candump" in flags else self._own_log()
        if "--candump" not in flags:
            command += ["--candump", self.log]
        self.devices = devices(flags)
        #: Whether the nodes have the values of their data sheets at the start.
        self.is_new = "--flash" not in flags
        self.expected: set[str] = set()
        self.is_judged = False
        if "--threads" not in flags:
            # As many tests as cores run at a time.
            command += ["--threads", "1"]
        command += ["--page-program", os.environ["NODECTL_COMMAND"], *(["--page", page] if page else ["--no-page"])]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        Simulator.started.append(self)
        # The first line lists the served addresses.
        line = self.process.stdout.readline()
        assert line, "the simulator has ended without serving clients"
        self.greeting = json.loads(line)
        self.socketcand, self.slcan = (int(self.greeting[name].split(":")[1]) for name in ("socketcand", "slcan"))

    @staticmethod
    def _own_log() -> Path:
        return Path(tempfile.mkdtemp(prefix="bus-")) / "candump.log"

    def expects(self, *rules: str) -> None:
        """Names the rules that the test breaks, as `nodectl rules --list` has them."""
        self.expected |= set(rules)

    def end(self) -> None:
        """Ends the run if it goes on, and judges the log of its bus."""
        if self.process.poll() is None:
            self.process.terminate()
            self.process.communicate(timeout=PATIENCE)
        self.judge()

    def judge(self) -> None:
        """Judges the log by the rules of the bus, once. A rule that was expected must be broken."""
        # A simulator that was killed leaves a log without its end.
        if self.is_judged or self.process.poll() != 0 or not self.devices:
            return
        self.is_judged = True
        command = [os.environ["NODECTL_COMMAND"], "--json", "rules", "--file", self.log]
        command += ["--of", ",".join(str(node) for node in self.devices)]
        command += [word for node, device in self.devices.items() for word in ("--device", f"{node}={device}")]
        result = subprocess.run(command + ["--factory"] * self.is_new, capture_output=True, text=True)
        assert result.returncode in (0, 10), result.stderr
        lines = [json.loads(line) for line in result.stdout.splitlines()]
        breaches = [line for line in lines if "rule" in line]
        found = {breach["rule"] for breach in breaches}
        new = [breach for breach in breaches if breach["rule"] not in self.expected]
        assert not new, f"a rule of the bus is broken: {json.dumps(new[0], indent=1)}"
        assert self.expected <= found, f"expected and not broken: {self.expected - found}"
        if "MONITOR_LOG" in os.environ:
            test = os.environ.get("PYTEST_CURRENT_TEST", "").split(" ")[0]
            with open(os.environ["MONITOR_LOG"], "a") as log:
                log.write(f"{test}\t{self.log.read_bytes().count(10)}\t{','.join(sorted(self.expected))}\n")

    def command(self, line: str) -> None:
        """Types a command, as on the terminal."""
        print(line, file=self.process.stdin, flush=True)

    def quit(self) -> dict:
        """Ends the run and returns its summary."""
        self.command("quit")
        return self.summary()

    def summary(self) -> dict:
        """The summary of a run that has ended."""
        output, _ = self.process.communicate(timeout=PATIENCE)
        assert self.process.returncode == 0
        (summary,) = output.splitlines()
        return json.loads(summary)

    def bus(self) -> can.BusABC:
        """A python-can bus over socketcand."""
        return can.Bus(interface="socketcand", host="127.0.0.1", port=self.socketcand, channel="vcan0")

    def slcan_bus(self, **options) -> can.BusABC:
        """A python-can bus over slcan."""
        channel = f"socket://127.0.0.1:{self.slcan}"
        return can.Bus(interface="slcan", channel=channel, sleep_after_open=0, **options)

    def serial_adapter(self) -> str:
        """The serial port of an slcan adapter, as a USB adapter has one: a pseudo-terminal before the slcan server."""
        adapter, port = os.openpty()
        tty.setraw(port)
        server = socket.create_connection(("127.0.0.1", self.slcan))

        def pass_on(read, write) -> None:
            with contextlib.suppress(OSError):
                while data := read(4096):
                    write(data)

        for ends in [(lambda size: os.read(adapter, size), server.sendall), (server.recv, lambda data: os.write(adapter, data))]:
            threading.Thread(target=pass_on, args=ends, daemon=True).start()
        return os.ttyname(port)


class Relay:
    """A relay between clients and the socketcand port of a simulator. It notes the frames that pass, with the time of the host."""

    def __init__(self, simulator: Simulator):
        self.server = simulator.socketcand
        listener = socket.create_server(("127.0.0.1", 0))
        self.socketcand = listener.getsockname()[1]
        #: Time, direction ("send" of the client, "frame" of the bus), CAN-ID and data, in hexadecimal digits.
        self.frames: list[tuple[float, str, int, str]] = []
        #: Is asked before a frame of the client passes; a frame that it holds never does, and neither does a later one.
        self.holds = lambda frames: False
        self.has_held = threading.Event()
        threading.Thread(target=self._accept, args=[listener], daemon=True).start()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            client, _ = listener.accept()
            server = socket.create_connection(("127.0.0.1", self.server))
            for ends in [(client, server), (server, client)]:
                threading.Thread(target=self._pass_on, args=ends, daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        text = ""
        with contextlib.suppress(OSError):
            while data := source.recv(4096):
                *messages, text = (text + data.decode()).split(">")
                for message in messages:
                    if self._is_held(message.split()[1:]):
                        return self.has_held.set()
                    sink.sendall(f"{message}>".encode())
            sink.shutdown(socket.SHUT_WR)

    def _is_held(self, words: list[str]) -> bool:
        match words:
            # The bus has a time, the client a length.
            case ["send" | "frame" as direction, can_id, _, *data]:
                self.frames.append((time.monotonic(), direction, int(can_id, 16), "".join(f"{int(byte, 16):02X}" for byte in data)))
                return direction == "send" and self.holds(self.frames)
        return False


def devices(flags: tuple) -> dict[int, str]:
    """The node-IDs and personalities of the boards that these flags make."""
    nodes = [flags[place + 1] for place, flag in enumerate(flags) if flag == "--node"] or ["1:pressure"]
    parts = [re.fullmatch(r"(\d+):?(\w*).*", str(node)) for node in nodes]
    return {int(part[1]): part[2] or "pressure" for part in parts if part and int(part[1]) <= 127}


class Master:
    """A stock python-canopen network with node 1, and the received frames."""

    def __init__(self, simulator: Simulator):
        self.simulator = simulator
        self.network = canopen.Network()
        self.network.connect(interface="socketcand", host="127.0.0.1", port=simulator.socketcand, channel="vcan0")
        self.node = self.network.add_node(1, canopen.ObjectDictionary())
        self.node.sdo.RESPONSE_TIMEOUT = PATIENCE
        # The client may be faster than the node, which does not answer before it has booted.
        if any(board["id"] == 1 for board in simulator.greeting["boards"]):
            self.ready()

    def ready(self) -> "Master":
        """Waits until the node answers: a simulator opens its ports before its nodes have booted."""
        self.node.sdo.RESPONSE_TIMEOUT = ONCE_MORE
        for _ in range(round(PATIENCE / ONCE_MORE)):
            try:
                self.node.sdo.upload(0x1000, 0)
                break
            except canopen.SdoCommunicationError:
                pass
        else:
            raise AssertionError("the node does not answer")
        self.node.sdo.RESPONSE_TIMEOUT = PATIENCE
        return self

    def close(self) -> None:
        self.network.disconnect()

    def listen(self, cob_id: int) -> "Listener":
        """Collects the frames with this COB-ID from now on."""
        return Listener(self.network, cob_id)

    def read(self, index: int, subindex: int = 0) -> int:
        return int.from_bytes(self.node.sdo.upload(index, subindex), "little")

    def write(self, index: int, subindex: int, value: int, size: int) -> None:
        self.node.sdo.download(index, subindex, value.to_bytes(size, "little"))


class Listener:
    """Frames of one COB-ID, in order."""

    def __init__(self, network: canopen.Network, cob_id: int):
        self._frames: queue.Queue[tuple[float, bytes]] = queue.Queue()
        network.subscribe(cob_id, lambda _, data, time: self._frames.put((time, bytes(data))))

    def next(self) -> tuple[float, bytes]:
        """The next frame: its virtual time in seconds and its data."""
        return self._frames.get(timeout=PATIENCE)

    def until(self, wanted) -> tuple[float, bytes]:
        """The next frame with the wanted data. Other frames do not make it wait for ever."""
        end = time.monotonic() + 2 * PATIENCE
        while time.monotonic() < end:
            stamp, data = self.next()
            if wanted(data):
                return stamp, data
        raise AssertionError("no frame has the wanted data")


def nodectl(simulator: Simulator, *arguments, node: int = 1) -> subprocess.CompletedProcess:
    bus = f"socketcand://127.0.0.1:{simulator.socketcand}/vcan0"
    command = [os.environ["NODECTL_COMMAND"], "--bus", bus, "--node", str(node), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=10 * PATIENCE)
