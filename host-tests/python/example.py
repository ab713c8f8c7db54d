"""The examples of the library on a simulated bus, with a stock python-canopen network."""

import os
import queue
import subprocess
import threading
from pathlib import Path

import canopen
from simulator import PATIENCE, Simulator


def command(name: str) -> Path:
    """The program of an example; all of them are beside the I/O module."""
    return Path(os.environ["IO_MODULE_COMMAND"]).with_name(name)


def data_sheet(name: str, folder: Path) -> Path:
    path = folder / f"{name}.eds"
    subprocess.run([command(name), "--eds", path], check=True)
    return path


class Program:
    """A running example: its process on standard input and output."""

    def __init__(self, name: str, port: int, node: int, *arguments):
        line = [command(name), f"127.0.0.1:{port}", "vcan0", str(node), *arguments]
        self.process = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.lines: queue.Queue[str] = queue.Queue()
        self.waiting: list[str] = []
        threading.Thread(target=lambda: [self.lines.put(line) for line in self.process.stdout], daemon=True).start()

    def command(self, *words) -> None:
        print(*words, file=self.process.stdin, flush=True)

    def line(self) -> str:
        """The next line of the process."""
        return self.lines.get(timeout=PATIENCE).strip()

    def wait_for(self, line: str) -> None:
        """Waits for a line. The lines before it are kept for other calls."""
        while line not in self.waiting:
            self.waiting.append(self.line())
        self.waiting.remove(line)

    def end(self) -> None:
        self.process.kill()
        self.process.wait()


class Bench:
    """The bus, an example on it, and a stock python-canopen network."""

    def __init__(self, name: str, node: int, sheet: Path, *arguments):
        self.name, self.id, self.sheet, self.arguments = name, node, sheet, arguments
        self.simulator = Simulator(speed="real")
        self.network = canopen.Network()
        self.network.connect(interface="socketcand", host="127.0.0.1", port=self.simulator.socketcand, channel="vcan0")
        self.frames: dict[int, queue.Queue] = {}
        self.programs: list[Program] = []
        self.listen(0x700 + node)
        self.program = self.start(name, node, *arguments)
        self.node = self.network.add_node(node, str(sheet))
        self.node.sdo.RESPONSE_TIMEOUT = PATIENCE
        assert self.next(0x700 + node) == b"\x00"

    def start(self, name: str, node: int, *arguments) -> Program:
        program = Program(name, self.simulator.socketcand, node, *arguments)
        self.programs.append(program)
        return program

    def restart(self) -> None:
        """Switches the device off and on."""
        self.program.end()
        self.program = self.start(self.name, self.id, *self.arguments)
        while self.next(0x700 + self.id) != b"\x00":
            pass

    def listen(self, cob_id: int) -> None:
        frames = self.frames[cob_id] = queue.Queue()
        self.network.subscribe(cob_id, lambda _id, data, _time: frames.put(bytes(data)))

    def next(self, cob_id: int) -> bytes:
        return self.frames[cob_id].get(timeout=PATIENCE)

    def state(self, command: str, code: int) -> None:
        """Commands a state and waits for the heartbeat with this state."""
        self.node.nmt.state = command
        while self.next(0x700 + self.id) != bytes([code]):
            pass

    def close(self) -> None:
        for program in self.programs:
            program.end()
        self.network.disconnect()
